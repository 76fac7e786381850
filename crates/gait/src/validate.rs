//! The ranges of the settings, checked before anything is built from them.
//!
//! They are wide: toys and giants, on small moons and large planets. Within them every number that the planner computes is
//! finite, and time and memory are bounded; whether there is a walk is the solver's answer.

use crate::error::{GaitError, PHASES_MAX, SAMPLES_MAX};
use crate::{GaitSettings, Walk};
use ranges::{OutOfRange, Range};
use std::f64::consts::PI;

/// Longest walk (s): a day.
const WALK_MAX_S: f64 = 86_400.0;
/// Farthest coordinate (m): 90 km, where the coordinates of a foot are rounded to 1e-11 m. Soft soles are computed up to 100 km: that
/// leaves the way walked from here.
const FAR_M: f64 = 9e4;
/// Largest heading (rad): the planner counts turns, but a heading must keep its digits.
const HEADING_MAX_RAD: f64 = 1e3;

const COORDINATE_M: Range = Range::within(FAR_M);
const HEADING_RAD: Range = Range::within(HEADING_MAX_RAD);
const SOLE_SIDE_M: Range = Range::between(0.01, 2.0);
const DURATION_S: Range = Range::between(0.05, 60.0);
/// A step, or the limit of one (m): giants.
const STEP_M: f64 = 10.0;
const STEP_LIMIT_M: Range = Range::between(0.001, STEP_M);

const MARGIN: &str = "limits.zmp_margin_m";
const NEAR: &str = "plan a walk near its start";
const HEADING_REMEDY: &str = "give the heading without its full turns";
const DURATION_REMEDY: &str = "half a second to a second is usual";

impl GaitSettings {
    /// Every number lies in its range, and the walk is not too large.
    ///
    /// # Errors
    /// The first field that does not, with its value and what to do.
    pub fn validate(&self) -> Result<(), GaitError> {
        self.validate_body()?;
        self.validate_timing()?;
        Range::between(0.0, 1.0).demand("cost.lambda", self.cost.lambda, "0.6 is usual")?;
        Range::between(0.0, 1e6).demand("cost.mu", self.cost.mu, "0 to 100 is usual")?;
        self.validate_limits()?;
        Range::between(0.0, 2.0).demand("swing.apex_m", self.swing.apex_m, "some centimetres are usual")?;
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

    fn validate_body(&self) -> Result<(), OutOfRange> {
        let (body, sole, start) = (&self.body, &self.sole, &self.start);
        Range::between(0.1, 1e4).demand("body.mass_kg", body.mass_kg(), "give kilograms")?;
        let gravity = body.gravity_m_per_s2;
        Range::between(0.1, 100.0).demand("body.gravity_m_per_s2", gravity, "9.81 on Earth")?;
        let height = body.com_height_m;
        Range::between(0.1, 10.0).demand("body.com_height_m", height, "give metres above the ground")?;
        let between = "the ankle lies between the ground and the COM";
        Range::between(0.0, height).demand("body.ankle_height_m", body.ankle_height_m(), between)?;
        SOLE_SIDE_M.demand("sole.length_m", sole.length_m(), "give metres")?;
        SOLE_SIDE_M.demand("sole.width_m", sole.width_m(), "give metres")?;
        let [ankle_x, ankle_y] = sole.left_ankle_in_sole_m();
        let over = |side_m: f64| Range::within(side_m / 2.0);
        let inside = "the ankle must stand over the sole";
        over(sole.length_m()).demand("sole.left_ankle_in_sole_m[0]", ankle_x, inside)?;
        over(sole.width_m()).demand("sole.left_ankle_in_sole_m[1]", ankle_y, inside)?;
        COORDINATE_M.demand("start.x_m", start.x_m, NEAR)?;
        COORDINATE_M.demand("start.y_m", start.y_m, NEAR)?;
        HEADING_RAD.demand("start.yaw_rad", start.yaw_rad, HEADING_REMEDY)?;
        let apart = "the distance of the ankles at half-sitting is usual";
        Range::between(0.001, 5.0).demand("start.ankle_distance_m", start.ankle_distance_m, apart)
    }

    fn validate_timing(&self) -> Result<(), OutOfRange> {
        let timing = &self.timing;
        for (key, duration_s) in [
            ("timing.start_s", timing.start_s),
            ("timing.single_support_s", timing.single_support_s),
            ("timing.double_support_s", timing.double_support_s),
            ("timing.stop_s", timing.stop_s),
        ] {
            DURATION_S.demand(key, duration_s, DURATION_REMEDY)?;
        }
        DURATION_S.demand_each("timing.single_support_each_s", &timing.single_support_each_s, DURATION_REMEDY)?;
        DURATION_S.demand_each("timing.double_support_each_s", &timing.double_support_each_s, DURATION_REMEDY)
    }

    fn validate_limits(&self) -> Result<(), OutOfRange> {
        let (sole, limits) = (&self.sole, &self.limits);
        let margin_m = limits.zmp_margin_m;
        Range::between(0.0, 2.0).demand(MARGIN, margin_m, "5 to 10 % of the sole's length is usual")?;
        let half_m = sole.length_m().min(sole.width_m()) / 2.0;
        if margin_m >= half_m {
            let expected = format!("less than half of the sole's smaller side, {half_m:.6}");
            return Err(OutOfRange::new(MARGIN, margin_m, expected, "it would leave no support polygon"));
        }
        // Start and stop hold each foot's ZMP under its ankle.
        let [ankle_x, ankle_y] = sole.left_ankle_in_sole_m();
        let room_m = (sole.length_m() / 2.0 - ankle_x.abs()).min(sole.width_m() / 2.0 - ankle_y.abs());
        if margin_m > room_m {
            let expected = format!("at most {room_m:.6}, the ankle's distance from the edge of the sole");
            return Err(OutOfRange::new(MARGIN, margin_m, expected, "the walk starts and stops with the ZMP under it"));
        }
        Range::within(1.0).demand("limits.feet_gap_min_m", limits.feet_gap_min_m, "some centimetres are usual")?;
        let reach = "about the leg's length at most";
        STEP_LIMIT_M.demand("limits.step_length_max_m", limits.step_length_max_m, reach)?;
        STEP_LIMIT_M.demand("limits.step_width_max_m", limits.step_width_max_m, reach)
    }

    fn validate_numerics(&self) -> Result<(), OutOfRange> {
        let d = &self.discretisation;
        let samples = f64::from(d.samples_per_polynomial);
        Range::between(3.0, 1000.0).demand("discretisation.samples_per_polynomial", samples, "11 is usual")?;
        let nodes = f64::from(d.quadrature_nodes);
        Range::between(6.0, 64.0).demand("discretisation.quadrature_nodes", nodes, "12 is usual")?;
        let pieces = f64::from(d.single_support_polynomials);
        Range::between(1.0, 20.0).demand("discretisation.single_support_polynomials", pieces, "2 is usual")?;
        Range::between(1e-13, 1e-3).demand("solver.tolerance", self.solver.tolerance, "1e-10 is usual")?;
        let iterations_max = f64::from(self.solver.iterations_max);
        Range::between(1.0, 1e4).demand("solver.iterations_max", iterations_max, "200 is usual")
    }

    fn validate_walk(&self) -> Result<(), OutOfRange> {
        let step = |key, length_m| Range::within(STEP_M).demand(key, length_m, "give metres per step");
        match &self.walk {
            Walk::Straight { step_length_m, .. } => step("walk.step_length_m", *step_length_m)?,
            Walk::Sideways { step_width_m, .. } => step("walk.step_width_m", *step_width_m)?,
            Walk::Circle { step_length_m, radius_m, .. } => {
                step("walk.step_length_m", *step_length_m)?;
                let remedy = "or its negative; for a turn on the spot use kind = \"in_place\"";
                Range::between(0.01, FAR_M).demand("walk.radius_m", radius_m.abs(), remedy)?;
            }
            Walk::InPlace { turn_per_swing_rad, .. } => {
                Range::within(PI).demand("walk.turn_per_swing_rad", *turn_per_swing_rad, "turn in more swings")?;
            }
            Walk::Free { swings, distance_m } => {
                COORDINATE_M.demand("walk.distance_m", *distance_m, NEAR)?;
                if *swings == 1 && *distance_m != 0.0 {
                    let remedy = "one swing only closes the feet";
                    return Err(OutOfRange::new("walk.swings", 1, "at least 2 for a walk over a distance", remedy));
                }
            }
            Walk::Path { landings } => {
                for (i, landing) in landings.iter().enumerate() {
                    COORDINATE_M.demand(format!("walk.landings[{i}].x_m"), landing.x_m, NEAR)?;
                    COORDINATE_M.demand(format!("walk.landings[{i}].y_m"), landing.y_m, NEAR)?;
                    HEADING_RAD.demand(format!("walk.landings[{i}].yaw_rad"), landing.yaw_rad, HEADING_REMEDY)?;
                }
            }
        }
        let swings = self.swings();
        if swings == 0 {
            return Err(OutOfRange::new("walk.swings", 0, "at least 1", "a walk has at least one swing"));
        }
        let (single, double) = (&self.timing.single_support_each_s, &self.timing.double_support_each_s);
        for (key, found, phases) in [
            ("timing.single_support_each_s", single.len(), swings),
            ("timing.double_support_each_s", double.len(), swings - 1),
        ] {
            if found != 0 && found != phases {
                let found = format!("a list of {found} numbers");
                return Err(OutOfRange::new(key, found, format!("one of {phases}"), "give all of them or none"));
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
        Range::between(0.0, WALK_MAX_S).demand(
            "timing (sum of all)",
            walk_s,
            "it is more than a day: plan it in parts",
        )?;
        Ok(())
    }
}
