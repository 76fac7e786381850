//! When the robot stands still enough to walk.

use serde::Deserialize;

/// What counts as standing still.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SettleSettings {
    /// Speed of the base over the ankles below this (m/s).
    pub base_speed_max_m_per_s: f64,
    /// Angular velocity of the body below this (deg/s).
    pub base_rate_max_deg_per_s: f64,
    /// Each foot's vertical force within this fraction of its plan.
    pub force_error_max: f64,
    /// All of it for this long (s).
    pub duration_s: f64,
    /// Time between the decision and time zero (ticks).
    pub lead_ticks: u32,
}

impl Default for SettleSettings {
    fn default() -> Self {
        Self {
            base_speed_max_m_per_s: 1e-3,
            base_rate_max_deg_per_s: 0.2,
            force_error_max: 0.05,
            duration_s: 0.5,
            lead_ticks: 20,
        }
    }
}

/// What is measured at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stillness {
    /// Speed of the base over the ankles (m/s).
    pub base_speed_m_per_s: f64,
    /// Angular velocity of the body (rad/s).
    pub base_rate_rad_per_s: f64,
    /// Measured vertical force of each foot (N).
    pub measured_n: [f64; 2],
    /// Its plan (N).
    pub planned_n: [f64; 2],
}

/// Watches for stillness that lasts.
#[derive(Debug, Clone)]
pub struct SettleDetector {
    settings: SettleSettings,
    still_since: Option<i64>,
}

impl SettleDetector {
    /// Nothing seen yet.
    #[must_use]
    pub fn new(settings: SettleSettings) -> Self {
        Self { settings, still_since: None }
    }

    /// Tick of time zero, once the robot has been still for long enough at `tick` (control period in seconds).
    pub fn observe(&mut self, tick: i64, period_s: f64, seen: &Stillness) -> Option<i64> {
        let s = &self.settings;
        let forces_right = (0..2).all(|foot| {
            let (measured, planned) = (seen.measured_n[foot], seen.planned_n[foot]);
            (measured - planned).abs() <= s.force_error_max * planned.abs()
        });
        let still = seen.base_speed_m_per_s <= s.base_speed_max_m_per_s
            && seen.base_rate_rad_per_s <= s.base_rate_max_deg_per_s.to_radians()
            && forces_right;
        if !still {
            self.still_since = None;
            return None;
        }
        let since = *self.still_since.get_or_insert(tick);
        let lasted = (tick - since) as f64 * period_s >= s.duration_s;
        lasted.then(|| tick + i64::from(s.lead_ticks))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: Stillness = Stillness {
        base_speed_m_per_s: 1e-4,
        base_rate_rad_per_s: 1e-4,
        measured_n: [190.0, 195.0],
        planned_n: [191.0, 191.0],
    };

    #[test]
    fn half_a_second_of_stillness_starts_the_walk_twenty_ticks_later() {
        let mut detector = SettleDetector::new(SettleSettings::default());
        let decided = (0..).find_map(|tick| detector.observe(tick, 0.005, &STILL).map(|zero| (tick, zero)));
        assert_eq!(decided, Some((100, 120)));
    }

    #[test]
    fn any_disturbance_starts_the_wait_anew() {
        let disturbances = [
            Stillness { base_speed_m_per_s: 2e-3, ..STILL },
            Stillness { base_rate_rad_per_s: 0.01, ..STILL },
            Stillness { measured_n: [180.0, 202.0], ..STILL },
            Stillness { measured_n: [f64::NAN, 191.0], ..STILL },
        ];
        for disturbance in disturbances {
            let mut detector = SettleDetector::new(SettleSettings::default());
            (0..100).for_each(|tick| assert_eq!(detector.observe(tick, 0.005, &STILL), None));
            assert_eq!(detector.observe(100, 0.005, &disturbance), None);
            assert_eq!(detector.observe(101, 0.005, &STILL), None);
            assert!(detector.observe(201, 0.005, &STILL).is_some());
        }
    }
}
