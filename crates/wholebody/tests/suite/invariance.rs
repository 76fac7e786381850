//! Where and in which direction the robot walks changes nothing, and left is as right: state and references of a whole walk
//! are moved or mirrored, and each controller goes on from its own last state.

use crate::support::{
    Joints, PERIOD_S, Walk, mirrored, mirrored_joints, mirrored_state, model, moved, moved_state, robot, settings,
    start,
};
use nalgebra::DVector;
use spatial::{Transform, Vec3, so3};
use wholebody::{RobotState, StepReport, WholeBody, WholeBodyReference};

/// Largest difference of any torque at any tick (N m); torques go up to 45 N m.
const TORQUE_NM: f64 = 1e-8;

/// The default walk's eleven steps.
fn whole_walk() -> Walk {
    Walk::straight(11)
}

/// Walks twice, the second time seen otherwise, and returns the largest difference of the torques (N m), as seen first.
fn difference(
    mut bodies: [WholeBody; 2],
    see_state: impl Fn(&RobotState) -> RobotState,
    see_reference: impl Fn(&WholeBodyReference) -> WholeBodyReference,
    see_torques: impl Fn(&DVector<f64>) -> DVector<f64>,
) -> f64 {
    let plan = whole_walk();
    let mut state = start(bodies[0].model(), bodies[0].settings(), &plan.reference(0.0));
    let mut other = see_state(&state);
    let mut worst: f64 = 0.0;
    let advance = |state: &mut RobotState, report: &StepReport| {
        (state.q, state.v) = (report.q_next.clone(), report.v_next.clone());
    };
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let reference = plan.reference(tick as f64 * PERIOD_S);
        let [first, second] = &mut bodies;
        let a = first.step(&state, &reference, PERIOD_S);
        let b = second.step(&other, &see_reference(&reference), PERIOD_S);
        worst = worst.max((see_torques(&a.torques) - &b.torques).amax());
        advance(&mut state, a);
        advance(&mut other, b);
    }
    worst
}

#[test]
fn a_walk_shifted_by_100_m_and_turned_needs_the_same_torques() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let body = || WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
    let elsewhere = Transform::new(so3::about_z(2.1), Vec3::new(100.0, -73.0, 0.0));
    let worst = difference(
        [body(), body()],
        |state| moved_state(state, &elsewhere),
        |reference| moved(reference, &elsewhere),
        DVector::clone,
    );
    assert!(worst < TORQUE_NM, "{worst:e} N m");
}

#[test]
fn a_mirrored_walk_needs_the_mirrored_torques() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    // Half-sitting was measured on a robot and is not quite symmetric: the mirrored robot has the mirrored posture.
    let mut seen = settings.clone();
    let posture = DVector::from_iterator(seen.posture.len(), settings.posture.iter().map(|joint| joint.position_rad));
    for (joint, position) in seen.posture.iter_mut().zip(mirrored_joints(&model, &posture).iter()) {
        joint.position_rad = *position;
    }
    let bodies =
        [settings, seen].map(|settings| WholeBody::new(model.clone(), settings).expect("settings fit the model"));
    let worst =
        difference(bodies, |state| mirrored_state(&model, state), mirrored, |torques| mirrored_joints(&model, torques));
    assert!(worst < TORQUE_NM, "{worst:e} N m");
}
