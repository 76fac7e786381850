//! The planner's configuration.

use controller::ControllerSettings;
use gait::{GaitError, GaitSettings};
use messages::CONTROL_PERIOD_S;
use ranges::{OutOfRange, Range};
use robot::{Robot, RobotError};
use serde::Deserialize;
use stance::{EstimatorError, EstimatorSettings};
use std::path::PathBuf;

use crate::reach::{LegsError, RobotLegs};

/// `config/planner.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannerSettings {
    /// Folder of the robot.
    pub robot: PathBuf,
    /// Another sole than that of the robot's folder: a file like its `sole.toml`.
    #[serde(default)]
    pub sole_file: Option<PathBuf>,
    /// The walk.
    pub gait: GaitSettings,
    /// By how much a constraint may be broken on the 1 ms grid (m): ZMPs between the samples of the problem, footsteps. With 11
    /// samples per polynomial the paper's walks leave their margin by up to 0.5 mm (lambda 0.9), with 3 by more than 3 mm. The
    /// default, a millimetre, is a twentieth of the default margin, and a tenth of the centimetre by which the swinging leg, which the
    /// plan does not know, moves the ZMP anyway.
    #[serde(default = "constraint_violation_max_m")]
    pub constraint_violation_max_m: f64,
    /// Largest angle between a sole and the ground: from 5 degrees on linear elasticity is doubtful ([`sole::Status::DoubtfulTilt`]).
    #[serde(default = "sole_tilt_max_deg")]
    pub sole_tilt_max_deg: f64,
    /// Largest mean compression of a sole, a part of its thickness: from a tenth on linear elasticity is doubtful
    /// ([`sole::Status::DoubtfulCompression`]).
    #[serde(default = "sole_compression_max")]
    pub sole_compression_max: f64,
    /// Who will walk it: the estimator's configuration, with whose soles and settings the walk is certified. A scenario puts here what its
    /// estimator is told.
    pub estimator: EstimatorSettings,
    /// The same of the controller, whose whole-body step rehearses the walk.
    pub controller: ControllerSettings,
    /// How the walk is rehearsed.
    #[serde(default)]
    pub rehearsal: RehearsalSettings,
}

/// Section `[rehearsal]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RehearsalSettings {
    /// Whether the pattern holds the body's own ZMP, so that the estimator's soles carry it; without, the cart-table's, as in the paper.
    pub body_zmp: bool,
    /// Time from step to step (s).
    pub period_s: f64,
    /// Half the width of the window over which the body's own ZMP is smoothed (s).
    pub smoothing_s: f64,
}

impl Default for RehearsalSettings {
    fn default() -> Self {
        Self { body_zmp: true, period_s: CONTROL_PERIOD_S, smoothing_s: 0.04 }
    }
}

fn constraint_violation_max_m() -> f64 {
    1e-3
}

fn sole_tilt_max_deg() -> f64 {
    5.0
}

fn sole_compression_max() -> f64 {
    0.1
}

/// Why there is no walk.
#[derive(Debug, thiserror::Error)]
pub enum PlannerError {
    /// The robot's folder.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// Configuration and robot disagree: the forces would be planned for another foot.
    #[error(
        "gait.{field} = {found}, but {} says {expected:.6}: remove the key, or change one of them", .file.display()
    )]
    Disagreement {
        /// Key in the planner's configuration.
        field: &'static str,
        /// What it says.
        found: f64,
        /// What the robot's folder says.
        expected: f64,
        /// Where.
        file: PathBuf,
    },
    /// The walk cannot be planned.
    #[error("{}", in_full(.0))]
    Gait(#[from] GaitError),
    /// A setting cannot be.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// What the estimator is told cannot be.
    #[error("estimator: {0}")]
    Estimator(#[from] EstimatorError),
    /// What the controller is told cannot be.
    #[error("controller: {0}")]
    Controller(#[from] controller::ControllerError),
    /// The robot makes no model.
    #[error(transparent)]
    Model(#[from] robot_model::RobotModelError),
    /// A setting of the controller does not fit the model.
    #[error("controller: {0}")]
    WholeBody(#[from] wholebody::WholeBodyError),
    /// The configuration of another process is for another robot or sole.
    #[error(
        "{key} = {}, but the planner's is {}: give all processes the same", .found.display(), .expected.display()
    )]
    OtherRobot {
        /// Key in the planner's configuration.
        key: &'static str,
        /// What it says.
        found: PathBuf,
        /// The planner's own.
        expected: PathBuf,
    },
    /// The walk was planned, but cannot be walked.
    #[error("the walk cannot be walked: {0}")]
    NotWalkable(#[from] crate::NotWalkable),
    /// The pattern cannot be sent.
    #[error(transparent)]
    Pattern(#[from] messages::PatternRefused),
}

/// A wrong setting with its full key, anything else as it is.
fn in_full(error: &GaitError) -> String {
    match error {
        GaitError::Setting(setting) => setting.clone().under("gait").to_string(),
        other => format!("gait: {other}"),
    }
}

/// Lengths that agree to this are the same (m): figures in files have at most six digits.
const SAME_LENGTH_M: f64 = 1e-6;
/// The links of a robot sum up to its mass with the rounding of as many numbers: it is taken to the gram.
const GRAMS_PER_KG: f64 = 1e3;
/// By how much less the gait may count on than a mesh carries (m): round soles carry no round figures, people write whole millimetres.
const ROUNDED_DOWN_M: f64 = 1e-3;

impl PlannerSettings {
    /// Is every number one that can be, and does what the gait says of the robot's foot agree with the robot?
    pub(crate) fn check(&self, robot: &Robot) -> Result<(), PlannerError> {
        let violation = Range::between(0.0, 0.1);
        violation.demand("constraint_violation_max_m", self.constraint_violation_max_m, "0.001 is usual")?;
        let doubtful = "linear elasticity is doubtful from the default on";
        Range::between(0.0, 90.0).demand("sole_tilt_max_deg", self.sole_tilt_max_deg, doubtful)?;
        Range::between(0.0, 1.0).demand("sole_compression_max", self.sole_compression_max, doubtful)?;
        let RehearsalSettings { period_s, smoothing_s, .. } = self.rehearsal;
        Range::between(1e-3, 0.02).demand(
            "rehearsal.period_s",
            period_s,
            "the controller's period, 0.005, is usual",
        )?;
        Range::between(rehearsal::HALF_WIDTH_MIN_PERIODS * period_s, 0.2).demand(
            "rehearsal.smoothing_s",
            smoothing_s,
            "0.04 is usual",
        )?;
        self.check_same_robot()?;
        let file = robot.sole_file.clone();
        let [length_m, width_m] = robot.sole_outline().carrying_m;
        let ankle = robot.sole.foot.ankle_in_sole_m;
        let gait = &self.gait;
        let less_m = if robot.sole_mesh.is_some() { ROUNDED_DOWN_M } else { 0.0 };
        let ankle_in_sole_m = |axis: usize| gait.sole.left_ankle_in_sole_m.map(|ankle| ankle[axis]);
        let pairs = [
            ("body.ankle_height_m", gait.body.ankle_height_m, ankle[2], 0.0),
            ("sole.left_ankle_in_sole_m[0]", ankle_in_sole_m(0), ankle[0], 0.0),
            ("sole.left_ankle_in_sole_m[1]", ankle_in_sole_m(1), ankle[1], 0.0),
            ("sole.length_m", gait.sole.length_m, length_m, less_m),
            ("sole.width_m", gait.sole.width_m, width_m, less_m),
        ];
        for (field, given, expected, less_m) in pairs {
            let Some(found) = given else { continue };
            // A value that is not a number is in no range.
            let same = (expected - less_m - SAME_LENGTH_M..=expected + SAME_LENGTH_M).contains(&found);
            if !same {
                return Err(PlannerError::Disagreement { field, found, expected, file });
            }
        }
        Ok(())
    }

    /// Are the other processes' configurations for the same robot and sole?
    fn check_same_robot(&self) -> Result<(), PlannerError> {
        let of = |file: &Option<PathBuf>| file.clone().unwrap_or_else(|| self.robot.join("sole.toml"));
        let pairs = [
            ("estimator.robot", self.estimator.robot.clone(), self.robot.clone()),
            ("estimator.sole_file", of(&self.estimator.sole_file), of(&self.sole_file)),
            ("controller.robot", self.controller.robot.clone(), self.robot.clone()),
            ("controller.sole_file", of(&self.controller.sole_file), of(&self.sole_file)),
        ];
        match pairs.into_iter().find(|(_, found, expected)| found != expected) {
            Some((key, found, expected)) => Err(PlannerError::OtherRobot { key, found, expected }),
            None => Ok(()),
        }
    }

    /// The walk for this robot: mass, ankles and soles are the robot's where nothing else is given. Where its soles reach farther than the
    /// rectangles it counts on, as round ones do, the feet keep their distance between the soles and not only between the rectangles.
    pub(crate) fn gait_of(&self, robot: &Robot) -> Result<GaitSettings, LegsError> {
        let mut gait = self.gait.clone();
        if gait.body.mass_kg.is_none() {
            let mass_kg = RobotLegs::new(robot)?.mass_kg();
            gait.body.mass_kg = Some((mass_kg * GRAMS_PER_KG).round() / GRAMS_PER_KG);
        }
        let [x_m, y_m, z_m] = robot.sole.foot.ankle_in_sole_m;
        let outline = robot.sole_outline();
        let [carrying_length_m, carrying_width_m] = outline.carrying_m;
        gait.body.ankle_height_m.get_or_insert(z_m);
        gait.sole.left_ankle_in_sole_m.get_or_insert([x_m, y_m]);
        let counted_length_m = *gait.sole.length_m.get_or_insert(carrying_length_m);
        let counted_width_m = *gait.sole.width_m.get_or_insert(carrying_width_m);
        let [length_m, width_m, _] = outline.size_m;
        let [beyond_x_m, beyond_y_m] = [0.5 * (length_m - counted_length_m), 0.5 * (width_m - counted_width_m)];
        // The inner edge of one sole, and the farthest corner of the other, which may be turned.
        gait.limits.feet_gap_min_m += beyond_y_m + beyond_x_m.hypot(beyond_y_m);
        Ok(gait)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn shipped(sole: Option<&str>) -> (PlannerSettings, Robot) {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let settings: PlannerSettings = scenario::load(&root.join("config/planner.toml"), &[]).expect("it ships");
        let sole = sole.map(|name| settings.robot.join(name));
        let robot = Robot::load_on(&settings.robot, sole.as_deref()).expect("it ships");
        (settings, robot)
    }

    #[test]
    fn a_block_changes_nothing_and_round_soles_keep_their_own_distance() {
        let (settings, robot) = shipped(None);
        let gait = settings.gait_of(&robot).expect("it has legs");
        assert_eq!(gait.limits, settings.gait.limits);
        let (body, sole) = (&gait.body, &gait.sole);
        assert_eq!((body.mass_kg, body.ankle_height_m), (Some(39.0), Some(0.103)));
        assert_eq!((sole.length_m, sole.width_m), (Some(0.23), Some(0.13)));
        assert_eq!(sole.left_ankle_in_sole_m, Some([-0.015, -0.011]));
        assert_eq!(settings.gait, GaitSettings::default(), "what ships says nothing of the robot");
        let (mut settings, robot) = shipped(Some("sole-rounded.toml"));
        let outline = robot.sole_outline();
        let [carrying_length_m, carrying_width_m] = outline.carrying_m;
        // What carries, and a millimetre less: at least both inner edges, counted from the rectangle that the gait knows.
        for (length_m, width_m) in [outline.carrying_m.into(), (carrying_length_m - 1e-3, carrying_width_m - 1e-3)] {
            (settings.gait.sole.length_m, settings.gait.sole.width_m) = (Some(length_m), Some(width_m));
            let beyond_m = settings.gait_of(&robot).expect("it has legs").limits.feet_gap_min_m
                - settings.gait.limits.feet_gap_min_m;
            let edge_m = 0.5 * (outline.size_m[1] - width_m);
            let corner_m = edge_m.hypot(0.5 * (outline.size_m[0] - length_m));
            assert!((beyond_m - edge_m - corner_m).abs() < 1e-12 && beyond_m < 0.035, "{beyond_m}");
        }
    }

    #[test]
    fn a_window_too_short_for_its_cubic_is_refused_with_its_key() {
        let (mut settings, robot) = shipped(None);
        for (period_s, shortest_s) in [(0.005, 0.0125), (0.01, 0.025)] {
            settings.rehearsal.period_s = period_s;
            settings.rehearsal.smoothing_s = shortest_s;
            settings.check(&robot).expect("it holds five steps");
            settings.rehearsal.smoothing_s = 0.99 * shortest_s;
            let refused = settings.check(&robot).expect_err("four, at some times").to_string();
            assert!(refused.contains("`rehearsal.smoothing_s`"), "{refused}");
        }
    }

    #[test]
    fn a_mesh_may_be_counted_on_a_little_less_but_never_more_than_it_carries() {
        let (mut settings, robot) = shipped(Some("sole-rounded.toml"));
        let [length_m, width_m] = robot.sole_outline().carrying_m;
        let mut with = |length_m: f64| {
            (settings.gait.sole.length_m, settings.gait.sole.width_m) = (Some(length_m), Some(width_m));
            settings.check(&robot)
        };
        assert!(with(length_m).is_ok() && with(length_m - 0.9e-3).is_ok());
        for found in [length_m + 1e-5, length_m - 1.1e-3, f64::NAN] {
            let refused = with(found);
            assert!(matches!(refused, Err(PlannerError::Disagreement { field: "sole.length_m", .. })), "{refused:?}");
        }
        let (mut settings, robot) = shipped(None);
        settings.gait.sole.length_m = Some(0.2295);
        assert!(settings.check(&robot).is_err(), "a block has round figures");
    }
}
