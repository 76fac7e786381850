//! The planner's configuration.

use gait::{GaitError, GaitSettings};
use robot::{Robot, RobotError};
use serde::Deserialize;
use soles::SoleChoice;
use std::path::PathBuf;

/// `config/planner.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannerSettings {
    /// Folder of the robot.
    pub robot: PathBuf,
    /// The walk.
    pub gait: GaitSettings,
    /// Largest angle between a sole and the ground: from 5 degrees on linear elasticity is doubtful ([`sole::Status::DoubtfulTilt`]).
    #[serde(default = "sole_tilt_max_deg")]
    pub sole_tilt_max_deg: f64,
    /// The soles that must carry it: what replaces the robot's `sole.toml`; level `rigid` asks none.
    #[serde(default)]
    pub sole: SoleChoice,
}

fn sole_tilt_max_deg() -> f64 {
    5.0
}

/// Why there is no walk.
#[derive(Debug, thiserror::Error)]
pub enum PlannerError {
    /// The robot's folder.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// Configuration and robot disagree: the forces would be planned for another foot.
    #[error(
        "gait.{field} = {found}, but {} says {expected}: change one of them", .file.display()
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
    #[error("gait: {0}")]
    Gait(#[from] GaitError),
    /// A limit that is none.
    #[error("sole_tilt_max_deg = {0}: expected 0 to 90 degrees")]
    SoleTiltMax(f64),
    /// The soles cannot be built.
    #[error(transparent)]
    Soles(#[from] soles::SolesError),
    /// The walk was planned, but cannot be walked.
    #[error("the walk cannot be walked: {0}")]
    NotWalkable(#[from] crate::NotWalkable),
    /// The pattern cannot be sent.
    #[error(transparent)]
    Pattern(#[from] messages::PatternRefused),
}

/// Lengths that agree to this are the same (m): figures in files have at most six digits.
const SAME_LENGTH_M: f64 = 1e-6;

impl PlannerSettings {
    /// Does the gait's foot agree with the robot's?
    pub(crate) fn check(&self, robot: &Robot) -> Result<(), PlannerError> {
        if !(0.0..=90.0).contains(&self.sole_tilt_max_deg) {
            return Err(PlannerError::SoleTiltMax(self.sole_tilt_max_deg));
        }
        let file = robot.folder.join("sole.toml");
        let ankle = robot.sole.foot.ankle_in_sole_m;
        let gait = &self.gait;
        let mut pairs = vec![
            ("body.ankle_height_m", gait.body.ankle_height_m, ankle[2]),
            ("sole.left_ankle_in_sole_m[0]", gait.sole.left_ankle_in_sole_m[0], ankle[0]),
            ("sole.left_ankle_in_sole_m[1]", gait.sole.left_ankle_in_sole_m[1], ankle[1]),
        ];
        if let Some([length_m, width_m, _]) = robot.sole.mesh.box_m {
            pairs.push(("sole.length_m", gait.sole.length_m, length_m));
            pairs.push(("sole.width_m", gait.sole.width_m, width_m));
        }
        for (field, found, expected) in pairs {
            // Written so that a value that is not a number disagrees.
            let same = (found - expected).abs() <= SAME_LENGTH_M;
            if !same {
                return Err(PlannerError::Disagreement { field, found, expected, file });
            }
        }
        Ok(())
    }
}
