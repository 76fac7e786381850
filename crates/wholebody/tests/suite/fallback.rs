//! What happens when there is no solution.

use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use wholebody::{
    AnsweredBy, Backend, Backup, ConstraintId, Limit, SolverSettings, StepStatus, WholeBody, WholeBodySettings,
};

#[test]
fn a_load_limit_that_cannot_be_met_gives_way_first_and_is_named() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let plan = Walk::straight(1);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let mut reference = plan.reference(0.0);
    let state = start(body.model(), body.settings(), &reference);
    // Each foot may carry 2 x 10 % of the weight, and both stay where they are: joints alone cannot let the robot fall so
    // fast. Feet that must not move and hardly push: the load limits contradict the contacts and the joints' bounds.
    reference.feet[0].load_share = 0.0;
    reference.feet[1].load_share = 0.0;
    let report = body.step(&state, &reference, PERIOD_S);
    assert_eq!(report.status, StepStatus::Solved, "free fall is possible: {:?}", report.relaxed);
    let mut settings = body.settings().clone();
    settings.constraints.acceleration_max_rad_per_s2 = 1.0;
    settings.constraints.braking_rad_per_s2 = 1.0;
    let mut stiff = WholeBody::new(body.model().clone(), settings).expect("settings fit the model");
    let report = stiff.step(&state, &reference, PERIOD_S);
    assert_eq!(report.status, StepStatus::Relaxed, "{:?}", report.contradiction);
    assert!(!report.relaxed.is_empty());
    for relaxed in &report.relaxed {
        assert!(matches!(relaxed.id, ConstraintId::Load { .. }), "{relaxed:?}");
    }
    let widened: f64 = report.relaxed.iter().map(|relaxed| relaxed.amount).sum();
    assert!(widened > 100.0 && widened < 1000.0, "most of the weight: {widened} N");
    assert!(report.contradiction.len() > 1, "the other side of the contradiction is named too");
    assert!(report.residuals.max() < 1e-9);
}

/// Every widened row is reported once, with what it was widened by in all its attempts together: the program that was solved
/// last shows it.
fn widenings_are_those_of_the_program(body: &WholeBody) -> u32 {
    let report = body.report();
    let problem = body.last_program().expect("a step was made");
    let mut most = 0;
    for (k, relaxed) in report.relaxed.iter().enumerate() {
        assert!(report.relaxed[..k].iter().all(|other| other.id != relaxed.id), "once each: {:?}", report.relaxed);
        most = most.max(relaxed.times);
        let row = |i: &usize| body.meaning(qp::Row::Inequality(*i)) == Some(relaxed.id);
        let widened = match relaxed.id {
            ConstraintId::Load { foot } => {
                let i = (0..problem.u.len()).find(row).expect("a row of the program");
                problem.u[i] - report.feet[foot].load_max_n
            }
            ConstraintId::Torque(joint) => {
                let fraction = body.settings().constraints.torque_factor;
                let limit = fraction * body.model().joints()[joint].limits.effort;
                problem.u[joint] - problem.l[joint] - 2.0 * limit
            }
            _ => continue,
        };
        assert!((widened - relaxed.amount).abs() < 1e-9 * (1.0 + widened), "{relaxed:?}, but {widened} in the program");
    }
    most
}

#[test]
fn a_row_that_gives_way_again_and_again_is_reported_once_with_the_whole_amount() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    settings.constraints.acceleration_max_rad_per_s2 = 1.0;
    settings.constraints.braking_rad_per_s2 = 1.0;
    settings.constraints.torque_factor = 0.05;
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let plan = Walk::straight(1);
    let state = start(body.model(), body.settings(), &plan.reference(0.0));
    let mut most = 0;
    for share in [0.0, 0.05, 0.2, 0.4] {
        let mut reference = plan.reference(0.0);
        reference.feet.iter_mut().for_each(|foot| foot.load_share = share);
        assert_ne!(body.step(&state, &reference, PERIOD_S).status, StepStatus::Solved, "share {share}");
        most = most.max(widenings_are_those_of_the_program(&body));
    }
    assert!(most > 1, "some row came up again");
}

#[test]
fn all_widenings_of_a_row_together_stay_within_its_allowance() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let plan = Walk::straight(1);
    let relaxed = |share: f64, allow: &dyn Fn(&mut wholebody::RelaxationSettings)| {
        let mut settings = settings(&robot, &model);
        settings.constraints.acceleration_max_rad_per_s2 = 1.0;
        settings.constraints.braking_rad_per_s2 = 1.0;
        settings.constraints.torque_factor = 0.05;
        allow(&mut settings.relaxation);
        let mut body = WholeBody::new(model.clone(), settings).expect("settings fit the model");
        let mut reference = plan.reference(0.0);
        let state = start(body.model(), body.settings(), &reference);
        reference.feet.iter_mut().for_each(|foot| foot.load_share = share);
        body.step(&state, &reference, PERIOD_S).relaxed.clone()
    };
    let mut again = 0;
    for share in [0.0, 0.05, 0.2, 0.4] {
        for widened in relaxed(share, &|_| {}).into_iter().filter(|relaxed| relaxed.times > 1) {
            // A little less than it took: the last attempt has to leave something.
            let allowance = 0.9 * widened.amount;
            let with_less = match widened.id.limit() {
                Some(Limit::Load) => relaxed(share, &|relaxation| relaxation.load_n = allowance),
                Some(Limit::JointMotion) => {
                    relaxed(share, &|relaxation| relaxation.joint_motion_rad_per_s2 = allowance)
                }
                _ => continue,
            };
            let same_kind = with_less.iter().filter(|relaxed| relaxed.id.limit() == widened.id.limit());
            same_kind.for_each(|relaxed| {
                assert!(relaxed.amount <= allowance * (1.0 + ROUNDING), "{relaxed:?} of {allowance}")
            });
            again += 1;
        }
    }
    assert!(again > 0, "some row came up again");
}

#[test]
fn a_held_robot_brakes_no_harder_than_its_joints_can_count_on() {
    let robot = robot();
    let model = model(&robot, Joints::Legs);
    let settings = settings(&robot, &model);
    let mut reference = Walk::straight(1).reference(0.0);
    let mut state = start(&model, &settings, &reference);
    let (braking, base) = (settings.constraints.braking_rad_per_s2, model.base_dofs());
    (state.v[base], state.v[base + 1], state.v[base + 2]) = (8.0, -8.0, 0.5);
    reference.com_position.x = f64::NAN;
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let report = body.step(&state, &reference, PERIOD_S);
    assert_eq!(report.status, StepStatus::Held);
    let accelerations = [0, 1, 2].map(|i| report.acceleration[base + i]);
    assert_eq!(accelerations, [-braking, braking, -5.0], "0.5 rad/s die away in 0.1 s");
}

#[test]
fn the_later_a_limit_is_to_give_way_the_higher_its_rank() {
    let mut settings = WholeBodySettings::new(["l_ankle", "r_ankle"], "body").relaxation;
    settings.order = vec![Limit::Contact, Limit::Load];
    let rank = |id: ConstraintId| id.limit().and_then(|limit| settings.rank(limit));
    assert_eq!(rank(ConstraintId::Contact { foot: 1, axis: 4 }), Some(0));
    assert_eq!(rank(ConstraintId::Load { foot: 0 }), Some(1));
    // Not listed, or physics: never.
    let never = [ConstraintId::Torque(0), ConstraintId::JointMotion(0), ConstraintId::Collision(0)];
    let physics = [ConstraintId::BaseDynamics(0), ConstraintId::Intensity { foot: 0, index: 0 }];
    assert!(never.into_iter().chain(physics).all(|id| rank(id).is_none()));
}

#[test]
fn joints_give_way_before_contacts_and_an_absurd_demand_is_named_whatever_comes_of_it() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    settings.constraints.acceleration_max_rad_per_s2 = 50.0;
    let plan = Walk::straight(1);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let mut reference = plan.reference(0.0);
    let state = start(body.model(), body.settings(), &reference);
    // The ground under the left foot falls away faster than 50 rad/s² can follow, but somewhat more can.
    reference.feet[0].ankle_acceleration.linear.z = -20.0;
    let report = body.step(&state, &reference, PERIOD_S);
    assert_eq!(report.status, StepStatus::Relaxed, "{:?}", report.contradiction);
    assert!(!report.relaxed.is_empty() && report.residuals.feasibility < 1e-9);
    assert!(report.relaxed.iter().any(|r| matches!(r.id, ConstraintId::JointMotion(_))), "{:?}", report.relaxed);
    assert!(!report.relaxed.iter().any(|r| matches!(r.id, ConstraintId::Contact { .. })), "{:?}", report.relaxed);
    // With 2000 m/s² only the contact itself can give way.
    reference.feet[0].ankle_acceleration.linear.z = -2000.0;
    let report = body.step(&state, &reference, PERIOD_S);
    assert_ne!(report.status, StepStatus::Solved);
    assert!(report.contradiction.iter().any(|id| matches!(id, ConstraintId::Contact { axis: 2, .. })));
    assert!(report.acceleration.iter().all(|a| a.is_finite()));
    // The next step says nothing of what has passed.
    reference.feet[0].ankle_acceleration.linear.z = 0.0;
    let report = body.step(&state, &reference, PERIOD_S);
    assert_eq!((report.status, report.relaxed.len(), report.contradiction.len()), (StepStatus::Solved, 0, 0));
}

#[test]
fn out_of_iterations_without_a_backup_brings_the_joints_to_rest() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    settings.solver.iterations_max = 1;
    settings.solver.backup = Backup::None;
    settings.constraints.torque_factor = 0.05; // so that a cold start has to change something
    let plan = Walk::straight(1);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let reference = plan.reference(0.0);
    let mut state = start(body.model(), body.settings(), &reference);
    state.v.rows_mut(6, 22).fill(0.2);
    let mut speed = state.v.amax();
    for _ in 0..100 {
        let report = body.step(&state, &reference, PERIOD_S);
        assert_eq!(report.status, StepStatus::Held);
        (state.q, state.v) = (report.q_next.clone(), report.v_next.clone());
        assert!(state.v.amax() <= speed);
        speed = state.v.amax();
    }
    assert!(speed < 0.01, "{speed} rad/s");
}

/// Of a sum of a few numbers.
const ROUNDING: f64 = 1e-12;

/// Interior points end near the vertex, not at it: torques at a tolerance of 1e-9.
const BACKUP_ERROR_NM: f64 = 0.05;

#[test]
fn the_backup_takes_the_steps_in_which_the_first_solver_runs_out_of_iterations() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let plan = Walk::straight(1);
    let mut body = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
    let few = SolverSettings { iterations_max: 1, ..settings.solver };
    let mut short = WholeBody::new(model, WholeBodySettings { solver: few, ..settings }).expect("settings fit");
    let mut state = start(body.model(), body.settings(), &plan.reference(0.0));
    let (mut by_backup, mut by_first, mut worst): (usize, usize, f64) = (0, 0, 0.0);
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let reference = plan.reference(tick as f64 * PERIOD_S);
        let report = body.step(&state, &reference, PERIOD_S);
        let other = short.step(&state, &reference, PERIOD_S);
        assert_eq!((other.status, report.answered_by), (StepStatus::Solved, AnsweredBy::Solver), "tick {tick}");
        worst = worst.max((&report.torques - &other.torques).amax());
        match other.answered_by {
            AnsweredBy::Backup => by_backup += 1,
            AnsweredBy::Solver => by_first += 1,
        }
        (state.q, state.v) = (report.q_next.clone(), report.v_next.clone());
    }
    assert!(by_backup > 10 && by_first > 10, "both were asked: {by_backup} {by_first}");
    assert!(worst < BACKUP_ERROR_NM, "{worst} N m");
}

#[test]
fn a_contradiction_is_relaxed_whichever_solver_finds_it() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    settings.constraints.acceleration_max_rad_per_s2 = 50.0;
    let plan = Walk::straight(1);
    let mut reference = plan.reference(0.0);
    let state = start(&model, &settings, &reference);
    reference.feet[0].ankle_acceleration.linear.z = -20.0;
    let interior = SolverSettings { backend: Backend::Interior, backup: Backup::None, ..settings.solver };
    let ways = [
        (SolverSettings { iterations_max: 1, ..settings.solver }, AnsweredBy::Backup),
        (interior, AnsweredBy::Solver),
        (SolverSettings { backup: Backup::ActiveSet, ..interior }, AnsweredBy::Solver),
    ];
    for (solver, answered_by) in ways {
        let mut body = WholeBody::new(model.clone(), WholeBodySettings { solver, ..settings.clone() })
            .expect("settings fit the model");
        let report = body.step(&state, &reference, PERIOD_S);
        assert_eq!((report.status, report.answered_by), (StepStatus::Relaxed, answered_by), "{:?}", report.relaxed);
        assert!(report.residuals.feasibility < 1e-6, "{:?}", report.residuals);
        assert!(report.relaxed.iter().any(|r| matches!(r.id, ConstraintId::JointMotion(_))), "{:?}", report.relaxed);
        assert!(!report.relaxed.iter().any(|r| matches!(r.id, ConstraintId::Contact { .. })), "{:?}", report.relaxed);
    }
}

/// A robot that hardly may bend its joints stands on feet whose ground rises with `acceleration` (m/s²): only torques and
/// contacts are left to give way.
fn lifted(fraction: f64, acceleration: f64, change: impl Fn(&mut WholeBodySettings)) -> wholebody::StepReport {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    settings.constraints.torque_factor = fraction;
    settings.constraints.acceleration_max_rad_per_s2 = 1.0;
    settings.constraints.braking_rad_per_s2 = 1.0;
    settings.relaxation.joint_motion_rad_per_s2 = 0.0;
    change(&mut settings);
    let mut reference = Walk::straight(1).reference(0.0);
    let state = start(&model, &settings, &reference);
    for foot in &mut reference.feet {
        foot.ankle_acceleration.linear.z = acceleration;
        foot.load_share = 4.0; // the ground can push as hard as it has to
    }
    WholeBody::new(model, settings).expect("settings fit the model").step(&state, &reference, PERIOD_S).clone()
}

#[test]
fn torques_give_way_up_to_the_motors_limit_and_never_beyond() {
    let robot = robot();
    let motors: Vec<f64> = model(&robot, Joints::Walking).joints().iter().map(|joint| joint.limits.effort).collect();
    let beyond = |report: &wholebody::StepReport, part: f64| {
        report.torques.iter().zip(&motors).map(|(tau, motor)| tau.abs() - part * motor).fold(f64::MIN, f64::max)
    };
    let is = |limit: fn(ConstraintId) -> bool| {
        move |report: &wholebody::StepReport| report.relaxed.iter().any(|relaxed| limit(relaxed.id))
    };
    let (torque, contact) =
        (is(|id| matches!(id, ConstraintId::Torque(_))), is(|id| matches!(id, ConstraintId::Contact { .. })));

    // Standing still takes more than a twentieth of the motors: torques alone give way.
    let report = lifted(0.05, 0.0, |_| {});
    assert_eq!(report.status, StepStatus::Relaxed, "{:?}", report.contradiction);
    assert!(torque(&report) && !contact(&report), "{:?}", report.relaxed);
    assert!(beyond(&report, 0.05) > 1.0, "more than the controller's limit is used");
    assert!(beyond(&report, 1.0) <= 0.0, "and no more than the motor's: {}", beyond(&report, 1.0));

    // Lifted at 200 m/s² no motor is strong enough: the contacts give way, the motors' limits do not.
    for fraction in [0.05, 0.45, 1.0] {
        let report = lifted(fraction, 200.0, |_| {});
        assert_ne!(report.status, StepStatus::Solved, "{fraction}");
        assert!(beyond(&report, 1.0) <= 0.0, "{fraction}: {} N m beyond the motor", beyond(&report, 1.0));
        assert!(report.status == StepStatus::Held || contact(&report), "{fraction}: {:?}", report.relaxed);
    }

    // A lower allowance, and none.
    let report = lifted(0.05, 0.0, |settings| settings.relaxation.torque_factor = 0.1);
    assert!(beyond(&report, 0.1) < 1e-6, "{}", beyond(&report, 0.1));
    let report = lifted(0.05, 0.0, |settings| settings.relaxation.order.retain(|limit| *limit != Limit::Torque));
    assert!(!torque(&report) && beyond(&report, 0.05) < 1e-6, "{:?}", report.relaxed);
}

#[test]
fn the_order_of_giving_way_is_a_setting() {
    let first = |order: [Limit; 2]| {
        let report = lifted(0.05, 0.0, |settings| settings.relaxation.order = order.to_vec());
        assert_eq!(report.status, StepStatus::Relaxed, "{:?}", report.contradiction);
        report.relaxed[0].id
    };
    assert!(matches!(first([Limit::Torque, Limit::Contact]), ConstraintId::Torque(_)));
    assert!(matches!(first([Limit::Contact, Limit::Torque]), ConstraintId::Contact { .. }));
}

#[test]
fn a_state_that_is_not_a_number_is_held_and_said() {
    let robot = robot();
    let model = model(&robot, Joints::Legs);
    let settings = settings(&robot, &model);
    let plan = Walk::straight(1);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let reference = plan.reference(0.0);
    let good = start(body.model(), body.settings(), &reference);
    let before = body.step(&good, &reference, PERIOD_S).clone();
    let mut bad = good.clone();
    bad.v[8] = f64::NAN;
    let held = body.step(&bad, &reference, PERIOD_S);
    assert_eq!(held.status, StepStatus::Held);
    assert_eq!((&held.q_next, held.v_next.amax()), (&before.q_next, 0.0), "the last configuration stands");
    assert_eq!((&held.torques, held.feet[0].wrench), (&before.torques, before.feet[0].wrench));
    let mut lost = reference.clone();
    lost.com_position.x = f64::NAN;
    let held = body.step(&good, &lost, PERIOD_S);
    assert_eq!(held.status, StepStatus::Held);
    assert!(held.q_next.joints.iter().chain(held.torques.iter()).all(|x| x.is_finite()));
    // The next good state is solved as if nothing had been.
    assert_eq!(body.step(&good, &reference, PERIOD_S).status, StepStatus::Solved);
}
