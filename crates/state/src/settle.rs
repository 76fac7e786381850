//! When the robot stands still enough to walk.
//!
//! Speeds are slopes: straight lines of least squares through what was measured as *position* over the last
//! [`SettleSettings::window_s`], forces are their mean. So the noise of `N` samples counts as `sqrt(12/N)` of it over the window, and what
//! ruins a raw rate does not matter: the bias of a gyro and the noise of joint rates are not looked at. An orientation known to 1e-3 rad
//! gives the angular velocity to 5e-4 rad/s and, 0.7 m above the ankles, the base's speed to 4e-4 m/s over the window of 0.6 s. Of a rocking
//! at the 1.3 Hz of the robot on its soft soles the slope sees half; a longer window sees less of it and less of the noise.
//!
//! Forces count as *shares* of what both feet measure, which a sensor that is a few percent off hardly changes; their sum has to be about
//! the weight.

use ranges::{OutOfRange, Range};
use serde::Deserialize;
use spatial::{Mat3, Vec3, so3};
use std::collections::VecDeque;
use std::fmt;

/// What counts as standing still.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SettleSettings {
    /// Speed of the base over each ankle at most this (m/s).
    pub base_speed_max_m_per_s: f64,
    /// Angular velocity of the body at most this (deg/s).
    pub base_rate_max_deg_per_s: f64,
    /// Share of the load on each foot as planned, up to this.
    pub load_share_error_max: f64,
    /// Load on both feet as planned, up to this part of it.
    pub weight_error_max: f64,
    /// Time over which speeds and forces are found (s).
    pub window_s: f64,
    /// All of it for this long (s).
    pub duration_s: f64,
    /// Time after which the controller gives up and says what is in the way (s).
    pub time_max_s: f64,
    /// Time between the decision and time zero (ticks).
    pub lead_ticks: u32,
}

impl Default for SettleSettings {
    fn default() -> Self {
        Self {
            base_speed_max_m_per_s: 1e-3,
            base_rate_max_deg_per_s: 0.2,
            load_share_error_max: 0.025,
            weight_error_max: 0.2,
            window_s: 0.6,
            duration_s: 0.5,
            time_max_s: 10.0,
            lead_ticks: 20,
        }
    }
}

/// Longest window (s): its samples are kept.
const WINDOW_MAX_S: f64 = 10.0;
/// A day (s).
const TIME_MAX_S: f64 = 86_400.0;
/// From the decision to time zero (ticks), at most ten seconds. Who hears of the start at its own tick has already begun the next one.
const LEAD_TICKS: Range = Range::between(1.0, 2000.0);

impl SettleSettings {
    /// Can the robot ever stand so still, as it is seen at this control period (s)?
    ///
    /// # Errors
    /// The first setting that excludes it, by its key below `settle`.
    pub fn check(&self, period_s: f64) -> Result<(), OutOfRange> {
        for (key, found, most) in [
            ("settle.base_speed_max_m_per_s", self.base_speed_max_m_per_s, 10.0),
            ("settle.base_rate_max_deg_per_s", self.base_rate_max_deg_per_s, 360.0),
            ("settle.load_share_error_max", self.load_share_error_max, 1.0),
            ("settle.weight_error_max", self.weight_error_max, 1.0),
        ] {
            Range::above_zero_to(most).demand(key, found, "larger than the noise of the sensors over the window")?;
        }
        let window = Range::between(2.0 * period_s, WINDOW_MAX_S);
        window.demand("settle.window_s", self.window_s, "two control periods at least; 0.6 is usual")?;
        Range::between(0.0, TIME_MAX_S).demand("settle.duration_s", self.duration_s, "half a second is usual")?;
        let time = Range::between((self.window_s + self.duration_s).next_up(), 2.0 * TIME_MAX_S);
        time.demand("settle.time_max_s", self.time_max_s, "longer than window_s and duration_s together")?;
        LEAD_TICKS.demand("settle.lead_ticks", f64::from(self.lead_ticks), "20 is usual")
    }
}

/// What is measured at a tick of a standing robot. Numbers are finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stance {
    /// Orientation of the base `R_WB`.
    pub base_rotation: Mat3,
    /// Each ankle from the base, world axes (m).
    pub ankles_from_base_m: [Vec3; 2],
    /// Measured vertical force of each foot (N).
    pub measured_n: [f64; 2],
    /// Its plan (N).
    pub planned_n: [f64; 2],
}

/// What has to be small enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Criterion {
    /// Speed of the base over an ankle (m/s).
    BaseSpeed,
    /// Angular velocity of the body (deg/s).
    BaseRate,
    /// Share of the load on a foot less its plan.
    LoadShare,
    /// Load on both feet less its plan, a part of the plan.
    Weight,
}

impl Criterion {
    /// What it is, its unit, its limit's key in the configuration, and what to look at.
    fn words(self) -> [&'static str; 4] {
        match self {
            Self::BaseSpeed => [
                "speed of the base over an ankle",
                " m/s",
                "settle.base_speed_max_m_per_s",
                "the robot moves, or encoders and orientation are noisy (a longer settle.window_s helps)",
            ],
            Self::BaseRate => [
                "angular velocity of the body",
                " deg/s",
                "settle.base_rate_max_deg_per_s",
                "the robot rocks, or its orientation is noisy (a longer settle.window_s helps)",
            ],
            Self::LoadShare => [
                "error of a foot's share of the load",
                "",
                "settle.load_share_error_max",
                "the robot leans, or a foot's force sensor is off",
            ],
            Self::Weight => [
                "error of the load on both feet, a part of the weight,",
                "",
                "settle.weight_error_max",
                "the robot hangs, or is heavier or lighter than planned, or its force sensors are off",
            ],
        }
    }
}

/// A criterion that is not met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unmet {
    /// Which.
    pub criterion: Criterion,
    /// What was measured.
    pub measured: f64,
    /// What is allowed.
    pub limit: f64,
}

impl fmt::Display for Unmet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [what, unit, key, look] = self.criterion.words();
        write!(f, "the {what} is {:.3e}{unit}, {key} allows {:.3e}{unit}: {look}", self.measured, self.limit)
    }
}

/// The robot did not come to stand still.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("not still for {duration_s} s within {time_max_s} s; {}", why(.unmet))]
pub struct NotSettled {
    /// How long it should have stood still (s).
    pub duration_s: f64,
    /// In which time (s).
    pub time_max_s: f64,
    /// What was in the way last; `None`: too little was measured to say.
    pub unmet: Option<Unmet>,
}

fn why(unmet: &Option<Unmet>) -> String {
    unmet.map_or_else(
        || "nothing could be measured last: the posture was held (the log says why), or states were missing, not finite or without orientation".to_string(),
        |unmet| unmet.to_string(),
    )
}

/// Watches for stillness that lasts.
#[derive(Debug, Clone)]
pub struct SettleDetector {
    settings: SettleSettings,
    period_s: f64,
    first_rotation: Option<Mat3>,
    /// The window: numbers whose slope counts (ankles from the base, turn of the base), and the measured forces.
    positions: VecDeque<([Vec3; 3], [f64; 2])>,
    positions_max: usize,
    first_tick: Option<i64>,
    last_tick: i64,
    still_since: Option<i64>,
    unmet: Option<Unmet>,
}

impl SettleDetector {
    /// Nothing seen yet.
    #[must_use]
    pub fn new(settings: SettleSettings, period_s: f64) -> Self {
        let positions_max = ((settings.window_s / period_s).round() as usize).max(2);
        Self {
            settings,
            period_s,
            first_rotation: None,
            positions: VecDeque::with_capacity(positions_max + 1),
            positions_max,
            first_tick: None,
            last_tick: 0,
            still_since: None,
            unmet: None,
        }
    }

    /// Takes what is measured at a tick, if anything could be. Tick of time zero, once the robot has been still for long enough.
    ///
    /// # Errors
    /// [`NotSettled`] when it takes too long.
    pub fn observe(&mut self, tick: i64, seen: Option<&Stance>) -> Result<Option<i64>, NotSettled> {
        let s = self.settings;
        let first_tick = *self.first_tick.get_or_insert(tick);
        if seen.is_none() {
            self.unmet = None;
        }
        let zero = seen.and_then(|seen| self.take(tick, seen));
        let waited_s = (tick - first_tick) as f64 * self.period_s;
        if zero.is_none() && waited_s >= s.time_max_s {
            return Err(NotSettled { duration_s: s.duration_s, time_max_s: s.time_max_s, unmet: self.unmet });
        }
        Ok(zero)
    }

    fn take(&mut self, tick: i64, seen: &Stance) -> Option<i64> {
        if tick != self.last_tick + 1 {
            self.positions.clear();
            self.still_since = None;
        }
        self.last_tick = tick;
        let first = self.first_rotation.get_or_insert(seen.base_rotation);
        let turn = so3::log(&(seen.base_rotation * first.transpose()));
        let [left, right] = seen.ankles_from_base_m;
        self.positions.push_back(([left, right, turn], seen.measured_n));
        if self.positions.len() <= self.positions_max {
            return None;
        }
        self.positions.pop_front();
        if let Some(unmet) = self.worst_unmet(seen.planned_n) {
            self.unmet = Some(unmet);
            self.still_since = None;
            return None;
        }
        let since = *self.still_since.get_or_insert(tick);
        let lasted_s = (tick - since) as f64 * self.period_s;
        (lasted_s >= self.settings.duration_s).then(|| tick + i64::from(self.settings.lead_ticks))
    }

    /// Of the criteria that are not met the one that is farthest off.
    fn worst_unmet(&self, planned_n: [f64; 2]) -> Option<Unmet> {
        let s = &self.settings;
        let [left, right, turn] = self.slopes_per_s();
        let measured_n = self.mean_forces_n();
        let (measured_sum, planned_sum) = (measured_n[0] + measured_n[1], planned_n[0] + planned_n[1]);
        // A robot that hangs has no shares: its weight is what is wrong then.
        let share_error =
            if measured_sum > 0.0 { (measured_n[0] / measured_sum - planned_n[0] / planned_sum).abs() } else { 0.0 };
        [
            (Criterion::BaseSpeed, left.norm().max(right.norm()), s.base_speed_max_m_per_s),
            (Criterion::BaseRate, turn.norm().to_degrees(), s.base_rate_max_deg_per_s),
            (Criterion::LoadShare, share_error, s.load_share_error_max),
            (Criterion::Weight, (measured_sum / planned_sum - 1.0).abs(), s.weight_error_max),
        ]
        .into_iter()
        // What is not a number is not met either.
        .filter(|(_, measured, limit)| measured.is_nan() || measured > limit)
        .max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2)))
        .map(|(criterion, measured, limit)| Unmet { criterion, measured, limit })
    }

    /// Slopes of least squares over the window.
    fn slopes_per_s(&self) -> [Vec3; 3] {
        let middle = 0.5 * (self.positions.len() - 1) as f64;
        let (mut moment, mut spread) = ([Vec3::zeros(); 3], 0.0);
        for (k, (positions, _)) in self.positions.iter().enumerate() {
            let t_s = (k as f64 - middle) * self.period_s;
            spread += t_s * t_s;
            for (moment, position) in moment.iter_mut().zip(positions) {
                *moment += t_s * position;
            }
        }
        moment.map(|moment| moment / spread)
    }

    fn mean_forces_n(&self) -> [f64; 2] {
        let sum = |foot: usize| self.positions.iter().map(|(_, forces)| forces[foot]).sum::<f64>();
        [0, 1].map(|foot| sum(foot) / self.positions.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.005;

    fn detector() -> SettleDetector {
        SettleDetector::new(SettleSettings::default(), PERIOD_S)
    }

    fn still() -> Stance {
        Stance {
            base_rotation: so3::about_z(2.0),
            ankles_from_base_m: [Vec3::new(0.0, 0.08, -0.7), Vec3::new(0.0, -0.08, -0.7)],
            measured_n: [190.0, 195.0],
            planned_n: [191.0, 191.0],
        }
    }

    /// Runs until a decision.
    fn decide(mut seen: impl FnMut(i64) -> Option<Stance>) -> Result<(i64, i64), NotSettled> {
        let mut detector = detector();
        for tick in 0.. {
            if let Some(zero) = detector.observe(tick, seen(tick).as_ref())? {
                return Ok((tick, zero));
            }
        }
        unreachable!("it gives up after ten seconds")
    }

    #[test]
    fn half_a_second_of_stillness_after_a_window_starts_the_walk_twenty_ticks_later() {
        assert_eq!(decide(|_| Some(still())), Ok((220, 240)));
    }

    #[test]
    fn whatever_is_in_the_way_is_told_with_value_and_limit() {
        let moving = |speed: f64| {
            move |tick: i64| {
                let mut seen = still();
                seen.ankles_from_base_m[1].x += speed * tick as f64 * PERIOD_S;
                Some(seen)
            }
        };
        let turning = |rate: f64| {
            move |tick: i64| {
                Some(Stance {
                    base_rotation: so3::about_x(rate * tick as f64 * PERIOD_S) * still().base_rotation,
                    ..still()
                })
            }
        };
        let loaded = |measured_n| move |_| Some(Stance { measured_n, ..still() });
        let unmet = |decided: Result<(i64, i64), NotSettled>| {
            let unmet = decided.expect_err("it is not still").unmet.expect("something was measured");
            assert!(unmet.to_string().contains("settle."), "{unmet}");
            (unmet.criterion, unmet.measured)
        };
        let near = |found: (Criterion, f64), criterion, measured: f64| {
            assert_eq!(found.0, criterion);
            assert!((found.1 / measured - 1.0).abs() < 1e-6, "{found:?}");
        };
        near(unmet(decide(moving(2e-3))), Criterion::BaseSpeed, 2e-3);
        near(unmet(decide(turning(0.5_f64.to_radians()))), Criterion::BaseRate, 0.5);
        near(unmet(decide(loaded([180.0, 202.0]))), Criterion::LoadShare, 11.0 / 382.0);
        near(unmet(decide(loaded([100.0, 100.0]))), Criterion::Weight, 1.0 - 200.0 / 382.0);
        near(unmet(decide(loaded([0.0, 0.0]))), Criterion::Weight, 1.0);
        for less in [decide(moving(0.9e-3)), decide(turning(0.19_f64.to_radians())), decide(loaded([183.0, 200.0]))] {
            less.expect("still enough");
        }
        let blind = decide(|_| None).expect_err("nothing is seen");
        assert_eq!(blind.unmet, None);
        assert!(blind.to_string().contains("missing, not finite"), "{blind}");
    }

    #[test]
    fn any_disturbance_and_any_gap_starts_the_wait_anew() {
        let jump = |tick: i64| {
            let mut seen = still();
            seen.ankles_from_base_m[0].y += if tick >= 200 { 0.01 } else { 0.0 };
            Some(seen)
        };
        // A jump is in the window for 120 ticks; what it leaves at the ends of the window is below the limit.
        let (decided, _) = decide(jump).expect("it comes to rest");
        assert!((410..=420).contains(&decided), "{decided}");
        let gap = |tick: i64| (tick != 200).then(still);
        assert_eq!(decide(gap), Ok((200 + 1 + 220, 200 + 1 + 240)));
    }

    #[test]
    fn a_bias_of_a_foots_force_and_noise_of_a_real_orientation_do_not_keep_the_robot_standing() {
        decide(|_| Some(Stance { measured_n: [206.0, 191.0], ..still() }))
            .expect("8 % on one foot are 2 % of the load");
        // Uniform on +-sqrt(3) times the deviation of 1e-3 rad.
        let mut seed = 1_u64;
        let mut uniform = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            3.0_f64.sqrt() * (2.0 * ((seed >> 11) as f64 / (1_u64 << 53) as f64) - 1.0)
        };
        decide(|_| {
            let noise = so3::exp(&(1e-3 * Vec3::new(uniform(), uniform(), uniform())));
            let stance = still();
            Some(Stance {
                base_rotation: noise * stance.base_rotation,
                ankles_from_base_m: stance.ankles_from_base_m.map(|ankle| noise * ankle),
                ..stance
            })
        })
        .expect("it stands");
    }
}
