//! Verdicts on what was measured.

use crate::{Lateness, Quantiles};

/// A ratio of two percentiles scatters by a factor of two from round to round: the median of so many rounds is judged, or none.
pub const ROUNDS_MIN: usize = 6;

/// How a criterion came out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// It holds.
    Met,
    /// It does not.
    NotMet,
    /// Too little was measured to say so; why.
    NotJudged(String),
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Met => f.write_str("met"),
            Self::NotMet => f.write_str("NOT MET"),
            Self::NotJudged(why) => write!(f, "not judged: {why}"),
        }
    }
}

/// One line of the table of verdicts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Criterion {
    /// Its name: A1, A2, ..
    pub id: &'static str,
    /// What is measured.
    pub measure: String,
    /// What is accepted.
    pub accept: String,
    /// What was found.
    pub found: String,
    /// The verdict.
    pub verdict: Verdict,
}

impl Criterion {
    /// A number that shall be at most a limit; without it, why.
    #[must_use]
    pub fn at_most(
        id: &'static str,
        measure: impl Into<String>,
        found: Result<f64, String>,
        limit: f64,
        write: impl Fn(f64) -> String,
    ) -> Self {
        let (said, verdict) = match found {
            Ok(found) if found <= limit => (write(found), Verdict::Met),
            // What is not a number is not met either.
            Ok(found) => (write(found), Verdict::NotMet),
            Err(why) => ("-".to_string(), Verdict::NotJudged(why)),
        };
        Self { id, measure: measure.into(), accept: format!("<= {}", write(limit)), found: said, verdict }
    }
}

/// The worst of several verdicts: one that is not met decides, then one that is not judged.
#[must_use]
pub fn worst<'a>(verdicts: impl IntoIterator<Item = &'a Verdict>) -> Verdict {
    let mut worst = Verdict::Met;
    for verdict in verdicts {
        match verdict {
            Verdict::NotMet => return Verdict::NotMet,
            Verdict::NotJudged(_) if worst == Verdict::Met => worst = verdict.clone(),
            _ => {}
        }
    }
    worst
}

/// Median of some numbers; `None` without any.
#[must_use]
pub fn median(numbers: &[f64]) -> Option<f64> {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => None,
        n if n % 2 == 1 => Some(sorted[middle]),
        _ => Some(0.5 * (sorted[middle - 1] + sorted[middle])),
    }
}

/// The median over rounds of one percentile of ours over that of the paired reference.
///
/// # Errors
/// What is missing: rounds, or samples in them.
pub fn median_ratio(
    rounds: &[(Quantiles, Quantiles)],
    percentile: impl Fn(&Quantiles) -> Option<u64>,
) -> Result<f64, String> {
    let ratio = |(ours, reference): &(Quantiles, Quantiles)| {
        Some(percentile(ours)? as f64 / (percentile(reference)?.max(1)) as f64)
    };
    let ratios: Vec<f64> = rounds.iter().filter_map(ratio).collect();
    if ratios.len() < ROUNDS_MIN {
        return Err(format!("{} of {ROUNDS_MIN} rounds with enough samples", ratios.len()));
    }
    Ok(median(&ratios).expect("some"))
}

/// A percentile so rare that no single round has it: all rounds together, ours over the reference's.
///
/// # Errors
/// What is missing.
pub fn pooled_ratio(ours: &Lateness, reference: &Lateness, share: f64) -> Result<f64, String> {
    match (ours.quantile_ns(share), reference.quantile_ns(share)) {
        (Some(ours), Some(reference)) => Ok(ours as f64 / reference.max(1) as f64),
        _ => Err(format!("{} and {} samples, too few for {} %", ours.count(), reference.count(), 100.0 * share)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(x: f64) -> String {
        format!("{x:.2}")
    }

    fn rounds(ours_us: &[u64]) -> Vec<(Quantiles, Quantiles)> {
        let of = |us: u64| Lateness::of((0..2_000).map(|_| us * 1_000)).quantiles();
        ours_us.iter().map(|us| (of(*us), of(100))).collect()
    }

    #[test]
    fn the_median_of_the_ratios_is_judged_and_one_bad_round_does_not_decide() {
        let found = median_ratio(&rounds(&[100, 110, 105, 120, 900, 95]), |q| q.p99_ns);
        let criterion = Criterion::at_most("A1", "wake p99", found, 1.5, write);
        assert_eq!((criterion.verdict, criterion.accept.as_str()), (Verdict::Met, "<= 1.50"));
        let found = median_ratio(&rounds(&[200, 210, 205, 220, 90, 95]), |q| q.p99_ns);
        assert_eq!(Criterion::at_most("A1", "wake p99", found, 1.5, write).verdict, Verdict::NotMet);
    }

    #[test]
    fn what_was_not_measured_enough_is_not_judged() {
        let few = median_ratio(&rounds(&[100; 5]), |q| q.p99_ns);
        assert_eq!(few, Err("5 of 6 rounds with enough samples".to_string()));
        let rare = median_ratio(&rounds(&[100; 6]), |q| q.p999_ns);
        assert_eq!(rare, Err("0 of 6 rounds with enough samples".to_string()), "2000 samples have no p99.9");
        let criterion = Criterion::at_most("A1", "wake p99.9", rare, 2.0, write);
        assert_eq!(criterion.verdict.to_string(), "not judged: 0 of 6 rounds with enough samples");
    }

    #[test]
    fn rare_percentiles_are_taken_of_all_rounds_together() {
        let (ours, reference) = (Lateness::of([300_000; 12_000]), Lateness::of([200_000; 12_000]));
        let ratio = pooled_ratio(&ours, &reference, 0.999).expect("12,000 samples");
        assert!((ratio - 1.5).abs() < 0.02, "{ratio}");
        assert!(pooled_ratio(&ours, &Lateness::of([1; 9_000]), 0.999).is_err());
    }

    #[test]
    fn what_is_not_a_number_is_not_met() {
        assert_eq!(Criterion::at_most("A7", "COM", Ok(f64::NAN), 1.1, write).verdict, Verdict::NotMet);
    }

    #[test]
    fn the_worst_verdict_decides() {
        let open = Verdict::NotJudged("few".to_string());
        assert_eq!(worst([&Verdict::Met, &open]), open);
        assert_eq!(worst([&open, &Verdict::NotMet, &Verdict::Met]), Verdict::NotMet);
        assert_eq!(worst([&Verdict::Met]), Verdict::Met);
        assert_eq!((median(&[3.0, 1.0, 2.0]), median(&[4.0, 1.0]), median(&[])), (Some(2.0), Some(2.5), None));
    }
}
