//! What stands first in every message.

use crate::plain::{Plain, plain_struct};
use iceoryx2::prelude::ZeroCopySend;

plain_struct! {
    /// Sequence, control time and robot of a message.
    "soleus.HeaderV1", 32 bytes, Header {
        /// Number of the message on its topic, counted by its publisher from zero. Filled in by the bus.
        sequence: u64,
        /// Control tick the content belongs to.
        tick: i64,
        /// Hash of the robot's description: a message of another robot must not be used.
        robot_fingerprint: u64,
        /// `CLOCK_MONOTONIC` time of the tick, in real time; zero in lock-step.
        clock_monotonic_ns: u64,
    }
}

impl Header {
    /// Header of a message for a tick; sequence and clock are filled in when it is sent.
    pub fn new(tick: i64, robot_fingerprint: u64) -> Self {
        Self { tick, robot_fingerprint, ..Self::ZERO }
    }

    /// Checks what every consumer must: the robot is ours, and nothing was lost since the message before.
    ///
    /// # Errors
    /// [`Fault::OtherRobot`]: the message must not be used. [`Fault::Gap`]: the message is fine, but others before it were lost
    /// or the publisher was restarted.
    pub fn check(&self, robot_fingerprint: u64, previous_sequence: Option<u64>) -> Result<(), Fault> {
        if self.robot_fingerprint != robot_fingerprint {
            return Err(Fault::OtherRobot { expected: robot_fingerprint, found: self.robot_fingerprint });
        }
        match previous_sequence.map(|sequence| sequence.wrapping_add(1)) {
            Some(expected) if expected != self.sequence => Err(Fault::Gap { expected, found: self.sequence }),
            _ => Ok(()),
        }
    }
}

/// What may be wrong with a header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The message describes another robot; two processes run with different robot folders.
    OtherRobot {
        /// Fingerprint of our robot.
        expected: u64,
        /// Fingerprint in the message.
        found: u64,
    },
    /// The sequence number is not the next one.
    Gap {
        /// The next sequence number.
        expected: u64,
        /// The one in the message; smaller if the publisher was restarted.
        found: u64,
    },
}
