//! Damaged and hostile recordings: errors, never panics, within bounded memory and time.
//!
//! `DAMAGED_FILES=20000 cargo test -p recording --test damage -- --nocapture` is the long form.

use messages::{
    Header, Message, PatternHeader, PatternPhase, Plain, RobotState, SoleContact, Topic, Truth, topic, topic::Visitor,
};
use recording::{Entry, ReadError, Recording, RunInfo, ViewerSettings, Writer, recover_file};
use std::path::Path;

/// A small recording with every kind of record.
fn whole(folder: &Path) -> Vec<u8> {
    let path = folder.join("whole.mcap");
    let facts = [("pace".to_string(), "lock-step".to_string())].into();
    let files = vec![("robot/robot.toml".to_string(), b"urdf = \"x.urdf\"".to_vec())];
    let mut writer = Writer::create(&path, &RunInfo { facts, files, ..RunInfo::default() }, ViewerSettings::default())
        .expect("writable");
    writer.record_pattern(&PatternHeader::ZERO, &[PatternPhase::ZERO; 2]).expect("room");
    for tick in 0..20 {
        let header = Header::new(tick, 7);
        writer.record(topic::ROBOT_STATE, &RobotState { header, ..RobotState::ZERO }).expect("room");
        writer.record(topic::SOLE_CONTACT, &SoleContact { header, ..SoleContact::ZERO }).expect("room");
        let truth = Truth { header, ..Truth::ZERO };
        writer.record(topic::TRUTH_ROBOT, &truth).expect("room");
        writer.show_truth(&truth).expect("room");
        if tick % 7 == 0 {
            writer.flush().expect("room");
        }
    }
    writer.finish().expect("room");
    std::fs::read(path).expect("readable")
}

/// Reads an entry as whatever it may be.
struct AsAny<'a, 'b>(&'a mut Entry<'b>);

impl Visitor for AsAny<'_, '_> {
    type Error = ReadError;
    fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), ReadError> {
        self.0.read(topic).map(drop)
    }
    fn slice<H: Message, E: topic::Element>(&mut self, _: Topic<H>) -> Result<(), ReadError> {
        self.0.pattern().map(drop)
    }
}

/// Everything that is done with a recording.
fn read(path: &Path) -> Result<(), ReadError> {
    let recording = Recording::open(path)?;
    let _ = recording.facts();
    let _ = recording.files();
    let _ = recording.survey();
    recording.each(|entry| topic::visit(&mut AsAny(entry)))
}

fn read_and_recover(folder: &Path, bytes: &[u8]) {
    let path = folder.join("damaged.mcap.partial");
    std::fs::write(&path, bytes).expect("writable");
    let _ = read(&path);
    if let Ok(recovered) = recover_file(&path) {
        // Messages may be damaged in themselves; the file is whole.
        let recording = Recording::open(&recovered.path).expect("finished");
        recording.survey().expect("whole");
        std::fs::remove_file(recovered.path).expect("it is there");
    }
}

#[test]
fn damaged_recordings_are_errors() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let whole = whole(folder.path());
    mutation::campaign("recording", 300, &whole, &["soleus", "zstd", "lz4", "protobuf"], |bytes| {
        read_and_recover(folder.path(), bytes);
    });
}

/// The same file with its chunks unpacked and without checksums, so that damage reaches what is in them.
fn unpacked(whole: &[u8]) -> Vec<u8> {
    let options =
        mcap::WriteOptions::new().compression(None).calculate_chunk_crcs(false).calculate_attachment_crcs(false);
    let mut out = options.create(std::io::Cursor::new(Vec::new())).expect("memory");
    for message in mcap::MessageStream::new(whole).expect("finished") {
        out.write(&message.expect("whole")).expect("memory");
    }
    out.finish().expect("memory");
    out.into_inner().into_inner()
}

#[test]
fn damaged_messages_are_errors() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let unpacked = unpacked(&whole(folder.path()));
    mutation::campaign("messages", 300, &unpacked, &["soleus.TruthV1", "/robot/state"], |bytes| {
        read_and_recover(folder.path(), bytes);
    });
}

/// A file of one record behind a header.
fn with_record(opcode: u8, length: u64, body: &[u8]) -> Vec<u8> {
    let mut out = mcap::WriteOptions::new().create(std::io::Cursor::new(Vec::new())).expect("memory");
    out.finish().expect("memory");
    let empty = out.into_inner().into_inner();
    // Magic and header: 8 bytes, opcode, length, content.
    let header = 17 + u64::from_le_bytes(empty[9..17].try_into().expect("eight bytes")) as usize;
    [&empty[..header], &[opcode], &length.to_le_bytes(), body, &empty[header..]].concat()
}

#[test]
fn sizes_that_no_file_has_are_not_believed() {
    use mcap::records::op;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("hostile.mcap");
    let mut chunk = [0_u64, 0, 2_800_000_000_000_000_000].map(u64::to_le_bytes).concat();
    chunk.extend([0, 0, 0, 0, 4, 0, 0, 0]);
    chunk.extend(b"zstd");
    chunk.extend(4_u64.to_le_bytes());
    chunk.extend(b"none");
    // Claims a chunk of 2.8 EB, a record of 2.8 EB, one of 16 EB; and an attachment that is shorter than its head.
    let files = [
        with_record(op::CHUNK, chunk.len() as u64, &chunk),
        with_record(op::CHUNK, 2_800_000_000_000_000_000, &chunk),
        with_record(op::MESSAGE, u64::MAX, &[]),
        with_record(op::ATTACHMENT, 28, &[0; 28]),
        with_record(op::METADATA, 8, &[0xff; 8]),
    ];
    for (index, bytes) in files.iter().enumerate() {
        std::fs::write(&path, bytes).expect("writable");
        let recording = Recording::open(&path).and_then(|recording| {
            recording.files()?;
            recording.survey()
        });
        assert!(matches!(recording, Err(ReadError::Broken { .. })), "{index}: {recording:?}");
    }
    assert!(mutation::peak_memory_bytes() < mutation::MEMORY_MAX_BYTES);
}

#[test]
fn files_that_grow_without_end_are_not_unpacked() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("bomb.mcap");
    let file = std::fs::File::create(&path).expect("writable");
    let mut out = mcap::WriteOptions::new().chunk_size(Some(32 << 20)).create(file).expect("room");
    let channel_id = out.add_channel(0, "/zeros", "json", &Default::default()).expect("room");
    let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
    let zeros = vec![0; 1 << 20];
    (0..256).for_each(|_| out.write_to_known_channel(&header, &zeros).expect("room"));
    out.finish().expect("room");
    let message = Recording::open(&path).expect("finished").survey().expect_err("a bomb");
    let ReadError::Broken { source, .. } = message else { panic!("{message}") };
    assert!(source.to_string().contains("times their size is not unpacked"), "{source}");
}
