//! Open loop drifts from a robot that is not the model; feedback does not.

use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use multibody::{Workspace, forward_kinematics_velocity};
use nalgebra::DVector;
use state::observer::FootAnchor;
use state::{Feedback, FeedbackFrames, IntegrationMode, IntegrationSettings, InternalState, Measured};
use std::collections::VecDeque;
use wholebody::{RobotState, StepStatus, WholeBody};

/// Walks on a plant whose base is carried along at a constant velocity, as if the feet crept. Returns the largest error of
/// the *plant's* centre of mass against the plan, and the largest distance that was reported.
fn creeping(integration: &IntegrationSettings) -> (f64, f64) {
    let robot = robot();
    let model = model(&robot, Joints::Legs);
    let settings = settings(&robot, &model);
    let plan = Walk::straight(2);
    let mut body = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
    let mut plant = start(&model, &settings, &plan.reference(0.0));
    let mut internal = InternalState::new(integration, plant.clone(), 0);
    let mut creep = DVector::zeros(model.nv());
    creep[1] = 2e-3 * PERIOD_S; // 2 mm/s to the left
    let (mut error, mut distance): (f64, f64) = (0.0, 0.0);
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let reference = plan.reference(tick as f64 * PERIOD_S);
        let measured: RobotState = plant.clone();
        let state = internal.begin(&model, Some(&measured), PERIOD_S).clone();
        distance = distance.max(internal.distance().base_m);
        let report = body.step(&state, &reference, PERIOD_S);
        assert_ne!(report.status, StepStatus::Held, "tick {tick}: {:?}", report.contradiction);
        let com = body.terms().com + (measured.q.base.translation - state.q.base.translation);
        error = error.max((com - reference.com_position).norm());
        // The plant moves as the step says, relative to where it really is, and creeps.
        let report = body.report();
        let mut step = DVector::zeros(model.nv());
        model.difference(&state.q, &report.q_next, &mut step);
        step += &creep;
        let mut next = plant.q.clone();
        model.integrate(&plant.q, &step, &mut next);
        plant = RobotState { q: next, v: report.v_next.clone() };
        internal.advance(report);
    }
    (error, distance)
}

fn feedback([base_pose_rate_per_s, base_twist_rate_per_s, joint_rate_per_s]: [f64; 3]) -> IntegrationSettings {
    let mode = IntegrationMode::Feedback;
    let rest = IntegrationSettings::default();
    IntegrationSettings { mode, base_pose_rate_per_s, base_twist_rate_per_s, joint_rate_per_s, ..rest }
}

#[test]
fn open_loop_drifts_with_a_creeping_plant_and_feedback_stays() {
    let (open_error, open_distance) = creeping(&IntegrationSettings::default());
    let (closed_error, closed_distance) = creeping(&feedback([5.0, 5.0, 0.0]));
    let (full_error, _) = creeping(&feedback([f64::INFINITY; 3]));
    // 2 mm/s for 4 s.
    assert!(open_error > 5e-3 && open_distance > 5e-3, "{open_error} {open_distance}");
    assert!(closed_error < 0.5 * open_error && closed_distance < 1e-3, "{closed_error} {closed_distance}");
    assert!(full_error < 0.5 * open_error, "{full_error}");
}

#[test]
fn each_rate_draws_its_own_part_of_the_state_and_nothing_else() {
    let robot = robot();
    let model = model(&robot, Joints::Legs);
    let own = start(&model, &settings(&robot, &model), &Walk::straight(1).reference(0.0));
    let base = model.base_dofs();
    let away = DVector::from_fn(model.nv(), |i, _| 1e-3 * (1.0 + i as f64));
    let mut measured = RobotState { q: model.neutral(), v: 10.0 * &away };
    model.integrate(&own.q, &away, &mut measured.q);
    let (rate, dt_s) = (20.0, PERIOD_S);
    let gain = 1.0 - (-rate * dt_s).exp();
    for part in 0..3 {
        let of = |k: usize| if k == part { rate } else { 0.0 };
        let mut internal = InternalState::new(&feedback([of(0), of(1), of(2)]), own.clone(), 0);
        let drawn = internal.begin(&model, Some(&measured), dt_s);
        let mut moved = DVector::zeros(model.nv());
        model.difference(&own.q, &drawn.q, &mut moved);
        for i in 0..model.nv() {
            let (pose, twist) = if i < base { (part == 0, part == 1) } else { (part == 2, part == 2) };
            let expected = |drawn: bool| if drawn { gain } else { 0.0 };
            // The base's pose is no vector space: drawn along the same screw, to rounding.
            assert!((moved[i] - expected(pose) * away[i]).abs() < 1e-12, "part {part}, coordinate {i}");
            assert!((drawn.v[i] - expected(twist) * measured.v[i]).abs() < 1e-12, "part {part}, velocity {i}");
        }
        let far = internal.distance();
        let norm = |from: usize| away.rows(from, 3).norm();
        assert!((far.base_m - norm(0)).abs() < 1e-12 && (far.base_rad - norm(3)).abs() < 1e-12, "{far:?}");
        assert!((far.joints_rad - away[model.nv() - 1]).abs() < 1e-12, "{far:?}");
    }
}

#[test]
fn without_a_measurement_a_step_starts_where_the_last_one_ended_and_rest_stops_it_there() {
    let robot = robot();
    let model = model(&robot, Joints::Legs);
    let mut own = start(&model, &settings(&robot, &model), &Walk::straight(1).reference(0.0));
    own.v.fill(0.1);
    let mut internal = InternalState::new(&feedback([20.0; 3]), own.clone(), 0);
    assert_eq!(internal.begin(&model, None, PERIOD_S), &own);
    internal.rest();
    assert_eq!(internal.state(), &RobotState { v: DVector::zeros(model.nv()), ..own });
}

/// Walks with measurements of a robot that is exactly where the model was `delay` ticks and the drives' one before. Returns the largest
/// differences in the base's position (m) and velocity (m/s) that are then found between the two.
fn late(delay_ticks: u32, rate_per_s: f64) -> (f64, f64) {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let plan = Walk::straight(2);
    let integration =
        IntegrationSettings { measurement_delay_ticks: delay_ticks, ..feedback([rate_per_s, rate_per_s, 0.0]) };
    let frames = FeedbackFrames {
        imu_link: "imu".to_owned(),
        ankle_links: settings.feet.each_ref().map(|foot| foot.ankle_link.clone()),
    };
    let behind = delay_ticks as usize + 1;
    let mut feedback = Feedback::new(&integration, &model, frames, 1, PERIOD_S).expect("its frames");
    let mut body = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
    let mut internal = InternalState::new(&integration, start(&model, &settings, &plan.reference(0.0)), behind);
    let mut ws = Workspace::new(&model);
    let imu = model.frame("imu").expect("HRP-4 has one");
    let (mut past, mut measured) = (VecDeque::new(), Measured::new(&model));
    let (mut off_m, mut off_m_per_s) = (0.0_f64, 0.0_f64);
    for tick in 0..(plan.duration_s() / PERIOD_S) as i64 {
        let reference = plan.reference(tick as f64 * PERIOD_S);
        let feet = reference.feet.map(|foot| FootAnchor {
            in_contact: foot.in_contact,
            load_share: foot.load_share,
            ankle_pose: foot.ankle_pose,
            ankle_twist: foot.ankle_twist,
        });
        feedback.remember(tick, feet);
        past.push_back(internal.state().clone());
        if past.len() > behind {
            let then: RobotState = past.pop_front().expect("it has one");
            let moving = forward_kinematics_velocity(&model, &mut ws, &then.q, &then.v);
            let base = model.base_dofs();
            measured.tick = tick;
            measured.joints.copy_from(&then.q.joints);
            measured.joint_rates.copy_from(&then.v.rows(base, model.joint_count()));
            let rotation = moving.pose(imu).rotation;
            measured.imu_rotation = Some(rotation);
            measured.gyro = rotation.tr_mul(&moving.velocity(imu).angular);
            let seen = feedback.observe(&model, &measured, &internal).expect("near").clone();
            off_m = off_m.max((seen.q.base.translation - internal.state().q.base.translation).norm());
            off_m_per_s = off_m_per_s.max((&seen.v - &internal.state().v).rows(0, 3).norm());
            internal.begin(&model, Some(&seen), PERIOD_S);
        }
        let state = internal.state().clone();
        let report = body.step(&state, &reference, PERIOD_S);
        internal.advance(report);
    }
    (off_m, off_m_per_s)
}

#[test]
fn a_robot_that_is_late_is_taken_for_no_other_than_the_model_was() {
    // The ankles follow their anchors to some micrometres, at some millimetres per second. Carried forward with their own velocity the
    // measurements would be wrong by the acceleration, 0.7 m/s^2, times their age: 15 mm/s at 20 ms.
    for delay_ticks in [0, 4] {
        let (off_m, off_m_per_s) = late(delay_ticks, 5.0);
        assert!(off_m < 1e-4 && off_m_per_s < 5e-3, "{delay_ticks} ticks late: {off_m} m, {off_m_per_s} m/s");
    }
    // Drawn by 63 % a period: without the corrections in the past as well, 25 ms of age would make that swing.
    let (off_m, off_m_per_s) = late(4, 200.0);
    assert!(off_m < 1e-4 && off_m_per_s < 5e-3, "{off_m} m, {off_m_per_s} m/s");
}
