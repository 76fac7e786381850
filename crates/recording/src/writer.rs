//! Writing a recording.

use crate::encode::encode;
use crate::error::WriteError;
use crate::plan::{FOXGLOVE, Plan, SOLEUS};
use crate::viewer::{Viewer, ViewerSettings};
use crate::wire::put_nested;
use crate::{PARTIAL, log_time_ns};
use mcap::records::{MessageHeader, Metadata};
use messages::topic::WALK_PATTERN;
use messages::{Message, PatternHeader, PatternPhase, Plain, SoleContact, Topic, Truth};
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// What a recording says about its run, written at its beginning.
#[derive(Debug, Clone, Default)]
pub struct RunInfo {
    /// Facts: version, commit, host, pace, scenario.
    pub facts: BTreeMap<String, String>,
    /// Files: name in the recording and content.
    pub files: Vec<(String, Vec<u8>)>,
}

/// A recording under way.
pub struct Writer {
    mcap: mcap::Writer<BufWriter<File>>,
    partial: PathBuf,
    path: PathBuf,
    channels: HashMap<&'static str, Channel>,
    phase_plan: Plan,
    viewer: Viewer,
    viewer_channels: [u16; 3],
    /// The bytes of a message, its protobuf; kept for their memory.
    bytes: Vec<u8>,
    content: Vec<u8>,
}

struct Channel {
    id: u16,
    plan: Plan,
    count: u32,
}

impl Writer {
    /// Begins a recording that will be called `path`; until it is finished its name ends in [`PARTIAL`].
    ///
    /// # Errors
    /// If the file cannot be made.
    pub fn create(path: &Path, info: &RunInfo, viewer: ViewerSettings) -> Result<Self, WriteError> {
        let partial = partial_path(path);
        let file = File::create(&partial).map_err(|source| WriteError::File { path: partial.clone(), source })?;
        let mut mcap = options().create(BufWriter::with_capacity(1 << 16, file))?;
        mcap.write_metadata(&Metadata { name: "soleus".to_string(), metadata: info.facts.clone() })?;
        for (name, content) in &info.files {
            mcap.attach(&mcap::Attachment {
                log_time: 0,
                create_time: 0,
                name: name.clone(),
                media_type: media_type(name).to_string(),
                data: content.as_slice().into(),
            })?;
        }
        let mut viewer_channel = |name: &str, topic: &str| -> Result<u16, WriteError> {
            let schema = mcap.add_schema(name, "protobuf", FOXGLOVE)?;
            Ok(mcap.add_channel(schema, topic, "protobuf", &BTreeMap::new())?)
        };
        let viewer_channels = [
            viewer_channel("foxglove.FrameTransforms", "/tf")?,
            viewer_channel("foxglove.JointStates", "/joint_states")?,
            viewer_channel("foxglove.SceneUpdate", "/scene")?,
        ];
        Ok(Self {
            mcap,
            partial,
            path: path.to_path_buf(),
            channels: HashMap::new(),
            phase_plan: Plan::new(PatternPhase::SHAPE)?,
            viewer: Viewer::new(viewer),
            viewer_channels,
            bytes: Vec::new(),
            content: Vec::new(),
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
        let header = header(channel.id, channel.count - 1, log_time_ns(message.header().tick));
        Ok(self.mcap.write_to_known_channel(&header, &self.content)?)
    }

    /// Records a walking pattern.
    ///
    /// # Errors
    /// If writing fails.
    pub fn record_pattern(&mut self, pattern: &PatternHeader, phases: &[PatternPhase]) -> Result<(), WriteError> {
        let name = WALK_PATTERN.name();
        let channel = channel::<PatternHeader>(&mut self.mcap, &mut self.channels, name, "soleus.WalkPatternV1")?;
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
        let header = header(channel.id, channel.count - 1, log_time_ns(pattern.header.tick));
        Ok(self.mcap.write_to_known_channel(&header, &self.content)?)
    }

    /// Records what viewers show of the truth: transforms, joints and, now and then, the scene.
    ///
    /// # Errors
    /// If writing fails.
    pub fn show_truth(&mut self, truth: &Truth) -> Result<(), WriteError> {
        let time_ns = log_time_ns(truth.header.tick);
        let [transforms, joints, scene] = self.viewer_channels;
        let sequence = u32::try_from(truth.header.tick).unwrap_or(0);
        self.content.clear();
        self.viewer.transforms(truth, &mut self.content);
        self.mcap.write_to_known_channel(&header(transforms, sequence, time_ns), &self.content)?;
        self.content.clear();
        self.viewer.joints(truth, &mut self.content);
        self.mcap.write_to_known_channel(&header(joints, sequence, time_ns), &self.content)?;
        if truth.header.tick % self.viewer.scene_every_ticks() == 0 {
            self.content.clear();
            self.viewer.scene(truth, &mut self.content);
            self.mcap.write_to_known_channel(&header(scene, sequence, time_ns), &self.content)?;
        }
        Ok(())
    }

    /// Records what viewers show of the contact forces that the estimator sees.
    ///
    /// # Errors
    /// If writing fails.
    pub fn show_contact(&mut self, contact: &SoleContact) -> Result<(), WriteError> {
        let sequence = u32::try_from(contact.header.tick).unwrap_or(0);
        self.content.clear();
        self.viewer.contact(contact, &mut self.content);
        let header = header(self.viewer_channels[2], sequence, log_time_ns(contact.header.tick));
        Ok(self.mcap.write_to_known_channel(&header, &self.content)?)
    }

    /// Makes everything so far readable, whatever happens next.
    ///
    /// # Errors
    /// If writing fails.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        Ok(self.mcap.flush()?)
    }

    /// Writes the index and gives the file its name, which is returned.
    ///
    /// # Errors
    /// If writing fails.
    pub fn finish(mut self) -> Result<PathBuf, WriteError> {
        self.mcap.finish()?;
        std::fs::rename(&self.partial, &self.path)
            .map_err(|source| WriteError::File { path: self.path.clone(), source })?;
        Ok(self.path.clone())
    }
}

/// Field numbers of `WalkPatternV1`.
pub(crate) const PATTERN_HEADER: u32 = 1;
pub(crate) const PATTERN_PHASES: u32 = 2;

/// How all recordings are written: chunks of some seconds, compressed in this thread (a recorder must not take the cores of
/// those it watches), every index there is.
pub(crate) fn options() -> mcap::WriteOptions {
    mcap::WriteOptions::new()
        .library("soleus")
        .compression(Some(mcap::Compression::Zstd))
        .compression_threads(0)
        .chunk_size(Some(1 << 20))
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
            let schema = mcap.add_schema(schema, "protobuf", SOLEUS)?;
            let id = mcap.add_channel(schema, &format!("/{topic}"), "protobuf", &BTreeMap::new())?;
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
