//! What the tests record.

use messages::{Message, Plain};
use prost_reflect::{DescriptorPool, DynamicMessage, Value};
use recording::{Follower, Link, RunInfo, ViewerSettings};
use std::path::Path;

/// A message of reproducible random bits, among them numbers that are not finite.
pub fn random<T: Message>(seed: u64) -> T {
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

pub fn bytes<T: Plain>(value: &T) -> Vec<u8> {
    let mut bytes = Vec::new();
    value.write_bytes(&mut bytes);
    bytes
}

pub fn settings() -> ViewerSettings {
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
pub fn link(name: &str, parent: &str, moved_by: Option<usize>) -> Link {
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

pub fn info() -> RunInfo {
    RunInfo {
        facts: [("commit", "abc"), ("started_utc", "2026-11-21T21:45:12Z")]
            .map(|(key, value)| (key.to_string(), value.to_string()))
            .into(),
        files: vec![("planner.toml".to_string(), b"lambda = 0.6".to_vec())],
        ..RunInfo::default()
    }
}

/// The last message of a topic, decoded by an independent protobuf library with nothing but what is in the file.
pub fn decoded(path: &Path, topic: &str) -> DynamicMessage {
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
pub fn raw(path: &Path, topic: &str) -> (String, Vec<u8>) {
    let file = std::fs::read(path).expect("readable");
    let message = mcap::MessageStream::new(&file).expect("finished").map(|message| message.expect("whole"));
    let message = message.filter(|message| message.channel.topic == topic).last().expect("recorded");
    let schema = message.channel.schema.as_ref().expect("every channel has one");
    assert_eq!((schema.encoding.as_str(), message.channel.message_encoding.as_str()), ("ros2msg", "cdr"));
    (schema.name.clone(), message.data.to_vec())
}

/// The value at a path of field names and list indices.
pub fn at(message: &DynamicMessage, path: &str) -> Value {
    path.split('.').fold(Value::Message(message.clone()), |value, part| match &value {
        Value::Message(message) => message.get_field_by_name(part).expect("the field exists").into_owned(),
        Value::List(list) => list[part.parse::<usize>().expect("an index")].clone(),
        other => panic!("{other:?} has no {part}"),
    })
}
