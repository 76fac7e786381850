//! Writes every topic to MCAP.
//!
//! The library stores messages and knows nothing of where they come from: the process of the same name takes them from the bus,
//! `closed_loop` from its own steps. What a recording holds is documented in `recording`.
//!
//! Storing never fails towards the caller: when the disk is full, messages are dropped and counted ([`Recorder::dropped`]), and
//! what was written stays readable.

mod settings;

pub use settings::{RecorderSettings, SettingsError, UnusableRobot};

use messages::{Message, PatternHeader, PatternPhase, SoleContact, Topic, Truth};
use recording::{RunInfo, WriteError, Writer};
use std::any::Any;
use std::path::PathBuf;

/// A recording under way.
pub struct Recorder {
    writer: Writer,
    contact_every_ticks: i64,
    stored: u64,
    dropped: u64,
    /// Last tick of the truth: in lock-step the last message of its tick.
    last_tick: i64,
    failure: Option<WriteError>,
}

impl Recorder {
    /// Recovers what a killed recorder left in the folder, then begins a recording. Facts are added to those about this build.
    ///
    /// # Errors
    /// If folder or file cannot be made.
    pub fn create(settings: &RecorderSettings, info: RunInfo) -> Result<Self, WriteError> {
        let folder = settings.output_file.parent().map_or_else(|| PathBuf::from("."), PathBuf::from);
        std::fs::create_dir_all(&folder).map_err(|source| WriteError::File { path: folder.clone(), source })?;
        for recovered in recording::recover(&folder)? {
            tracing::warn!("recovered {} messages of {}", recovered.messages, recovered.path.display());
        }
        Ok(Self {
            writer: Writer::create(&settings.output_file, &info, settings.viewer.clone())?,
            contact_every_ticks: settings.contact_every_ticks,
            stored: 0,
            dropped: 0,
            last_tick: -1,
            failure: None,
        })
    }

    /// Stores a message, and what viewers show of it.
    pub fn store<T: Message>(&mut self, topic: Topic<T>, message: &T) {
        let any: &dyn Any = message;
        let tick = message.header().tick;
        let result = if let Some(contact) = any.downcast_ref::<SoleContact>() {
            if tick % self.contact_every_ticks != 0 {
                return;
            }
            self.writer.record(topic, message).and_then(|()| self.writer.show_contact(contact))
        } else if let Some(truth) = any.downcast_ref::<Truth>() {
            self.last_tick = self.last_tick.max(tick);
            self.writer.record(topic, message).and_then(|()| self.writer.show_truth(truth))
        } else {
            self.writer.record(topic, message)
        };
        self.count(result);
    }

    /// Stores a walking pattern.
    pub fn store_pattern(&mut self, header: &PatternHeader, phases: &[PatternPhase]) {
        let result = self.writer.record_pattern(header, phases);
        self.count(result);
    }

    fn count(&mut self, result: Result<(), WriteError>) {
        match result {
            Ok(()) => self.stored += 1,
            Err(failure) => {
                self.dropped += 1;
                if self.failure.is_none() {
                    tracing::error!("messages are being dropped: {failure}");
                    self.failure = Some(failure);
                }
            }
        }
    }

    /// Makes everything so far readable.
    pub fn flush(&mut self) {
        if let Err(failure) = self.writer.flush() {
            self.failure.get_or_insert(failure);
        }
    }

    /// Messages stored.
    pub fn stored(&self) -> u64 {
        self.stored
    }

    /// Messages dropped because writing failed.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Why writing failed first, if it did.
    pub fn failure(&self) -> Option<&WriteError> {
        self.failure.as_ref()
    }

    /// The last tick of the simulated truth that has been dealt with; -1 before the first.
    pub fn last_tick(&self) -> i64 {
        self.last_tick
    }

    /// Writes the index and gives the file its name, which is returned.
    ///
    /// # Errors
    /// If writing fails.
    pub fn finish(self) -> Result<PathBuf, WriteError> {
        self.writer.finish()
    }
}
