//! Whether the soles can carry a walk: the estimator goes through every stance, tick by tick, before anybody walks it.
//!
//! The ZMP inside the rectangle is not enough: near an edge a soft sole folds before the ZMP gets there, and what a sole can
//! carry depends on the history of its contact. So the same equilibrium is solved here as will be at 200 Hz later.

use crate::NotWalkable;
use crate::check::word;
use messages::CONTROL_PERIOD_S;
use pattern::{Side, WalkPattern};
use sole::{EstimatorSettings, SoleModel, StanceEstimator, StanceReference, Status};

/// Force (N) from which a foot counts as loaded, the estimator's default.
const LOADED_N: f64 = 0.05;

/// What the soles say of a walk that they can carry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoleCheck {
    /// Stances' ticks solved, of both feet.
    pub ticks: usize,
    /// Largest angle between the sole and the ground (rad).
    pub tilt_rad: f64,
    /// When that is (walk time, s).
    pub time_s: f64,
    /// Of which foot.
    pub foot: Side,
}

/// Walks through every stance on the given soles (left, right), which may tilt by `tilt_max_deg`.
pub(crate) fn carry(pattern: &WalkPattern, soles: [SoleModel; 2], tilt_max_deg: f64) -> Result<SoleCheck, NotWalkable> {
    let mut check = SoleCheck { ticks: 0, tilt_rad: 0.0, time_s: 0.0, foot: Side::Left };
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
            let tilt_rad = report.sole_pose.rotation[(2, 2)].clamp(-1.0, 1.0).acos();
            if tilt_rad > check.tilt_rad {
                check = SoleCheck { tilt_rad, time_s, foot, ..check };
            }
        }
    }
    let tilt_deg = check.tilt_rad.to_degrees();
    if tilt_deg > tilt_max_deg {
        let (time_s, foot) = (check.time_s, word(check.foot));
        return Err(NotWalkable::SoleTilt { time_s, foot, tilt_deg, max_deg: tilt_max_deg });
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
        Status::NotConverged => "has no equilibrium that the iteration could find".to_string(),
        other => format!("cannot be solved for: {other:?}"),
    }
}
