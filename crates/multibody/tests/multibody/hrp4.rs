//! The robot that ships: size, weight and posture of HRP-4, as `robots/hrp4/ORIGIN.md` says.

use multibody::*;
use nalgebra::DMatrix;
use robot::{Capsule, Robot};
use spatial::{Transform, Vec3, so3};
use std::path::Path;

/// Ankle to the ground of the original foot, without the soft sole (m).
const ORIGINAL_ANKLE_HEIGHT_M: f64 = 0.093;
/// Neck axis to crown (m).
const NECK_TO_CROWN_M: f64 = 0.091;
/// Published lengths are given to the millimetre.
const MILLIMETRE: f64 = 1e-3;
/// Lengths of the ankles at half-sitting are given to a tenth of a millimetre.
const TENTH_OF_A_MILLIMETRE: f64 = 1e-4;

fn hrp4() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4"))
        .expect("the shipped robot is readable")
}

fn model(robot: &Robot) -> Model {
    Model::from_urdf(&robot.urdf, &ModelOptions::default()).expect("the shipped URDF is a robot")
}

/// Half-sitting, the left foot on the ground of the original foot.
fn half_sitting(robot: &Robot, model: &Model) -> Configuration {
    let mut q = model.neutral();
    for (position, joint) in q.joints.iter_mut().zip(model.joints()) {
        *position = robot.description.half_sitting_rad(&joint.name);
    }
    let mut ws = Workspace::new(model);
    let ankle = model.frame(&robot.description.feet[0].ankle_frame).unwrap();
    q.base.translation.z = ORIGINAL_ANKLE_HEIGHT_M - forward_kinematics(model, &mut ws, &q).pose(ankle).translation.z;
    q
}

#[test]
fn it_has_34_joints_and_39_kilograms() {
    let robot = hrp4();
    let model = model(&robot);
    assert!((model.total_mass_kg() - 39.0).abs() < 1e-12);
    let names: Vec<&str> = model.joints().iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, robot.description.joints, "the URDF and robot.toml list the same joints in the same order");
    assert_eq!((names.len(), model.nv()), (34, 40));
}

#[test]
fn every_name_in_the_description_is_in_the_urdf() {
    let robot = hrp4();
    let model = model(&robot);
    let description = &robot.description;
    let feet = description.feet.iter().flat_map(|foot| [&foot.link, &foot.ankle_frame, &foot.force_sensor_frame]);
    let links = [&description.base_link, &description.torso_link, &description.imu_frame];
    for name in links.into_iter().chain(feet).chain(description.capsules.iter().map(|capsule| &capsule.link)) {
        model.frame(name).unwrap();
    }
    assert_eq!(model.base_frame(), model.frame(&description.base_link).unwrap());
}

#[test]
fn with_straight_legs_it_is_a_metre_and_a_half_high() {
    let robot = hrp4();
    let model = model(&robot);
    let mut ws = Workspace::new(&model);
    let placed = forward_kinematics(&model, &mut ws, &model.neutral());
    let z_of = |frame: &str| placed.pose(model.frame(frame).unwrap()).translation.z;
    let ground = z_of("l_ankle") - ORIGINAL_ANKLE_HEIGHT_M;
    assert!((ground + 0.79216).abs() < TENTH_OF_A_MILLIMETRE, "base height {}", -ground);
    let height = z_of("NECK_P_LINK") + NECK_TO_CROWN_M - ground;
    assert!((height - 1.514).abs() < MILLIMETRE, "height {height}");
}

#[test]
fn half_sitting_is_where_the_facts_say() {
    let robot = hrp4();
    let model = model(&robot);
    let (q, mut ws) = (half_sitting(&robot, &model), Workspace::new(&model));
    let placed = forward_kinematics(&model, &mut ws, &q);
    let com = placed.center_of_mass();
    assert!((com.z - 0.780).abs() < MILLIMETRE, "centre of mass {}", com.z);
    // On the soft sole the ankle is 10 mm higher, and so is everything else.
    let on_the_sole = com.z - ORIGINAL_ANKLE_HEIGHT_M + robot.sole.foot.ankle_in_sole_m(0)[2];
    assert!((on_the_sole - 0.790).abs() < MILLIMETRE, "centre of mass {on_the_sole}");
    assert!((placed.pose(model.base_frame()).translation.z - 0.7472).abs() < MILLIMETRE);
    // Not symmetric: that is the robot's posture, not an error.
    for (foot, y_m) in robot.description.feet.iter().zip([0.0816, -0.0771]) {
        let X_WF = placed.pose(model.frame(&foot.ankle_frame).unwrap());
        assert!((X_WF.translation.y - y_m).abs() < TENTH_OF_A_MILLIMETRE, "{} at {}", foot.link, X_WF.translation.y);
        assert!((X_WF.translation.z - ORIGINAL_ANKLE_HEIGHT_M).abs() < MILLIMETRE);
        // The posture is given to a hundredth of a degree per joint but leaves the feet tilted by up to 1.3 degrees.
        let tilt = so3::log(&X_WF.rotation);
        assert!(tilt.norm() < 1.5_f64.to_radians(), "{} tilted by {} deg", foot.link, tilt.norm().to_degrees());
        assert!((X_WF.translation.x - com.x).abs() < 3.0 * MILLIMETRE, "the feet are under the centre of mass");
    }
}

#[test]
fn centroidal_inertia_is_that_of_the_facts() {
    let robot = hrp4();
    let model = model(&robot);
    let (q, mut ws) = (half_sitting(&robot, &model), Workspace::new(&model));
    let mut terms = WholeBodyTerms::new(&model, &[]);
    whole_body_terms(&model, &mut ws, &q, &nalgebra::DVector::zeros(model.nv()), &mut terms);
    // The base's axes are the world's here.
    let diagonal = [3, 4, 5].map(|k| terms.centroidal_matrix[(k, k)]);
    for (found, expected) in diagonal.iter().zip([5.67, 5.25, 0.67]) {
        assert!((found - expected).abs() < 0.01, "{diagonal:?}");
    }
}

#[test]
fn left_and_right_are_mirror_images() {
    let robot = hrp4();
    let model = model(&robot);
    let mut ws = Workspace::new(&model);
    let (mut q, mut mirrored) = (model.neutral(), model.neutral());
    for (i, joint) in model.joints().iter().enumerate() {
        let Some(name) = joint.name.strip_prefix("R_") else { continue };
        let left = model.joint(&format!("L_{name}")).unwrap();
        // Pitch keeps its sign; roll and yaw, and the hand's axes, change it.
        let sign = if name.ends_with("_P") { 1.0 } else { -1.0 };
        let position = 0.1 + 0.01 * i as f64;
        q.joints[i] = position;
        mirrored.joints[left.0] = sign * position;
        let limits = &model.joints()[left.0].limits;
        let (lower, upper) = if sign > 0.0 { (limits.lower, limits.upper) } else { (-limits.upper, -limits.lower) };
        assert_eq!((joint.limits.lower, joint.limits.upper), (lower, upper), "{name}");
        assert_eq!((joint.limits.velocity, joint.limits.effort), (limits.velocity, limits.effort), "{name}");
    }
    let mut state = |q: &Configuration| {
        let mut terms = WholeBodyTerms::new(&model, &[]);
        whole_body_terms(&model, &mut ws, q, &nalgebra::DVector::zeros(model.nv()), &mut terms);
        terms
    };
    let (a, b) = (state(&q), state(&mirrored));
    let mirror = |p: Vec3| Vec3::new(p.x, -p.y, p.z);
    assert!((a.com - mirror(b.com)).norm() < 1e-15);
    let trace = |t: &WholeBodyTerms| t.mass_matrix.diagonal().sum();
    assert!((trace(&a) - trace(&b)).abs() < 1e-12);
}

#[test]
fn locking_the_scene_changes_the_joints_but_not_the_mass() {
    let robot = hrp4();
    let locked = robot.description.walking_locked_joints();
    let walking = Model::from_urdf(&robot.urdf, &ModelOptions { locked_joints: locked, ..Default::default() }).unwrap();
    assert_eq!(walking.joint_count(), 22);
    assert!((walking.total_mass_kg() - 39.0).abs() < 1e-12);
    let whole = model(&robot);
    let (mut ws_a, mut ws_b) = (Workspace::new(&whole), Workspace::new(&walking));
    let a = forward_kinematics(&whole, &mut ws_a, &half_sitting(&robot, &whole));
    let b = forward_kinematics(&walking, &mut ws_b, &half_sitting(&robot, &walking));
    assert!((a.center_of_mass() - b.center_of_mass()).norm() < 1e-14);
    for frame in whole.frames() {
        let X_a = a.pose(whole.frame(&frame.name).unwrap());
        let X_b = b.pose(walking.frame(&frame.name).unwrap());
        assert!((X_a.translation - X_b.translation).norm() < 1e-14, "{}", frame.name);
        assert!((X_a.rotation - X_b.rotation).norm() < 1e-14, "{}", frame.name);
    }
}

#[test]
fn servo_damping_is_critical_for_rotor_and_link() {
    let robot = hrp4();
    let mut model = Model::from_urdf(&robot.urdf, &ModelOptions { base: Base::Fixed, ..Default::default() }).unwrap();
    for i in 0..model.joint_count() {
        let servo = robot.description.servo(&model.joints()[i].name).unwrap();
        model.set_rotor_inertia(JointIndex(i), servo.rotor_inertia_kg_m2);
    }
    let mut q = model.neutral();
    q.joints.iter_mut().zip(model.joints()).for_each(|(p, joint)| *p = robot.description.half_sitting_rad(&joint.name));
    let (mut ws, mut mass) = (Workspace::new(&model), DMatrix::zeros(model.nv(), model.nv()));
    crba(&model, &mut ws, &q, &mut mass);
    for (i, joint) in model.joints().iter().enumerate() {
        let servo = robot.description.servo(&joint.name).unwrap();
        let critical = 2.0 * (servo.kp_nm_per_rad * mass[(i, i)]).sqrt();
        assert!((servo.kd_nm_s_per_rad / critical - 1.0).abs() < 0.03, "{}: {critical}", joint.name);
    }
}

/// Distance between the surfaces of two capsules in the world, by sampling: slow, simple, an upper bound within `step`.
fn sampled_distance(a: (Vec3, Vec3, f64), b: (Vec3, Vec3, f64)) -> f64 {
    let along = |(p, q, _): (Vec3, Vec3, f64)| (0..=200).map(move |k| p + (q - p) * (f64::from(k) / 200.0));
    let centre = along(a).flat_map(|p| along(b).map(move |q| (p - q).norm())).fold(f64::INFINITY, f64::min);
    centre - a.2 - b.2
}

#[test]
fn capsules_are_those_of_the_urdf_and_keep_apart_at_half_sitting() {
    let robot = hrp4();
    let model = model(&robot);
    let (q, mut ws) = (half_sitting(&robot, &model), Workspace::new(&model));
    let placed = forward_kinematics(&model, &mut ws, &q);
    let place = |capsule: &Capsule| {
        let X_WL: Transform = placed.pose(model.frame(&capsule.link).unwrap());
        (X_WL.point(&Vec3::from(capsule.from_m)), X_WL.point(&Vec3::from(capsule.to_m)), capsule.radius_m)
    };
    let find = |name: &str| robot.description.capsules.iter().find(|capsule| capsule.name == name).unwrap();
    assert!(robot.description.collision_pairs.len() >= 10);
    for [a, b] in &robot.description.collision_pairs {
        let distance = sampled_distance(place(find(a)), place(find(b)));
        assert!(distance > 0.015, "{a} and {b} are {distance} m apart");
    }
    // Every capsule but the feet's (there the URDF has the exact box) is drawn in the URDF as well.
    let urdf = urdf_rs::read_from_string(&robot.urdf).unwrap();
    for capsule in robot.description.capsules.iter().filter(|capsule| !capsule.name.ends_with("foot")) {
        let link = urdf.links.iter().find(|link| link.name == capsule.link).unwrap();
        for end in [capsule.from_m, capsule.to_m] {
            let drawn = link.collision.iter().any(|collision| match collision.geometry {
                urdf_rs::Geometry::Sphere { radius } => collision.origin.xyz.0 == end && radius == capsule.radius_m,
                _ => false,
            });
            assert!(drawn, "{}: no sphere at {end:?}", capsule.name);
        }
    }
}
