//! Legs read off a model, and models whose legs are of another shape.

use crate::random_robot::Random;
use multibody::leg::{LegChain, LegError, LegGeometry, LegKinematics};
use multibody::*;
use spatial::Vec3;

/// Rounding of about thirty operations on lengths below 1 m.
const ROUNDING_M: f64 = 1e-12;
/// What [`ROUNDING_M`] and the tolerance of a chain, 1e-12 m, make of angles of legs with bent knees (0.2 rad and more).
const SOLVED_RAD: f64 = 1e-10;
const LEG: [&str; 6] = ["HIP_Y", "HIP_R", "HIP_P", "KNEE_P", "ANKLE_P", "ANKLE_R"];

fn hrp4() -> String {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/hrp4/hrp4.urdf");
    std::fs::read_to_string(file).expect("the shipped robot")
}

fn read(text: &str) -> Model {
    Model::from_urdf(text, &ModelOptions::default()).expect("a robot")
}

fn joints(model: &Model, side: &str) -> [JointIndex; 6] {
    LEG.map(|name| model.joint(&format!("{side}_{name}")).expect("a leg's joint"))
}

#[test]
fn hrp4_s_legs_have_the_published_lengths_and_reach_where_its_kinematics_say() {
    let model = read(&hrp4());
    let (mut ws, mut q, mut random) = (Workspace::new(&model), model.neutral(), Random(4));
    for (side, ankle, left) in [("L", "l_ankle", 1.0), ("R", "r_ankle", -1.0)] {
        let (joints, ankle) = (joints(&model, side), model.frame(ankle).expect("a frame"));
        let leg = LegGeometry::of_model(&model, &joints, ankle).expect("HRP-4's leg has the shape");
        assert!((leg.hip_in_base - Vec3::new(0.0, 0.0875 * left, 0.0)).norm() < ROUNDING_M, "{leg:?}");
        assert!((leg.knee_offset_m + 0.01905 * left).abs() < ROUNDING_M, "{leg:?}");
        assert!((leg.thigh_m - 0.358).abs() < ROUNDING_M && (leg.shank_m - 0.34115).abs() < ROUNDING_M, "{leg:?}");
        for _ in 0..20 {
            let limits = |joint: JointIndex| model.joints()[joint.0].limits;
            let angles = joints.map(|joint| {
                let Limits { lower, upper, .. } = limits(joint);
                q.joints[joint.0] = 0.5 * (lower + upper) + 0.5 * (upper - lower) * random.symmetric();
                q.joints[joint.0]
            });
            let placed = forward_kinematics(&model, &mut ws, &q);
            let X_BA = placed.pose(model.base_frame()).inverse() * placed.pose(ankle);
            let forward = leg.forward(&angles);
            assert!((forward.translation - X_BA.translation).norm() < ROUNDING_M);
            assert!((forward.rotation - X_BA.rotation).norm() < ROUNDING_M);
        }
    }
}

#[test]
fn legs_of_another_shape_are_refused_by_joint_and_distance() {
    let of = |model: &Model| LegGeometry::of_model(model, &joints(model, "L"), model.frame("l_ankle").unwrap());
    let urdf = hrp4();
    // One joint of the left leg as it stands in the file, changed.
    let changed = |joint: &str, from: &str, to: &str| {
        let start = urdf.find(&format!(r#"<joint name="{joint}""#)).expect("the file has the joint");
        let (before, after) = urdf.split_at(start);
        let (inside, rest) = after.split_at(after.find("</joint>").expect("it ends"));
        assert!(inside.contains(from), "{inside}");
        of(&read(&format!("{before}{}{rest}", inside.replacen(from, to, 1)))).expect_err("not the known shape")
    };
    for (joint, from, to, expected) in [
        ("L_HIP_P", "<axis", r#"<origin xyz="0.01 0 0"/><axis"#, "yaw axis"),
        ("L_HIP_P", "<axis", r#"<origin xyz="0 0 0.01"/><axis"#, "roll and pitch axes meet"),
        ("L_KNEE_P", r#"xyz="0 -0.01905"#, r#"xyz="0.01 -0.01905"#, "hip straight above the ankle"),
        ("L_ANKLE_P", r#"xyz="0 0 "#, r#"xyz="0.01 0 "#, "knee straight above the ankle"),
        ("L_ANKLE_R", "<axis", r#"<origin xyz="0 0 0.01"/><axis"#, "pitch axis through the ankle"),
        ("l_ankle_mount", "<child", r#"<origin xyz="0 0.01 0"/><child"#, "roll axis through the ankle"),
    ] {
        let error = changed(joint, from, to);
        let LegError::Offset { relation, distance_m, .. } = &error else { panic!("{joint}: {error}") };
        assert!(relation.contains(expected) && (distance_m - 0.01).abs() < ROUNDING_M, "{joint}: {error}");
    }
    let error = changed("L_KNEE_P", r#"<axis xyz="0 1 0"/>"#, r#"<axis xyz="0 -1 0"/>"#);
    assert!(matches!(&error, LegError::Axis { joint, .. } if joint == "L_KNEE_P"), "{error}");
    let error = changed("l_ankle_mount", "<child", r#"<origin rpy="0 0 0.2"/><child"#);
    assert!(matches!(&error, LegError::Foot { angle_rad, .. } if (angle_rad - 0.2).abs() < ROUNDING_M), "{error}");
}

/// HRP-4's legs with the hips of JVRC-1: pitch, roll, yaw; and roll before pitch in the ankles.
fn other_order() -> String {
    let mut urdf = hrp4();
    for side in ["L", "R"] {
        for (joint, axis) in [("HIP_Y", "0 1 0"), ("HIP_P", "0 0 1"), ("ANKLE_P", "1 0 0"), ("ANKLE_R", "0 1 0")] {
            let start = urdf.find(&format!(r#"<joint name="{side}_{joint}""#)).expect("the file has the joint");
            let from = start + urdf[start..].find(r#"<axis xyz=""#).expect("it has an axis") + r#"<axis xyz=""#.len();
            let to = from + urdf[from..].find('"').expect("it ends");
            urdf.replace_range(from..to, axis);
        }
    }
    urdf
}

#[test]
fn a_chain_finds_what_the_closed_form_finds() {
    let model = read(&hrp4());
    let mut random = Random(11);
    let (joints, ankle) = (joints(&model, "L"), model.frame("l_ankle").expect("a frame"));
    let closed = LegGeometry::of_model(&model, &joints, ankle).expect("HRP-4's leg has the shape");
    let chain = LegChain::of_model(&model, &joints, ankle).expect("six joints");
    assert_eq!(LegKinematics::of_model(&model, &joints, ankle), Ok(LegKinematics::YawRollPitch(closed)));
    assert!((chain.hip_in_base() - closed.hip_in_base).norm() < ROUNDING_M);
    for _ in 0..200 {
        let angles = walking(&mut random);
        let near = angles.map(|angle| angle + 0.1 * random.symmetric());
        let wanted = closed.forward(&angles);
        let (found, expected) = (chain.inverse(&wanted, &near), closed.inverse(&wanted));
        assert_eq!(found.out_of_reach_m, 0.0, "{angles:?} from {near:?}");
        for (found, expected) in found.joints_rad.iter().zip(expected.joints_rad) {
            assert!((found - expected).abs() < SOLVED_RAD, "{found} for {expected} of {angles:?}");
        }
    }
}

#[test]
fn legs_with_other_orders_of_axes_are_solved_as_chains() {
    let model = read(&other_order());
    let mut random = Random(12);
    for (side, ankle) in [("L", "l_ankle"), ("R", "r_ankle")] {
        let (joints, ankle) = (joints(&model, side), model.frame(ankle).expect("a frame"));
        let leg = LegKinematics::of_model(&model, &joints, ankle).expect("six joints");
        assert!(matches!(leg, LegKinematics::Chain(_)), "{leg:?}");
        // The knee's offset from the straight line stays in the length.
        assert!((leg.length_m(0.0) - (0.69915_f64).hypot(0.01905)).abs() < ROUNDING_M, "{}", leg.length_m(0.0));
        let (mut ws, mut q) = (Workspace::new(&model), model.neutral());
        for _ in 0..200 {
            let angles = walking(&mut random);
            for (joint, angle) in joints.iter().zip(angles) {
                q.joints[joint.0] = angle;
            }
            let placed = forward_kinematics(&model, &mut ws, &q);
            let X_BA = placed.pose(model.base_frame()).inverse() * placed.pose(ankle);
            let near = angles.map(|angle| angle + 0.1 * random.symmetric());
            let found = leg.inverse(&X_BA, &near);
            assert_eq!(found.out_of_reach_m, 0.0, "{angles:?} from {near:?}");
            for (found, expected) in found.joints_rad.iter().zip(angles) {
                assert!((found - expected).abs() < SOLVED_RAD, "{found} for {expected} of {angles:?}");
            }
        }
    }
}

#[test]
fn a_pose_out_of_a_chain_s_reach_is_missed_by_what_is_said() {
    let model = read(&other_order());
    let (joints, ankle) = (joints(&model, "L"), model.frame("l_ankle").expect("a frame"));
    let leg = LegKinematics::of_model(&model, &joints, ankle).expect("six joints");
    let bent = [-0.4, 0.0, 0.0, 0.7, 0.0, -0.3];
    let mut wanted = leg.forward(&bent);
    wanted.translation.z -= 0.5;
    let found = leg.inverse(&wanted, &bent);
    assert!(found.joints_rad.iter().all(|angle| angle.is_finite()));
    let missed = (leg.forward(&found.joints_rad).translation - wanted.translation).norm();
    assert!(found.out_of_reach_m >= missed && missed > 0.3, "{found:?}, {missed} m");
}

#[test]
fn joints_that_make_no_leg_are_refused_by_name() {
    let model = read(&hrp4());
    let ankle = model.frame("l_ankle").expect("a frame");
    let refused = |joints: [JointIndex; 6]| LegKinematics::of_model(&model, &joints, ankle).expect_err("no leg");
    let (left, right) = (joints(&model, "L"), joints(&model, "R"));
    let crossed = refused(right);
    assert!(matches!(crossed, LegError::OtherJoints { .. }), "{crossed}");
    let mut swapped = left;
    swapped.swap(0, 1);
    let swapped = refused(swapped);
    assert!(matches!(&swapped, LegError::Order { joint } if joint == "L_HIP_Y"), "{swapped}");
    // Three axes in one direction and none in another.
    let flat = read(&hrp4().replace(r#"<axis xyz="1 0 0"/>"#, r#"<axis xyz="0 1 0"/>"#));
    let flat = LegKinematics::of_model(&flat, &joints(&flat, "L"), flat.frame("l_ankle").unwrap()).expect_err("flat");
    assert!(matches!(flat, LegError::NotFree { .. }), "{flat}");
}

/// Angles of a walking leg (rad): the knee bends, by 0.2 and more.
fn walking(random: &mut Random) -> [f64; 6] {
    let middle = [0.0, 0.0, -0.4, 0.8, -0.4, 0.0];
    let room = [0.4, 0.3, 0.4, 0.6, 0.3, 0.3];
    std::array::from_fn(|i| middle[i] + room[i] * random.symmetric())
}
