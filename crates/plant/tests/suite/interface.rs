//! Sensors and truth agree with mechanics; runs repeat; falls are seen; limits are kept.

use multibody::{Model, ModelOptions, forward_kinematics};
use plant::disturbance::Push;
use plant::ground::{GroundSettings, GroundShape};
use plant::{FallReason, Plant, PlantCommand, PlantError, PlantFrames, PlantSensors, PlantSettings};
use spatial::{Transform, Vec3, so3};

use super::robot;

const COM: Vec3 = Vec3::new(0.0, 0.0, 0.78);
const SINK_M: f64 = 4e-4;

/// Standing on both feet, with the command that holds it there.
fn standing(settings: PlantSettings) -> (Plant, PlantCommand) {
    let model = robot::model();
    let ankles = robot::flat_ankles(SINK_M);
    let q = robot::stand(&model, &ankles, COM);
    let plan = robot::resting_plan(&model, &q, &ankles, COM, [0.5, 0.5]);
    let command = robot::command(&model, &q, &plan);
    let mut plant = Plant::new(settings, model, robot::soles(), &robot::frames()).unwrap();
    plant.place(&q);
    (plant, command)
}

/// A shove that makes everything move.
fn shove() -> Push {
    Push {
        link: "torso".to_owned(),
        force_n: [60.0, 40.0, 0.0],
        point_in_link_m: [0.0, 0.0, 0.2],
        start_s: 0.05,
        duration_s: 0.1,
    }
}

#[test]
fn at_rest_the_sensors_feel_gravity_and_the_weight() {
    let (mut plant, command) = standing(robot::settings());
    plant.settle(&command, 5.0).unwrap();
    let weight = plant.model().total_mass_kg() * 9.81;
    let sensors = plant.sensors();
    let up = sensors.orientation * sensors.acceleration;
    assert!((up - Vec3::new(0.0, 0.0, 9.81)).norm() < 0.05, "{up}");
    let carried: f64 = sensors.foot_wrenches.iter().map(|wrench| wrench.force.z).sum();
    assert!((carried - weight).abs() < 1e-3 * weight, "{carried}");
    // The sensor lies 93 mm below the ankle and 10 mm above the ground: its moments locate the ZMP.
    let foot = &plant.truth().feet[0];
    let wrench = &sensors.foot_wrenches[0];
    let zmp_y = foot.ankle.translation.y + wrench.moment.x / wrench.force.z;
    assert!((zmp_y - foot.zmp.unwrap().y).abs() < 1e-3);
}

#[test]
fn inertial_unit_and_encoders_integrate_to_the_motion() {
    let mut settings = robot::settings();
    settings.pushes.push(shove());
    let (mut plant, command) = standing(settings);
    plant.start_clock();
    let period_s = 0.005;
    let before = plant.sensors().clone();
    let start = *plant.truth();
    let (mut velocity, mut turned) = (Vec3::zeros(), before.orientation);
    let mut last = before.clone();
    for _ in 0..60 {
        let now = plant.tick(&command).clone();
        // Mean proper acceleration over the period, in the axes at its end.
        velocity += period_s * (now.orientation * now.acceleration + Vec3::new(0.0, 0.0, -9.81));
        let mean_rate = 0.5 * (last.orientation * last.angular_velocity + now.orientation * now.angular_velocity);
        turned = so3::exp(&(period_s * mean_rate)) * turned;
        last = now;
    }
    let truth = plant.truth();
    let arm = truth.base.rotation * Vec3::new(-0.0325, 0.0, 0.1095); // inertial unit in the base, from the URDF
    let really = truth.base_twist.at(&arm).linear - start.base_twist.linear;
    assert!(really.norm() > 0.02, "the shove moved it by only {really}");
    assert!((velocity - really).norm() < 1e-9, "{velocity} not {really}");
    assert!(so3::log(&(turned * last.orientation.transpose())).norm() < 1e-4);
}

#[test]
fn momentum_changes_by_the_impulse_of_all_external_forces() {
    let mut settings = robot::settings();
    settings.pushes.push(shove());
    settings.step.force_tolerance_n = 1e-8;
    // One integration step per tick: the truth then holds every force that acted.
    settings.step.control_period_s = 1e-3;
    settings.step.work_error_max_j = 1e6;
    let (mut plant, command) = standing(settings);
    plant.start_clock();
    let mass = plant.model().total_mass_kg();
    let mut before = *plant.truth();
    for _ in 0..300 {
        plant.tick(&command);
        let now = *plant.truth();
        let change = mass * (now.com_velocity - before.com_velocity);
        assert!((change - 1e-3 * mass * now.com_acceleration).norm() < 1e-9, "at {} s", now.t_s);
        before = now;
    }
}

#[test]
fn the_same_inputs_give_the_same_bits() {
    let mut settings = robot::settings();
    settings.pushes.push(shove());
    settings.sensors.foot_force_noise_n = 1.0;
    settings.sensors.gyro_noise_rad_per_s = 0.01;
    let run = |plant: &mut Plant, command: &PlantCommand| -> Vec<PlantSensors> {
        plant.start_clock();
        (0..100).map(|_| plant.tick(command).clone()).collect()
    };
    let (mut plant, command) = standing(settings.clone());
    let first = run(&mut plant, &command);
    let (mut other, _) = standing(settings);
    assert_eq!(first, run(&mut other, &command));
    // Placing it again forgets everything.
    let (fresh, _) = standing(plant.settings().clone());
    plant.place(&robot::stand(&robot::model(), &robot::flat_ankles(SINK_M), COM));
    assert_eq!((plant.sensors(), plant.truth()), (fresh.sensors(), fresh.truth()));
    assert_eq!(first, run(&mut plant, &command));
    assert_eq!(plant.truth(), other.truth());
}

#[test]
fn a_fallen_robot_that_is_placed_again_stands() {
    let mut settings = robot::settings();
    settings.fall.base_height_min_m = 0.9;
    let (mut plant, command) = standing(settings);
    assert!(
        matches!(plant.fallen(), Some(fall) if matches!(fall.reason, FallReason::BaseLow(_))),
        "as high it never is"
    );
    let mut q = plant.state().q.clone();
    q.base.translation.z = 2.0;
    plant.place(&q);
    assert_eq!(plant.fallen(), None);
    plant.tick(&command);
    assert!(plant.truth().com_velocity.z < -0.04, "it moves again");
}

#[test]
fn links_at_the_ankles_may_be_as_low_as_the_ankles_are() {
    let mut settings = robot::settings();
    // Above the ankles, below the knees.
    settings.fall.link_height_min_m = 0.2;
    let (plant, _) = standing(settings);
    assert_eq!(plant.fallen(), None);
}

#[test]
fn what_is_not_solved_is_counted() {
    let mut settings = robot::settings();
    settings.step.newton_steps_max = 1;
    settings.step.force_tolerance_n = 1e-9;
    settings.step.work_error_max_j = 1e6;
    let (mut plant, command) = standing(settings);
    plant.tick(&command);
    let integration = plant.truth().integration;
    assert_eq!((integration.steps, integration.newton_steps, integration.unconverged_steps), (5, 5, 5));
}

#[test]
fn who_turns_or_moves_on_the_spot_is_not_at_rest() {
    let model = robot::model();
    let mut q = robot::posture(&model);
    q.base.translation.z = 100.0;
    let mut settings = robot::settings();
    settings.rest.duration_s = 0.005;
    for (row, rate, resting) in [(5, 0.5, false), (5, 1e-3, true), (0, 0.5, false), (0, 1e-4, true)] {
        // Weightless, for otherwise it falls.
        let options =
            ModelOptions { locked_joints: robot::locked_joints(), gravity: Vec3::zeros(), ..Default::default() };
        let model = Model::from_urdf(&robot::urdf(), &options).unwrap();
        let mut v = nalgebra::DVector::zeros(model.nv());
        v[row] = rate;
        let mut plant = Plant::new(settings.clone(), model, robot::hard_soles(), &robot::frames()).unwrap();
        plant.place_moving(&q, &v);
        assert!(!plant.at_rest(), "not before it has been for a while");
        let joint_count = plant.model().joint_count();
        let command = PlantCommand {
            joint_positions: q.joints.clone(),
            joint_torques: nalgebra::DVector::zeros(joint_count),
            plan: None,
        };
        plant.tick(&command);
        assert_eq!(plant.at_rest(), resting, "{rate} in row {row}");
    }
}

#[test]
fn the_zero_moment_point_of_both_feet_lies_between_theirs_as_they_carry() {
    let (mut plant, command) = standing(robot::settings());
    plant.settle(&command, 5.0).unwrap();
    let truth = plant.truth();
    let total: f64 = truth.feet.iter().map(|foot| foot.wrench.force.z).sum();
    let weighted =
        truth.feet.iter().map(|foot| foot.zmp.unwrap() * (foot.wrench.force.z / total)).sum::<nalgebra::Vector2<f64>>();
    assert!((truth.zmp.unwrap() - weighted).norm() < 1e-9, "{:?} not {weighted}", truth.zmp);
}

#[test]
fn torques_stay_within_the_drives_limits_and_references_within_the_joints() {
    let (mut plant, mut command) = standing(robot::settings());
    let elbow = plant.model().joint("L_ELBOW_P").unwrap();
    let limits = plant.model().joints()[elbow.0].limits;
    command.joint_positions[elbow.0] = 10.0;
    let mut saturated = 0;
    for _ in 0..200 {
        plant.tick(&command);
        let joints = plant.model().joints();
        for (torque, joint) in plant.sensors().joint_torques.iter().zip(joints) {
            assert!(torque.abs() <= joint.limits.effort, "{}: {torque} N m", joint.name);
        }
        let rate = plant.sensors().joint_rates[elbow.0];
        assert!(rate.abs() < 1.5 * limits.velocity, "{rate} rad/s");
        saturated += plant.truth().integration.saturated_drives_max;
        assert_eq!(plant.truth().integration.unconverged_steps, 0);
    }
    assert!(saturated > 0, "the elbow was to be at its torque limit");
    assert!(plant.truth().limited_references > 0);
    assert!((plant.sensors().joint_positions[elbow.0] - limits.upper).abs() < 0.01);
}

#[test]
fn falls_are_seen_and_end_the_motion() {
    let reason = |edit: &dyn Fn(&mut PlantSettings)| {
        let mut settings = robot::settings();
        settings.stabiliser.enabled = false;
        settings.pushes.push(Push { force_n: [0.0, 400.0, 0.0], start_s: 0.0, duration_s: 0.3, ..shove() });
        edit(&mut settings);
        let (mut plant, command) = standing(settings);
        plant.start_clock();
        for _ in 0..800 {
            plant.tick(&command);
        }
        let fall = plant.fallen().expect("such a push makes it fall").clone();
        assert!(fall.t_s < 4.0);
        let last = plant.sensors().clone();
        plant.tick(&command);
        assert_eq!(&last, plant.sensors(), "a fallen robot no longer moves");
        assert!(plant.settle(&command, 1.0).is_none());
        fall.reason
    };
    assert!(matches!(reason(&|_| ()), FallReason::Tilted(angle) if angle > 0.78));
    let low = reason(&|settings| settings.fall.tilt_max_rad = 3.0);
    assert!(matches!(low, FallReason::BaseLow(height) if height < 0.5), "{low}");
    let link = reason(&|settings| {
        settings.fall.tilt_max_rad = 3.0;
        settings.fall.base_height_min_m = 1e-3;
        settings.fall.link_height_min_m = 0.3;
    });
    assert!(matches!(&link, FallReason::LinkLow(_, height) if *height < 0.3), "{link}");
}

#[test]
fn it_stands_on_bumps_and_slopes() {
    for shape in
        [GroundShape::Bumps { height_m: 0.002, length_m: 0.11 }, GroundShape::Slope { rise_x: 0.02, rise_y: 0.01 }]
    {
        let mut settings = robot::settings();
        settings.ground = GroundSettings { shape, ..Default::default() };
        let (mut plant, command) = standing(settings);
        assert!(plant.settle(&command, 5.0).is_some(), "{:?}", plant.truth());
    }
}

#[test]
fn what_cannot_be_built_is_named() {
    let build = |edit: &dyn Fn(&mut PlantSettings, &mut PlantFrames)| -> PlantError {
        let (mut settings, mut frames) = (robot::settings(), robot::frames());
        edit(&mut settings, &mut frames);
        let error = Plant::new(settings, robot::model(), robot::hard_soles(), &frames).err();
        error.expect("it cannot be built")
    };
    assert!(matches!(build(&|settings, _| settings.step.step_s = -1.0), PlantError::Settings(_)));
    assert!(matches!(build(&|_, frames| frames.imu = "nowhere".to_owned()), PlantError::Model(_)));
    assert!(matches!(build(&|_, frames| frames.legs[0][0] = "nothing".to_owned()), PlantError::Model(_)));
    let unknown = build(&|settings, _| {
        settings.servo.joints.insert("L_TAIL".to_owned(), Default::default());
    });
    assert!(unknown.to_string().contains("L_TAIL"), "{unknown}");
    let swapped = build(&|_, frames| frames.legs[0].swap(0, 1));
    assert!(matches!(swapped, PlantError::Leg { side: "left", .. }), "{swapped}");
    let crossed = build(&|_, frames| frames.legs.swap(0, 1));
    assert!(matches!(crossed, PlantError::Leg { .. }), "{crossed}");
    let pushed = build(&|settings, _| settings.pushes.push(Push { link: "tail".to_owned(), ..shove() }));
    assert!(matches!(pushed, PlantError::Model(_)), "{pushed}");

    let options = ModelOptions { base: multibody::Base::Fixed, ..Default::default() };
    let fixed = Model::from_urdf(&robot::urdf(), &options).unwrap();
    let error = Plant::new(robot::settings(), fixed, robot::hard_soles(), &robot::frames()).err();
    assert!(matches!(error, Some(PlantError::FixedBase)));
}

/// A step of the whole chain: forward kinematics of the model after the stabiliser's inverse kinematics gives the planned feet.
#[test]
fn without_errors_the_stabiliser_changes_nothing() {
    let (mut plant, command) = standing(robot::settings());
    plant.settle(&command, 5.0).unwrap();
    let report = plant.truth().stabiliser;
    assert!(report.dcm_error.norm() < 1e-3, "{report:?}");
    assert!(report.out_of_reach_m < 1e-12);
    let mut ws = multibody::Workspace::new(plant.model());
    let placed = forward_kinematics(plant.model(), &mut ws, &plant.state().q);
    let ankles: [Transform; 2] = robot::flat_ankles(SINK_M);
    for (name, planned) in robot::frames().ankles.iter().zip(ankles) {
        let is = placed.pose(plant.model().frame(name).unwrap());
        assert!((is.translation - planned.translation).norm() < 1e-3);
    }
    let moved = (&plant.sensors().joint_positions - &command.joint_positions).amax();
    assert!(moved < 0.01, "{moved} rad");
}
