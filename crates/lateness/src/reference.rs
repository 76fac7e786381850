//! A thread that does nothing but wake up beside what is measured, on the same core and one priority above it.
//!
//! What stalls both is the machine's: another tenant of the host, firmware, an interrupt. It is *excused*, counted and shown, never
//! dropped silently; what stalls ours alone is ours.

use crate::Lateness;

/// Period of a reference thread: the control period, so that the core is as idle before its wake-up as before ours.
pub const PERIOD_NS: u64 = 5_000_000;
/// A reference that is late by more was stalled (ns). A fifth of the control period; a core that is free wakes up ten times faster.
pub const STALL_NS: u64 = 1_000_000;

/// One wake-up of a reference thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// When it should have run (ns, `CLOCK_MONOTONIC`).
    pub due_ns: u64,
    /// How much later it ran (ns).
    pub late_ns: u64,
}

/// What a reference thread on one core saw.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reference {
    /// The core.
    pub core: usize,
    /// All its wake-ups.
    pub lateness: Lateness,
    /// From when to when (ns) it was stalled, in order.
    stalls: Vec<(u64, u64)>,
}

impl Reference {
    /// On a core, from its samples in their order.
    #[must_use]
    pub fn of(core: usize, samples: &[Sample]) -> Self {
        let stalled = samples.iter().filter(|sample| sample.late_ns > STALL_NS);
        Self {
            core,
            lateness: Lateness::of(samples.iter().map(|sample| sample.late_ns)),
            stalls: stalled.map(|sample| (sample.due_ns, sample.due_ns + sample.late_ns)).collect(),
        }
    }

    /// Whether a stall overlaps this stretch of time.
    #[must_use]
    pub fn stalled_between(&self, from_ns: u64, to_ns: u64) -> bool {
        // The stalls are in order and do not overlap: one thread has them one after the other.
        let first = self.stalls.partition_point(|(_, end_ns)| *end_ns < from_ns);
        self.stalls.get(first).is_some_and(|(begin_ns, _)| *begin_ns <= to_ns)
    }

    /// How many stalls there were.
    #[must_use]
    pub fn stalls(&self) -> usize {
        self.stalls.len()
    }
}

/// How many of something, how many of them bad, and how many of the bad ones a stall of the machine excuses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Excused {
    /// All.
    pub all: u64,
    /// The bad ones, excused ones among them.
    pub bad: u64,
    /// The excused ones.
    pub excused: u64,
}

impl Excused {
    /// One more that lasted for this stretch of time; bad ones are excused by a stall on any of the cores.
    pub fn take(&mut self, bad: bool, between_ns: (u64, u64), cores: &[Reference]) {
        self.all += 1;
        self.bad += u64::from(bad);
        let stalled = || cores.iter().any(|core| core.stalled_between(between_ns.0, between_ns.1));
        self.excused += u64::from(bad && stalled());
    }

    /// Those of others as well.
    pub fn add(&mut self, other: &Self) {
        self.all += other.all;
        self.bad += other.bad;
        self.excused += other.excused;
    }

    /// The bad ones that nothing excuses.
    #[must_use]
    pub fn ours(&self) -> u64 {
        self.bad - self.excused
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn reference() -> Reference {
        let sample = |k: u64, late_ns| Sample { due_ns: k * PERIOD_NS, late_ns };
        // Stalled from 10 to 12 ms and from 25 to 43 ms; a late wake-up at 15 ms that is no stall.
        Reference::of(1, &[sample(1, 30_000), sample(2, 2 * MS), sample(3, MS), sample(5, 18 * MS), sample(9, 20_000)])
    }

    #[test]
    fn a_stall_excuses_what_it_overlaps_and_nothing_else() {
        let reference = reference();
        assert_eq!((reference.stalls(), reference.lateness.count()), (2, 5));
        for (from, to, stalled) in [
            (0, 9, false),
            (8, 10, true),
            (11, 11, true),
            (12, 17, true),
            (13, 24, false),
            (30, 35, true),
            (44, 90, false),
        ] {
            assert_eq!(reference.stalled_between(from * MS, to * MS), stalled, "{from} to {to} ms");
        }
    }

    #[test]
    fn what_is_excused_is_counted_and_not_dropped() {
        let mut missed = Excused::default();
        let cores = [Reference::default(), reference()];
        missed.take(false, (30 * MS, 35 * MS), &cores);
        missed.take(true, (30 * MS, 35 * MS), &cores);
        missed.take(true, (50 * MS, 55 * MS), &cores);
        assert_eq!((missed, missed.ours()), (Excused { all: 3, bad: 2, excused: 1 }, 1));
        missed.add(&missed.clone());
        assert_eq!((missed.all, missed.ours()), (6, 2));
    }
}
