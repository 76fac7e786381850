//! Whether a round of measurements counts at all.

use crate::reference::{Reference, STALL_NS};

/// A reference's p99 beyond this makes a round invalid (ns): the machine cannot do what is asked of us.
pub const REFERENCE_P99_MAX_NS: u64 = STALL_NS;
/// So does a larger share of stalled wake-ups of a reference.
pub const STALLED_SHARE_MAX: f64 = 0.01;
/// So does a larger share of time that the host gave to others. It proves a bad round, never a good one: whole machines stand still
/// without it.
pub const STEAL_SHARE_MAX: f64 = 0.01;

/// What is known of a round beside what was measured.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surroundings {
    /// What the reference threads saw, one per core.
    pub references: Vec<Reference>,
    /// Share of time that the host gave to others (/proc/stat).
    pub steal_share: f64,
    /// Rights that were asked for and not got, in words.
    pub refused: Vec<String>,
    /// Major page faults of the measured threads.
    pub major_faults: u64,
}

impl Surroundings {
    /// Why the round is invalid; empty: it is valid. An invalid one is repeated, and neither passes nor fails.
    #[must_use]
    pub fn faults(&self) -> Vec<String> {
        let mut faults = self.refused.clone();
        if self.references.iter().any(|reference| reference.lateness.count() == 0) {
            faults.push("a reference thread saw nothing".to_string());
        }
        for reference in &self.references {
            let core = reference.core;
            if let Some(p99_ns) = reference.lateness.quantile_ns(0.99).filter(|p99_ns| *p99_ns > REFERENCE_P99_MAX_NS) {
                faults.push(format!("core {core}: reference p99 {:.2} ms", p99_ns as f64 * 1e-6));
            }
            let stalled = reference.lateness.share_beyond(STALL_NS);
            if stalled > STALLED_SHARE_MAX {
                faults.push(format!("core {core}: {:.1} % of the reference's wake-ups stalled", 100.0 * stalled));
            }
        }
        if self.steal_share > STEAL_SHARE_MAX {
            faults.push(format!("steal {:.1} %", 100.0 * self.steal_share));
        }
        if self.major_faults > 0 {
            faults.push(format!("{} major page faults", self.major_faults));
        }
        faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::{PERIOD_NS, Sample};

    fn reference(late_ns: impl Fn(u64) -> u64) -> Reference {
        let samples: Vec<Sample> = (0..2_000).map(|k| Sample { due_ns: k * PERIOD_NS, late_ns: late_ns(k) }).collect();
        Reference::of(1, &samples)
    }

    #[test]
    fn a_quiet_machine_gives_a_valid_round_and_every_rule_an_invalid_one() {
        let quiet = || Surroundings { references: vec![reference(|_| 30_000)], ..Surroundings::default() };
        assert_eq!(quiet().faults(), [] as [String; 0]);
        let one_in_fifty = reference(|k| if k % 50 == 0 { 2_000_000 } else { 30_000 });
        for (round, told) in [
            (Surroundings { references: vec![one_in_fifty], ..quiet() }, "reference p99 2.0"),
            (Surroundings { references: vec![Reference::default()], ..quiet() }, "saw nothing"),
            (Surroundings { steal_share: 0.02, ..quiet() }, "steal 2.0 %"),
            (Surroundings { major_faults: 3, ..quiet() }, "3 major page faults"),
            (Surroundings { refused: vec!["controller: no SCHED_FIFO 65".to_string()], ..quiet() }, "no SCHED_FIFO"),
        ] {
            let faults = round.faults();
            assert!(faults.iter().any(|fault| fault.contains(told)), "{faults:?}");
        }
        let faults = Surroundings { references: vec![reference(|k| 2_000_000 * u64::from(k % 50 == 0))], ..quiet() };
        assert!(faults.faults().iter().any(|fault| fault.contains("2.0 % of the reference's")), "both rules");
    }
}
