//! Subscribing to one topic.

use crate::error::{PortError, ReceiveError};
use crate::service::{self, Messages, publisher_lives};
use crate::sleep::{SLICE, clock_monotonic_ns, listener, sleep_until_woken};
use iceoryx2::port::listener::Listener;
use iceoryx2::prelude::*;
use messages::{Fault, Header, Message, Topic};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// How often one who hears a second publisher asks whether the first one still lives: that takes a look at some files.
const ASK_AGAIN: Duration = Duration::from_millis(50);

/// Whose messages are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Robot {
    /// Of any robot: recorder, launcher.
    Any,
    /// Of the robot with this fingerprint only.
    Only(u64),
}

/// What a subscriber has seen so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Messages taken.
    pub taken: u64,
    /// Messages that never arrived: gaps in the sequence numbers.
    pub lost: u64,
    /// Messages of other robots, not taken.
    pub refused: u64,
    /// Messages of a second publisher while the first one lives, not taken.
    pub strangers: u64,
    /// How often a publisher began anew.
    pub restarts: u64,
}

/// The checks of headers, apart from where they come from.
#[derive(Debug)]
pub(crate) struct Gate {
    robot: Robot,
    /// Who is listened to until it is dead.
    publisher: Option<u128>,
    /// When somebody else was heard, and the publisher found alive.
    found_alive: Option<Instant>,
    /// Last sequence number of each publisher so far. Numbers alone do not tell a new one that was not heard from its beginning from
    /// the old one, and what the old one said may still come after what the new one says.
    previous: BTreeMap<u128, u64>,
    pub(crate) counts: Counts,
    /// Fingerprint in the latest message that was refused.
    refused: u64,
}

impl Gate {
    pub(crate) fn new(robot: Robot) -> Self {
        Self {
            robot,
            publisher: None,
            found_alive: None,
            previous: BTreeMap::new(),
            counts: Counts::default(),
            refused: 0,
        }
    }

    /// Whether a publisher is the one that is listened to, or was before it died; else it becomes the one, unless that one `lives`.
    fn listens_to(&mut self, publisher: u128, lives: impl FnOnce(u128) -> bool) -> bool {
        if let Some(current) = self.publisher.filter(|current| *current != publisher) {
            if self.previous.contains_key(&publisher) {
                return true;
            }
            if self.found_alive.is_some_and(|asked| asked.elapsed() < ASK_AGAIN) {
                return false;
            }
            if lives(current) {
                self.found_alive = Some(Instant::now());
                return false;
            }
        }
        self.publisher = Some(publisher);
        self.found_alive = None;
        true
    }

    /// Whether a message of a publisher with this header may be taken; counts what it learns. `lives` says whether a publisher does.
    pub(crate) fn admits(&mut self, publisher: u128, header: &Header, lives: impl FnOnce(u128) -> bool) -> bool {
        if !self.listens_to(publisher, lives) {
            self.counts.strangers += 1;
            return false;
        }
        let ours = if let Robot::Only(fingerprint) = self.robot { fingerprint } else { header.robot_fingerprint };
        let previous = self.previous.insert(publisher, header.sequence);
        match header.check(ours, previous) {
            Err(Fault::OtherRobot { .. }) => {
                self.counts.refused += 1;
                self.refused = header.robot_fingerprint;
                return false;
            }
            Err(Fault::Gap { expected, found }) => self.counts.lost += found.saturating_sub(expected),
            Ok(()) if previous.is_none() && self.counts.taken > 0 => {
                self.counts.restarts += 1;
                // We were there when it said its first.
                self.counts.lost += header.sequence;
            }
            Ok(()) => {}
        }
        self.counts.taken += 1;
        true
    }

    /// What somebody is told who waited in vain since these counts.
    ///
    /// # Errors
    /// If messages came, but of another robot.
    pub(crate) fn nothing_came<T>(&self, since: Counts, topic: &'static str) -> Result<Option<T>, ReceiveError> {
        match self.robot {
            Robot::Only(expected) if self.counts.refused > since.refused => {
                Err(ReceiveError::OtherRobot { topic, expected, found: self.refused })
            }
            _ => Ok(None),
        }
    }
}

/// A subscriber to a topic.
pub struct Subscriber<T: Message> {
    subscriber: iceoryx2::port::subscriber::Subscriber<ipc::Service, T, ()>,
    listener: Option<Listener<ipc::Service>>,
    topic: Topic<T>,
    gate: Gate,
    config: Config,
    // After its ports.
    service: Messages<T>,
}

impl<T: Message> Subscriber<T> {
    pub(crate) fn new(
        node: &Node<ipc::Service>,
        topic: Topic<T>,
        robot: Robot,
        depth: usize,
    ) -> Result<Self, PortError> {
        let name = topic.name();
        let service = service::open(node, topic)?;
        let create = || service.subscriber_builder().buffer_size(depth.clamp(1, service::MAX_DEPTH)).create();
        let subscriber = create().or_else(|_| {
            node.try_cleanup_dead_nodes();
            create()
        });
        let subscriber = subscriber.map_err(|source| PortError::Subscriber { topic: name, source })?;
        let listener = listener(node, topic)?;
        Ok(Self { subscriber, listener, topic, gate: Gate::new(robot), config: node.config().clone(), service })
    }

    /// The oldest message not yet received, if there is one. Does not wait.
    ///
    /// # Errors
    /// When the subscriber is broken.
    pub fn try_next(&mut self) -> Result<Option<T>, ReceiveError> {
        let topic = self.topic.name();
        while let Some(sample) = self.subscriber.receive().map_err(|source| ReceiveError::Receive { topic, source })? {
            let lives = |publisher| publisher_lives(&self.config, self.service.dynamic_config(), publisher);
            if self.gate.admits(sample.origin().value(), sample.payload().header(), lives) {
                return Ok(Some(*sample));
            }
        }
        Ok(None)
    }

    /// The newest message, if any came since the last call; those before it are dropped. Does not wait.
    ///
    /// # Errors
    /// When the subscriber is broken.
    pub fn latest(&mut self) -> Result<Option<T>, ReceiveError> {
        let mut latest = None;
        while let Some(message) = self.try_next()? {
            latest = Some(message);
        }
        Ok(latest)
    }

    /// Waits for the next message, at most for `patience`.
    ///
    /// # Errors
    /// When the subscriber is broken, and when nothing but messages of another robot came.
    pub fn wait(&mut self, patience: Duration) -> Result<Option<T>, ReceiveError> {
        let (start, before) = (Instant::now(), self.gate.counts);
        loop {
            if let Some(message) = self.try_next()? {
                return Ok(Some(message));
            }
            let Some(left) = patience.checked_sub(start.elapsed()) else {
                return self.gate.nothing_came(before, self.topic.name());
            };
            sleep_until_woken(self.listener.as_ref(), left.min(SLICE), self.topic.name())?;
        }
    }

    /// Waits for the next message until a time of `CLOCK_MONOTONIC` (ns); `None` then. What came before is taken at once, however late
    /// it is.
    ///
    /// # Errors
    /// When the subscriber is broken.
    pub fn wait_until(&mut self, deadline_ns: u64) -> Result<Option<T>, ReceiveError> {
        loop {
            if let Some(message) = self.try_next()? {
                return Ok(Some(message));
            }
            let left_ns = deadline_ns.saturating_sub(clock_monotonic_ns());
            if left_ns == 0 {
                return Ok(None);
            }
            let left = Duration::from_nanos(left_ns);
            sleep_until_woken(self.listener.as_ref(), left.min(SLICE), self.topic.name())?;
        }
    }

    /// What it has seen so far.
    pub fn counts(&self) -> Counts {
        self.gate.counts
    }

    /// The topic.
    pub fn topic(&self) -> Topic<T> {
        self.topic
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_publisher_that_began_anew_is_told_from_one_whose_messages_were_lost() {
        let header = |sequence, robot| Header { sequence, ..Header::new(0, robot) };
        let mut gate = Gate::new(Robot::Only(7));
        let (old, new, of_another_robot) = (1, 2, 3);
        let dead = |_| false;
        // Who comes late has lost nothing.
        assert!(gate.admits(old, &header(5, 7), dead));
        assert_eq!(gate.counts, Counts { taken: 1, ..Counts::default() });
        // Further than the old one ever came; and the old one's last words come later.
        for (publisher, sequence) in [(new, 9), (old, 6), (new, 10), (new, 12)] {
            assert!(gate.admits(publisher, &header(sequence, 7), dead));
        }
        assert_eq!(gate.counts, Counts { taken: 5, lost: 9 + 1, restarts: 1, ..Counts::default() });
        assert!(!gate.admits(of_another_robot, &header(0, 8), dead));
        // One of another robot is in the numbers of its publisher, too.
        assert!(!gate.admits(new, &header(13, 8), dead));
        assert!(gate.admits(new, &header(14, 7), dead));
        assert_eq!(gate.counts, Counts { taken: 6, lost: 10, restarts: 1, refused: 2, strangers: 0 });
        // Who waits in vain is told of another robot only if it was heard while one waited.
        let now = gate.counts;
        assert!(matches!(gate.nothing_came::<()>(now, "t"), Ok(None)));
        assert!(!gate.admits(of_another_robot, &header(1, 9), dead));
        let told = gate.nothing_came::<()>(now, "t");
        assert!(matches!(told, Err(ReceiveError::OtherRobot { topic: "t", expected: 7, found: 9 })), "{told:?}");
        let mut everybody = Gate::new(Robot::Any);
        assert!(everybody.admits(old, &header(0, 7), dead) && everybody.admits(new, &header(0, 8), dead));
        assert_eq!(everybody.counts, Counts { taken: 2, restarts: 1, ..Counts::default() });
        assert!(matches!(everybody.nothing_came::<()>(Counts::default(), "t"), Ok(None)));
    }

    #[test]
    fn a_second_publisher_is_not_heard_while_the_first_lives() {
        let header = |sequence| Header { sequence, ..Header::new(0, 7) };
        let (first, second) = (1, 2);
        let mut gate = Gate::new(Robot::Any);
        let never = |_| panic!("nobody else was heard");
        assert!(gate.admits(first, &header(0), never) && gate.admits(first, &header(1), never));
        let lives = |publisher| {
            assert_eq!(publisher, first);
            true
        };
        assert!(!gate.admits(second, &header(0), lives));
        assert!(!gate.admits(second, &header(1), |_| panic!("asked a moment ago")));
        assert!(gate.admits(first, &header(2), never));
        std::thread::sleep(ASK_AGAIN);
        assert!(!gate.admits(second, &header(2), lives));
        std::thread::sleep(ASK_AGAIN);
        assert!(gate.admits(second, &header(3), |_| false), "the first is dead");
        assert!(gate.admits(first, &header(3), never), "what it said last comes late");
        assert_eq!(gate.counts, Counts { taken: 5, strangers: 3, restarts: 1, lost: 3, refused: 0 });
    }
}
