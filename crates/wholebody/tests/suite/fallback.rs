//! What happens when there is no solution.

use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use wholebody::{ConstraintId, StepStatus, WholeBody};

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
}

#[test]
fn out_of_iterations_brings_the_joints_to_rest() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    settings.iterations_max = 1;
    settings.constraints.torque_fraction = 0.05; // so that a cold start has to change something
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
