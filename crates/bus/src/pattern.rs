//! The walking pattern: one message of many phases, kept for those who come later.

use crate::error::{PortError, PublishError, ReceiveError};
use crate::publisher::{notifier, wake};
use crate::service::{self, Phases, publisher_lives};
use crate::sleep::{SLICE, listener, sleep_until_woken};
use crate::subscriber::{Counts, Gate, Robot};
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::*;
use messages::topic::WALK_PATTERN;
use messages::{MAX_PHASES, PatternHeader, PatternPhase};
use std::time::{Duration, Instant};

const TOPIC: &str = WALK_PATTERN.name();

/// A walking pattern as it travels.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    /// What the phases have in common.
    pub header: PatternHeader,
    /// The phases.
    pub phases: Vec<PatternPhase>,
}

/// Publishes the walking pattern; must live as long as anybody may still come to ask for it.
pub struct PatternPublisher {
    publisher: Publisher<ipc::Service, [PatternPhase], PatternHeader>,
    notifier: Option<Notifier<ipc::Service>>,
    max_phases: usize,
    sequence: u64,
}

impl PatternPublisher {
    pub(crate) fn new(node: &Node<ipc::Service>, max_phases: usize) -> Result<Self, PortError> {
        let service = service::open_pattern(node, &WALK_PATTERN.row)?;
        let max_phases = max_phases.clamp(1, MAX_PHASES);
        let create = || service.publisher_builder().initial_max_slice_len(max_phases).max_loaned_samples(1).create();
        let publisher = create().or_else(|_| {
            node.try_cleanup_dead_nodes();
            create()
        });
        let publisher = publisher.map_err(|source| PortError::Publisher { topic: TOPIC, source })?;
        let notifier = notifier(node, WALK_PATTERN)?;
        Ok(Self { publisher, notifier, max_phases, sequence: 0 })
    }

    /// Publishes a pattern; sequence number and number of phases are set here.
    ///
    /// # Errors
    /// [`PublishError::PatternTooLong`] if it has more phases than announced when the publisher was made.
    pub fn publish(&mut self, header: &PatternHeader, phases: &[PatternPhase]) -> Result<(), PublishError> {
        if phases.len() > self.max_phases {
            return Err(PublishError::PatternTooLong { found: phases.len(), limit: self.max_phases });
        }
        let mut sample = self
            .publisher
            .loan_slice_uninit(phases.len())
            .map_err(|source| PublishError::Loan { topic: TOPIC, source })?;
        let mut header = PatternHeader { phase_count: phases.len() as u32, ..*header };
        header.header.sequence = self.sequence;
        *sample.user_header_mut() = header;
        let sample = sample.write_from_slice(phases);
        sample.send().map_err(|source| PublishError::Send { topic: TOPIC, source })?;
        self.sequence += 1;
        wake(&self.notifier);
        Ok(())
    }

    /// Gives the pattern to those who subscribed since the last call, and wakes them.
    ///
    /// # Errors
    /// When connecting fails.
    pub fn serve_late_joiners(&self) -> Result<(), PublishError> {
        self.publisher.update_connections().map_err(|source| PublishError::Connect { topic: TOPIC, source })?;
        wake(&self.notifier);
        Ok(())
    }
}

/// Receives the walking pattern.
pub struct PatternSubscriber {
    subscriber: Subscriber<ipc::Service, [PatternPhase], PatternHeader>,
    listener: Option<Listener<ipc::Service>>,
    gate: Gate,
    max_phases: usize,
    config: Config,
    // After its ports.
    service: Phases,
}

impl PatternSubscriber {
    pub(crate) fn new(node: &Node<ipc::Service>, robot: Robot, max_phases: usize) -> Result<Self, PortError> {
        let service = service::open_pattern(node, &WALK_PATTERN.row)?;
        let create = || service.subscriber_builder().buffer_size(1).create();
        let subscriber = create().or_else(|_| {
            node.try_cleanup_dead_nodes();
            create()
        });
        let subscriber = subscriber.map_err(|source| PortError::Subscriber { topic: TOPIC, source })?;
        let listener = listener(node, WALK_PATTERN)?;
        Ok(Self { subscriber, listener, gate: Gate::new(robot), max_phases, config: node.config().clone(), service })
    }

    /// The newest pattern, if one came since the last call. Does not wait.
    ///
    /// # Errors
    /// [`ReceiveError::PatternTooLong`] if there is no memory for it. Whether its content is whole, `messages::read_pattern` says.
    pub fn latest(&mut self) -> Result<Option<Pattern>, ReceiveError> {
        let mut latest = None;
        let failed = |source| ReceiveError::Receive { topic: TOPIC, source };
        while let Some(sample) = self.subscriber.receive().map_err(failed)? {
            let header = *sample.user_header();
            let lives = |publisher| publisher_lives(&self.config, self.service.dynamic_config(), publisher);
            if !self.gate.admits(sample.origin().value(), &header.header, lives) {
                continue;
            }
            let phases = sample.payload();
            if phases.len() > self.max_phases {
                return Err(ReceiveError::PatternTooLong { found: phases.len(), limit: self.max_phases });
            }
            latest = Some(Pattern { header, phases: phases.to_vec() });
        }
        Ok(latest)
    }

    /// Waits for a pattern, at most for `patience`.
    ///
    /// # Errors
    /// As [`PatternSubscriber::latest`], and when nothing but patterns for another robot came.
    pub fn wait(&mut self, patience: Duration) -> Result<Option<Pattern>, ReceiveError> {
        let (start, before) = (Instant::now(), self.gate.counts);
        loop {
            if let Some(pattern) = self.latest()? {
                return Ok(Some(pattern));
            }
            let Some(left) = patience.checked_sub(start.elapsed()) else {
                return self.gate.nothing_came(before, TOPIC);
            };
            sleep_until_woken(self.listener.as_ref(), left.min(SLICE), TOPIC)?;
        }
    }

    /// What it has seen so far.
    pub fn counts(&self) -> Counts {
        self.gate.counts
    }
}
