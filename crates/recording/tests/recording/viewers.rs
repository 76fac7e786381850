//! Other programs read the numbers, and viewers see what there is.

use crate::samples::{at, decoded, info, raw, settings};
use messages::{Header, PatternHeader, PatternPhase, Plain, RobotState, SoleContact, SoleDeformation, Truth, topic};
use prost_reflect::{DynamicMessage, Value};
use recording::{Recording, ViewerSettings, Writer};
use std::path::Path;

/// A `sensor_msgs/msg/JointState`, read as ROS 2 does.
struct Joints {
    time: (u32, u32),
    names: Vec<String>,
    numbers: [Vec<f64>; 3],
}

fn joints(path: &Path) -> Joints {
    let (schema, bytes) = raw(path, "/joint_states");
    assert_eq!(schema, "sensor_msgs/msg/JointState");
    assert_eq!(bytes[..4], [0, 1, 0, 0], "little-endian");
    let (content, mut at) = (&bytes[4..], 0_usize);
    let mut take = |count: usize, size: usize| {
        at = at.next_multiple_of(size);
        at += count * size;
        content[at - count * size..at].to_vec()
    };
    let number = |take: &mut dyn FnMut(usize, usize) -> Vec<u8>| {
        u32::from_le_bytes(take(1, 4).try_into().expect("four")) as usize
    };
    let time = (number(&mut take) as u32, number(&mut take) as u32);
    let text = |take: &mut dyn FnMut(usize, usize) -> Vec<u8>| {
        let length = number(take);
        let bytes = take(length, 1);
        String::from_utf8(bytes[..length - 1].to_vec()).expect("text")
    };
    assert_eq!(text(&mut take), "");
    let count = u32::from_le_bytes(take(1, 4).try_into().expect("four"));
    let names = (0..count).map(|_| text(&mut take)).collect();
    let mut doubles = || -> Vec<f64> {
        let count = u32::from_le_bytes(take(1, 4).try_into().expect("four")) as usize;
        let bytes = take(count, 8);
        bytes.chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().expect("eight"))).collect()
    };
    let numbers = [doubles(), doubles(), doubles()];
    assert_eq!(at, content.len(), "and nothing more");
    Joints { time, names, numbers }
}

#[test]
fn other_programs_read_the_numbers_with_the_schema_in_the_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
    let mut state = RobotState { header: Header::new(-3, 77), joint_count: 2, ..RobotState::ZERO };
    state.header.sequence = 300;
    state.joint_position_rad[1] = 0.25;
    state.foot_wrench_n_nm[1][2] = 400.5;
    writer.record(topic::ROBOT_STATE, &state).expect("room");
    let mut truth = Truth { header: Header::new(400, 77), joint_count: 1, ..Truth::ZERO };
    truth.joint_position_rad[0] = -0.5;
    truth.joint_velocity_rad_per_s[0] = 3.0;
    truth.joint_torque_nm[0] = 40.0;
    truth.base_position_m = [1.0, 2.0, 3.0];
    truth.base_rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    truth.sole_rotation = [truth.base_rotation; 2];
    truth.foot_wrench_n_nm[0][2] = 200.0;
    writer.record(topic::TRUTH_ROBOT, &truth).expect("room");
    writer.show_truth(&truth).expect("room");
    let mut deformation = SoleDeformation::ZERO;
    deformation.feet[1].compliance_m_rad_per_n_nm[35] = 7.0;
    writer.record(topic::SOLE_DEFORMATION, &deformation).expect("room");
    writer.record_pattern(&PatternHeader::ZERO, &[PatternPhase { kind: 2, ..PatternPhase::ZERO }; 2]).expect("room");
    writer.finish().expect("room");

    let state = decoded(&path, "/robot/state");
    assert_eq!(at(&state, "header.tick"), Value::I64(-3));
    assert_eq!(at(&state, "header.sequence"), Value::U64(300));
    assert_eq!(at(&state, "joint_count"), Value::U32(2));
    assert_eq!(at(&state, "joint_position_rad.1"), Value::F64(0.25));
    assert_eq!(at(&state, "foot_wrench_n_nm.8"), Value::F64(400.5));
    assert_eq!(at(&decoded(&path, "/sole/deformation"), "feet.1.compliance_m_rad_per_n_nm.35"), Value::F64(7.0));
    assert_eq!(at(&decoded(&path, "/walk/pattern"), "phases.1.kind"), Value::EnumNumber(2));
    let transforms = decoded(&path, "/tf");
    assert_eq!(at(&transforms, "transforms.0.child_frame_id"), Value::String("body".to_string()));
    assert_eq!(at(&transforms, "transforms.0.translation.y"), Value::F64(2.0));
    assert_eq!(at(&transforms, "transforms.2.rotation.w"), Value::F64(1.0));
    assert_eq!(at(&transforms, "transforms.0.timestamp.seconds"), Value::I64(2));
    // Every link in its parent: a rotation by q about y is the quaternion (0, sin q/2, 0, cos q/2).
    let turned = |index: usize, q: f64| {
        let at = |part: &str| at(&transforms, &format!("transforms.{index}.{part}")).as_f64().expect("a double");
        assert_near(
            &[at("rotation.y"), at("rotation.w"), at("translation.z")],
            &[(q / 2.0).sin(), (q / 2.0).cos(), -0.5],
        );
    };
    assert_eq!(at(&transforms, "transforms.3.child_frame_id"), Value::String("thigh".to_string()));
    assert_eq!(at(&transforms, "transforms.4.parent_frame_id"), Value::String("thigh".to_string()));
    [(3, -0.5), (4, 1.25), (5, 0.0)].into_iter().for_each(|(index, q)| turned(index, q));
    let joints = joints(&path);
    assert_eq!(joints.names, ["HIP", "FINGER", "CLASP"]);
    assert_eq!(joints.numbers, [[-0.5, 1.25, 0.25], [3.0, -6.0, 0.0], [40.0, 0.0, 0.0]]);
    assert_eq!(joints.time, (2, 0));
    let (schema, text) = raw(&path, "/robot_description");
    assert_eq!((schema.as_str(), &text[8..]), ("std_msgs/msg/String", &b"<robot name=\"small\"/>\0"[..]));
    let scene = decoded(&path, "/scene");
    assert_eq!(at(&scene, "entities.0.cubes.1.size.x"), Value::F64(0.23));
    assert_eq!(at(&scene, "entities.0.arrows.0.shaft_length"), Value::F64(0.8 * 0.2));
}

/// A field of doubles, or of messages of them, by the names of its parts.
fn numbers(message: &DynamicMessage, path: &str, parts: &[&str]) -> Vec<f64> {
    parts.iter().map(|part| at(message, &format!("{path}.{part}")).as_f64().expect("a double")).collect()
}

const XYZ: [&str; 3] = ["x", "y", "z"];

fn assert_near(found: &[f64], expected: &[f64]) {
    let same = found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(same, "{found:?} instead of {expected:?}");
}

#[test]
fn viewers_see_soles_forces_and_points_where_they_are() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
    let mut truth = Truth { header: Header::new(0, 7), joint_count: 2, ..Truth::ZERO };
    (truth.joint_velocity_rad_per_s[1], truth.joint_torque_nm[1]) = (1.5, -20.0);
    truth.base_rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    // The right sole stands on its heel: its z axis points along the world's x axis.
    let upright = [0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0];
    truth.sole_rotation = [truth.base_rotation, upright];
    truth.sole_position_m = [[0.0, 0.1, 0.0], [0.5, -0.1, 0.2]];
    (truth.com_position_m, truth.zmp_m) = ([0.1, 0.2, 0.8], [0.3, 0.4]);
    // Of the left foot nothing worth an arrow.
    truth.foot_wrench_n_nm = [[0.0, 0.0, 0.05, 9.0, 9.0, 9.0], [30.0, -40.0, 120.0, 9.0, 9.0, 9.0]];
    writer.show_truth(&truth).expect("room");
    let mut contact = SoleContact { header: Header::new(0, 7), ..SoleContact::ZERO };
    let nodes = &mut contact.feet[1];
    nodes.count = 2;
    nodes.position_m[..3].copy_from_slice(&[[9.0; 3], [0.1, 0.2, 0.0], [9.0; 3]]);
    nodes.force_n[..3].copy_from_slice(&[[0.0; 3], [1.0, 0.0, 5.0], [5.0; 3]]);
    writer.show_contact(&contact).expect("room");
    writer.finish().expect("room");

    let transforms = decoded(&path, "/tf");
    assert_eq!(at(&transforms, "transforms.2.child_frame_id"), Value::String("right_sole".to_string()));
    assert_near(&numbers(&transforms, "transforms.2.translation", &XYZ), &[0.5, -0.1, 0.2]);
    let quarter = 0.5_f64.sqrt();
    assert_near(&numbers(&transforms, "transforms.2.rotation", &["x", "y", "z", "w"]), &[0.0, quarter, 0.0, quarter]);
    let joints = joints(&path);
    assert_eq!(joints.names[1], "joint 1", "it has no name");
    assert_eq!([joints.numbers[1][1], joints.numbers[2][1]], [1.5, -20.0]);

    let robot = decoded(&path, "/scene");
    // The sole's frame is at the centre of its bottom, a box is drawn about its middle.
    assert_near(&numbers(&robot, "entities.0.cubes.1.pose.position", &XYZ), &[0.5 + 0.0105, -0.1, 0.2]);
    let Value::List(arrows) = at(&robot, "entities.0.arrows") else { panic!("a list") };
    assert_eq!(arrows.len(), 1);
    // The force acts at the foot's zero-moment point: 9 N m about y move it by 9/120 m along -x.
    assert_near(&numbers(&robot, "entities.0.arrows.0.pose.position", &XYZ), &[0.5 - 0.075, -0.1 + 0.075, 0.2]);
    // An arrow points along its x axis: the first column of its rotation is the direction of the force.
    let turn = numbers(&robot, "entities.0.arrows.0.pose.orientation", &["x", "y", "z", "w"]);
    let [x, y, z, w] = turn.try_into().expect("four numbers");
    let direction = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)];
    assert_near(&direction, &[30.0 / 130.0, -40.0 / 130.0, 120.0 / 130.0]);
    assert_near(&numbers(&robot, "entities.0.arrows.0", &["shaft_length", "head_length"]), &[0.104, 0.026]);
    assert_near(&numbers(&robot, "entities.0.spheres.0.pose.position", &XYZ), &[0.1, 0.2, 0.8]);
    assert_near(&numbers(&robot, "entities.0.spheres.1.pose.position", &XYZ), &[0.3, 0.4, 0.0]);
    let lines = decoded(&path, "/scene/contact");
    let Value::List(points) = at(&lines, "entities.0.lines.0.points") else { panic!("a list") };
    assert_eq!(points.len(), 2, "one node carries, and those beyond the count are none");
    assert_near(&numbers(&lines, "entities.0.lines.0.points.0", &XYZ), &[0.1, 0.2, 0.0]);
    assert_near(&numbers(&lines, "entities.0.lines.0.points.1", &XYZ), &[0.11, 0.2, 0.05]);
}

#[test]
fn scenes_are_drawn_now_and_then_only() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let settings = ViewerSettings { scene_every_ticks: 4, ..settings() };
    let mut writer = Writer::create(&path, &info(), settings).expect("writable");
    for tick in 0..10 {
        writer.show_truth(&Truth { header: Header::new(tick, 7), ..Truth::ZERO }).expect("room");
    }
    writer.finish().expect("room");
    let survey = Recording::open(&path).expect("finished").survey().expect("whole");
    let count = |name: &str| survey.topics.get(name).map(|topic| topic.messages);
    assert_eq!((count("/tf"), count("/joint_states"), count("/scene")), (Some(3), Some(10), Some(3)));
}
