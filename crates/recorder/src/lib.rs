//! Writes every topic to MCAP.
//!
//! The library stores messages and knows nothing of where they come from: the process of the same name takes them
//! from the bus, `closed_loop` from its own steps. What a recording holds is documented in `recording`.
//!
//! Storing never fails towards the caller: when the disk is full, messages are dropped and counted
//! ([`Recorder::dropped`]), and what was written stays readable.

mod settings;

pub use settings::{RecorderSettings, UnusableRobot, viewer_settings};

use messages::code::{Process, Reason};
use messages::{Health, Message, PatternHeader, PatternPhase, SoleContact, Topic, Truth};
use recording::{Recovered, RunInfo, WriteError, Writer};
use std::any::Any;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::SystemTime;

/// A recording under way.
pub struct Recorder {
    writer: Writer,
    contact_every_ticks: i64,
    stored: u64,
    dropped: u64,
    /// Of those stored, how many were flushed.
    safe: u64,
    /// Last tick of the truth: in lock-step the last message of its tick.
    last_tick: i64,
    failure: Option<WriteError>,
    /// State, reason and losses of our own health that was stored last, and its tick.
    own_health: Option<((u32, u32, u64), i64)>,
    /// What the simulator said last.
    simulator: Option<Health>,
    /// Duration of the walk that was planned last.
    walk_duration_s: Option<f64>,
}

/// Of our own health one message in so many ticks is stored: one a second.
pub const OWN_HEALTH_TICKS: i64 = 1_000_000_000 / messages::CONTROL_PERIOD_NS as i64;

impl Recorder {
    /// Recovers what a killed recorder left in the folder, then begins a recording. Facts are added to those about
    /// this build.
    ///
    /// # Errors
    /// If folder or file cannot be made.
    pub fn create(settings: &RecorderSettings, info: RunInfo) -> Result<Self, WriteError> {
        let folder = settings.output_file.parent().map_or_else(|| PathBuf::from("."), PathBuf::from);
        std::fs::create_dir_all(&folder).map_err(|source| WriteError::File { path: folder.clone(), source })?;
        let recovery = recording::recover(&folder)?;
        for Recovered { path, from, messages } in &recovery.recovered {
            tracing::warn!("recovered {messages} messages of {} as {}", from.display(), path.display());
        }
        for left in &recovery.left {
            tracing::error!("not recovered, and left as it is: {left}");
        }
        let create = if settings.overwrite { Writer::create_over } else { Writer::create };
        Ok(Self {
            writer: create(&settings.output_path(SystemTime::now()), &info, settings.viewer.clone())?,
            contact_every_ticks: settings.contact_every_ticks,
            stored: 0,
            dropped: 0,
            safe: 0,
            last_tick: -1,
            failure: None,
            own_health: None,
            simulator: None,
            walk_duration_s: None,
        })
    }

    /// Stores a message, and what viewers show of it.
    pub fn store<T: Message>(&mut self, topic: Topic<T>, message: &T) {
        let any: &dyn Any = message;
        let tick = message.header().tick;
        if self.failure.is_some() {
            // Dealt with all the same: in lock-step others wait for it.
            if any.is::<Truth>() {
                self.last_tick = self.last_tick.max(tick);
            }
            self.dropped += 1;
            return;
        }
        let events = self.writer.show_events(message);
        let result = if let Some(contact) = any.downcast_ref::<SoleContact>() {
            if tick % self.contact_every_ticks != 0 {
                return;
            }
            self.writer.record(topic, message).and_then(|()| self.writer.show_contact(contact))
        } else if let Some(health) = any.downcast_ref::<Health>() {
            if !self.is_kept(health) {
                return;
            }
            self.writer.record(topic, message)
        } else if let Some(truth) = any.downcast_ref::<Truth>() {
            self.last_tick = self.last_tick.max(tick);
            self.writer.record(topic, message).and_then(|()| self.writer.show_truth(truth))
        } else {
            self.writer.record(topic, message)
        };
        self.count(events.and(result));
    }

    /// Whether a health is stored. Our own would be a tenth of all messages: once a second, and when it changes, is
    /// enough.
    fn is_kept(&mut self, health: &Health) -> bool {
        match Process::from_code(health.process) {
            Some(Process::Simulator) => self.simulator = Some(*health),
            Some(Process::Recorder) => {
                let now = (health.state, health.reason, health.lost);
                let (before, tick) = self.own_health.unwrap_or(((0, 0, 0), i64::MIN));
                if now == before && health.header.tick < tick.saturating_add(OWN_HEALTH_TICKS) {
                    return false;
                }
                self.own_health = Some((now, health.header.tick));
            }
            _ => {}
        }
        true
    }

    /// How the run went, as far as it was heard: what the simulator said last.
    fn result(&self) -> BTreeMap<String, String> {
        let mut facts = BTreeMap::new();
        let mut say = |key: &str, value: String| facts.insert(key.to_string(), value);
        say("messages", self.stored.to_string());
        if let Some(health) = &self.simulator {
            let reason = Reason::from_code(health.reason).map_or("unknown", Reason::word);
            say("result", if reason.is_empty() { "broken off" } else { reason }.to_string());
            say("walk_time_s", format!("{:.3}", health.walk_time_s));
            if let Some(duration_s) = self.walk_duration_s {
                say("walk_duration_s", format!("{duration_s:.3}"));
            }
            say("distance_m", format!("{:.3}", health.simulator.distance_m));
        }
        facts
    }

    /// Stores a walking pattern.
    pub fn store_pattern(&mut self, header: &PatternHeader, phases: &[PatternPhase]) {
        if self.failure.is_some() {
            self.dropped += 1;
            return;
        }
        self.walk_duration_s = Some(header.duration_s);
        let result = self.writer.record_pattern(header, phases);
        self.count(result);
    }

    fn count(&mut self, result: Result<(), WriteError>) {
        match result {
            Ok(()) => self.stored += 1,
            Err(failure) => {
                self.dropped += 1;
                self.fails(failure);
            }
        }
    }

    fn fails(&mut self, failure: WriteError) {
        if self.failure.is_none() {
            tracing::error!("the recording broke off, messages are dropped from now on: {}", error_chain(&failure));
            // What was not flushed may be lost, too.
            self.dropped += self.stored - self.safe;
            self.failure = Some(failure);
        }
    }

    /// Makes everything so far readable.
    pub fn flush(&mut self) {
        if self.failure.is_some() {
            return;
        }
        match self.writer.flush() {
            Ok(()) => self.safe = self.stored,
            Err(failure) => self.fails(failure),
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

    /// Writes the index and gives the file its name, which is returned. A recording that broke off stays what it is,
    /// unfinished.
    ///
    /// # Errors
    /// [`BrokenOff`] if any message could not be stored, or the index cannot be written.
    pub fn finish(mut self) -> Result<PathBuf, BrokenOff> {
        let result = self.result();
        let partial = self.writer.partial().to_path_buf();
        let (safe, dropped, stored) = (self.safe, self.dropped, self.stored);
        match self.failure {
            Some(source) => Err(BrokenOff { safe, dropped, partial, source }),
            None => self.writer.record_result(result).and_then(|()| self.writer.finish()).map_err(|source| BrokenOff {
                safe,
                dropped: stored - safe,
                partial,
                source,
            }),
        }
    }
}

/// The recording broke off: disk full?
#[derive(Debug, thiserror::Error)]
#[error(
    "the recording broke off: {safe} messages are safe, up to {dropped} are lost; make room, then save what is whole by \
     `soleus-inspect recording --recover {}`", partial.display()
)]
pub struct BrokenOff {
    /// Messages that were flushed before.
    pub safe: u64,
    /// Messages that were dropped, or stored and not flushed.
    pub dropped: u64,
    /// The unfinished file.
    pub partial: PathBuf,
    /// Why.
    pub source: WriteError,
}

/// An error and what caused it, as one sentence.
fn error_chain(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(error.source(), |cause| cause.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}
