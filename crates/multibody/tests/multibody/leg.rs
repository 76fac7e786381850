//! Legs read off a model, and models whose legs are of another shape.

use crate::random_robot::Random;
use multibody::leg::{LegError, LegGeometry};
use multibody::*;
use spatial::Vec3;

/// Rounding of about thirty operations on lengths below 1 m.
const ROUNDING_M: f64 = 1e-12;
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
            forward_kinematics(&model, &mut ws, &q);
            let X_BA = ws.placement(&model, model.base_frame()).inverse() * ws.placement(&model, ankle);
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
