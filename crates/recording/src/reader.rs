//! Reading a recording: one pass over the file, a chunk at a time.

use crate::chunk::Unpacker;
use crate::decode::{decode, nested};
use crate::error::ReadError;
use crate::older::OlderPlan;
use crate::plan::Plan;
use crate::record::{Broken, Record, next_in_chunk};
use crate::source::{Head, Source};
use crate::writer::{METADATA, PATTERN_HEADER, PATTERN_PHASES, WALK_PATTERN_SCHEMA};
use mcap::records::op;
use messages::topic::WALK_PATTERN;
use messages::{MAX_PHASES, Message, Older, PatternHeader, PatternPhase, Plain, Shape, Topic};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// All files in a recording together (bytes); a robot with large meshes has some tens of megabytes.
const FILES_MAX_BYTES: u64 = 256 << 20;
/// Files in a recording.
const FILES_MAX: usize = 4096;
/// What messages may take in memory: so many times the file's size, at least the second number of bytes. Ours take
/// two times.
const MEMORY_RATIO_MAX: u64 = 16;
const MEMORY_MIN_BYTES: u64 = 128 << 20;

/// A finished recording.
///
/// Opening it looks at the front of every record and passes over the rest, so that it takes no longer for an hour
/// than for a minute; an index is neither needed nor believed. Messages are read by [`each`](Self::each), a chunk at
/// a time.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    size: u64,
    library: String,
    /// Facts about the run, if there are any.
    facts: Option<BTreeMap<String, String>>,
    /// Where its files are.
    files: Vec<Head>,
}

/// A message as it lies in a recording.
pub struct Entry<'a> {
    path: &'a Path,
    channel: &'a Channel,
    /// Which of its topic, from zero.
    index: u64,
    log_time_ns: u64,
    content: &'a [u8],
    decoding: &'a mut Decoding,
}

#[derive(Debug)]
struct Channel {
    topic: String,
    schema: String,
    is_protobuf: bool,
    read: u64,
}

/// What decoding needs and may use.
struct Decoding {
    plans: HashMap<&'static str, Plan>,
    older: HashMap<&'static str, OlderPlan>,
    /// Bytes that messages may still take in memory.
    room: u64,
    max_bytes: u64,
    bytes: Vec<u8>,
}

impl Recording {
    /// Opens a recording.
    ///
    /// # Errors
    /// If it cannot be read, is of another format, is damaged or is not finished.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let mut source = Source::open(path)?;
        if !source.is_finished()? {
            return Err(ReadError::Unfinished { path: path.to_path_buf() });
        }
        let (path, size) = (path.to_path_buf(), source.size());
        let mut recording = Self { path, size, library: String::new(), facts: None, files: Vec::new() };
        let mut data_ended = false;
        while let Some(head) = source.next()? {
            match head.opcode {
                op::HEADER => {
                    if let Record::Header { library, profile } = source.read(head)? {
                        let profile = if profile.is_empty() { String::new() } else { format!(", profile {profile}") };
                        recording.library = format!("{library}{profile}");
                    }
                }
                op::METADATA if !data_ended => {
                    if let Record::Metadata { name, metadata } = source.read(head)?
                        && METADATA.contains(&name)
                    {
                        recording.facts.get_or_insert_default().extend(metadata);
                    }
                }
                op::ATTACHMENT if !data_ended => {
                    recording.files.push(head);
                    let bytes = recording.files.iter().map(|head| head.length).sum();
                    if bytes > FILES_MAX_BYTES || recording.files.len() > FILES_MAX {
                        let what = "a file too many: all attachments together";
                        let broken = Broken::TooLarge { what, bytes, max_bytes: FILES_MAX_BYTES };
                        return Err(source.broken(head.at, broken));
                    }
                    source.skip(head)?;
                }
                op::DATA_END => {
                    data_ended = true;
                    source.skip(head)?;
                }
                op::FOOTER => {
                    source.skip(head)?;
                    let after = source.broken(head.at, Broken::AfterEnd);
                    return if source.at_end() { Ok(recording) } else { Err(after) };
                }
                _ => source.skip(head)?,
            }
        }
        Err(ReadError::Unfinished { path: recording.path })
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its size (bytes).
    #[must_use]
    pub fn size_bytes(&self) -> u64 {
        self.size
    }

    /// What it says about its run: what was known at the beginning, and how it ended.
    ///
    /// # Errors
    /// If it is of another program.
    pub fn facts(&self) -> Result<BTreeMap<String, String>, ReadError> {
        let not_ours = || ReadError::NotOurs { path: self.path.clone(), library: self.library.clone() };
        self.facts.clone().ok_or_else(not_ours)
    }

    /// The files in it: name and content.
    ///
    /// # Errors
    /// If it is damaged.
    pub fn files(&self) -> Result<Vec<(String, Vec<u8>)>, ReadError> {
        let mut source = Source::open(&self.path)?;
        let mut files = Vec::with_capacity(self.files.len());
        for head in &self.files {
            source.back_to(*head)?;
            if let Record::Attachment(file) = source.read(*head)? {
                files.push((file.name.to_string(), file.content.to_vec()));
            }
        }
        Ok(files)
    }

    /// Shows every message to `visit`, in the order in which they lie in the file. Memory holds one chunk.
    ///
    /// # Errors
    /// If it is damaged, and those of `visit`.
    pub fn each<E: From<ReadError>>(&self, mut visit: impl FnMut(&mut Entry) -> Result<(), E>) -> Result<(), E> {
        let mut source = Source::open(&self.path)?;
        let mut unpacker = Unpacker::default();
        let mut channels = Channels { path: &self.path, schemas: HashMap::new(), channels: HashMap::new() };
        let max_bytes = MEMORY_MIN_BYTES.max(MEMORY_RATIO_MAX.saturating_mul(self.size));
        let mut decoding =
            Decoding { plans: HashMap::new(), older: HashMap::new(), room: max_bytes, max_bytes, bytes: Vec::new() };
        while let Some(head) = source.next()? {
            let broken = |broken| ReadError::Broken { path: self.path.clone(), at: head.at, source: broken };
            match head.opcode {
                op::DATA_END | op::FOOTER => break,
                op::CHUNK => {
                    let Record::Chunk(chunk) = source.read(head)? else { continue };
                    let mut content = unpacker.unpack(&chunk).map_err(broken)?;
                    while let Some(record) = next_in_chunk(&mut content).map_err(broken)? {
                        channels.take(record, head, &mut decoding, &mut visit)?;
                    }
                }
                op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                    channels.take(source.read(head)?, head, &mut decoding, &mut visit)?;
                }
                _ => source.skip(head)?,
            }
        }
        Ok(())
    }

    /// All messages of a topic, in the order in which they lie in the file; bit for bit what was sent.
    ///
    /// # Errors
    /// If they are of another version or damaged.
    pub fn messages<T: Message>(&self, topic: Topic<T>) -> Result<Vec<T>, ReadError> {
        let mut messages = Vec::new();
        self.each(|entry| {
            messages.extend(entry.read(topic)?);
            Ok::<_, ReadError>(())
        })?;
        Ok(messages)
    }

    /// All walking patterns in it.
    ///
    /// # Errors
    /// If they are of another version or damaged.
    pub fn patterns(&self) -> Result<Vec<(PatternHeader, Vec<PatternPhase>)>, ReadError> {
        let mut patterns = Vec::new();
        self.each(|entry| {
            patterns.extend(entry.pattern()?);
            Ok::<_, ReadError>(())
        })?;
        Ok(patterns)
    }
}

/// What was introduced so far.
struct Channels<'a> {
    path: &'a Path,
    schemas: HashMap<u16, (String, bool)>,
    channels: HashMap<u16, Channel>,
}

impl Channels<'_> {
    fn take<E: From<ReadError>>(
        &mut self,
        record: Record,
        head: Head,
        decoding: &mut Decoding,
        visit: &mut impl FnMut(&mut Entry) -> Result<(), E>,
    ) -> Result<(), E> {
        let unknown = |what, id| -> E {
            let source = Broken::Unknown { what, id };
            ReadError::Broken { path: self.path.to_path_buf(), at: head.at, source }.into()
        };
        match record {
            Record::Schema { id, name, encoding, .. } => {
                self.schemas.insert(id, (name.to_string(), encoding == "protobuf"));
            }
            Record::Channel { id, schema, topic, encoding, .. } => {
                // Schema 0 is none.
                let none = (String::new(), false);
                let schema = if schema == 0 { Some(&none) } else { self.schemas.get(&schema) };
                let (schema, of_protobuf) = schema.ok_or_else(|| unknown("a channel of schema", id))?.clone();
                let is_protobuf = of_protobuf && encoding == "protobuf";
                // Introduced again with every chunk that uses it.
                let channel = Channel { topic: topic.to_string(), schema, is_protobuf, read: 0 };
                self.channels.entry(id).or_insert(channel);
            }
            Record::Message { channel, log_time_ns, content, .. } => {
                let id = channel;
                let Some(channel) = self.channels.get_mut(&id) else {
                    return Err(unknown("a message of channel", id));
                };
                channel.read += 1;
                let index = channel.read - 1;
                visit(&mut Entry { path: self.path, channel, index, log_time_ns, content, decoding })?;
            }
            _ => {}
        }
        Ok(())
    }
}

impl Entry<'_> {
    /// Its topic, with the `/` in front.
    #[must_use]
    pub fn topic(&self) -> &str {
        &self.channel.topic
    }

    /// Name of its schema.
    #[must_use]
    pub fn schema(&self) -> &str {
        &self.channel.schema
    }

    /// Its place on the time line of viewers.
    #[must_use]
    pub fn log_time_ns(&self) -> u64 {
        self.log_time_ns
    }

    /// Its bytes as they are stored.
    #[must_use]
    pub fn content(&self) -> &[u8] {
        self.content
    }

    /// The message, if it is one of this topic; bit for bit what was sent. One of an older version becomes one of ours:
    /// see [`messages::Older`].
    ///
    /// # Errors
    /// If it is of a version this build does not know, or damaged.
    pub fn read<T: Message>(&mut self, topic: Topic<T>) -> Result<Option<T>, ReadError> {
        if !self.is_of(topic.name()) {
            return Ok(None);
        }
        match T::OLDER.iter().find(|older| older.wire_name == self.channel.schema) {
            Some(older) => self.decode_older(topic.name(), older).map(Some),
            None => self.decode::<T>(topic.name(), T::WIRE_NAME, self.content).map(Some),
        }
    }

    /// The walking pattern, if it is one.
    ///
    /// # Errors
    /// If it is of a version this build does not know, or damaged.
    pub fn pattern(&mut self) -> Result<Option<(PatternHeader, Vec<PatternPhase>)>, ReadError> {
        let topic = WALK_PATTERN.name();
        if !self.is_of(topic) {
            return Ok(None);
        }
        self.known(topic, WALK_PATTERN_SCHEMA)?;
        let damaged = || self.damaged(topic);
        let headers = nested(self.content, PATTERN_HEADER, 1).ok_or_else(damaged)?;
        let phases = nested(self.content, PATTERN_PHASES, MAX_PHASES).ok_or_else(damaged)?;
        let header = headers.first().ok_or_else(damaged)?;
        let header = self.decode_as::<PatternHeader>(topic, PatternHeader::WIRE_NAME, header)?;
        let phase_schema = struct_name::<PatternPhase>();
        let phases = phases.into_iter().map(|phase| self.decode_as(topic, phase_schema, phase));
        Ok(Some((header, phases.collect::<Result<_, _>>()?)))
    }

    fn is_of(&self, topic: &str) -> bool {
        self.channel.topic.strip_prefix('/') == Some(topic)
    }

    fn damaged(&self, topic: &str) -> ReadError {
        ReadError::Damaged { path: self.path.to_path_buf(), topic: topic.to_string(), index: self.index }
    }

    /// That it is of a schema that this build reads as `ours`.
    fn known(&self, topic: &str, ours: &'static str) -> Result<(), ReadError> {
        let Channel { schema, is_protobuf, .. } = self.channel;
        if *is_protobuf && same_but_version(schema, ours) && Plan::has(schema) {
            return Ok(());
        }
        let (path, topic, found) = (self.path.to_path_buf(), topic.to_string(), schema.clone());
        Err(ReadError::OtherVersion { path, topic, found, expected: ours })
    }

    fn decode<T: Plain>(&mut self, topic: &str, ours: &'static str, content: &[u8]) -> Result<T, ReadError> {
        self.known(topic, ours)?;
        self.decode_as(topic, &self.channel.schema, content)
    }

    fn decode_older<T: Message>(&mut self, topic: &str, older: &'static Older) -> Result<T, ReadError> {
        self.known(topic, T::WIRE_NAME)?;
        self.take_room(T::SHAPE.size())?;
        let plans = &mut self.decoding.older;
        if !plans.contains_key(older.wire_name) {
            plans.insert(older.wire_name, OlderPlan::new(T::SHAPE, older)?);
        }
        plans[older.wire_name].read(self.content).ok_or_else(|| self.damaged(topic))
    }

    /// That so many bytes more may be taken in memory.
    fn take_room(&mut self, size: usize) -> Result<(), ReadError> {
        let Some(room) = self.decoding.room.checked_sub(size as u64) else {
            return Err(ReadError::TooMuch { path: self.path.to_path_buf(), max_bytes: self.decoding.max_bytes });
        };
        self.decoding.room = room;
        Ok(())
    }

    /// Decodes what was written after a schema of ours, which may be older than `T`.
    fn decode_as<T: Plain>(&mut self, topic: &str, schema: &str, content: &[u8]) -> Result<T, ReadError> {
        let size = T::SHAPE.size();
        self.take_room(size)?;
        let key = struct_name::<T>();
        if !self.decoding.plans.contains_key(key) {
            self.decoding.plans.insert(key, Plan::reading(T::SHAPE, schema)?);
        }
        let Decoding { plans, bytes, .. } = &mut *self.decoding;
        bytes.clear();
        bytes.resize(size, 0);
        let decoded = decode(&plans[key], content, bytes).and_then(|()| T::read_bytes(&mut bytes.as_slice()));
        decoded.ok_or_else(|| self.damaged(topic))
    }
}

fn struct_name<T: Plain>() -> &'static str {
    match T::SHAPE {
        Shape::Struct { wire_name, .. } => wire_name,
        _ => unreachable!("messages and phases are structs"),
    }
}

/// Whether two names of schemas are those of one message, `soleus.TruthV1` and `soleus.TruthV2`.
fn same_but_version(one: &str, other: &str) -> bool {
    let base = |name: &str| name.trim_end_matches(|c: char| c.is_ascii_digit()).to_string();
    base(one) == base(other)
}
