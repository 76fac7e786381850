//! What the soles must carry before anybody walks: [`stance::certify`], within the planner's limits and in its words.

use crate::words::word;
use crate::{NotWalkable, PlannerSettings};
use sole::{Cause, Status};
use stance::{Carried, Largest, NotCarried, WalkOnSoles, certify};

/// Walks through every stance and refuses what a sole cannot carry and what exceeds the settings' limits.
pub(crate) fn check(walk: &mut WalkOnSoles, settings: &PlannerSettings) -> Result<Carried, NotWalkable> {
    let carried = certify(walk).map_err(|NotCarried { time_s, foot, status }| NotWalkable::Sole {
        time_s,
        foot: word(foot),
        why: why(status),
    })?;
    let Largest { value, time_s, foot } = carried.tilt_rad;
    let (tilt_deg, max_deg) = (value.to_degrees(), settings.sole_tilt_max_deg);
    if tilt_deg > max_deg {
        return Err(NotWalkable::SoleTilt { time_s, foot: word(foot), tilt_deg, max_deg });
    }
    let Largest { value: part, time_s, foot } = carried.compression;
    let max = settings.sole_compression_max;
    if part > max {
        return Err(NotWalkable::SoleCompression { time_s, foot: word(foot), part, max });
    }
    Ok(carried)
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
        Status::NotFound { cause } => {
            let why = match cause {
                Cause::Circling => "the contact states run in circles",
                Cause::Steps => "Newton's method led nowhere",
                Cause::Work => "the search took more than it may",
                Cause::Laws => "the contact laws do not hold where it ended",
                Cause::Singular => "its tangent is singular",
            };
            format!("has no equilibrium that was found, which does not say that there is none: {why}")
        }
        other => format!("cannot be solved for: {other:?}"),
    }
}
