//! Writing a recording.

use crate::encode::encode;
use crate::error::WriteError;
use crate::events::{Event, Events};
use crate::live::{self, PROTOBUF, ViewerTopic};
use crate::plan::{Plan, SOLEUS};
use crate::ros;
use crate::viewer::{Viewer, ViewerSettings};
use crate::wire::put_nested;
use crate::{PARTIAL, log_time_ns};
use mcap::records::{MessageHeader, Metadata};
use messages::topic::WALK_PATTERN;
use messages::{
    Health, Message, PatternHeader, PatternPhase, Plain, RobotCommand, SoleContact, Topic, Truth, WalkStart,
};
use std::any::Any;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufWriter, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// What a recording says about its run, written at its beginning.
#[derive(Debug, Clone, Default)]
pub struct RunInfo {
    /// Facts: version, commit, host, pace, scenario.
    pub facts: BTreeMap<String, String>,
    /// Files: name in the recording and content.
    pub files: Vec<(String, Vec<u8>)>,
    /// In real time, what is added to `CLOCK_MONOTONIC` to make it universal time: the recording is then on the time
    /// line of all other logs of that day. Without it time is the control time, from zero, and a run in lock-step
    /// makes the same file whenever it is run.
    pub utc_minus_monotonic_ns: Option<i128>,
}

impl RunInfo {
    /// Where the time line begins.
    fn start_ns(&self) -> u64 {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        self.utc_minus_monotonic_ns.map_or(0, |_| u64::try_from(now.as_nanos()).unwrap_or(0))
    }
}

/// A recording under way.
pub struct Writer {
    mcap: mcap::Writer<BufWriter<File>>,
    partial: PathBuf,
    path: PathBuf,
    overwrite: bool,
    channels: HashMap<&'static str, Channel>,
    phase_plan: Plan,
    viewer: Viewer,
    viewer_channels: ViewerChannels,
    events: Events,
    clock: Clock,
    /// The bytes of a message, its protobuf; kept for their memory.
    bytes: Vec<u8>,
    content: Vec<u8>,
}

#[derive(Clone, Copy)]
struct ViewerChannels {
    transforms: u16,
    joints: u16,
    scene: u16,
    contact: u16,
    log: u16,
}

/// Where messages are on the time line of viewers.
#[derive(Debug, Default)]
struct Clock {
    /// What is added to the clock of the messages to make it universal time; without it time is the control time.
    utc_minus_monotonic_ns: Option<i128>,
    /// How far the recording has come.
    now_ns: u64,
}

impl Clock {
    /// Control time in lock-step, universal time in real time; what belongs to no tick is where the recording has
    /// come to.
    fn time_ns(&mut self, header: &messages::Header) -> u64 {
        match self.utc_minus_monotonic_ns {
            _ if header.tick < 0 => self.now_ns,
            Some(_) if header.clock_monotonic_ns == 0 => self.now_ns,
            Some(offset_ns) => u64::try_from(offset_ns + i128::from(header.clock_monotonic_ns)).unwrap_or(self.now_ns),
            None => log_time_ns(header.tick),
        }
    }

    /// A message at this time was written.
    fn reach(&mut self, time_ns: u64) {
        self.now_ns = self.now_ns.max(time_ns);
    }
}

struct Channel {
    id: u16,
    plan: Plan,
    count: u32,
}

impl Writer {
    /// Begins a recording that will be called `path`; until it is finished its name ends in [`PARTIAL`]. Only its
    /// owner can read it.
    ///
    /// # Errors
    /// If there is something of either name, or the file cannot be made.
    pub fn create(path: &Path, info: &RunInfo, viewer: ViewerSettings) -> Result<Self, WriteError> {
        if path.symlink_metadata().is_ok() {
            return Err(WriteError::Exists { path: path.to_path_buf() });
        }
        Self::begin(path, info, viewer, false)
    }

    /// The same, and a finished recording of this name is replaced when this one is finished.
    ///
    /// # Errors
    /// If there is an unfinished one of this name, or the file cannot be made.
    pub fn create_over(path: &Path, info: &RunInfo, viewer: ViewerSettings) -> Result<Self, WriteError> {
        Self::begin(path, info, viewer, true)
    }

    fn begin(path: &Path, info: &RunInfo, viewer: ViewerSettings, overwrite: bool) -> Result<Self, WriteError> {
        let partial = partial_path(path);
        let file = files::create_new(&partial).map_err(|source| match source.kind() {
            ErrorKind::AlreadyExists => WriteError::Exists { path: partial.clone() },
            _ => WriteError::File { path: partial.clone(), source },
        })?;
        // Says to those who recover that it is under way; where a file system has no locks there is nothing to be said.
        let _ = file.try_lock();
        let mut mcap = options().create(BufWriter::with_capacity(1 << 16, file))?;
        mcap.write_metadata(&Metadata { name: METADATA[0].to_string(), metadata: info.facts.clone() })?;
        for (name, content) in &info.files {
            mcap.attach(&mcap::Attachment {
                log_time: 0,
                create_time: 0,
                name: name.clone(),
                media_type: media_type(name).to_string(),
                data: content.as_slice().into(),
            })?;
        }
        let mut channel = |topic: ViewerTopic| -> Result<u16, WriteError> {
            let schema = mcap.add_schema(topic.schema_name, topic.schema_encoding, topic.schema)?;
            Ok(mcap.add_channel(schema, topic.name, topic.encoding, &BTreeMap::new())?)
        };
        let (transforms, scene, contact) = (channel(live::TRANSFORMS)?, channel(live::SCENE)?, channel(live::CONTACT)?);
        let (log, joints) = (channel(live::LOG)?, channel(live::JOINT_STATES)?);
        let description = channel(live::ROBOT_DESCRIPTION)?;
        let viewer = Viewer::new(viewer);
        let clock = Clock { utc_minus_monotonic_ns: info.utc_minus_monotonic_ns, now_ns: info.start_ns() };
        let mut content = Vec::new();
        if !viewer.urdf().is_empty() {
            ros::put_string(viewer.urdf(), &mut content);
            mcap.write_to_known_channel(&header(description, 0, clock.now_ns), &content)?;
        }
        Ok(Self {
            mcap,
            partial,
            path: path.to_path_buf(),
            overwrite,
            channels: HashMap::new(),
            phase_plan: Plan::new(PatternPhase::SHAPE)?,
            viewer,
            viewer_channels: ViewerChannels { transforms, joints, scene, contact, log },
            events: Events::default(),
            clock,
            bytes: Vec::new(),
            content,
        })
    }

    /// Records a message.
    ///
    /// # Errors
    /// If writing fails.
    pub fn record<T: Message>(&mut self, topic: Topic<T>, message: &T) -> Result<(), WriteError> {
        let channel = channel::<T>(&mut self.mcap, &mut self.channels, topic.name(), T::WIRE_NAME)?;
        self.bytes.clear();
        message.write_bytes(&mut self.bytes);
        self.content.clear();
        encode(&channel.plan, &self.bytes, &mut self.content);
        channel.count += 1;
        let time_ns = self.clock.time_ns(message.header());
        self.mcap.write_to_known_channel(&header(channel.id, channel.count - 1, time_ns), &self.content)?;
        self.clock.reach(time_ns);
        Ok(())
    }

    /// Records a walking pattern.
    ///
    /// # Errors
    /// If writing fails.
    pub fn record_pattern(&mut self, pattern: &PatternHeader, phases: &[PatternPhase]) -> Result<(), WriteError> {
        let name = WALK_PATTERN.name();
        let channel = channel::<PatternHeader>(&mut self.mcap, &mut self.channels, name, WALK_PATTERN_SCHEMA)?;
        self.content.clear();
        self.bytes.clear();
        pattern.write_bytes(&mut self.bytes);
        let bytes = &mut self.bytes;
        put_nested(&mut self.content, PATTERN_HEADER, |out| encode(&channel.plan, bytes, out));
        for phase in phases {
            bytes.clear();
            phase.write_bytes(bytes);
            put_nested(&mut self.content, PATTERN_PHASES, |out| encode(&self.phase_plan, bytes, out));
        }
        channel.count += 1;
        let time_ns = self.clock.time_ns(&pattern.header);
        self.mcap.write_to_known_channel(&header(channel.id, channel.count - 1, time_ns), &self.content)?;
        let mut found = Vec::new();
        self.events.pattern(phases, &mut found);
        self.log(time_ns, &found)
    }

    /// Records what viewers show of the truth: joints and, now and then, transforms and the scene.
    ///
    /// # Errors
    /// If writing fails.
    pub fn show_truth(&mut self, truth: &Truth) -> Result<(), WriteError> {
        let time_ns = self.clock.time_ns(&truth.header);
        let ViewerChannels { transforms, joints, scene, .. } = self.viewer_channels;
        let sequence = u32::try_from(truth.header.tick).unwrap_or(0);
        self.viewer.look_at(truth);
        self.content.clear();
        self.viewer.joints(time_ns, &mut self.content);
        self.mcap.write_to_known_channel(&header(joints, sequence, time_ns), &self.content)?;
        if truth.header.tick % self.viewer.scene_every_ticks() == 0 {
            self.content.clear();
            self.viewer.transforms(truth, time_ns, &mut self.content);
            self.mcap.write_to_known_channel(&header(transforms, sequence, time_ns), &self.content)?;
            self.content.clear();
            self.viewer.scene(truth, time_ns, &mut self.content);
            self.mcap.write_to_known_channel(&header(scene, sequence, time_ns), &self.content)?;
        }
        Ok(())
    }

    /// Records what viewers show of the contact forces that the estimator sees.
    ///
    /// # Errors
    /// If writing fails.
    pub fn show_contact(&mut self, contact: &SoleContact) -> Result<(), WriteError> {
        let time_ns = self.clock.time_ns(&contact.header);
        let sequence = u32::try_from(contact.header.tick).unwrap_or(0);
        self.content.clear();
        self.viewer.contact(contact, time_ns, &mut self.content);
        let header = header(self.viewer_channels.contact, sequence, time_ns);
        Ok(self.mcap.write_to_known_channel(&header, &self.content)?)
    }

    /// Records what a message says of what happens: lines of a log on the time line of viewers.
    ///
    /// # Errors
    /// If writing fails.
    pub fn show_events<T: Message>(&mut self, message: &T) -> Result<(), WriteError> {
        let any: &dyn Any = message;
        let mut found = Vec::new();
        if let Some(truth) = any.downcast_ref::<Truth>() {
            self.events.truth(truth, &mut found);
        } else if let Some(health) = any.downcast_ref::<Health>() {
            self.events.health(health, &mut found);
        } else if let Some(start) = any.downcast_ref::<WalkStart>() {
            self.events.start(start, &mut found);
        } else if any.is::<RobotCommand>() {
            self.events.tick(message.header().tick, &mut found);
        }
        let time_ns = self.clock.time_ns(message.header());
        self.log(time_ns, &found)
    }

    fn log(&mut self, time_ns: u64, found: &[Event]) -> Result<(), WriteError> {
        for event in found {
            self.content.clear();
            event.put(time_ns, &mut self.content);
            self.mcap.write_to_known_channel(&header(self.viewer_channels.log, 0, time_ns), &self.content)?;
        }
        Ok(())
    }

    /// The file until it is finished.
    #[must_use]
    pub fn partial(&self) -> &Path {
        &self.partial
    }

    /// Makes everything so far readable, whatever happens next.
    ///
    /// # Errors
    /// If writing fails.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        Ok(self.mcap.flush()?)
    }

    /// Writes how the run ended, for [`Recording::facts`](crate::Recording::facts).
    ///
    /// # Errors
    /// If writing fails.
    pub fn record_result(&mut self, facts: BTreeMap<String, String>) -> Result<(), WriteError> {
        Ok(self.mcap.write_metadata(&Metadata { name: METADATA[1].to_string(), metadata: facts })?)
    }

    /// Writes the index and gives the file its name, which is returned.
    ///
    /// # Errors
    /// If writing fails.
    pub fn finish(mut self) -> Result<PathBuf, WriteError> {
        self.mcap.finish()?;
        // The file system may tell only now that there is no room.
        let file = self.mcap.into_inner().into_inner().map_err(|error| mcap::McapError::Io(error.into_error()))?;
        file.sync_all().map_err(mcap::McapError::Io)?;
        files::replace(&self.partial, &self.path, self.overwrite).map_err(|source| match source.kind() {
            ErrorKind::AlreadyExists => WriteError::Exists { path: self.path.clone() },
            _ => WriteError::File { path: self.path.clone(), source },
        })?;
        Ok(self.path)
    }
}

/// Names of the metadata: what is known at the beginning, and at the end.
pub(crate) const METADATA: [&str; 2] = ["soleus", "soleus.result"];
/// Key of the time at which a recording was begun.
pub(crate) const STARTED: &str = "started_utc";
/// Schema of walking patterns.
pub(crate) const WALK_PATTERN_SCHEMA: &str = "soleus.WalkPatternV1";
/// Field numbers of it.
pub(crate) const PATTERN_HEADER: u32 = 1;
pub(crate) const PATTERN_PHASES: u32 = 2;

/// Raw bytes of a chunk. Who looks for a moment reads the index of all chunks and unpacks those of that moment: of ten minutes, half a
/// thousand of these.
const CHUNK_BYTES: u64 = 2 << 20;

/// How all recordings are written: chunks of some seconds, compressed in this thread (a recorder must not take the
/// cores of those it watches), every index there is.
pub(crate) fn options() -> mcap::WriteOptions {
    mcap::WriteOptions::new()
        .library("soleus")
        .compression(Some(mcap::Compression::Zstd))
        // Of the levels the one that costs least: a third less time than the default for files that are 3 % larger.
        .compression_level(1)
        .compression_threads(0)
        .chunk_size(Some(CHUNK_BYTES))
}

/// What a recording is called until it is finished.
pub(crate) fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(".");
    name.push(PARTIAL);
    PathBuf::from(name)
}

fn header(channel_id: u16, sequence: u32, time_ns: u64) -> MessageHeader {
    MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns }
}

fn channel<'a, T: Message>(
    mcap: &mut mcap::Writer<BufWriter<File>>,
    channels: &'a mut HashMap<&'static str, Channel>,
    topic: &'static str,
    schema: &str,
) -> Result<&'a mut Channel, WriteError> {
    use std::collections::hash_map::Entry;
    match channels.entry(topic) {
        Entry::Occupied(entry) => Ok(entry.into_mut()),
        Entry::Vacant(entry) => {
            let schema = mcap.add_schema(schema, PROTOBUF, SOLEUS)?;
            let id = mcap.add_channel(schema, &format!("/{topic}"), PROTOBUF, &BTreeMap::new())?;
            Ok(entry.insert(Channel { id, plan: Plan::new(T::SHAPE)?, count: 0 }))
        }
    }
}

fn media_type(name: &str) -> &'static str {
    match Path::new(name).extension().and_then(|ending| ending.to_str()) {
        Some("toml") => "application/toml",
        Some("urdf" | "xml") => "application/xml",
        Some("md" | "txt" | "log") => "text/plain",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::Header;

    /// Topics are emptied one after the other: when tick 0 of the second comes, the first has gone on.
    #[test]
    fn tick_zero_is_at_time_zero_whoever_is_ahead() {
        let mut clock = Clock::default();
        clock.reach(50_000_000);
        let at = |clock: &mut Clock, tick, monotonic| {
            clock.time_ns(&Header { clock_monotonic_ns: monotonic, ..Header::new(tick, 7) })
        };
        assert_eq!([0, 1, -1].map(|tick| at(&mut clock, tick, 0)), [0, 5_000_000, 50_000_000]);
        let mut clock = Clock { utc_minus_monotonic_ns: Some(1_000), now_ns: 9_000 };
        assert_eq!([(0, 500), (3, 0), (-1, 500)].map(|(tick, ns)| at(&mut clock, tick, ns)), [1_500, 9_000, 9_000]);
    }
}
