//! What former versions wrote is read as today's messages.

use messages::code::Process;
use messages::topic;
use prost_reflect::{DescriptorPool, DynamicMessage, ReflectMessage, Value};
use recording::{Recording, RunInfo, ViewerSettings, Writer};
use std::path::Path;

/// The schemas that every recording carries, as a recording has them.
fn pool(folder: &Path) -> (Vec<u8>, DescriptorPool) {
    let path = folder.join("schema.mcap");
    let mut writer = Writer::create(&path, &RunInfo::default(), ViewerSettings::default()).expect("writable");
    writer.record(topic::ROBOT_STATE, &messages::RobotState::default()).expect("room");
    writer.finish().expect("room");
    let file = std::fs::read(&path).expect("readable");
    let mut messages = mcap::MessageStream::new(&file).expect("finished").map(|message| message.expect("whole"));
    let message = messages.find(|message| message.channel.topic == "/robot/state").expect("recorded");
    let schema = message.channel.schema.as_ref().expect("it has one").data.to_vec();
    let pool = DescriptorPool::decode(schema.as_slice()).expect("complete");
    (schema, pool)
}

/// A recording with one message of an older version.
fn recorded(folder: &Path, name: &str, topic: &str, fill: impl FnOnce(&mut DynamicMessage)) -> Recording {
    let (schema, pool) = pool(folder);
    let mut message = DynamicMessage::new(pool.get_message_by_name(name).expect("old versions stay in the schema"));
    fill(&mut message);
    let path = folder.join("old.mcap");
    let file = std::fs::File::create(&path).expect("writable");
    let mut writer = mcap::Writer::new(std::io::BufWriter::new(file)).expect("room");
    let schema = writer.add_schema(name, "protobuf", &schema).expect("room");
    let channel = writer.add_channel(schema, topic, "protobuf", &Default::default()).expect("room");
    let header = mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 0, publish_time: 0 };
    let content = prost::Message::encode_to_vec(&message);
    writer.write_to_known_channel(&header, &content).expect("room");
    writer.finish().expect("room");
    Recording::open(&path).expect("finished")
}

fn header(pool: &DynamicMessage, tick: i64) -> Value {
    let field = pool.descriptor().get_field_by_name("header").expect("it has one");
    let kind = field.kind();
    let mut header = DynamicMessage::new(kind.as_message().expect("a message").clone());
    header.set_field_by_name("tick", Value::I64(tick));
    Value::Message(header)
}

fn doubles(values: &[f64]) -> Value {
    Value::List(values.iter().map(|value| Value::F64(*value)).collect())
}

#[test]
fn renamed_fields_of_old_truths_are_found() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let recording = recorded(folder.path(), "soleus.TruthV1", "/truth/robot", |truth| {
        let tick = header(truth, 100);
        truth.set_field_by_name("header", tick);
        truth.set_field_by_name("momentum", doubles(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        truth.set_field_by_name("foot_wrench", doubles(&[0.0, 0.0, 200.0]));
        truth.set_field_by_name("contact_residual", Value::F64(1e-9));
    });
    let truths = recording.messages(topic::TRUTH_ROBOT).expect("readable");
    assert_eq!(truths.len(), 1);
    assert_eq!(truths[0].linear_momentum_kg_m_per_s, [1.0, 2.0, 3.0]);
    assert_eq!(truths[0].angular_momentum_kg_m2_per_s, [4.0, 5.0, 6.0]);
    assert_eq!((truths[0].foot_wrench_n_nm[0][2], truths[0].contact_residual), (200.0, 1e-9));
    assert_eq!(truths[0].command_tick, 98);
}

#[test]
fn values_by_position_of_old_health_get_their_names() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let topic = topic::health(Process::Controller);
    let recording = recorded(folder.path(), "soleus.HealthV1", "/health/controller", |health| {
        let tick = header(health, 7);
        health.set_field_by_name("header", tick);
        health.set_field_by_name("process", Value::EnumNumber(Process::Controller.code() as i32));
        health.set_field_by_name("cycles", Value::U64(8));
        health.set_field_by_name("values", doubles(&[2.0, 3.0, 0.0, 0.5, 0.25, f64::INFINITY, 15.0]));
    });
    let healths = recording.messages(topic).expect("readable");
    let figures = healths[0].controller;
    assert_eq!((healths[0].header.tick, healths[0].cycles), (7, 8));
    assert_eq!((figures.steps_relaxed, figures.steps_held, figures.steps_solved), (2, 3, 15));
    assert_eq!((figures.joint_distance_max_rad, figures.collision_distance_m), (0.5, f64::INFINITY));
}

#[test]
fn old_commands_and_deformations_keep_their_feet() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let recording = recorded(folder.path(), "soleus.RobotCommandV1", "/robot/command", |command| {
        let tick = header(command, 40);
        command.set_field_by_name("header", tick);
        command.set_field_by_name("deformation_age_ticks", Value::U32(2));
        command.set_field_by_name("fallback", Value::U32(1));
        let plan = command.descriptor().get_field_by_name("plan").expect("it has one").kind();
        let mut plan = DynamicMessage::new(plan.as_message().expect("a message").clone());
        let foot = plan.descriptor().get_field_by_name("feet").expect("it has them").kind();
        let mut foot = DynamicMessage::new(foot.as_message().expect("a message").clone());
        foot.set_field_by_name("in_contact", Value::U32(1));
        foot.set_field_by_name("wrench", doubles(&[0.0, 0.0, 190.0]));
        plan.set_field_by_name("feet", Value::List(vec![Value::Message(foot.clone()), Value::Message(foot)]));
        command.set_field_by_name("plan", Value::Message(plan));
    });
    let command = recording.messages(topic::ROBOT_COMMAND).expect("readable")[0];
    assert_eq!((command.deformation_tick, command.deformation_age_ticks), (38, 2));
    assert_eq!((command.plan.feet[1].loaded, command.plan.feet[1].wrench_n_nm[2]), (1, 190.0));
}
