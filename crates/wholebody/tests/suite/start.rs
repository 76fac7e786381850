//! The configuration in which a walk starts.

use crate::support::{Joints, Walk, model, robot, settings, start};
use multibody::{Workspace, forward_kinematics};
use nalgebra::DVector;
use spatial::{Transform, Vec3, so3};
use wholebody::{ConfigurationError, ConfigurationTargets, initial_configuration};

#[test]
fn the_start_meets_its_targets_to_rounding_within_the_joint_limits() {
    let robot = robot();
    for joints in [Joints::Full, Joints::Walking, Joints::Legs] {
        let model = model(&robot, joints);
        let settings = settings(&robot, &model);
        let reference = Walk::straight(1).reference(0.0);
        let state = start(&model, &settings, &reference);
        let mut ws = Workspace::new(&model);
        let placed = forward_kinematics(&model, &mut ws, &state.q);
        assert!((placed.center_of_mass() - reference.com_position).norm() < 1e-10);
        for i in 0..2 {
            let ankle = placed.pose(model.frame(&settings.feet[i].ankle_link).expect("an ankle"));
            assert!((ankle.translation - reference.feet[i].ankle_pose.translation).norm() < 1e-10);
            assert!((ankle.rotation - reference.feet[i].ankle_pose.rotation).norm() < 1e-10);
        }
        let torso = placed.pose(model.frame(&settings.torso_link).expect("a torso"));
        assert!((torso.rotation - reference.torso_rotation).norm() < 1e-10);
        for (q, joint) in state.q.joints.iter().zip(model.joints()) {
            assert!(*q >= joint.limits.lower && *q <= joint.limits.upper, "{}", joint.name);
        }
        // HRP-4 stands as half-sitting does: the legs bend a little more or less, the arms stay.
        let knee = model.joint("L_KNEE_P").expect("a knee").0;
        assert!((state.q.joints[knee] - robot.description.half_sitting_rad("L_KNEE_P")).abs() < 0.25);
    }
}

#[test]
fn far_from_the_origin_and_turned_the_start_is_the_same() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let reference = Walk::straight(1).reference(0.0);
    let elsewhere = Transform::new(so3::about_z(-2.5), Vec3::new(100.0, 40.0, 0.0));
    let here = start(&model, &settings, &reference);
    let there = start(&model, &settings, &crate::support::moved(&reference, &elsewhere));
    assert!((here.q.joints - there.q.joints).amax() < 1e-9);
}

#[test]
fn out_of_reach_says_how_far_and_which_joints_stop_it() {
    let robot = robot();
    let model = model(&robot, Joints::Legs);
    let settings = settings(&robot, &model);
    let reference = Walk::straight(1).reference(0.0);
    let frame = |name: &str| model.frame(name).expect("a frame");
    let targets = ConfigurationTargets {
        com: reference.com_position + Vec3::new(0.0, 0.0, 0.15), // legs are not that long
        ankles: [frame(&settings.feet[0].ankle_link), frame(&settings.feet[1].ankle_link)],
        ankle_poses: [reference.feet[0].ankle_pose, reference.feet[1].ankle_pose],
        torso: frame(&settings.torso_link),
        torso_rotation: reference.torso_rotation,
        posture: DVector::zeros(model.joint_count()),
        limit_margin_rad: 0.01,
    };
    match initial_configuration(&model, &targets) {
        Err(ConfigurationError::OutOfReach { error, joints }) => {
            assert!(error > 0.01 && error < 0.3, "{error}");
            assert!(joints.iter().any(|name| name.contains("KNEE")), "{joints:?}");
        }
        Ok(_) => panic!("no such configuration exists"),
    }
}
