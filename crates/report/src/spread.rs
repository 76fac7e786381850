//! How far something was from where it should be, over a walk.

use serde::{Deserialize, Serialize};

/// Root mean square and largest of some values that are not negative.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Spread {
    /// Number of values.
    pub count: u64,
    /// Sum of their squares.
    pub squares: f64,
    /// The largest.
    pub max: f64,
    /// Tick of the largest.
    pub max_tick: i64,
}

impl Spread {
    /// One more value.
    pub fn add(&mut self, tick: i64, value: f64) {
        self.count += 1;
        self.squares += value * value;
        if value > self.max {
            (self.max, self.max_tick) = (value, tick);
        }
    }

    /// Root mean square; `None` without values.
    #[must_use]
    pub fn rms(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / self.count as f64).sqrt())
    }

    /// Largest; `None` without values.
    #[must_use]
    pub fn largest(&self) -> Option<f64> {
        (self.count > 0).then_some(self.max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_three_and_four_the_mean_square_is_twelve_and_a_half() {
        let mut spread = Spread::default();
        assert_eq!((spread.rms(), spread.largest()), (None, None));
        spread.add(7, 4.0);
        spread.add(8, 3.0);
        assert_eq!((spread.rms(), spread.largest(), spread.max_tick), (Some(12.5_f64.sqrt()), Some(4.0), 7));
    }
}
