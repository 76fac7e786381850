//! Quintic polynomials.

use serde::{Deserialize, Serialize};

/// `sum a_i t^i`, i = 0..5, in powers of the local time (s).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Quintic(pub [f64; 6]);

impl Quintic {
    /// The same value at all times.
    #[must_use]
    pub fn constant(value: f64) -> Self {
        Self([value, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    /// The quintic with these values, first and second derivatives at 0 and at `duration_s`.
    #[must_use]
    pub fn hermite(duration_s: f64, start: [f64; 3], end: [f64; 3]) -> Self {
        let T = duration_s;
        // In the normalised time s = t/T, with derivatives scaled accordingly.
        let (p0, v0, h0) = (start[0], start[1] * T, start[2] * T * T / 2.0);
        let (v1, a1) = (end[1] * T, end[2] * T * T);
        // What remains to be gained after the parabola of the start.
        let p = end[0] - p0 - v0 - h0;
        let v = v1 - v0 - 2.0 * h0;
        let a = a1 - 2.0 * h0;
        let s = [p0, v0, h0, 10.0 * p - 4.0 * v + a / 2.0, -15.0 * p + 7.0 * v - a, 6.0 * p - 3.0 * v + a / 2.0];
        let mut power = 1.0;
        Self(s.map(|coefficient| {
            let scaled = coefficient / power;
            power *= T;
            scaled
        }))
    }

    /// Value and the first `N - 1` derivatives at local time `t` (s).
    #[must_use]
    pub fn derivatives<const N: usize>(&self, t: f64) -> [f64; N] {
        let mut coefficients = self.0;
        let mut out = [0.0; N];
        for (order, value) in out.iter_mut().enumerate().take(6) {
            *value = coefficients[..6 - order].iter().rev().fold(0.0, |sum, a| sum * t + a);
            for i in 1..6 - order {
                coefficients[i - 1] = i as f64 * coefficients[i];
            }
        }
        out
    }

    /// Divided by `t^3`, for a quintic whose first three coefficients vanish.
    #[must_use]
    pub fn divided_by_cube(&self) -> Self {
        debug_assert!(self.0[..3].iter().all(|a| *a == 0.0), "t^3 is no factor of {self:?}");
        Self([self.0[3], self.0[4], self.0[5], 0.0, 0.0, 0.0])
    }

    /// Coefficient by coefficient.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - other.0[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hermite_meets_its_six_conditions_on_short_and_long_phases() {
        let (start, end) = ([0.3, -0.2, 1.5], [-0.4, 0.7, -2.0]);
        for duration in [0.05, 0.4, 1.0, 20.0] {
            let quintic = Quintic::hermite(duration, start, end);
            for (t, wanted) in [(0.0, start), (duration, end)] {
                let got = quintic.derivatives::<3>(t);
                for order in 0..3 {
                    // Rounding is relative to what cancels: the parabola of the start, differentiated.
                    let scale = (1.0 + duration + duration * duration) / duration.powi(order as i32);
                    assert!((got[order] - wanted[order]).abs() < 1e-13 * scale, "{duration} {t} {order}");
                }
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_powers() {
        let quintic = Quintic([1.0, -2.0, 0.5, 3.0, -1.0, 0.25]);
        let t: f64 = 0.7;
        let d = quintic.derivatives::<7>(t);
        let value = 1.0 - 2.0 * t + 0.5 * t.powi(2) + 3.0 * t.powi(3) - t.powi(4) + 0.25 * t.powi(5);
        let snap = -24.0 + 0.25 * 120.0 * t;
        assert!((d[0] - value).abs() < 1e-14);
        assert!((d[3] - (18.0 - 24.0 * t + 15.0 * t * t)).abs() < 1e-13);
        assert!((d[4] - snap).abs() < 1e-13);
        assert_eq!((d[5], d[6]), (30.0, 0.0));
    }
}
