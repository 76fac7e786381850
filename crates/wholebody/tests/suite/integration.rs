//! Open loop drifts from a robot that is not the model; feedback does not.

use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use nalgebra::DVector;
use wholebody::{Integration, RobotState, StateIntegrator, StepStatus, WholeBody};

/// Walks on a plant whose base is carried along at a constant velocity, as if the feet crept. Returns the largest error of
/// the *plant's* centre of mass against the plan, and the largest distance that was reported.
fn creeping(mode: Integration) -> (f64, f64) {
    let robot = robot();
    let model = model(&robot, Joints::Legs);
    let settings = settings(&robot, &model);
    let plan = Walk::straight(2);
    let mut body = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
    let mut plant = start(&model, &settings, &plan.reference(0.0));
    let mut integrator = StateIntegrator::new(mode, plant.clone());
    let mut creep = DVector::zeros(model.nv());
    creep[1] = 2e-3 * PERIOD_S; // 2 mm/s to the left
    let (mut error, mut distance): (f64, f64) = (0.0, 0.0);
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let reference = plan.reference(tick as f64 * PERIOD_S);
        let measured: RobotState = plant.clone();
        let state = integrator.begin(&model, Some(&measured), PERIOD_S).clone();
        distance = distance.max(integrator.distance().base_m);
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
        integrator.advance(report);
    }
    (error, distance)
}

#[test]
fn open_loop_drifts_with_a_creeping_plant_and_feedback_stays() {
    let (open_error, open_distance) = creeping(Integration::OpenLoop);
    let (closed_error, closed_distance) = creeping(Integration::Feedback { base_rate: 5.0, joint_rate: 0.0 });
    let (full_error, _) = creeping(Integration::Feedback { base_rate: f64::INFINITY, joint_rate: f64::INFINITY });
    // 2 mm/s for 4 s.
    assert!(open_error > 5e-3 && open_distance > 5e-3, "{open_error} {open_distance}");
    assert!(closed_error < 0.5 * open_error && closed_distance < 1e-3, "{closed_error} {closed_distance}");
    assert!(full_error < 0.5 * open_error, "{full_error}");
}
