//! Running by the clock.

use crate::system;
use messages::CONTROL_PERIOD_NS;

/// Time of `CLOCK_MONOTONIC`, the clock of all processes on a host.
pub fn clock_monotonic_ns() -> u64 {
    system::clock_monotonic_ns()
}

/// Absolute times, one control period apart.
#[derive(Debug, Clone)]
pub struct Pacer {
    next_ns: u64,
    /// Whole periods that were skipped because a cycle took too long.
    pub skipped: u64,
}

impl Pacer {
    /// The first time is one period from now.
    pub fn start() -> Self {
        Self { next_ns: clock_monotonic_ns() + CONTROL_PERIOD_NS, skipped: 0 }
    }

    /// Sleeps until the next time and returns it. Periods that have passed already are skipped and counted: never caught up
    /// with in a burst.
    pub fn wait(&mut self) -> u64 {
        let now_ns = clock_monotonic_ns();
        if now_ns > self.next_ns {
            let passed = (now_ns - self.next_ns).div_ceil(CONTROL_PERIOD_NS);
            self.skipped += passed;
            self.next_ns += passed * CONTROL_PERIOD_NS;
        }
        let time_ns = self.next_ns;
        Self::sleep_until(time_ns);
        self.next_ns += CONTROL_PERIOD_NS;
        time_ns
    }

    /// Sleeps until a time; returns earlier only if a signal came.
    pub fn sleep_until(time_ns: u64) {
        system::sleep_until_ns(time_ns);
    }
}
