//! What a replayed process says, as a recording of its own.

use crate::replay::Said;
use messages::topic;
use recording::{PARTIAL, Recording, RunInfo, ViewerSettings, WriteError, Writer};
use std::path::{Path, PathBuf};

/// A recording of what is said anew, under the topics of the run and with its files.
pub struct Keeper {
    writer: Writer,
    partial: PathBuf,
    failure: Option<WriteError>,
}

impl Keeper {
    /// Begins it; nothing that exists is replaced unless it shall `overwrite`.
    ///
    /// # Errors
    /// If there is something of this name, or the file cannot be made.
    pub fn create(path: &Path, info: &RunInfo, overwrite: bool) -> Result<Self, WriteError> {
        let mut partial = path.as_os_str().to_os_string();
        partial.push(".");
        partial.push(PARTIAL);
        let create = if overwrite { Writer::create_over } else { Writer::create };
        let writer = create(path, info, ViewerSettings::default())?;
        Ok(Self { writer, partial: partial.into(), failure: None })
    }

    /// Stores what is said; the first failure is kept for [`finish`](Self::finish).
    pub fn store(&mut self, said: &Said) {
        let writer = &mut self.writer;
        let result = match said {
            Said::Pattern(header, phases) => writer.record_pattern(header, phases),
            Said::Start(start) => writer.record(topic::WALK_START, *start),
            Said::State(state) => writer.record(topic::ROBOT_STATE, *state),
            Said::Deformation(deformation) => writer.record(topic::SOLE_DEFORMATION, *deformation),
            Said::Contact(contact) => writer.record(topic::SOLE_CONTACT, *contact),
            Said::Command(command) => writer.record(topic::ROBOT_COMMAND, *command),
            Said::Truth(truth) => writer.record(topic::TRUTH_ROBOT, *truth),
        };
        if let Err(failure) = result {
            self.failure.get_or_insert(failure);
        }
    }

    /// Leaves nothing of it: the replay came to no end.
    pub fn discard(self) {
        drop(self.writer);
        // What cannot be removed is named as unfinished.
        let _ = std::fs::remove_file(self.partial);
    }

    /// Writes the index; the file has its name then.
    ///
    /// # Errors
    /// The first thing that could not be written.
    pub fn finish(self) -> Result<PathBuf, WriteError> {
        match self.failure {
            Some(failure) => Err(failure),
            None => self.writer.finish(),
        }
    }
}

/// What the recording of a replay says about itself: the run's facts and files, and how it came to be.
///
/// # Errors
/// If the run's recording is damaged.
pub fn replayed_info(of: &Recording, facts: &[(&str, String)]) -> Result<RunInfo, recording::ReadError> {
    let mut info = RunInfo { facts: of.facts()?, files: of.files()?, ..RunInfo::default() };
    info.facts.extend(facts.iter().map(|(key, value)| (format!("replay {key}"), value.clone())));
    Ok(info)
}
