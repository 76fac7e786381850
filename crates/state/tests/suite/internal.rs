//! Open loop drifts from a robot that is not the model; feedback does not.

use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use nalgebra::DVector;
use state::{IntegrationMode, IntegrationSettings, InternalState};
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
    let mut internal = InternalState::new(integration, plant.clone());
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
        let mut internal = InternalState::new(&feedback([of(0), of(1), of(2)]), own.clone());
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
    let mut internal = InternalState::new(&feedback([20.0; 3]), own.clone());
    assert_eq!(internal.begin(&model, None, PERIOD_S), &own);
    internal.rest();
    assert_eq!(internal.state(), &RobotState { v: DVector::zeros(model.nv()), ..own });
}
