//! What a pattern must fulfil beyond its own constraints before anybody walks it: soles that can carry it, legs that can follow.

use gait::{CheckReport, GaitSettings, Plan, Quantity};
use pattern::Side;
use robot::Robot;

use crate::reach::{LegsError, RobotLegs};

/// Grid of the check (s).
const GRID_S: f64 = 1e-3;
/// Share of the friction that a plan may use: towards 1 the distance a sole slides grows without bound.
const FRICTION_USE_MAX: f64 = 0.99;
/// Names of a leg's joints, from the hip.
const JOINTS: [&str; 6] = ["hip yaw", "hip roll", "hip pitch", "knee", "ankle pitch", "ankle roll"];

/// A walk that cannot be walked.
#[derive(Debug, thiserror::Error)]
pub enum NotWalkable {
    /// The legs are not known.
    #[error(transparent)]
    Legs(#[from] LegsError),
    /// More friction is needed than there is.
    #[error(
        "at {time_s:.3} s (step {step}) the feet need a friction of {needed:.3}, the sole gives {available:.3}: walk slower or raise gait.cost.lambda"
    )]
    Friction {
        /// Walk time.
        time_s: f64,
        /// The swing.
        step: u32,
        /// Horizontal over vertical force.
        needed: f64,
        /// What may be used.
        available: f64,
    },
    /// A foot's ZMP leaves the sole.
    #[error(
        "at {time_s:.3} s (step {step}) the ZMP of the {foot} foot is {by_m:.4} m outside its sole: raise gait.limits.zmp_margin_m or gait.discretisation.samples_per_polynomial"
    )]
    ZmpOutside {
        /// Walk time.
        time_s: f64,
        /// The swing.
        step: u32,
        /// Which foot.
        foot: &'static str,
        /// By how much.
        by_m: f64,
    },
    /// A sole cannot carry its load.
    #[error(
        "at {time_s:.3} s the {foot} sole {why}: raise gait.limits.zmp_margin_m, lower the accelerations (gait.cost.lambda) or take a stiffer sole"
    )]
    Sole {
        /// Walk time.
        time_s: f64,
        /// Which foot.
        foot: &'static str,
        /// What it says.
        why: String,
    },
    /// A sole would tilt too much.
    #[error(
        "at {time_s:.3} s the {foot} sole tilts by {tilt_deg:.1} degrees, more than {max_deg}: raise gait.limits.zmp_margin_m, lower gait.cost.lambda, take a stiffer sole or raise sole_tilt_max_deg"
    )]
    SoleTilt {
        /// Walk time.
        time_s: f64,
        /// Which foot.
        foot: &'static str,
        /// Its largest tilt.
        tilt_deg: f64,
        /// Largest one allowed.
        max_deg: f64,
    },
    /// A sole would be pressed too thin.
    #[error(
        "at {time_s:.3} s the {foot} sole is pressed together by {part:.3} of its thickness on average, more than {max}: take a stiffer or thicker sole or raise sole_compression_max"
    )]
    SoleCompression {
        /// Walk time.
        time_s: f64,
        /// Which foot.
        foot: &'static str,
        /// Largest mean compression, a part of the thickness.
        part: f64,
        /// Largest one allowed.
        max: f64,
    },
    /// A leg is too short.
    #[error(
        "at {time_s:.3} s the {leg} leg is {by_m:.4} m too short: lower gait.body.com_height_m or shorten the steps"
    )]
    TooShort {
        /// Walk time.
        time_s: f64,
        /// Which leg.
        leg: &'static str,
        /// By how much.
        by_m: f64,
    },
    /// A joint would pass its limit.
    #[error(
        "at {time_s:.3} s the {joint} of the {leg} leg would be {by_deg:.2} degrees beyond its limit: change the steps or gait.body.com_height_m"
    )]
    Joint {
        /// Walk time.
        time_s: f64,
        /// Which leg.
        leg: &'static str,
        /// Which joint.
        joint: &'static str,
        /// By how much.
        by_deg: f64,
    },
}

pub(crate) fn word(side: Side) -> &'static str {
    match side {
        Side::Left => "left",
        Side::Right => "right",
    }
}

/// Measures the plan on a 1 ms grid and refuses what robot and soles cannot do.
/// `friction`: instead of the robot's.
pub(crate) fn check(
    plan: &Plan,
    gait: &GaitSettings,
    robot: &Robot,
    friction: Option<f64>,
) -> Result<CheckReport, NotWalkable> {
    let legs = RobotLegs::new(robot)?;
    let report = gait::check(plan, gait, GRID_S, Some(&legs));
    let worst = |quantity: Quantity| report.worst.iter().find(|worst| worst.quantity == quantity);
    let available = FRICTION_USE_MAX * friction.unwrap_or_else(|| robot.sole.friction.smallest());
    // Comparisons are written so that a value that is not a number is refused.
    if let Some(w) = worst(Quantity::FrictionDemand) {
        let enough = w.value <= available;
        if !enough {
            return Err(NotWalkable::Friction { time_s: w.time_s, step: w.step, needed: w.value, available });
        }
    }
    if let Some(w) = worst(Quantity::NegativeZmpMargin) {
        let inside = w.value <= 0.0;
        if !inside {
            let foot = w.foot.map_or("loaded", word);
            return Err(NotWalkable::ZmpOutside { time_s: w.time_s, step: w.step, foot, by_m: w.value });
        }
    }
    if let Some(reach) = &report.reach {
        let (extension_m, time_s, leg) = reach.extension;
        let long_enough = extension_m >= 0.0;
        if !long_enough {
            return Err(NotWalkable::TooShort { time_s, leg: word(leg), by_m: -extension_m });
        }
        let (room_rad, time_s, leg, joint) = reach.joint;
        let within = room_rad >= 0.0;
        if !within {
            let by_deg = -room_rad.to_degrees();
            return Err(NotWalkable::Joint { time_s, leg: word(leg), joint: JOINTS[joint], by_deg });
        }
    }
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PlannerError, PlannerSettings};
    use scenario::Setting;
    use std::path::Path;

    fn plan(changes: &[&str]) -> Result<crate::PlannerOutput, PlannerError> {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/planner.toml");
        let changes: Vec<Setting> = changes.iter().map(|text| text.parse().expect("a setting")).collect();
        let settings: PlannerSettings = scenario::load(&file, &changes).expect("the configuration that ships is read");
        crate::plan(&settings)
    }

    #[test]
    fn the_walk_that_ships_leaves_room() {
        let reach = plan(&[]).expect("it can be walked").check.reach.expect("legs were given");
        // Half-sitting is bent by 41 degrees: the knee keeps most of it.
        assert!(reach.extension.0 > 0.01, "{reach:?}");
        assert!(reach.joint.0.to_degrees() > 5.0, "{reach:?}");
    }

    #[test]
    fn a_walk_too_long_for_its_message_is_refused_by_its_number_of_phases() {
        for (swings, phases) in [("1400", 4201), ("4294967295", 12_884_901_886)] {
            let refused = plan(&[&format!("gait.walk.swings={swings}")]).expect_err("no reader has memory for it");
            let PlannerError::Pattern(messages::PatternRefused::TooLong { found }) = refused else {
                panic!("{refused}")
            };
            assert_eq!(found, phases);
        }
    }

    #[test]
    fn a_body_that_is_too_high_is_refused_with_leg_and_amount() {
        let refused = plan(&["gait.body.com_height_m=0.9"]).expect_err("no leg is that long");
        let PlannerError::NotWalkable(NotWalkable::TooShort { by_m, .. }) = refused else { panic!("{refused}") };
        assert!((0.02..0.2).contains(&by_m), "{by_m}");
    }

    #[test]
    fn a_body_that_is_too_low_is_refused_with_the_joint() {
        let refused = plan(&["gait.body.com_height_m=0.45"]).expect_err("no ankle bends that far");
        assert!(matches!(refused, PlannerError::NotWalkable(NotWalkable::Joint { .. })), "{refused}");
    }

    #[test]
    fn the_soles_of_the_walk_that_ships_carry_it() {
        let soles = plan(&[]).expect("it can be walked").soles.expect("soles are asked");
        let pattern = plan(&["sole.level=rigid"]).expect("it can be walked");
        assert_eq!(pattern.soles, None);
        // Both feet, loaded at least while the other swings.
        let swings: f64 = 11.0 * 0.8 / messages::CONTROL_PERIOD_S;
        assert!(soles.ticks as f64 > swings, "{soles:?}");
        assert!((0.5..5.0).contains(&soles.tilt_rad.value.to_degrees()), "{soles:?}");
    }

    /// Along the edge of a soft sole: lambda 1 keeps the ZMP at the inner margin.
    const EDGE: [&str; 3] = ["gait.cost.lambda=1.0", "gait.limits.zmp_margin_m=0.002", "sole.young_modulus_factor=0.2"];

    #[test]
    fn a_zmp_that_no_pose_of_the_sole_carries_is_refused_with_time_and_foot() {
        let [lambda, margin, soft] = EDGE;
        let refused = plan(&[lambda, margin, soft, "sole_tilt_max_deg=90.0"]).err().map(|refused| refused.to_string());
        let words = refused.expect("2 mm from the edge a sole five times as soft folds as the other foot lifts off");
        assert!(words.contains("the left sole folds over"), "{words}");
    }

    #[test]
    fn a_tilt_at_which_the_soles_elasticity_is_doubtful_is_refused_with_its_degrees() {
        let [lambda, margin, _] = EDGE;
        let Err(PlannerError::NotWalkable(refused)) = plan(&[lambda, margin]) else { panic!("not refused") };
        let NotWalkable::SoleTilt { tilt_deg, max_deg, .. } = refused else { panic!("{refused}") };
        assert_eq!(max_deg, 5.0);
        assert!((20.0..40.0).contains(&tilt_deg), "{tilt_deg}");
    }

    #[test]
    fn foam_that_is_pressed_too_thin_is_refused_with_its_compression() {
        let refused = plan(&["sole.young_modulus_factor=0.1", "sole_tilt_max_deg=90.0", "gait.cost.lambda=0.0"]);
        let Err(PlannerError::NotWalkable(refused)) = refused else { panic!("not refused") };
        let NotWalkable::SoleCompression { part, max, .. } = refused else { panic!("{refused}") };
        assert_eq!(max, 0.1);
        assert!((0.1..1.0).contains(&part), "{part}");
    }

    #[test]
    fn a_walk_on_ice_is_refused_for_its_friction() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let settings: PlannerSettings = scenario::load(&folder.join("../../config/planner.toml"), &[])
            .expect("the configuration that ships is read");
        let plan = gait::plan(&settings.gait).expect("it can be planned");
        let mut robot = Robot::load(&settings.robot).expect("the robot that ships is read");
        robot.sole.friction = robot::Friction::Uniform(0.01);
        let refused = check(&plan, &settings.gait, &robot, None).expect_err("no walk needs so little");
        assert!(matches!(refused, NotWalkable::Friction { needed, .. } if needed > 0.01), "{refused}");
    }
}
