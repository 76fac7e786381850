//! Times in a histogram of fixed size.

use hdrhistogram::Histogram;

/// What is shorter lies in the first buckets (ns).
const LEAST_NS: u64 = 1_000;
/// What is longer counts as this long (ns); the largest itself is kept as it is.
const MOST_NS: u64 = 10_000_000_000;
/// Significant decimal digits: a bucket is at most a hundredth wide.
const DIGITS: u8 = 2;
/// A percentile is given where so many samples lie beyond it: 1000 samples for 99 %, 10,000 for 99.9 %.
pub const SAMPLES_BEYOND: f64 = 10.0;

/// Times (ns), each within a hundredth.
#[derive(Debug, Clone, PartialEq)]
pub struct Lateness {
    counts: Histogram<u64>,
    largest_ns: u64,
}

/// What of a histogram is told (ns). A percentile that the samples are too few for is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Quantiles {
    /// Number of samples.
    pub count: u64,
    /// Median.
    pub p50_ns: Option<u64>,
    /// What 99 of 100 do not exceed.
    pub p99_ns: Option<u64>,
    /// What 999 of 1000 do not exceed.
    pub p999_ns: Option<u64>,
    /// The largest, exactly; zero without samples.
    pub max_ns: u64,
}

impl Default for Lateness {
    fn default() -> Self {
        let counts = Histogram::new_with_bounds(LEAST_NS, MOST_NS, DIGITS);
        Self { counts: counts.expect("constants that are right"), largest_ns: 0 }
    }
}

impl Lateness {
    /// Of these times (ns).
    #[must_use]
    pub fn of(times_ns: impl IntoIterator<Item = u64>) -> Self {
        let mut lateness = Self::default();
        times_ns.into_iter().for_each(|time_ns| lateness.record(time_ns));
        lateness
    }

    /// One more time (ns). Does not allocate.
    pub fn record(&mut self, time_ns: u64) {
        self.counts.saturating_record(time_ns);
        self.largest_ns = self.largest_ns.max(time_ns);
    }

    /// All samples of another histogram as well: rounds are added, percentiles of rounds are never averaged.
    pub fn add(&mut self, other: &Self) {
        self.counts.add(&other.counts).expect("the same bounds");
        self.largest_ns = self.largest_ns.max(other.largest_ns);
    }

    /// Number of samples.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.counts.len()
    }

    /// The largest, exactly (ns).
    #[must_use]
    pub fn max_ns(&self) -> u64 {
        self.largest_ns
    }

    /// What this share of all samples does not exceed (ns); `None` if fewer than [`SAMPLES_BEYOND`] lie beyond it, or before it.
    #[must_use]
    pub fn quantile_ns(&self, share: f64) -> Option<u64> {
        let rarer = (1.0 - share).min(share);
        // A part in 1e9: 0.999 as a binary number is not quite what it says.
        let enough = self.count() as f64 * rarer * (1.0 + 1e-9) >= SAMPLES_BEYOND;
        enough.then(|| self.counts.value_at_quantile(share).min(self.largest_ns))
    }

    /// Share of all samples that exceed a time (ns), within a bucket's width; zero without samples.
    #[must_use]
    pub fn share_beyond(&self, time_ns: u64) -> f64 {
        if self.count() == 0 {
            return 0.0;
        }
        let within = self.counts.count_between(0, time_ns.min(MOST_NS));
        (self.count() - within) as f64 / self.count() as f64
    }

    /// What is told of it.
    #[must_use]
    pub fn quantiles(&self) -> Quantiles {
        Quantiles {
            count: self.count(),
            p50_ns: self.quantile_ns(0.5),
            p99_ns: self.quantile_ns(0.99),
            p999_ns: self.quantile_ns(0.999),
            max_ns: self.largest_ns,
        }
    }

    /// The buckets that hold something: the longest time of each (ns) and how many.
    pub fn buckets(&self) -> impl Iterator<Item = (u64, u64)> + '_ {
        self.counts.iter_recorded().map(|step| (step.value_iterated_to(), step.count_at_value()))
    }

    /// The histogram itself, for writing it down.
    #[must_use]
    pub fn counts(&self) -> &Histogram<u64> {
        &self.counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_within_a_hundredth_and_the_largest_is_exact() {
        let lateness = Lateness::of((1..=20_000).map(|k| k * 1_000));
        let told = lateness.quantiles();
        for (found, expected) in [(told.p50_ns, 10_000_000), (told.p99_ns, 19_800_000), (told.p999_ns, 19_980_000)] {
            let found = found.expect("enough samples") as f64;
            assert!((found / f64::from(expected) - 1.0).abs() < 0.01, "{found} for {expected}");
        }
        assert_eq!((told.count, told.max_ns), (20_000, 20_000_000));
    }

    #[test]
    fn a_percentile_needs_ten_samples_beyond_it() {
        let of = |count: u64| Lateness::of(1..=count).quantiles();
        assert_eq!((of(19).p50_ns, of(999).p99_ns, of(9_999).p999_ns), (None, None, None));
        assert!(of(20).p50_ns.is_some() && of(1_000).p99_ns.is_some() && of(10_000).p999_ns.is_some());
        assert_eq!(Lateness::default().quantiles(), Quantiles::default());
    }

    #[test]
    fn what_is_beyond_all_bounds_counts_and_stays_the_largest() {
        let mut lateness = Lateness::of([0, 50]);
        lateness.record(u64::MAX);
        assert_eq!((lateness.count(), lateness.max_ns()), (3, u64::MAX));
        assert!((lateness.share_beyond(1_000_000) - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(Lateness::default().share_beyond(1), 0.0);
    }

    #[test]
    fn added_rounds_have_the_samples_of_both() {
        let mut both = Lateness::of([1_000_000; 30]);
        both.add(&Lateness::of([3_000_000; 10]));
        assert_eq!((both.count(), both.max_ns()), (40, 3_000_000));
        assert!((both.share_beyond(2_000_000) - 0.25).abs() < 1e-12);
        assert_eq!(both.buckets().map(|(_, count)| count).collect::<Vec<_>>(), [30, 10]);
    }
}
