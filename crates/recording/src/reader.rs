//! Reading a recording.

use crate::decode::{decode, nested};
use crate::error::ReadError;
use crate::plan::Plan;
use crate::writer::{PATTERN_HEADER, PATTERN_PHASES};
use mcap::{MessageStream, Summary};
use messages::topic::WALK_PATTERN;
use messages::{Message, PatternHeader, PatternPhase, Plain, Topic};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A finished recording in memory.
pub struct Recording {
    path: PathBuf,
    bytes: Vec<u8>,
    summary: Summary,
}

/// A topic in a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recorded {
    /// Its name, with the `/` in front.
    pub topic: String,
    /// Its schema.
    pub schema: String,
    /// How many messages it has.
    pub messages: u64,
}

impl Recording {
    /// Opens a recording.
    ///
    /// # Errors
    /// If it cannot be read or is not finished.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let bytes = std::fs::read(path).map_err(|source| ReadError::File { path: path.to_path_buf(), source })?;
        let failed = |source| ReadError::Mcap { path: path.to_path_buf(), source };
        let summary = Summary::read(&bytes).map_err(failed)?.ok_or(mcap::McapError::UnexpectedEof).map_err(failed)?;
        Ok(Self { path: path.to_path_buf(), bytes, summary })
    }

    /// The topics in it, by name.
    pub fn topics(&self) -> Vec<Recorded> {
        let counts = self.summary.stats.as_ref().map(|stats| &stats.channel_message_counts);
        let mut topics: Vec<Recorded> = self
            .summary
            .channels
            .values()
            .map(|channel| Recorded {
                topic: channel.topic.clone(),
                schema: channel.schema.as_ref().map(|schema| schema.name.clone()).unwrap_or_default(),
                messages: counts.and_then(|counts| counts.get(&channel.id)).copied().unwrap_or(0),
            })
            .collect();
        topics.sort_by(|a, b| a.topic.cmp(&b.topic));
        topics
    }

    /// What it says about its run.
    ///
    /// # Errors
    /// If it is damaged.
    pub fn facts(&self) -> Result<BTreeMap<String, String>, ReadError> {
        let failed = |source| ReadError::Mcap { path: self.path.clone(), source };
        let Some(index) = self.summary.metadata_indexes.iter().find(|index| index.name == "soleus") else {
            return Ok(BTreeMap::new());
        };
        Ok(mcap::read::metadata(&self.bytes, index).map_err(failed)?.metadata)
    }

    /// The files in it: name and content.
    ///
    /// # Errors
    /// If it is damaged.
    pub fn files(&self) -> Result<Vec<(String, Vec<u8>)>, ReadError> {
        let failed = |source| ReadError::Mcap { path: self.path.clone(), source };
        let file = |index| {
            mcap::read::attachment(&self.bytes, index).map(|file| (file.name, file.data.into_owned())).map_err(failed)
        };
        self.summary.attachment_indexes.iter().map(file).collect()
    }

    /// All messages of a topic, in the order in which they were written; bit for bit what was sent.
    ///
    /// # Errors
    /// If they are of another version or damaged.
    pub fn messages<T: Message>(&self, topic: Topic<T>) -> Result<Vec<T>, ReadError> {
        let plan = Plan::new(T::SHAPE)?;
        let mut index = 0;
        let mut messages = Vec::new();
        self.each(topic.name(), T::WIRE_NAME, |content| {
            let message = read::<T>(&plan, content).ok_or_else(|| self.damaged(topic.name(), index))?;
            index += 1;
            messages.push(message);
            Ok(())
        })?;
        Ok(messages)
    }

    /// All walking patterns in it.
    ///
    /// # Errors
    /// If they are of another version or damaged.
    pub fn patterns(&self) -> Result<Vec<(PatternHeader, Vec<PatternPhase>)>, ReadError> {
        let header_plan = Plan::new(PatternHeader::SHAPE)?;
        let phase_plan = Plan::new(PatternPhase::SHAPE)?;
        let mut patterns = Vec::new();
        self.each(WALK_PATTERN.name(), "soleus.WalkPatternV1", |content| {
            let pattern = || {
                let header = read(&header_plan, nested(content, PATTERN_HEADER)?.first()?)?;
                let phases = nested(content, PATTERN_PHASES)?;
                let phases = phases.into_iter().map(|phase| read(&phase_plan, phase)).collect::<Option<Vec<_>>>()?;
                Some((header, phases))
            };
            let pattern = pattern().ok_or_else(|| self.damaged(WALK_PATTERN.name(), patterns.len()))?;
            patterns.push(pattern);
            Ok(())
        })?;
        Ok(patterns)
    }

    fn damaged(&self, topic: &str, index: usize) -> ReadError {
        ReadError::Damaged { path: self.path.clone(), topic: topic.to_string(), index }
    }

    fn each(
        &self,
        topic: &str,
        schema: &'static str,
        mut visit: impl FnMut(&[u8]) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        let failed = |source| ReadError::Mcap { path: self.path.clone(), source };
        for message in MessageStream::new(&self.bytes).map_err(failed)? {
            let message = message.map_err(failed)?;
            if message.channel.topic.strip_prefix('/') != Some(topic) {
                continue;
            }
            let found = message.channel.schema.as_ref().map(|schema| schema.name.as_str()).unwrap_or_default();
            if found != schema {
                let (topic, found) = (topic.to_string(), found.to_string());
                return Err(ReadError::OtherVersion { path: self.path.clone(), topic, found, expected: schema });
            }
            visit(&message.data)?;
        }
        Ok(())
    }
}

fn read<T: Plain>(plan: &Plan, content: &[u8]) -> Option<T> {
    let mut bytes = vec![0; plan.size];
    decode(plan, content, &mut bytes)?;
    T::read_bytes(&mut bytes.as_slice())
}
