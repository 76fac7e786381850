//! Tasks that are off by default, and the foot wrenches: each does what its name says.

use crate::support::watch::Watch;
use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use gait::GaitSettings;
use nalgebra::Vector2;
use spatial::Vec3;
use wholebody::{FootTarget, Gains, StepReport, StepStatus, TaskId, TaskSettings, WholeBody, WholeBodySettings};

/// Root mean squares over a walk in which every limit held at every tick.
struct Effort {
    /// Angular momentum about the centre of mass, per axis (N m s).
    momentum: Vec3,
    /// Norm of the joint torques (N m).
    torque: f64,
}

/// Walks three steps of 0.1 m in 0.9 s each.
fn effort(change: impl Fn(&mut TaskSettings)) -> Effort {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    change(&mut settings.tasks);
    let mut gait =
        GaitSettings { walk: gait::Walk::Straight { swings: 3, step_length_m: 0.1 }, ..GaitSettings::default() };
    gait.timing.single_support_s = 0.6;
    gait.timing.double_support_s = 0.3;
    let plan = Walk::plan(&gait);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let mut state = start(body.model(), body.settings(), &plan.reference(0.0));
    let mut watch = Watch::new(&body);
    let (mut momentum, mut torque) = (Vec3::zeros(), 0.0);
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let reference = plan.reference(tick as f64 * PERIOD_S);
        let report = body.step(&state, &reference, PERIOD_S);
        watch.look(tick, &reference, report);
        torque += report.torques.norm_squared();
        (state.q, state.v) = (report.q_next.clone(), report.v_next.clone());
        let angular = body.terms().momentum.fixed_rows::<3>(3).into_owned();
        momentum += angular.component_mul(&angular);
    }
    let ticks = watch.ticks as f64;
    Effort { momentum: (momentum / ticks).map(f64::sqrt), torque: (torque / ticks).sqrt() }
}

#[test]
fn a_weight_on_the_angular_momentum_makes_it_smaller_about_every_axis() {
    let free = effort(|_| {}).momentum;
    let mut last = free;
    for weight in [10.0, 100.0, 1000.0] {
        let now = effort(|tasks| tasks.angular_momentum.weight = weight).momentum;
        assert!((0..3).all(|axis| now[axis] < last[axis]), "{weight}: {now} against {last}");
        last = now;
    }
    assert!((0..3).all(|axis| last[axis] < 0.2 * free[axis]), "{last} of {free}");
}

#[test]
fn a_weight_on_the_torques_makes_them_smaller() {
    let mut last = effort(|_| {}).torque;
    for weight in [1e-3, 1e-2, 1e-1] {
        let now = effort(|tasks| tasks.torque_weight = weight).torque;
        assert!(now < last, "{weight}: {now} N m against {last}");
        last = now;
    }
}

/// Stands at rest with the load shared as wanted; the ZMPs of the feet keep the whole in balance.
fn standing(left_share: f64, change: impl Fn(&mut TaskSettings)) -> (StepReport, [FootTarget; 2]) {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings: WholeBodySettings = settings(&robot, &model);
    change(&mut settings.tasks);
    let weight_n = model.total_mass_kg() * model.gravity().norm();
    let mut reference = Walk::straight(1).reference(0.0);
    let state = start(&model, &settings, &reference);
    let com = reference.com_position;
    // Left at its ankle's line and beyond: k y_l + (1 - k) y_r = y_com with the same shift of both.
    let ankles = [0, 1].map(|i: usize| reference.feet[i].ankle_pose.translation);
    let shift = com.y - left_share * ankles[0].y - (1.0 - left_share) * ankles[1].y;
    for (i, share) in [left_share, 1.0 - left_share].into_iter().enumerate() {
        let zmp = Vector2::new(com.x, ankles[i].y + shift);
        reference.feet[i] = FootTarget::standing(reference.feet[i].ankle_pose, share, weight_n, zmp);
    }
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let report = body.step(&state, &reference, PERIOD_S).clone();
    assert_eq!(report.status, StepStatus::Solved, "{:?}", report.contradiction);
    (report, reference.feet)
}

/// Largest component of any foot's wrench that is not as planned (N, N m), as reported.
fn missed(report: &StepReport) -> f64 {
    let is_wrench = |id| matches!(id, TaskId::Wrench(_));
    report.tasks.iter().filter(|task| is_wrench(task.id)).map(|task| task.residual).fold(0.0, f64::max)
}

#[test]
fn forces_follow_their_plan_the_more_the_greater_the_weight() {
    for share in [0.4, 0.5, 0.6] {
        let mut last = f64::INFINITY;
        for weight in [0.0, 1e-5, 1e-3, 0.1] {
            let (report, _) = standing(share, |tasks| tasks.wrench_weight = weight);
            let now = missed(&report);
            assert!(now < last, "share {share}, weight {weight}: {now} N against {last}");
            last = now;
        }
        // The start is not quite at rest: what the other tasks want remains.
        assert!(last < 0.01 * 383.0, "share {share}: {last} N of 383 N");
        // The default's forces are the planned ones, on the planned side.
        let (report, feet) = standing(share, |_| {});
        for (foot, target) in report.feet.iter().zip(&feet) {
            let error = foot.wrench.force.z - target.wrench.force.z;
            assert!(error.abs() < 0.02 * 383.0, "share {share}: off by {error} N");
        }
    }
}

#[test]
fn a_step_with_a_weight_on_the_torques_needs_less_and_less_of_them() {
    let mut last = f64::INFINITY;
    for weight in [0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0] {
        let (report, _) = standing(0.5, |tasks| tasks.torque_weight = weight);
        let now = report.torques.norm();
        assert!(now < last, "{weight}: {now} N m against {last}");
        last = now;
    }
}

/// Step of the differences (s): they err by it times the jerk, some hundred m/s³.
const DIFFERENCE_S: f64 = 1e-6;
/// (m/s², rad/s²)
const DIFFERENCE_ERROR: f64 = 1e-2;

#[test]
fn reported_residuals_are_what_the_motion_lacks_by_differences_of_the_velocities() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let mut reference = Walk::straight(1).reference(0.0);
    let mut state = start(&model, &settings, &reference);
    // Everything moves and turns, so that no term of the second derivatives vanishes; both feet swing.
    for (i, v) in state.v.iter_mut().enumerate() {
        *v = 1.5 * (1.0 + 7.0 * i as f64).sin();
    }
    for foot in &mut reference.feet {
        *foot = FootTarget::hanging(foot.ankle_pose);
    }
    let mut body = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
    let report = body.step(&state, &reference, PERIOD_S).clone();
    assert_eq!(report.status, StepStatus::Solved, "{:?}", report.contradiction);
    let now = body.terms().clone();
    let increment = DIFFERENCE_S * (&state.v + 0.5 * DIFFERENCE_S * &report.acceleration);
    let mut later = state.clone();
    model.integrate(&state.q, &increment, &mut later.q);
    later.v += DIFFERENCE_S * &report.acceleration;
    body.step(&later, &reference, PERIOD_S);
    let then = body.terms();

    let tasks = &settings.tasks;
    let lacking = |before: Vec3, after: Vec3, error: Vec3, gains: Gains| {
        let kp = gains.stiffness_per_s2.min(0.25 / (PERIOD_S * PERIOD_S));
        let desired = kp * error - 2.0 * kp.sqrt() * before;
        ((after - before) / DIFFERENCE_S - desired).amax()
    };
    let mut expected = vec![(TaskId::Com, {
        let error = reference.com_position - now.com;
        lacking(now.com_velocity, then.com_velocity, error, tasks.com)
    })];
    let frames = now.frames.iter().zip(&then.frames);
    for (k, (before, after)) in frames.take(3).enumerate() {
        let target = reference.feet.get(k).map(|foot| foot.ankle_pose);
        let rotation = target.map_or(reference.torso_rotation, |pose| pose.rotation);
        let error = spatial::so3::log(&(rotation * before.placement.rotation.transpose()));
        let (id, gains) = match target {
            Some(_) => (TaskId::SwingOrientation(k), tasks.swing_orientation),
            None => (TaskId::Torso, tasks.torso),
        };
        expected.push((id, lacking(before.velocity.angular, after.velocity.angular, error, gains)));
        if let Some(pose) = target {
            let error = pose.translation - before.placement.translation;
            let lack = lacking(before.velocity.linear, after.velocity.linear, error, tasks.swing_position);
            expected.push((TaskId::SwingPosition(k), lack));
        }
    }
    for (id, lack) in expected {
        let task = report.tasks.iter().find(|task| task.id == id).expect("reported");
        let difference = (task.residual - lack).abs();
        assert!(difference < DIFFERENCE_ERROR, "{id:?}: {} reported, {lack} by differences", task.residual);
    }
}
