//! What was put in comes back, at its time.

use crate::samples::{at, bytes, decoded, info, random, settings};
use messages::{Header, Message, PatternHeader, PatternPhase, Plain, RobotState, SoleContact, Topic, Truth, topic};
use prost_reflect::{DynamicMessage, Value};
use recording::{Recording, RunInfo, Writer};
use std::path::Path;

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
