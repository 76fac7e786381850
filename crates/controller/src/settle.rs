//! When the robot stands still enough to walk.

use serde::Deserialize;
use spatial::Vec3;

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
    /// Time constant of the first-order filter through which all of it is seen (s): sensors are noisy. 0: none.
    pub filter_s: f64,
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
            filter_s: 0.1,
            lead_ticks: 20,
        }
    }
}

/// What is measured at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stillness {
    /// Velocity of the base over the ankles (m/s); with two ankles, that of the faster one.
    pub base_velocity_m_per_s: Vec3,
    /// Angular velocity of the body (rad/s).
    pub base_rate_rad_per_s: Vec3,
    /// Measured vertical force of each foot (N).
    pub measured_n: [f64; 2],
    /// Its plan (N).
    pub planned_n: [f64; 2],
}

impl Stillness {
    /// First-order filter: `share` of the way from here to what is seen now. The plan is not filtered.
    fn towards(&self, seen: &Self, share: f64) -> Self {
        Self {
            base_velocity_m_per_s: self.base_velocity_m_per_s.lerp(&seen.base_velocity_m_per_s, share),
            base_rate_rad_per_s: self.base_rate_rad_per_s.lerp(&seen.base_rate_rad_per_s, share),
            measured_n: std::array::from_fn(|i| self.measured_n[i] + share * (seen.measured_n[i] - self.measured_n[i])),
            planned_n: seen.planned_n,
        }
    }
}

/// Watches for stillness that lasts.
#[derive(Debug, Clone)]
pub struct SettleDetector {
    settings: SettleSettings,
    filtered: Option<Stillness>,
    still_since: Option<i64>,
}

impl SettleDetector {
    /// Nothing seen yet.
    #[must_use]
    pub fn new(settings: SettleSettings) -> Self {
        Self { settings, filtered: None, still_since: None }
    }

    /// Tick of time zero, once the robot has been still for long enough at `tick` (control period in seconds). Numbers
    /// that are not finite must be kept out: they would stay in the filter.
    pub fn observe(&mut self, tick: i64, period_s: f64, seen: &Stillness) -> Option<i64> {
        let s = &self.settings;
        let share = period_s / (period_s + s.filter_s);
        let seen = self.filtered.map_or(*seen, |before| before.towards(seen, share));
        self.filtered = Some(seen);
        let forces_right = (0..2).all(|foot| {
            let (measured, planned) = (seen.measured_n[foot], seen.planned_n[foot]);
            (measured - planned).abs() <= s.force_error_max * planned.abs()
        });
        let still = seen.base_velocity_m_per_s.norm() <= s.base_speed_max_m_per_s
            && seen.base_rate_rad_per_s.norm() <= s.base_rate_max_deg_per_s.to_radians()
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
        base_velocity_m_per_s: Vec3::new(1e-4, 0.0, 0.0),
        base_rate_rad_per_s: Vec3::new(0.0, 1e-4, 0.0),
        measured_n: [190.0, 195.0],
        planned_n: [191.0, 191.0],
    };

    fn unfiltered() -> SettleDetector {
        SettleDetector::new(SettleSettings { filter_s: 0.0, ..SettleSettings::default() })
    }

    #[test]
    fn half_a_second_of_stillness_starts_the_walk_twenty_ticks_later() {
        let mut detector = SettleDetector::new(SettleSettings::default());
        let decided = (0..).find_map(|tick| detector.observe(tick, 0.005, &STILL).map(|zero| (tick, zero)));
        assert_eq!(decided, Some((100, 120)));
    }

    #[test]
    fn any_disturbance_starts_the_wait_anew() {
        let disturbances = [
            Stillness { base_velocity_m_per_s: Vec3::new(0.0, 2e-3, 0.0), ..STILL },
            Stillness { base_rate_rad_per_s: Vec3::new(0.0, 0.0, 0.01), ..STILL },
            Stillness { measured_n: [180.0, 202.0], ..STILL },
        ];
        for disturbance in disturbances {
            let mut detector = unfiltered();
            (0..100).for_each(|tick| assert_eq!(detector.observe(tick, 0.005, &STILL), None));
            assert_eq!(detector.observe(100, 0.005, &disturbance), None);
            assert_eq!(detector.observe(101, 0.005, &STILL), None);
            assert!(detector.observe(201, 0.005, &STILL).is_some());
        }
    }

    #[test]
    fn noise_of_a_real_gyro_does_not_keep_the_robot_standing() {
        // Alternating by 0.5 deg/s: each tick alone is above the limit of 0.2.
        let noisy = |tick: i64| Stillness {
            base_rate_rad_per_s: Vec3::new(if tick % 2 == 0 { 0.0087 } else { -0.0087 }, 0.0, 0.0),
            ..STILL
        };
        let started = |mut detector: SettleDetector| (0..400).any(|k| detector.observe(k, 0.005, &noisy(k)).is_some());
        assert!(!started(unfiltered()));
        assert!(started(SettleDetector::new(SettleSettings::default())));
    }
}
