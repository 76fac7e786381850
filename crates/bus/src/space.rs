//! Whether shared memory has room for a domain.
//!
//! Memory that is mapped and turns out not to be there ends a process by SIGBUS, in the middle of a walk. So there must be room for all
//! that a domain may ever touch before anything is made.

use crate::error::MemoryError;
use crate::memory;
use crate::service::{MAX_DEPTH, MAX_PUBLISHERS, MAX_SUBSCRIBERS};
use messages::topic::{Element, Visitor, visit};
use messages::{MAX_PHASES, Message, Topic};
use std::convert::Infallible;

/// Messages of a publisher beside those that wait: one being written, two being read by each subscriber, those that are kept.
fn messages_max(waiting: usize, kept: u32) -> u64 {
    (MAX_SUBSCRIBERS * (waiting + 2) + 1 + kept as usize) as u64
}

/// What iceoryx2 keeps beside the messages, for each topic: measured 0.1 MB with all ports, most of it lists of free places.
const MANAGEMENT_BYTES: u64 = 256 * 1024;

struct Needed(u64);

impl Visitor for Needed {
    type Error = Infallible;

    fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), Infallible> {
        self.0 += MANAGEMENT_BYTES + size_of::<T>() as u64 * messages_max(MAX_DEPTH, topic.row.kept);
        Ok(())
    }

    fn slice<H: Message, E: Element>(&mut self, topic: Topic<H>) -> Result<(), Infallible> {
        let message = size_of::<H>() + MAX_PHASES * size_of::<E>();
        self.0 += MANAGEMENT_BYTES + message as u64 * messages_max(1, topic.row.kept);
        Ok(())
    }
}

/// Bytes of shared memory that a domain may touch, each topic with one publisher and as many subscribers as there may be.
pub(crate) fn needed_bytes() -> u64 {
    const { assert!(MAX_PUBLISHERS == 2, "the second is one that died and is not yet reaped") };
    let mut needed = Needed(0);
    let Ok(()) = visit(&mut needed);
    needed.0
}

/// Refuses to begin where there is no room.
pub(crate) fn check() -> Result<(), MemoryError> {
    let needed_bytes = needed_bytes();
    match memory::free_bytes() {
        Some(free_bytes) if free_bytes < needed_bytes => Err(MemoryError::Full { free_bytes, needed_bytes }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_needs_less_than_it_is_said_to() {
        let needed = needed_bytes();
        assert!((10_000_000..400_000_000).contains(&needed), "{needed} bytes");
    }
}
