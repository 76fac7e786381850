//! A curve through samples: value, rate and acceleration anywhere.

use nalgebra::{Matrix4, Vector4};

/// Equidistant samples of a quantity, held at both ends.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    /// The values, the first at time zero.
    pub values: &'a [f64],
    /// Time from one to the next (s).
    pub period_s: f64,
}

/// Shortest half width of a window, in periods, that holds the five samples that a cubic takes, wherever it lies.
pub const HALF_WIDTH_MIN_PERIODS: f64 = 2.5;

/// Value, rate and acceleration at `t_s` of the cubic that fits the samples within `half_width_s` best: what lasts longer than the window is
/// kept, what is shorter is gone.
///
/// # Panics
/// If there are no samples, or the window holds fewer than five: below [`HALF_WIDTH_MIN_PERIODS`].
#[must_use]
pub fn local_cubic(samples: &Samples, t_s: f64, half_width_s: f64) -> [f64; 3] {
    let Samples { values, period_s } = *samples;
    let last = values.len() as i64 - 1;
    // Rounding must not decide whether a sample at the window's edge is in it.
    let reach = |t: f64| t / period_s;
    let first = (reach(t_s - half_width_s) - 1e-9).ceil() as i64;
    let end = (reach(t_s + half_width_s) + 1e-9).floor() as i64;
    assert!(end - first >= 4, "a cubic takes more samples than {}", end - first + 1);
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for k in first..=end {
        // In units of the window, so that the powers are of one size.
        let x = (k as f64 * period_s - t_s) / half_width_s;
        let row = Vector4::new(1.0, x, x * x, x * x * x);
        normal += row * row.transpose();
        right += row * values[k.clamp(0, last) as usize];
    }
    let fit = normal.cholesky().expect("five different times determine a cubic").solve(&right);
    [fit[0], fit[1] / half_width_s, 2.0 * fit[2] / (half_width_s * half_width_s)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_found_between_its_samples() {
        let (period_s, cubic) = (0.005, |t: f64| 0.3 - 2.0 * t + 5.0 * t * t - 7.0 * t * t * t);
        let values: Vec<f64> = (0..200).map(|k| cubic(f64::from(k) * period_s)).collect();
        for t in [0.1, 0.2017, 0.7] {
            let [value, rate, acceleration] = local_cubic(&Samples { values: &values, period_s }, t, 0.04);
            assert!((value - cubic(t)).abs() < 1e-12);
            assert!((rate - (-2.0 + 10.0 * t - 21.0 * t * t)).abs() < 1e-10);
            assert!((acceleration - (10.0 - 42.0 * t)).abs() < 1e-8);
        }
    }

    #[test]
    fn the_shortest_window_makes_a_cubic_wherever_it_lies() {
        let values: Vec<f64> = (0..40).map(f64::from).collect();
        let samples = Samples { values: &values, period_s: 0.005 };
        for k in 0..1000 {
            let t_s = 0.05 + 1e-4 * f64::from(k) / 7.0;
            let [value, rate, _] = local_cubic(&samples, t_s, HALF_WIDTH_MIN_PERIODS * samples.period_s);
            assert!((value - t_s / 0.005).abs() < 1e-9 && (rate - 200.0).abs() < 1e-6, "{t_s}: {value} {rate}");
        }
    }

    #[test]
    fn what_is_shorter_than_the_window_is_gone() {
        let values: Vec<f64> = (0..200).map(|k| if k == 100 { 0.1 } else { 0.0 }).collect();
        let [value, ..] = local_cubic(&Samples { values: &values, period_s: 0.005 }, 0.5, 0.04);
        assert!(value.abs() < 0.014, "one sample of seventeen: {value}");
    }
}
