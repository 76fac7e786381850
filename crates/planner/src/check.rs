//! What a pattern must fulfil beyond its own constraints before anybody walks it: soles that can carry it, legs that can follow.

use gait::{CheckReport, GaitSettings, Plan, Quantity, Worst};
use robot::Robot;
use std::path::PathBuf;
use wholebody::ConfigurationError;

use crate::reach::{LegsError, RobotLegs};
use crate::words::{amount, place, word};

/// Grid of the check (s).
const GRID_S: f64 = 1e-3;
/// Share of the friction that a plan may use: towards 1 the distance a sole slides grows without bound.
const FRICTION_USE_MAX: f64 = 0.99;
/// Masses that agree to this part are the same: a robot is weighed to some hundred grams, and batteries differ.
const SAME_MASS: f64 = 0.01;
/// A walk that cannot be walked.
#[derive(Debug, thiserror::Error)]
pub enum NotWalkable {
    /// The legs are not known.
    #[error(transparent)]
    Legs(#[from] LegsError),
    /// The walk is planned for another mass than the robot's.
    #[error(
        "gait.body.mass_kg = {found}, but the robot of {} has {expected:.3} kg: the forces would be planned for another body; remove the key, or change one of them",
        .file.display()
    )]
    Mass {
        /// What the planner's configuration says (kg).
        found: f64,
        /// What the links of the robot sum up to (kg).
        expected: f64,
        /// Where.
        file: PathBuf,
    },
    /// A constraint that the plan was made for is broken between the samples of the problem.
    #[error(
        "the plan is {} {}, more than {max_m} m: raise gait.discretisation.samples_per_polynomial (or constraint_violation_max_m)",
        amount(worst),
        place(worst)
    )]
    ConstraintViolated {
        /// The constraint, phase, time and amount (m).
        worst: Worst,
        /// Largest violation allowed.
        max_m: f64,
    },
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
        "at {time_s:.3} s the {foot} sole {why}: raise gait.limits.zmp_margin_m, lower gait.swing.apex_m or lengthen gait.timing (a swinging leg moves the ZMP), lower gait.cost.lambda or take a stiffer sole"
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
    /// There is no configuration in which it begins.
    #[error("rehearsal: {0}: lower gait.body.com_height_m")]
    Start(#[from] ConfigurationError),
    /// Even on an ideal plant a joint is held back by a limit.
    #[error(
        "rehearsal: at {time_s:.3} s {joint} is at its limit of {kind}, {limit:.4} {unit}, and would be beyond it: {remedy}"
    )]
    AtLimit {
        /// Walk time.
        time_s: f64,
        /// Joint of the model.
        joint: String,
        /// Travel, speed or torque.
        kind: &'static str,
        /// The limit.
        limit: f64,
        /// Its unit.
        unit: &'static str,
        /// What helps.
        remedy: &'static str,
    },
    /// Even on an ideal plant not all limits can be kept.
    #[error(
        "rehearsal: at {time_s:.3} s not all limits can be kept, the first that gives way is {what}: lower gait.body.com_height_m, walk slower \
         (gait.timing) or shorten the steps"
    )]
    GivesWay {
        /// Walk time.
        time_s: f64,
        /// Which, and by how much.
        what: String,
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
        "at {time_s:.3} s joint {joint} of the {leg} leg would be {by_deg:.2} degrees beyond its limit: change the steps, gait.swing.apex_m or gait.body.com_height_m"
    )]
    Joint {
        /// Walk time.
        time_s: f64,
        /// Which leg.
        leg: &'static str,
        /// Its name.
        joint: String,
        /// By how much.
        by_deg: f64,
    },
}

/// Friction that a plan may use; `friction`: instead of that of the robot's soles.
pub(crate) fn friction_available(robot: &Robot, friction: Option<f64>) -> f64 {
    FRICTION_USE_MAX * friction.unwrap_or_else(|| robot.sole.friction.smallest())
}

/// Measures the plan on a 1 ms grid and refuses what breaks its own constraints by more than `violation_max_m` and what robot and
/// soles cannot do.
pub(crate) fn check(
    plan: &Plan,
    gait: &GaitSettings,
    robot: &Robot,
    available: f64,
    violation_max_m: f64,
) -> Result<CheckReport, NotWalkable> {
    let legs = RobotLegs::new(robot)?;
    let (found, expected) = (gait.body.mass_kg(), legs.mass_kg());
    let same = (found - expected).abs() <= SAME_MASS * expected;
    if !same {
        return Err(NotWalkable::Mass { found, expected, file: robot.folder.join(&robot.description.urdf) });
    }
    let report = gait::check(plan, gait, GRID_S, Some(&legs));
    let worst = |quantity: Quantity| report.worst.iter().find(|worst| worst.quantity == quantity);
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
    if let Some(w) = report.largest_violation() {
        let kept = w.value <= violation_max_m;
        if !kept {
            return Err(NotWalkable::ConstraintViolated { worst: *w, max_m: violation_max_m });
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
            return Err(NotWalkable::Joint {
                time_s,
                leg: word(leg),
                joint: legs.joint_name(leg, joint).to_owned(),
                by_deg,
            });
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
    fn a_walk_for_another_mass_is_refused() {
        assert!(plan(&["gait.body.mass_kg=39.3"]).is_ok(), "as good as the same");
        let refused = plan(&["gait.body.mass_kg=31.75"]).expect_err("another robot's").to_string();
        assert!(refused.contains("body.mass_kg = 31.75") && refused.contains("39.000 kg"), "{refused}");
        assert!(refused.contains("hrp4.urdf"), "{refused}");
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
        let pattern = plan(&["estimator.sole.level=rigid"]).expect("it can be walked");
        assert_eq!(pattern.soles, None);
        // Both feet, loaded at least while the other swings.
        let swings: f64 = 11.0 * 0.8 / messages::CONTROL_PERIOD_S;
        assert!(soles.ticks as f64 > swings, "{soles:?}");
        assert!((0.5..5.0).contains(&soles.tilt_rad.value.to_degrees()), "{soles:?}");
    }

    /// Along the edge of a soft sole: lambda 1 keeps the ZMP at the inner margin.
    const EDGE: [&str; 3] =
        ["gait.cost.lambda=1.0", "gait.limits.zmp_margin_m=0.002", "estimator.sole.young_modulus_factor=0.2"];

    #[test]
    fn a_zmp_that_no_pose_of_the_sole_carries_is_refused_with_time_and_foot() {
        let [lambda, margin, soft] = EDGE;
        let refused = plan(&[lambda, margin, soft, "sole_tilt_max_deg=90.0"]).err().map(|refused| refused.to_string());
        let words = refused.expect("2 mm from the edge a sole five times as soft folds as the other foot lifts off");
        // Whether none is there was not shown for this load: not found is a refusal, too.
        let told = [" sole folds over", " sole has no equilibrium that was found"];
        assert!(words.contains(" s the ") && told.iter().any(|told| words.contains(told)), "{words}");
    }

    #[test]
    fn a_tilt_at_which_the_soles_elasticity_is_doubtful_is_refused_with_its_degrees() {
        let Err(PlannerError::NotWalkable(refused)) = plan(&["sole_tilt_max_deg=0.5"]) else { panic!("not refused") };
        let NotWalkable::SoleTilt { tilt_deg, max_deg, .. } = refused else { panic!("{refused}") };
        assert_eq!(max_deg, 0.5);
        assert!((0.5..5.0).contains(&tilt_deg), "{tilt_deg}");
    }

    #[test]
    fn foam_that_is_pressed_too_thin_is_refused_with_its_compression() {
        let refused =
            plan(&["estimator.sole.young_modulus_factor=0.1", "sole_tilt_max_deg=90.0", "gait.cost.lambda=0.0"]);
        let Err(PlannerError::NotWalkable(refused)) = refused else { panic!("not refused") };
        let NotWalkable::SoleCompression { part, max, .. } = refused else { panic!("{refused}") };
        assert_eq!(max, 0.1);
        assert!((0.1..1.0).contains(&part), "{part}");
    }

    /// Three samples per polynomial: its ends and its middle.
    const COARSE: [&str; 3] =
        ["gait.discretisation.samples_per_polynomial=3", "gait.cost.lambda=0.5", "estimator.sole.level=rigid"];

    #[test]
    fn a_zmp_that_leaves_its_margin_between_the_samples_is_refused_with_phase_time_and_amount() {
        let refused = plan(&COARSE).expect_err("1 mm is allowed");
        let words = refused.to_string();
        let PlannerError::NotWalkable(NotWalkable::ConstraintViolated { worst, max_m: 1e-3 }) = refused else {
            panic!("{words}")
        };
        assert!((1e-3..2e-3).contains(&worst.value) && (0.8..14.0).contains(&worst.time_s), "{words}");
        assert!(words.contains(&format!("phase {})", worst.phase)), "{words}");
        assert!(words.contains("outside the ZMP's margin of the"), "{words}");
        // More samples are the remedy, as the message says; with a larger limit the whole sole still counts.
        let [_, lambda, rigid] = COARSE;
        assert!(plan(&["gait.discretisation.samples_per_polynomial=5", lambda, rigid]).is_ok());
        let [samples, ..] = COARSE;
        assert!(plan(&[samples, lambda, rigid, "constraint_violation_max_m=0.002"]).is_ok());
        for bad in ["-1e-3", "nan", "1.0"] {
            let refused = plan(&[&format!("constraint_violation_max_m={bad}")]).expect_err("a limit that is none");
            assert!(
                matches!(&refused, PlannerError::Setting(refused) if refused.key == "constraint_violation_max_m"),
                "{refused}"
            );
        }
    }

    #[test]
    fn every_plan_says_its_violation_friction_margin_and_tightest_leg() {
        let [samples, lambda, rigid] = COARSE;
        let planned = plan(&[samples, lambda, rigid, "constraint_violation_max_m=0.002"]).expect("allowed");
        let [violation, margins, leg, rehearsed, speeds] = &planned.findings()[..] else {
            panic!("{:?}", planned.findings())
        };
        assert!(speeds.starts_with("as fast as they may be: R_KNEE_P for "), "{speeds}");
        let worst = planned.check.largest_violation().expect("measured");
        let place = format!("at {:.3} s (step {}, {:?}, phase {})", worst.time_s, worst.step, worst.kind, worst.phase);
        assert!(violation.starts_with("largest violation of a constraint: 1."), "{violation}");
        assert!(violation.contains("mm outside the ZMP's margin") && violation.ends_with(&place), "{violation}");
        assert!(margins.contains("friction demand: 0.0") && margins.contains("of 0.643"), "{margins}");
        // The margin is 20 mm.
        let margin_mm = 20.0 - 1e3 * worst.value;
        assert!(margins.contains(&format!("edge: {margin_mm:.2} mm, ")), "{margins}");
        let reach = planned.check.reach.expect("legs were given");
        let (extension_mm, room_deg) = (1e3 * reach.extension.0, reach.joint.0.to_degrees());
        assert!(leg.contains(&format!("could be {extension_mm:.1} mm longer at")), "{leg}");
        assert!(leg.contains(&format!("has {room_deg:.1} degrees to its limit at")), "{leg}");
        assert!(rehearsed.starts_with("rehearsed: the body's own ZMP is "), "{rehearsed}");
        assert!(["rad of travel (", "rad/s of speed (", "N m of torque ("].iter().all(|part| rehearsed.contains(part)));
        // A walk that keeps everything says so.
        let kept = plan(&["gait.cost.lambda=0.0", rigid]).expect("it can be walked").findings();
        assert!(kept[0].starts_with("every constraint is kept, nearest: "), "{kept:?}");
    }

    #[test]
    fn a_zmp_beyond_the_edge_of_the_sole_is_refused_whatever_violation_is_allowed() {
        let [samples, _, rigid] = COARSE;
        let refused = plan(&[
            samples,
            "gait.cost.lambda=1.0",
            rigid,
            "constraint_violation_max_m=0.1",
            "gait.limits.zmp_margin_m=0.0",
        ]);
        let Err(PlannerError::NotWalkable(NotWalkable::ZmpOutside { by_m, .. })) = refused else {
            panic!("not refused")
        };
        assert!((1e-4..5e-3).contains(&by_m), "{by_m}");
    }

    /// Patches, loads and tilt are the same whichever way the walk goes.
    #[test]
    fn the_soles_say_the_same_of_a_walk_in_any_direction() {
        let ahead = plan(&["gait.walk.swings=3"]).expect("it can be walked");
        let turned = plan(&["gait.walk.swings=3", "gait.start.yaw_rad=1.2"]).expect("it can be walked");
        let [a, b] = [&ahead, &turned].map(|planned| planned.soles.expect("soles are asked"));
        assert_eq!(a.ticks, b.ticks);
        assert!((a.tilt_rad.value - b.tilt_rad.value).abs() < 1e-6, "{a:?} {b:?}");
        assert!((a.compression.value - b.compression.value).abs() < 1e-6, "{a:?} {b:?}");
    }

    #[test]
    fn a_pattern_is_published_for_the_robot_it_was_planned_for() {
        let planned = plan(&["estimator.sole.level=rigid"]).expect("it can be walked");
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4");
        let robot = Robot::load(&folder).expect("it ships");
        assert_eq!(planned.header.header.robot_fingerprint, robot.fingerprint);
    }

    /// The configuration's friction replaces that of the robot's soles, here the other way round: the walk that ships needs 0.05.
    #[test]
    fn the_friction_of_the_configuration_is_the_one_that_counts() {
        let refused = plan(&["estimator.sole.friction=0.01"]).expect_err("no walk needs so little").to_string();
        assert!(refused.contains("the sole gives 0.010"), "{refused}");
    }

    #[test]
    fn a_gait_for_another_foot_is_refused_by_its_key() {
        for (key, value) in [
            ("body.ankle_height_m", "0.104"),
            ("sole.left_ankle_in_sole_m", "[-0.014, -0.011]"),
            ("sole.left_ankle_in_sole_m", "[-0.015, -0.012]"),
            ("sole.length_m", "0.231"),
            ("sole.width_m", "0.129"),
        ] {
            let refused = plan(&[&format!("gait.{key}={value}")]).expect_err("another foot").to_string();
            assert!(refused.starts_with(&format!("gait.{key}")) && refused.contains("sole.toml"), "{refused}");
        }
    }

    #[test]
    fn a_wrong_setting_of_the_gait_is_told_with_its_full_key() {
        for (key, value, told) in [
            ("swing.apex_m", "3.0", "`gait.swing.apex_m` is 3, must be at least 0 and at most 2: "),
            (
                "timing.double_support_each_s",
                "[0.4]",
                "`gait.timing.double_support_each_s` is a list of 1 numbers, must be one of 10: ",
            ),
            (
                "limits.zmp_margin_m",
                "0.07",
                "`gait.limits.zmp_margin_m` is 0.07, must be less than half of the sole's smaller side, 0.065000: ",
            ),
            (
                "limits.zmp_margin_m",
                "0.06",
                "`gait.limits.zmp_margin_m` is 0.06, must be at most 0.054000, the ankle's distance from the edge of the sole: ",
            ),
            ("walk.step_length_m", "0.31", "gait: step 1: the Right foot's distance along the stance foot"),
        ] {
            let refused = plan(&[&format!("gait.{key}={value}")]).expect_err("wrong").to_string();
            assert!(refused.starts_with(told), "{refused}");
        }
    }

    #[test]
    fn a_foot_lifted_higher_than_its_knee_bends_is_refused_with_the_joint() {
        let refused = plan(&["gait.swing.apex_m=0.5"]).expect_err("the knee bends by 125 degrees").to_string();
        assert!(refused.contains("_KNEE_P of the") && refused.contains("gait.swing.apex_m"), "{refused}");
    }

    #[test]
    fn a_walk_on_ice_is_refused_for_its_friction() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let settings: PlannerSettings = scenario::load(&folder.join("../../config/planner.toml"), &[])
            .expect("the configuration that ships is read");
        let plan = gait::plan(&settings.gait).expect("it can be planned");
        let mut robot = Robot::load(&settings.robot).expect("the robot that ships is read");
        robot.sole.friction = robot::Friction::Uniform(0.01);
        let refused = check(&plan, &settings.gait, &robot, friction_available(&robot, None), 1e-3)
            .expect_err("no walk needs so little");
        assert!(matches!(refused, NotWalkable::Friction { needed, .. } if needed > 0.01), "{refused}");
    }
}
