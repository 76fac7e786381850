//! Whether the soles can carry a walk: the estimator goes through every stance, tick by tick, before anybody walks it.
//!
//! The ZMP inside the rectangle is not enough: near an edge a soft sole tilts and may fold before the ZMP gets there, and what a
//! sole can carry depends on the history of its contact. So the equilibrium that the estimator will solve at 200 Hz is solved here,
//! with more patience (nobody waits) and on the sole of the planner's own configuration, by default on patches instead of all nodes.

use crate::check::word;
use crate::{NotWalkable, PlannerSettings};
use messages::CONTROL_PERIOD_S;
use pattern::{Side, WalkPattern};
use sole::{EstimatorSettings, SoleModel, StanceEstimator, StanceReference, Status};

/// Force (N) from which a foot counts as loaded, the estimator's default.
const LOADED_N: f64 = 0.05;

/// The largest value of something and where it occurs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Largest {
    /// The value.
    pub value: f64,
    /// Walk time (s).
    pub time_s: f64,
    /// Which foot.
    pub foot: Side,
}

impl Largest {
    fn nothing() -> Self {
        Self { value: 0.0, time_s: 0.0, foot: Side::Left }
    }

    fn see(&mut self, value: f64, time_s: f64, foot: Side) {
        if value > self.value {
            *self = Self { value, time_s, foot };
        }
    }
}

/// What the soles say of a walk that they can carry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoleCheck {
    /// Stances' ticks solved, of both feet.
    pub ticks: usize,
    /// Angle between the sole and the ground (rad).
    pub tilt_rad: Largest,
    /// Mean compression, a part of the thickness.
    pub compression: Largest,
}

impl SoleCheck {
    /// Refuses what exceeds the settings' limits.
    pub(crate) fn within(self, settings: &PlannerSettings) -> Result<Self, NotWalkable> {
        let Largest { value, time_s, foot } = self.tilt_rad;
        let (tilt_deg, max_deg) = (value.to_degrees(), settings.sole_tilt_max_deg);
        if tilt_deg > max_deg {
            return Err(NotWalkable::SoleTilt { time_s, foot: word(foot), tilt_deg, max_deg });
        }
        let Largest { value: part, time_s, foot } = self.compression;
        let max = settings.sole_compression_max;
        if part > max {
            return Err(NotWalkable::SoleCompression { time_s, foot: word(foot), part, max });
        }
        Ok(self)
    }
}

/// Walks through every stance on the given soles (left, right).
pub(crate) fn carry(pattern: &WalkPattern, soles: [SoleModel; 2]) -> Result<SoleCheck, NotWalkable> {
    let mut check = SoleCheck { ticks: 0, tilt_rad: Largest::nothing(), compression: Largest::nothing() };
    let last_tick = (pattern.duration_s() / CONTROL_PERIOD_S).ceil() as usize;
    for (foot, model) in [Side::Left, Side::Right].into_iter().zip(soles) {
        let mut sole = StanceEstimator::new(model, EstimatorSettings::default());
        let mut loaded = false;
        for tick in 0..=last_tick {
            let time_s = tick as f64 * CONTROL_PERIOD_S;
            let reference = pattern.evaluate(time_s).feet[foot.index()];
            let before = std::mem::replace(&mut loaded, reference.force.z > LOADED_N);
            if !loaded {
                continue;
            }
            if !before {
                let at = reference.sole_foothold;
                sole.touch_down(sole::Foothold { x_m: at.x_m, y_m: at.y_m, yaw_rad: at.yaw_rad });
            }
            let report = sole.step(&StanceReference {
                force: reference.force,
                force_rate: reference.force_rate,
                force_acceleration: reference.force_acceleration,
                zmp: [reference.zmp.position, reference.zmp.velocity, reference.zmp.acceleration],
            });
            if !report.status.is_solved() {
                return Err(NotWalkable::Sole { time_s, foot: word(foot), why: why(report.status) });
            }
            check.ticks += 1;
            check.tilt_rad.see(report.sole_pose.rotation[(2, 2)].clamp(-1.0, 1.0).acos(), time_s, foot);
            check.compression.see(report.compression, time_s, foot);
        }
    }
    Ok(check)
}

/// What the sole says, in words and numbers.
fn why(status: Status) -> String {
    match status {
        Status::Fold { reached_zmp_m: at, fraction } => format!(
            "folds over: followed from the load of the tick before, {:.0} % of the way are carried, to a ZMP at ({:.4}, {:.4}) m",
            100.0 * fraction,
            at.x,
            at.y
        ),
        Status::ZmpOutsideSole { by_m } => format!("is left by the ZMP, by {by_m:.4} m"),
        Status::OutsideFrictionCone { tangential_n, limit_n } => {
            format!("slides: {tangential_n:.2} N sideways are more than the {limit_n:.2} N of its friction")
        }
        Status::Indeterminate => "has no friction: nothing says where it stays".to_string(),
        Status::NotFound { cause } => format!("has no equilibrium that was found, which does not say that there is none: {cause:?}"),
        other => format!("cannot be solved for: {other:?}"),
    }
}
