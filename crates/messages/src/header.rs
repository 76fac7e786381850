//! What stands first in every message.

use crate::older;
use crate::plain::plain_struct;
use crate::{Gone, Older, Plain};
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

/// A message: a plain value with a header first.
pub trait Message: Plain + std::fmt::Debug + ZeroCopySend + 'static {
    /// The type's name and version on the wire.
    const WIRE_NAME: &'static str;

    /// Older versions of it that recordings hold, newest first.
    const OLDER: &'static [Older] = &[];

    /// Derives what an older version did not hold from what it did: the fields of the same meaning are filled in already, the others
    /// are zero, and `gone` has the numbers of those that have no place any more.
    fn complete(&mut self, _gone: &Gone) {}

    /// Its header.
    fn header(&self) -> &Header;

    /// Its header, to be filled in.
    fn header_mut(&mut self) -> &mut Header;
}

macro_rules! message {
    ($($type:ty, $wire_name:literal $(, older $older:path, $complete:path)?;)*) => {$(
        impl $crate::Message for $type {
            const WIRE_NAME: &'static str = $wire_name;
            $(
                const OLDER: &'static [$crate::Older] = &$older;
                fn complete(&mut self, gone: &$crate::Gone) {
                    $complete(self, gone);
                }
            )?
            fn header(&self) -> &$crate::Header {
                &self.header
            }
            fn header_mut(&mut self) -> &mut $crate::Header {
                &mut self.header
            }
        }
    )*};
}

message! {
    crate::PatternHeader, "soleus.PatternHeaderV1";
    crate::WalkStart, "soleus.WalkStartV1";
    crate::WalkOrder, "soleus.WalkOrderV1";
    crate::RobotState, "soleus.RobotStateV2", older older::ROBOT_STATE, older::same;
    crate::SoleDeformation, "soleus.SoleDeformationV2", older older::SOLE_DEFORMATION, older::same;
    crate::SoleContact, "soleus.SoleContactV1";
    crate::RobotCommand, "soleus.RobotCommandV2", older older::ROBOT_COMMAND, older::command;
    crate::Truth, "soleus.TruthV2", older older::TRUTH, older::truth;
    crate::Health, "soleus.HealthV2", older older::HEALTH, older::health;
}
