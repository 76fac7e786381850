//! Recordings give back what was put in, bit for bit, and survive being killed.

use messages::{
    Header, Message, PatternHeader, PatternPhase, Plain, RobotState, SoleContact, SoleDeformation, Topic, Truth, topic,
};
use prost_reflect::{DescriptorPool, DynamicMessage, Value};
use recording::{Follower, Link, Recording, Recovered, RunInfo, ViewerSettings, Writer, recover, recover_file};
use std::path::Path;

/// A message of reproducible random bits, among them numbers that are not finite.
fn random<T: Message>(seed: u64) -> T {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut byte = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u8
    };
    let bytes: Vec<u8> = (0..size_of::<T>()).map(|_| byte()).collect();
    T::read_bytes(&mut bytes.as_slice()).expect("as many bytes as it has")
}

fn bytes<T: Plain>(value: &T) -> Vec<u8> {
    let mut bytes = Vec::new();
    value.write_bytes(&mut bytes);
    bytes
}

fn settings() -> ViewerSettings {
    ViewerSettings {
        joint_names: vec!["HIP".to_string()],
        followers: [("FINGER", Some(0), -2.0), ("CLASP", None, 0.0)]
            .map(|(name, leader, multiplier)| Follower { name: name.to_string(), leader, multiplier, offset: 0.25 })
            .to_vec(),
        base_link: "body".to_string(),
        links: vec![
            link("thigh", "body", Some(0)),
            // Moved by the first follower, which comes after the joints of the messages.
            link("finger", "thigh", Some(1)),
            link("hat", "body", None),
        ],
        urdf: "<robot name=\"small\"/>".to_string(),
        sole_size_m: [0.23, 0.13, 0.021],
        scene_every_ticks: 1,
    }
}

/// A link that turns about y, half a metre below its parent.
fn link(name: &str, parent: &str, moved_by: Option<usize>) -> Link {
    Link {
        name: name.to_string(),
        parent: parent.to_string(),
        position_m: [0.0, 0.0, -0.5],
        rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        moved_by,
        axis: [0.0, 1.0, 0.0],
        slides: false,
    }
}

fn info() -> RunInfo {
    RunInfo {
        facts: [("commit", "abc"), ("started_utc", "2026-11-21T21:45:12Z")]
            .map(|(key, value)| (key.to_string(), value.to_string()))
            .into(),
        files: vec![("planner.toml".to_string(), b"lambda = 0.6".to_vec())],
        ..RunInfo::default()
    }
}

#[test]
fn every_message_comes_back_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");

    fn put<T: Message>(writer: &mut Writer, topic: Topic<T>) -> Vec<Vec<u8>> {
        let mut sent: Vec<T> = (1..6).map(random).collect();
        sent.push(T::ZERO);
        for message in &sent {
            writer.record(topic, message).expect("room");
        }
        sent.iter().map(bytes).collect()
    }
    fn got<T: Message>(recording: &Recording, topic: Topic<T>) -> Vec<Vec<u8>> {
        recording.messages(topic).expect("whole").iter().map(bytes).collect()
    }
    let health = topic::health(messages::code::Process::Planner);
    let start = put(&mut writer, topic::WALK_START);
    let state = put(&mut writer, topic::ROBOT_STATE);
    let deformation = put(&mut writer, topic::SOLE_DEFORMATION);
    let contact = put(&mut writer, topic::SOLE_CONTACT);
    let command = put(&mut writer, topic::ROBOT_COMMAND);
    let truth = put(&mut writer, topic::TRUTH_ROBOT);
    let healths = put(&mut writer, health);
    let pattern: PatternHeader = random(9);
    let phases = [PatternPhase::ZERO, PatternPhase { step: 3, zmp: [[-0.0; 6]; 2], ..PatternPhase::ZERO }];
    writer.record_pattern(&pattern, &phases).expect("room");
    assert_eq!(writer.finish().expect("room"), path);

    let recording = Recording::open(&path).expect("finished");
    assert_eq!(got(&recording, topic::WALK_START), start);
    assert_eq!(got(&recording, topic::ROBOT_STATE), state);
    assert_eq!(got(&recording, topic::SOLE_DEFORMATION), deformation);
    assert_eq!(got(&recording, topic::SOLE_CONTACT), contact);
    assert_eq!(got(&recording, topic::ROBOT_COMMAND), command);
    assert_eq!(got(&recording, topic::TRUTH_ROBOT), truth);
    assert_eq!(got(&recording, health), healths);
    let patterns = recording.patterns().expect("whole");
    assert_eq!(patterns.len(), 1);
    assert_eq!(bytes(&patterns[0].0), bytes(&pattern));
    assert_eq!(patterns[0].1.iter().map(bytes).collect::<Vec<_>>(), phases.iter().map(bytes).collect::<Vec<_>>());
    assert_eq!(recording.facts().expect("whole")["commit"], "abc");
    assert_eq!(recording.files().expect("whole"), info().files);
    let survey = recording.survey().expect("whole");
    let state = &survey.topics["/robot/state"];
    assert_eq!((state.schema.as_str(), state.messages), ("soleus.RobotStateV2", 6));
}

/// The last message of a topic, decoded by an independent protobuf library with nothing but what is in the file.
fn decoded(path: &Path, topic: &str) -> DynamicMessage {
    let file = std::fs::read(path).expect("readable");
    let message = mcap::MessageStream::new(&file).expect("finished").map(|message| message.expect("whole"));
    let message = message.filter(|message| message.channel.topic == topic).last().expect("recorded");
    let schema = message.channel.schema.as_ref().expect("every channel has one");
    assert_eq!((schema.encoding.as_str(), message.channel.message_encoding.as_str()), ("protobuf", "protobuf"));
    let pool = DescriptorPool::decode(schema.data.as_ref()).expect("complete in itself");
    let descriptor = pool.get_message_by_name(&schema.name).expect("the schema describes what it names");
    DynamicMessage::decode(descriptor, message.data.as_ref()).expect("protobuf")
}

/// Schema and bytes of the last message of a topic.
fn raw(path: &Path, topic: &str) -> (String, Vec<u8>) {
    let file = std::fs::read(path).expect("readable");
    let message = mcap::MessageStream::new(&file).expect("finished").map(|message| message.expect("whole"));
    let message = message.filter(|message| message.channel.topic == topic).last().expect("recorded");
    let schema = message.channel.schema.as_ref().expect("every channel has one");
    assert_eq!((schema.encoding.as_str(), message.channel.message_encoding.as_str()), ("ros2msg", "cdr"));
    (schema.name.clone(), message.data.to_vec())
}

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

/// The value at a path of field names and list indices.
fn at(message: &DynamicMessage, path: &str) -> Value {
    path.split('.').fold(Value::Message(message.clone()), |value, part| match &value {
        Value::Message(message) => message.get_field_by_name(part).expect("the field exists").into_owned(),
        Value::List(list) => list[part.parse::<usize>().expect("an index")].clone(),
        other => panic!("{other:?} has no {part}"),
    })
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

#[test]
fn what_a_killed_recorder_left_is_recovered_up_to_the_last_flush() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
    let state = |tick| RobotState { header: Header::new(tick, 7), ..random(tick as u64) };
    for tick in 0..500 {
        writer.record(topic::ROBOT_STATE, &state(tick)).expect("room");
    }
    writer.flush().expect("room");
    for tick in 500..600 {
        writer.record(topic::ROBOT_STATE, &state(tick)).expect("room");
    }
    // What a kill would leave on the disk now.
    let killed = tempfile::tempdir().expect("a temporary folder");
    std::fs::copy(folder.path().join("walk.mcap.partial"), killed.path().join("walk.mcap.partial")).expect("there");
    assert!(Recording::open(&killed.path().join("walk.mcap.partial")).is_err(), "it is not finished");

    let [recovered] = &recover(killed.path()).expect("readable").recovered[..] else { panic!("one was left") };
    let Recovered { path, from, messages } = recovered;
    // The robot's description is one, too.
    assert_eq!((from, *messages), (&killed.path().join("walk.mcap.partial"), 501));
    let name = path.file_name().expect("it has one").to_string_lossy();
    assert_eq!(name, "walk-20261121T214512Z.mcap", "called after its begin");
    assert_eq!(std::fs::read_dir(killed.path()).expect("readable").count(), 1, "nothing else is left");
    assert_eq!(mode(path), 0o600);
    let recording = Recording::open(path).expect("finished now");
    let states = recording.messages(topic::ROBOT_STATE).expect("whole");
    assert_eq!(states.len(), 500);
    assert_eq!(bytes(&states[499]), bytes(&state(499)));
    assert_eq!(recording.files().expect("whole"), info().files);
    assert_eq!(recording.facts().expect("whole")["commit"], "abc");
    assert_eq!(recover(killed.path()).expect("nothing to do").recovered, []);
}

fn mode(path: &Path) -> u32 {
    std::os::unix::fs::PermissionsExt::mode(&path.metadata().expect("it is there").permissions()) & 0o777
}

#[test]
fn recordings_are_their_owners_and_replace_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let writer = Writer::create(&path, &info(), settings()).expect("nothing is there");
    assert_eq!(mode(&folder.path().join("walk.mcap.partial")), 0o600);
    let refused = || Writer::create_over(&path, &info(), settings()).err().expect("one is under way").to_string();
    assert!(refused().contains("walk.mcap.partial exists and is not replaced"), "{}", refused());
    writer.finish().expect("room");
    let refused = Writer::create(&path, &info(), settings()).err().expect("it is there").to_string();
    assert!(refused.contains("walk.mcap exists and is not replaced"), "{refused}");
    let before = std::fs::read(&path).expect("readable");
    // Something that comes while it is under way is not replaced, either.
    let other = folder.path().join("other.mcap");
    let writer = Writer::create(&other, &info(), settings()).expect("nothing is there");
    std::fs::write(&other, "mine").expect("writable");
    assert!(writer.finish().is_err());
    assert_eq!(std::fs::read(&other).expect("readable"), b"mine");
    let mut writer = Writer::create_over(&path, &info(), settings()).expect("asked for");
    writer.record(topic::ROBOT_STATE, &RobotState::ZERO).expect("room");
    assert_eq!(std::fs::read(&path).expect("readable"), before, "not before it is finished");
    writer.finish().expect("room");
    assert_ne!(std::fs::read(&path).expect("readable"), before);
}

#[test]
fn recovering_leaves_alone_what_is_none_of_its_business() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let partial = |name: &str| folder.path().join(format!("{name}.partial"));
    // A download of some browser, a recording of nothing, and one that is under way.
    for name in ["film.mp4", "film.mcap"] {
        std::fs::write(partial(name), "not ours").expect("writable");
    }
    std::fs::write(partial("nothing.mcap"), "").expect("writable");
    let mut writer = Writer::create(&folder.path().join("now.mcap"), &info(), settings()).expect("writable");
    writer.flush().expect("room");
    let recovery = recover(folder.path()).expect("readable");
    assert!(recovery.recovered.is_empty() && recovery.left.is_empty(), "{recovery:?}");
    for name in ["film.mp4", "film.mcap"] {
        assert_eq!(std::fs::read(partial(name)).expect("still there"), b"not ours");
    }
    assert!(!partial("nothing.mcap").exists());
    let message = recover_file(&partial("now.mcap")).expect_err("under way").to_string();
    assert!(message.ends_with("is still being written: stop its recorder first"), "{message}");
    writer.finish().expect("nobody took it away");
    assert_eq!(mode(&folder.path().join("now.mcap")), 0o600);
}

#[test]
fn recorders_that_are_killed_again_and_again_lose_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let killed = folder.path().join("walk.mcap.partial");
    for count in 1..=3 {
        let elsewhere = tempfile::tempdir().expect("a temporary folder");
        let path = elsewhere.path().join("walk.mcap");
        let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
        (0..count).for_each(|_| writer.record(topic::ROBOT_STATE, &RobotState::ZERO).expect("room"));
        writer.flush().expect("room");
        std::fs::copy(elsewhere.path().join("walk.mcap.partial"), &killed).expect("there");
        recover(folder.path()).expect("readable");
    }
    let mut found: Vec<_> = std::fs::read_dir(folder.path()).expect("readable").flatten().map(|f| f.path()).collect();
    found.sort();
    let states = |path: &std::path::PathBuf| Recording::open(path).expect("finished").messages(topic::ROBOT_STATE);
    let mut counts: Vec<usize> = found.iter().map(|path| states(path).expect("whole").len()).collect();
    counts.sort_unstable();
    assert_eq!(counts, [1, 2, 3], "{found:?}");
}

/// A recording as another program may write it.
fn rewritten(path: &Path, options: mcap::WriteOptions, order: impl Fn(&mut Vec<mcap::Message>)) -> Vec<u8> {
    let file = std::fs::read(path).expect("readable");
    let mut messages: Vec<_> = mcap::MessageStream::new(&file).expect("finished").map(|m| m.expect("whole")).collect();
    order(&mut messages);
    let mut out = options.create(std::io::Cursor::new(Vec::new())).expect("memory");
    let summary = mcap::Summary::read(&file).expect("finished").expect("it has one");
    for index in &summary.metadata_indexes {
        out.write_metadata(&mcap::read::metadata(&file, index).expect("whole")).expect("memory");
    }
    for index in &summary.attachment_indexes {
        out.attach(&mcap::read::attachment(&file, index).expect("whole")).expect("memory");
    }
    messages.iter().for_each(|message| out.write(message).expect("memory"));
    out.finish().expect("memory");
    out.into_inner().into_inner()
}

#[test]
fn legal_files_of_other_writers_are_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
    let sent: Vec<RobotState> =
        (0..300).map(|tick| RobotState { header: Header::new(tick, 7), ..random(tick as u64) }).collect();
    sent.iter().for_each(|state| writer.record(topic::ROBOT_STATE, state).expect("room"));
    writer.finish().expect("room");
    let options = || mcap::WriteOptions::new().compression(None);
    let plain = options().emit_summary_records(false).emit_summary_offsets(false).emit_message_indexes(false);
    let writers = [
        ("without a summary", plain.clone()),
        ("without chunks", plain.use_chunks(false)),
        ("lz4", options().compression(Some(mcap::Compression::Lz4)).chunk_size(Some(4096))),
        ("without checksums", options().calculate_chunk_crcs(false).calculate_attachment_crcs(false)),
    ];
    for (what, options) in writers {
        let other = folder.path().join("other.mcap");
        std::fs::write(&other, rewritten(&path, options, |messages| messages.reverse())).expect("writable");
        let recording = Recording::open(&other).unwrap_or_else(|error| panic!("{what}: {error}"));
        let mut states = recording.messages(topic::ROBOT_STATE).expect(what);
        states.reverse();
        assert!(states.iter().map(bytes).eq(sent.iter().map(bytes)), "{what}");
        assert_eq!(recording.facts().expect(what)["commit"], "abc", "{what}");
        assert_eq!(recording.files().expect(what), info().files, "{what}");
        assert_eq!(recording.survey().expect(what).topics["/robot/state"].messages, 300, "{what}");
    }
}

#[test]
fn messages_of_nothing_that_take_much_memory_are_not_all_kept() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("x.mcap");
    let mut out = mcap::Writer::new(std::fs::File::create(&path).expect("writable")).expect("room");
    let schema = out.add_schema("soleus.SoleContactV1", "protobuf", b"").expect("room");
    let channel_id = out.add_channel(schema, "/sole/contact", "protobuf", &Default::default()).expect("room");
    let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
    // A message of zeros has no bytes in the file and many in memory.
    (0..50_000).for_each(|_| out.write_to_known_channel(&header, b"").expect("room"));
    out.finish().expect("room");
    let recording = Recording::open(&path).expect("finished");
    let message = recording.messages(topic::SOLE_CONTACT).expect_err("too many").to_string();
    assert!(message.contains("its messages would take more than 134.2 MB"), "{message}");
    assert!(mutation::peak_memory_bytes() < mutation::MEMORY_MAX_BYTES);
}

/// Sequence and log time of every message of a topic.
fn times(path: &Path, topic: &str) -> Vec<(u32, u64)> {
    let file = std::fs::read(path).expect("readable");
    let messages = mcap::MessageStream::new(&file).expect("finished").map(|message| message.expect("whole"));
    let messages = messages.filter(|message| message.channel.topic == topic);
    messages.inspect(|m| assert_eq!(m.log_time, m.publish_time)).map(|m| (m.sequence, m.log_time)).collect()
}

#[test]
fn messages_are_at_the_time_of_their_tick() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
    let planner = topic::health(messages::code::Process::Planner);
    for tick in [-1, 0, 400] {
        let header = Header::new(tick, 7);
        writer.record(topic::ROBOT_STATE, &RobotState { header, ..RobotState::ZERO }).expect("room");
        // A process that waits is where the recording has come to, not at its begin.
        let waits = messages::Health { header: Header::new(-1, 0), ..messages::Health::ZERO };
        writer.record(planner, &waits).expect("room");
    }
    writer.finish().expect("room");
    // 5 ms a tick; nothing is before the beginning.
    assert_eq!(times(&path, "/robot/state"), [(0, 0), (1, 0), (2, 2_000_000_000)]);
    assert_eq!(times(&path, "/health/planner"), [(0, 0), (1, 0), (2, 2_000_000_000)]);
}

#[test]
fn in_real_time_messages_are_at_universal_time() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let info = RunInfo { utc_minus_monotonic_ns: Some(1_795_000_000_000_000_000), ..info() };
    let mut writer = Writer::create(&path, &info, settings()).expect("writable");
    for tick in [0, 1] {
        let mut header = Header::new(tick, 7);
        header.clock_monotonic_ns = 5_000_000_007 + 5_000_000 * tick as u64;
        writer.record(topic::ROBOT_STATE, &RobotState { header, ..RobotState::ZERO }).expect("room");
    }
    writer.finish().expect("room");
    let first = 1_795_000_005_000_000_007;
    assert_eq!(times(&path, "/robot/state"), [(0, first), (1, first + 5_000_000)]);
}

#[test]
fn chunks_follow_each_other_in_time() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
    let planner = topic::health(messages::code::Process::Planner);
    for tick in 0..400 {
        let state = RobotState { header: Header::new(tick, 7), ..random(tick as u64) };
        let state = RobotState { header: Header::new(tick, 7), ..state };
        writer.record(topic::ROBOT_STATE, &state).expect("room");
        let waits = messages::Health { header: Header::new(-1, 0), ..messages::Health::ZERO };
        writer.record(planner, &waits).expect("room");
        if tick % 100 == 99 {
            writer.flush().expect("room");
        }
    }
    writer.finish().expect("room");
    let file = std::fs::read(&path).expect("readable");
    let summary = mcap::Summary::read(&file).expect("finished").expect("it has one");
    assert_eq!(summary.chunk_indexes.len(), 4);
    for pair in summary.chunk_indexes.windows(2) {
        assert!(pair[1].message_start_time + 100_000_000 >= pair[0].message_end_time, "{pair:?}");
    }
}

#[test]
fn arrays_are_whole_whatever_is_in_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
    // A robot of 34 joints at rest, its right foot in the air.
    let state = RobotState { joint_count: 34, ..RobotState::ZERO };
    writer.record(topic::ROBOT_STATE, &state).expect("room");
    let mut contact = SoleContact::ZERO;
    contact.feet[0].count = 5;
    writer.record(topic::SOLE_CONTACT, &contact).expect("room");
    writer.finish().expect("room");
    let state = decoded(&path, "/robot/state");
    let length = |message: &DynamicMessage, path: &str| at(message, path).as_list().expect("a list").len();
    let lengths: Vec<usize> = ["joint_position_rad", "joint_velocity_rad_per_s", "gyro_rad_per_s"]
        .map(|field| length(&state, field))
        .to_vec();
    assert_eq!(lengths, [34, 34, 3]);
    let contact = decoded(&path, "/sole/contact");
    let feet =
        [0, 1].map(|foot| ["position_m", "state"].map(|field| length(&contact, &format!("feet.{foot}.{field}"))));
    assert_eq!(feet, [[15, 5], [0, 0]]);
}

#[test]
fn what_happens_is_on_the_time_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
    let fallen = Truth { header: Header::new(300, 7), fallen: 1, fall_tick: 299, fall_cause: 2, ..Truth::ZERO };
    writer.show_events(&fallen).expect("room");
    writer.finish().expect("room");
    let log = decoded(&path, "/log");
    assert_eq!(at(&log, "level"), Value::EnumNumber(4));
    assert_eq!(at(&log, "name"), Value::String("simulator".to_string()));
    assert_eq!(at(&log, "message"), Value::String("the robot has fallen at tick 299: tilted too far".to_string()));
    assert_eq!(times(&path, "/log"), [(0, 1_500_000_000)]);
}

#[test]
fn other_versions_and_damaged_messages_are_errors_that_name_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let refused = |schema: &str, content: &[u8]| {
        let path = folder.path().join("other.mcap");
        let mut writer = mcap::Writer::new(std::fs::File::create(&path).expect("writable")).expect("room");
        let schema = writer.add_schema(schema, "protobuf", b"").expect("room");
        let channel = writer.add_channel(schema, "/robot/state", "protobuf", &Default::default()).expect("room");
        let header = mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 0, publish_time: 0 };
        writer.write_to_known_channel(&header, content).expect("room");
        writer.finish().expect("room");
        let recording = Recording::open(&path).expect("finished");
        assert!(recording.messages(topic::ROBOT_COMMAND).expect("of no other topic").is_empty());
        recording.messages(topic::ROBOT_STATE).expect_err("of no use").to_string()
    };
    let message = refused("soleus.RobotStateV0", b"");
    assert!(
        message.ends_with("has `robot/state` as soleus.RobotStateV0, this build knows soleus.RobotStateV2"),
        "{message}"
    );
    // A key whose length is beyond the end.
    let message = refused("soleus.RobotStateV2", &[0x0a, 0x7f]);
    assert!(message.ends_with("message 0 of `robot/state` is damaged"), "{message}");
}

#[test]
fn files_that_are_no_recordings_are_named_for_what_they_are() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("x.mcap");
    let said = || Recording::open(&path).expect_err("of no use").to_string();
    assert!(said().contains("x.mcap: check the path"), "{}", said());
    std::fs::write(&path, b"").expect("writable");
    assert!(said().contains("x.mcap is empty: nothing was recorded"), "{}", said());
    std::fs::write(&path, b"bag of ROS 1").expect("writable");
    assert!(said().contains("x.mcap is no MCAP file (it begins with `bag of R`)"), "{}", said());
    let mut out = mcap::WriteOptions::new().library("other").create(std::io::Cursor::new(Vec::new())).expect("memory");
    out.finish().expect("memory");
    let foreign = out.into_inner().into_inner();
    std::fs::write(&path, &foreign).expect("writable");
    let message = Recording::open(&path).expect("a legal file").facts().expect_err("not ours").to_string();
    assert!(message.contains("x.mcap was written by `other"), "{message}");
    // Cut short, and with something after its end.
    std::fs::write(&path, &foreign[..foreign.len() - 1]).expect("writable");
    assert!(said().contains("is no finished recording") && said().contains("--recover"), "{}", said());
    std::fs::write(&path, [&foreign[..], &foreign[..]].concat()).expect("writable");
    assert!(said().contains("is damaged at byte "), "{}", said());
    std::fs::remove_file(&path).expect("it is there");
    std::os::unix::fs::symlink("/dev/zero", &path).expect("a link");
    assert!(said().contains("cannot read"), "{}", said());
}

#[test]
fn the_types_of_all_topics_have_a_written_schema() {
    struct Check(Writer);
    impl topic::Visitor for Check {
        type Error = recording::WriteError;
        fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), Self::Error> {
            self.0.record(topic, &T::ZERO)
        }
        fn slice<H: Message, E: topic::Element>(&mut self, _: Topic<H>) -> Result<(), Self::Error> {
            self.0.record_pattern(&PatternHeader::ZERO, &[PatternPhase::ZERO])
        }
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut check = Check(Writer::create(&path, &info(), settings()).expect("writable"));
    topic::visit(&mut check).expect("each message and its schema agree");
    check.0.finish().expect("room");
    let recorded = Recording::open(&path).expect("finished").survey().expect("whole");
    for row in topic::ROWS {
        assert_eq!(recorded.topics[&format!("/{}", row.name)].messages, 1, "{row:?}");
    }
}
