//! Recordings give back what was put in, bit for bit, and survive being killed.

use messages::{
    Header, Message, PatternHeader, PatternPhase, Plain, RobotState, SoleContact, SoleDeformation, Topic, Truth, topic,
};
use prost_reflect::{DescriptorPool, DynamicMessage, Value};
use recording::{Follower, Recording, RunInfo, ViewerSettings, Writer, recover};
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
        sole_size_m: [0.23, 0.13, 0.021],
        scene_every_ticks: 1,
    }
}

fn info() -> RunInfo {
    RunInfo {
        facts: [("commit".to_string(), "abc".to_string())].into(),
        files: vec![("planner.toml".to_string(), b"lambda = 0.6".to_vec())],
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
    let topics = recording.topics();
    let state = topics.iter().find(|topic| topic.topic == "/robot/state").expect("recorded");
    assert_eq!((state.schema.as_str(), state.messages), ("soleus.RobotStateV1", 6));
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
    state.foot_wrench[1][2] = 400.5;
    writer.record(topic::ROBOT_STATE, &state).expect("room");
    let mut truth = Truth { header: Header::new(400, 77), joint_count: 1, ..Truth::ZERO };
    truth.joint_position_rad[0] = -0.5;
    truth.joint_velocity_rad_per_s[0] = 3.0;
    truth.joint_torque_nm[0] = 40.0;
    truth.base_position_m = [1.0, 2.0, 3.0];
    truth.base_rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    truth.sole_rotation = [truth.base_rotation; 2];
    truth.foot_wrench[0][2] = 200.0;
    writer.record(topic::TRUTH_ROBOT, &truth).expect("room");
    writer.show_truth(&truth).expect("room");
    let mut deformation = SoleDeformation::ZERO;
    deformation.feet[1].compliance[35] = 7.0;
    writer.record(topic::SOLE_DEFORMATION, &deformation).expect("room");
    writer.record_pattern(&PatternHeader::ZERO, &[PatternPhase { kind: 2, ..PatternPhase::ZERO }; 2]).expect("room");
    writer.finish().expect("room");

    let state = decoded(&path, "/robot/state");
    assert_eq!(at(&state, "header.tick"), Value::I64(-3));
    assert_eq!(at(&state, "header.sequence"), Value::U64(300));
    assert_eq!(at(&state, "joint_count"), Value::U32(2));
    assert_eq!(at(&state, "joint_position_rad.1"), Value::F64(0.25));
    assert_eq!(at(&state, "foot_wrench.8"), Value::F64(400.5));
    assert_eq!(at(&decoded(&path, "/sole/deformation"), "feet.1.compliance.35"), Value::F64(7.0));
    assert_eq!(at(&decoded(&path, "/walk/pattern"), "phases.1.kind"), Value::U32(2));
    let transforms = decoded(&path, "/tf");
    assert_eq!(at(&transforms, "transforms.0.child_frame_id"), Value::String("body".to_string()));
    assert_eq!(at(&transforms, "transforms.0.translation.y"), Value::F64(2.0));
    assert_eq!(at(&transforms, "transforms.2.rotation.w"), Value::F64(1.0));
    assert_eq!(at(&transforms, "transforms.0.timestamp.seconds"), Value::I64(2));
    let joints = decoded(&path, "/joint_states");
    assert_eq!(at(&joints, "joints.0.name"), Value::String("HIP".to_string()));
    assert_eq!(at(&joints, "joints.0.position"), Value::F64(-0.5));
    assert_eq!(at(&joints, "joints.0.velocity"), Value::F64(3.0));
    assert_eq!(at(&joints, "joints.0.effort"), Value::F64(40.0));
    assert_eq!(at(&joints, "joints.1.name"), Value::String("FINGER".to_string()));
    assert_eq!(at(&joints, "joints.1.position"), Value::F64(1.25));
    assert_eq!(at(&joints, "joints.1.velocity"), Value::F64(-6.0));
    assert_eq!(at(&joints, "joints.2.name"), Value::String("CLASP".to_string()));
    assert_eq!(at(&joints, "joints.2.position"), Value::F64(0.25));
    assert_eq!(at(&joints, "joints.2.velocity"), Value::F64(0.0));
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
    truth.foot_wrench = [[0.0, 0.0, 0.05, 9.0, 9.0, 9.0], [30.0, -40.0, 120.0, 9.0, 9.0, 9.0]];
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
    let joints = decoded(&path, "/joint_states");
    assert_eq!(at(&joints, "joints.1.name"), Value::String("joint 1".to_string()), "it has no name");
    assert_near(&numbers(&joints, "joints.1", &["velocity", "effort"]), &[1.5, -20.0]);

    // The scene of the contact is the last; that of the truth came before it.
    let file = std::fs::read(&path).expect("readable");
    let messages = mcap::MessageStream::new(&file).expect("finished").map(|message| message.expect("whole"));
    let scenes: Vec<_> = messages.filter(|message| message.channel.topic == "/scene").collect();
    let pool = DescriptorPool::decode(scenes[0].channel.schema.as_ref().expect("it has one").data.as_ref());
    let descriptor = pool.expect("complete").get_message_by_name("foxglove.SceneUpdate").expect("described");
    let robot = DynamicMessage::decode(descriptor, scenes[0].data.as_ref()).expect("protobuf");
    // The sole's frame is at the centre of its bottom, a box is drawn about its middle.
    assert_near(&numbers(&robot, "entities.0.cubes.1.pose.position", &XYZ), &[0.5 + 0.0105, -0.1, 0.2]);
    let Value::List(arrows) = at(&robot, "entities.0.arrows") else { panic!("a list") };
    assert_eq!(arrows.len(), 1);
    assert_near(&numbers(&robot, "entities.0.arrows.0.pose.position", &XYZ), &[0.5, -0.1, 0.2]);
    // An arrow points along its x axis: the first column of its rotation is the direction of the force.
    let turn = numbers(&robot, "entities.0.arrows.0.pose.orientation", &["x", "y", "z", "w"]);
    let [x, y, z, w] = turn.try_into().expect("four numbers");
    let direction = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)];
    assert_near(&direction, &[30.0 / 130.0, -40.0 / 130.0, 120.0 / 130.0]);
    assert_near(&numbers(&robot, "entities.0.arrows.0", &["shaft_length", "head_length"]), &[0.104, 0.026]);
    assert_near(&numbers(&robot, "entities.0.spheres.0.pose.position", &XYZ), &[0.1, 0.2, 0.8]);
    assert_near(&numbers(&robot, "entities.0.spheres.1.pose.position", &XYZ), &[0.3, 0.4, 0.0]);
    let lines = decoded(&path, "/scene");
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
    let topics = Recording::open(&path).expect("finished").topics();
    let count = |name: &str| topics.iter().find(|topic| topic.topic == name).map(|topic| topic.messages);
    assert_eq!((count("/tf"), count("/joint_states"), count("/scene")), (Some(10), Some(10), Some(3)));
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

    let recovered = recover(killed.path()).expect("writable");
    let path = killed.path().join("walk.mcap");
    assert_eq!(recovered, [recording::Recovered { path: path.clone(), messages: 500 }]);
    assert_eq!(std::fs::read_dir(killed.path()).expect("readable").count(), 1, "nothing else is left");
    let recording = Recording::open(&path).expect("finished now");
    let states = recording.messages(topic::ROBOT_STATE).expect("whole");
    assert_eq!(states.len(), 500);
    assert_eq!(bytes(&states[499]), bytes(&state(499)));
    assert_eq!(recording.files().expect("whole"), info().files);
    assert_eq!(recording.facts().expect("whole")["commit"], "abc");
    assert_eq!(recover(killed.path()).expect("nothing to do"), []);
}

#[test]
fn messages_are_at_the_time_of_their_tick_and_counted_by_topic() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
    for tick in [-1, 0, 400] {
        let state = RobotState { header: Header::new(tick, 7), ..RobotState::ZERO };
        writer.record(topic::ROBOT_STATE, &state).expect("room");
    }
    writer.finish().expect("room");
    let file = std::fs::read(&path).expect("readable");
    let messages = mcap::MessageStream::new(&file).expect("finished").map(|message| message.expect("whole"));
    let found: Vec<_> = messages.map(|message| (message.sequence, message.log_time, message.publish_time)).collect();
    // 5 ms a tick; nothing is before the beginning.
    assert_eq!(found, [(0, 0, 0), (1, 0, 0), (2, 2_000_000_000, 2_000_000_000)]);
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
        message.ends_with("has `robot/state` as soleus.RobotStateV0, this build knows soleus.RobotStateV1"),
        "{message}"
    );
    // A key whose length is beyond the end.
    let message = refused("soleus.RobotStateV1", &[0x0a, 0x7f]);
    assert!(message.ends_with("message 0 of `robot/state` is damaged"), "{message}");
}

#[test]
fn an_empty_or_foreign_file_is_an_error_that_names_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("x.mcap");
    assert!(Recording::open(&path).err().expect("not there").to_string().contains("x.mcap: check the path"));
    std::fs::write(&path, b"not a recording").expect("writable");
    assert!(Recording::open(&path).err().expect("foreign").to_string().contains("no finished recording"));
    std::fs::rename(&path, folder.path().join("x.mcap.partial")).expect("renamed");
    assert_eq!(recover(folder.path()).expect("writable")[0].messages, 0);
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
    let recorded = Recording::open(&path).expect("finished").topics();
    for row in topic::ROWS {
        assert!(recorded.iter().any(|topic| topic.topic == format!("/{}", row.name) && topic.messages == 1), "{row:?}");
    }
}
