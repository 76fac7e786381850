//! The clock of all processes on a host.

use crate::system;

/// Time of `CLOCK_MONOTONIC`.
pub fn clock_monotonic_ns() -> u64 {
    system::clock_monotonic_ns()
}
