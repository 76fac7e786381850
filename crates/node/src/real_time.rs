//! Running by the clock.

use crate::system;
use messages::CONTROL_PERIOD_NS;

/// Time of `CLOCK_MONOTONIC`, the clock of all processes on a host.
pub fn clock_monotonic_ns() -> u64 {
    system::clock_monotonic_ns()
}

/// Under which policy a process really runs, read back from the system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Policy {
    /// Priority under SCHED_FIFO; `None` under the ordinary policy.
    pub fifo_priority: Option<i32>,
    /// Whether all memory is locked.
    pub memory_locked: bool,
}

impl Policy {
    /// Asks for SCHED_FIFO and locked memory and says what it got. What was refused, and how it can be granted, is a warning:
    /// the process runs on, visibly marked in its health.
    pub fn enter(priority: i32) -> Self {
        let memory_locked = match system::lock_memory() {
            Ok(()) => true,
            Err(refusal) => {
                tracing::warn!("memory cannot be locked ({refusal}): grant LimitMEMLOCK=infinity, or CAP_IPC_LOCK");
                false
            }
        };
        if let Err(refusal) = system::schedule_fifo(priority) {
            tracing::warn!(
                "SCHED_FIFO {priority} is refused ({refusal}): grant LimitRTPRIO={priority}, or CAP_SYS_NICE"
            );
        }
        let fifo_priority = match system::scheduling() {
            (libc::SCHED_FIFO, priority) => Some(priority),
            _ => None,
        };
        Self { fifo_priority, memory_locked }
    }
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
