//! The ranges of the settings, checked before anything is built from them.
//!
//! They are wide: toys and giants, on small moons and large planets. Within them every number that the planner computes is
//! finite, and time and memory are bounded; whether there is a walk is the solver's answer.

use crate::{GaitError, GaitSettings, Walk};
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// Polynomials of one walk: 3300 swings. Time and memory grow with them in proportion (3 s, 0.3 GB with 11 samples each).
pub const PHASES_MAX: usize = 10_000;
/// Polynomials times samples: a thousand swings with 41 samples are a quarter of it. At this limit 4 s, 0.7 GB.
pub const SAMPLES_MAX: usize = 500_000;
/// Longest walk (s): a day.
const WALK_MAX_S: f64 = 86_400.0;
/// Farthest coordinate (m): 90 km, where the coordinates of a foot are rounded to 1e-11 m. Soft soles are computed up to 100 km: that
/// leaves the way walked from here.
const FAR_M: f64 = 9e4;
/// Largest heading (rad): the planner counts turns, but a heading must keep its digits.
const HEADING_MAX_RAD: f64 = 1e3;

/// `value` lies in `range`; so a NaN does not.
fn within(field: &'static str, value: f64, range: RangeInclusive<f64>, remedy: &'static str) -> Result<(), GaitError> {
    if range.contains(&value) { Ok(()) } else { Err(GaitError::Setting { field, value, remedy }) }
}

impl GaitSettings {
    /// Every number lies in its range, and the walk is not too large.
    ///
    /// # Errors
    /// The first field that does not, with its value and what to do.
    pub fn validate(&self) -> Result<(), GaitError> {
        self.validate_body()?;
        self.validate_timing()?;
        within("cost.lambda", self.cost.lambda, 0.0..=1.0, "lambda lies between 0 and 1")?;
        within("cost.mu", self.cost.mu, 0.0..=1e6, "give 0 to 1e6, usual are 0 to 100")?;
        self.validate_limits()?;
        within("swing.apex_m", self.swing.apex_m, 0.0..=2.0, "give 0 m to 2 m")?;
        self.validate_numerics()?;
        self.validate_walk()?;
        self.validate_size()
    }

    /// Polynomial pieces of the walk: the paper's m = 3 n + 4 with n = N - 1 double supports, or 5 for N = 1, if a single support
    /// has two polynomials.
    #[must_use]
    pub fn phases(&self) -> usize {
        let swings = self.swings();
        let inner = swings.saturating_sub(2).saturating_mul(self.discretisation.single_support_polynomials as usize);
        // Start and stop, the first and the last single support, the double supports.
        inner.saturating_add(4 + swings.min(2)).saturating_add(swings.saturating_sub(1))
    }

    fn swings(&self) -> usize {
        match &self.walk {
            Walk::Straight { swings, .. }
            | Walk::Sideways { swings, .. }
            | Walk::Circle { swings, .. }
            | Walk::InPlace { swings, .. }
            | Walk::Free { swings, .. } => *swings as usize,
            Walk::Path { landings } => landings.len(),
        }
    }

    fn validate_body(&self) -> Result<(), GaitError> {
        let (body, sole, start) = (&self.body, &self.sole, &self.start);
        within("body.mass_kg", body.mass_kg, 0.1..=1e4, "masses may lie between 0.1 kg and 10 t")?;
        let gravity = body.gravity_m_per_s2;
        within("body.gravity_m_per_s2", gravity, 0.1..=100.0, "gravity may lie between 0.1 and 100 m/s^2")?;
        let height = body.com_height_m;
        within("body.com_height_m", height, 0.1..=10.0, "heights may lie between 0.1 m and 10 m")?;
        let ankle = body.ankle_height_m;
        within("body.ankle_height_m", ankle, 0.0..=height, "the ankle lies between the ground and the COM")?;
        within("sole.length_m", sole.length_m, 0.01..=2.0, "soles measure 0.01 m to 2 m")?;
        within("sole.width_m", sole.width_m, 0.01..=2.0, "soles measure 0.01 m to 2 m")?;
        let [ankle_x, ankle_y] = sole.left_ankle_in_sole_m;
        let over = |side: f64| -side / 2.0..=side / 2.0;
        let inside = "the ankle must stand over the sole";
        within("sole.left_ankle_in_sole_m[0]", ankle_x, over(sole.length_m), inside)?;
        within("sole.left_ankle_in_sole_m[1]", ankle_y, over(sole.width_m), inside)?;
        let near = "give at most 90 km";
        within("start.x_m", start.x_m, -FAR_M..=FAR_M, near)?;
        within("start.y_m", start.y_m, -FAR_M..=FAR_M, near)?;
        within("start.yaw_rad", start.yaw_rad, -HEADING_MAX_RAD..=HEADING_MAX_RAD, "give at most 1000 rad")?;
        within("start.ankle_distance_m", start.ankle_distance_m, 0.001..=5.0, "ankles are 0.001 m to 5 m apart")
    }

    fn validate_timing(&self) -> Result<(), GaitError> {
        let duration =
            |field, value: f64| within(field, value, 0.05..=60.0, "durations may lie between 0.05 s and 60 s");
        let timing = &self.timing;
        duration("timing.start_s", timing.start_s)?;
        duration("timing.single_support_s", timing.single_support_s)?;
        duration("timing.double_support_s", timing.double_support_s)?;
        duration("timing.stop_s", timing.stop_s)?;
        timing.single_support_each_s.iter().try_for_each(|s| duration("timing.single_support_each_s", *s))?;
        timing.double_support_each_s.iter().try_for_each(|s| duration("timing.double_support_each_s", *s))
    }

    fn validate_limits(&self) -> Result<(), GaitError> {
        let (sole, limits) = (&self.sole, &self.limits);
        let half = sole.length_m.min(sole.width_m) / 2.0;
        within("limits.zmp_margin_m", limits.zmp_margin_m, 0.0..=2.0, "give zero or a positive number")?;
        if limits.zmp_margin_m >= half {
            return Err(GaitError::EmptyPolygon { margin_m: limits.zmp_margin_m, half_size_m: half });
        }
        // Start and stop hold each foot's ZMP under its ankle.
        let [ankle_x, ankle_y] = sole.left_ankle_in_sole_m;
        let room = (sole.length_m / 2.0 - ankle_x.abs()).min(sole.width_m / 2.0 - ankle_y.abs());
        if limits.zmp_margin_m > room {
            return Err(GaitError::AnkleOutsidePolygon { margin_m: limits.zmp_margin_m, room_m: room });
        }
        within("limits.feet_gap_min_m", limits.feet_gap_min_m, -1.0..=1.0, "give -1 m to 1 m")?;
        within("limits.step_length_max_m", limits.step_length_max_m, 0.001..=10.0, "give 0.001 m to 10 m")?;
        within("limits.step_width_max_m", limits.step_width_max_m, 0.001..=10.0, "give 0.001 m to 10 m")
    }

    fn validate_numerics(&self) -> Result<(), GaitError> {
        let d = &self.discretisation;
        let samples = f64::from(d.samples_per_polynomial);
        within("discretisation.samples_per_polynomial", samples, 3.0..=1000.0, "give 3 to 1000")?;
        let nodes = f64::from(d.quadrature_nodes);
        within("discretisation.quadrature_nodes", nodes, 6.0..=64.0, "give 6 to 64")?;
        let pieces = f64::from(d.single_support_polynomials);
        within("discretisation.single_support_polynomials", pieces, 1.0..=20.0, "give 1 to 20")?;
        within("solver.tolerance", self.solver.tolerance, 1e-13..=1e-3, "give 1e-13 to 1e-3")?;
        within("solver.iterations_max", f64::from(self.solver.iterations_max), 1.0..=10_000.0, "give 1 to 10000")
    }

    fn validate_walk(&self) -> Result<(), GaitError> {
        let step = |field, value: f64| within(field, value, -10.0..=10.0, "steps may measure up to 10 m");
        let coordinate = |field, value: f64| within(field, value, -FAR_M..=FAR_M, "give at most 90 km");
        match &self.walk {
            Walk::Straight { step_length_m, .. } => step("walk.step_length_m", *step_length_m)?,
            Walk::Sideways { step_width_m, .. } => step("walk.step_width_m", *step_width_m)?,
            Walk::Circle { step_length_m, radius_m, .. } => {
                step("walk.step_length_m", *step_length_m)?;
                let remedy = "give 0.01 m to 90 km, or its negative; for a turn on the spot use kind = \"in_place\"";
                within("walk.radius_m", radius_m.abs(), 0.01..=FAR_M, remedy)?;
            }
            Walk::InPlace { turn_per_swing_rad, .. } => {
                within("walk.turn_per_swing_rad", *turn_per_swing_rad, -PI..=PI, "turn by at most pi at a time")?;
            }
            Walk::Free { swings, distance_m } => {
                coordinate("walk.distance_m", *distance_m)?;
                if *swings == 1 && *distance_m != 0.0 {
                    let remedy = "one swing only closes the feet: a free walk over a distance takes at least 2";
                    return Err(GaitError::Setting { field: "walk.swings", value: 1.0, remedy });
                }
            }
            Walk::Path { landings } => {
                for landing in landings {
                    coordinate("walk.landings.x_m", landing.x_m)?;
                    coordinate("walk.landings.y_m", landing.y_m)?;
                    let heading = -HEADING_MAX_RAD..=HEADING_MAX_RAD;
                    within("walk.landings.yaw_rad", landing.yaw_rad, heading, "give at most 1000 rad")?;
                }
            }
        }
        let swings = self.swings();
        within("walk.swings", swings as f64, 1.0..=f64::INFINITY, "a walk has at least one swing")?;
        let (single, double) = (&self.timing.single_support_each_s, &self.timing.double_support_each_s);
        for (field, found, expected) in [
            ("timing.single_support_each_s", single.len(), swings),
            ("timing.double_support_each_s", double.len(), swings - 1),
        ] {
            if found != 0 && found != expected {
                return Err(GaitError::Durations { field, found, expected });
            }
        }
        Ok(())
    }

    /// By count and by time, before anything is built.
    fn validate_size(&self) -> Result<(), GaitError> {
        let (phases, samples) = (self.phases(), self.discretisation.samples_per_polynomial);
        if phases > PHASES_MAX || phases.saturating_mul(samples as usize) > SAMPLES_MAX {
            return Err(GaitError::TooLarge { phases, samples });
        }
        let timing = &self.timing;
        let total = |each: &[f64], count: usize, all: f64| {
            if each.is_empty() { all * count as f64 } else { each.iter().sum::<f64>() }
        };
        let swings = self.swings();
        let walk_s = timing.start_s
            + total(&timing.single_support_each_s, swings, timing.single_support_s)
            + total(&timing.double_support_each_s, swings - 1, timing.double_support_s)
            + timing.stop_s;
        within("timing (sum of all)", walk_s, 0.0..=WALK_MAX_S, "a walk lasts at most a day: plan it in parts")
    }
}
