//! The times at which a page has values.

use super::PageSettings;
use super::walk::Walk;
use messages::CONTROL_PERIOD_S;

/// Samples that a curve has at most.
const SAMPLES_MAX: usize = 12_000;
/// Ticks from one picture of the replay to the next: 50 Hz.
const REPLAY_TICKS: usize = 4;

/// A window of walk time in control ticks: the same for all runs, whatever their time zero.
pub(super) struct Grid {
    /// First tick, in walk time.
    first: i64,
    ticks: usize,
    /// Ticks that share two samples; 1: each has its own.
    bucket: usize,
}

impl Grid {
    /// Over all walks, or the part that is asked for; `None` if nothing is in it.
    pub fn over(walks: &[Walk], settings: &PageSettings) -> Option<Self> {
        let start = walks.iter().map(|walk| -walk.tick_zero).min()?;
        let end = walks.iter().map(|walk| walk.ticks as i64 - walk.tick_zero).max()?;
        let tick = |time_s: f64| (time_s / CONTROL_PERIOD_S).round() as i64;
        let first = settings.from_s.map_or(start, |from_s| tick(from_s).max(start));
        let last = settings.to_s.map_or(end, |to_s| tick(to_s).saturating_add(1).min(end));
        let ticks = usize::try_from(last - first).ok().filter(|ticks| *ticks > 0)?;
        let bucket = if ticks <= SAMPLES_MAX { 1 } else { (2 * ticks).div_ceil(SAMPLES_MAX) };
        Some(Self { first, ticks, bucket })
    }

    pub fn from_s(&self) -> f64 {
        self.first as f64 * CONTROL_PERIOD_S
    }

    pub fn step_s(&self) -> f64 {
        if self.bucket == 1 { CONTROL_PERIOD_S } else { 0.5 * self.bucket as f64 * CONTROL_PERIOD_S }
    }

    pub fn count(&self) -> usize {
        if self.bucket == 1 { self.ticks } else { 2 * self.ticks.div_ceil(self.bucket) }
    }

    pub fn holds(&self, time_s: f64) -> bool {
        let tick = time_s / CONTROL_PERIOD_S - self.first as f64;
        tick > -1.0 && tick < self.ticks as f64 + 1.0
    }

    /// Time at which the replay begins: the first step is on its way.
    pub fn shown_first_s(&self) -> f64 {
        (self.from_s() + 0.4 * self.ticks as f64 * CONTROL_PERIOD_S).max(self.from_s())
    }

    fn at(&self, values: &[f64], tick_zero: i64, tick: usize) -> f64 {
        let index = usize::try_from(self.first + tick as i64 + tick_zero);
        index.ok().and_then(|index| values.get(index)).copied().unwrap_or(f64::NAN)
    }

    /// A sample per tick, or the smallest and the largest of each bucket in the order in which they come: no peak is lost.
    pub fn extremes(&self, values: &[f64], tick_zero: i64) -> Vec<f64> {
        if self.bucket == 1 {
            return (0..self.ticks).map(|tick| self.at(values, tick_zero, tick)).collect();
        }
        let mut out = Vec::with_capacity(self.count());
        for start in (0..self.ticks).step_by(self.bucket) {
            let bucket = (start..(start + self.bucket).min(self.ticks)).map(|tick| self.at(values, tick_zero, tick));
            let bucket: Vec<f64> = bucket.filter(|value| value.is_finite()).collect();
            let places = bucket.iter().enumerate();
            let low = places.clone().min_by(|a, b| a.1.total_cmp(b.1));
            let high = places.max_by(|a, b| a.1.total_cmp(b.1));
            match (low, high) {
                (Some((i, low)), Some((j, high))) if i <= j => out.extend([*low, *high]),
                (Some((_, low)), Some((_, high))) => out.extend([*high, *low]),
                _ => out.extend([f64::NAN; 2]),
            }
        }
        out
    }

    /// The first value of each bucket, for what has no size: the index of a joint.
    pub fn firsts(&self, values: &[f64], tick_zero: i64) -> Vec<f64> {
        if self.bucket == 1 {
            return self.extremes(values, tick_zero);
        }
        (0..self.ticks).step_by(self.bucket).flat_map(|tick| [self.at(values, tick_zero, tick); 2]).collect()
    }

    /// Ticks of the replay's pictures: 50 Hz, 25 Hz in a long walk.
    fn stride(&self) -> usize {
        if self.bucket == 1 { REPLAY_TICKS } else { 2 * REPLAY_TICKS }
    }

    pub fn replay_step_s(&self) -> f64 {
        self.stride() as f64 * CONTROL_PERIOD_S
    }

    pub fn pictures(&self, values: &[f64], tick_zero: i64) -> Vec<f64> {
        (0..self.ticks).step_by(self.stride()).map(|tick| self.at(values, tick_zero, tick)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_and_gaps_of_long_walks_are_kept() {
        let grid = Grid { first: -2, ticks: 9, bucket: 4 };
        // Tick 2 of the recording is time zero: the window begins with its first value.
        let values = [0.0, 7.0, -3.0, 1.0, f64::NAN, f64::NAN, f64::NAN, f64::NAN, 5.0];
        let found = grid.extremes(&values, 2);
        assert_eq!((found.len(), grid.count(), grid.step_s()), (6, 6, 0.01));
        assert_eq!(found[..2], [7.0, -3.0]);
        assert!(found[2].is_nan() && found[3].is_nan());
        assert_eq!(found[4..], [5.0, 5.0]);
        assert_eq!(grid.firsts(&values, 2)[..2], [0.0, 0.0]);
    }

    #[test]
    fn short_walks_have_every_tick_and_what_is_before_them_is_a_gap() {
        let grid = Grid { first: -3, ticks: 4, bucket: 1 };
        let found = grid.extremes(&[1.0, 2.0], 2);
        assert!(found[0].is_nan() && found[3].is_nan());
        assert_eq!(found[1..3], [1.0, 2.0]);
    }
}
