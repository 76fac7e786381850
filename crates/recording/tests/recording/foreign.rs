//! Files that somebody else wrote, or nobody should have.

use crate::samples::{bytes, info, random, settings};
use messages::{Header, RobotState, topic};
use recording::{Recording, Writer};
use std::path::Path;

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
