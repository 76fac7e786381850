//! The controller's configuration.
//!
//! The tables of the whole-body step are [`wholebody`]'s own types, read as they are; what the robot's folder says is added to them here.

use lateness::RightsSettings;
use messages::CONTROL_PERIOD_S;
use multibody::Model;
use ranges::OutOfRange;
use robot::{Robot, RobotError};
use robot_model::RobotModelError;
use serde::Deserialize;
use spatial::Vec3;
use stabiliser::StabiliserSettings;
use state::{IntegrationSettings, SettleSettings};
use std::path::PathBuf;
use wholebody::{
    CollisionSettings, ConstraintSettings, FootSettings, LinkCapsule, PostureJoint, RelaxationSettings, SoleFace,
    SolverSettings, TaskSettings, WholeBodySettings,
};

/// `config/controller.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerSettings {
    /// Folder of the robot.
    pub robot: PathBuf,
    /// Another sole than that of the robot's folder: a file like its `sole.toml`.
    #[serde(default)]
    pub sole_file: Option<PathBuf>,
    /// Weights and stiffnesses of the tasks.
    #[serde(default)]
    pub tasks: TaskSettings,
    /// Limits.
    #[serde(default)]
    pub constraints: ConstraintSettings,
    /// Self-collision.
    #[serde(default)]
    pub collision: CollisionSettings,
    /// What gives way when limits exclude each other.
    #[serde(default)]
    pub relaxation: RelaxationSettings,
    /// Solver of the quadratic program.
    #[serde(default)]
    pub solver: SolverSettings,
    /// From accelerations to the next state.
    #[serde(default)]
    pub integration: IntegrationSettings,
    /// The stabiliser, for robots whose driver has none: it acts one period later than a built-in one. Without the table there is
    /// none.
    #[serde(default)]
    pub stabiliser: Option<StabiliserSettings>,
    /// When the walk may start.
    #[serde(default)]
    pub settle: SettleSettings,
    /// Quadratic programs to be written down.
    #[serde(default)]
    pub programs: Programs,
    /// What it asks of the system by the clock.
    #[serde(default = "own_rights")]
    pub real_time: RightsSettings,
}

/// What the controller asks of the system by the clock.
fn own_rights() -> RightsSettings {
    RightsSettings::fifo(65, 1)
}

/// Section `[programs]`: quadratic programs written as JSON, as `soleus-inspect qp` reads them. By default none is, and no tick pays.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Programs {
    /// Those of these ticks.
    pub ticks: Vec<i64>,
    /// Those of as many steps that were relaxed or held, the first ones.
    pub trouble_max: u32,
    /// Where to; the launcher names a folder of the run. By default the working directory.
    pub output_folder: PathBuf,
}

/// Why there is no controller.
#[derive(Debug, thiserror::Error)]
pub enum ControllerError {
    /// The robot's folder.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// Its model.
    #[error(transparent)]
    Model(#[from] RobotModelError),
    /// More joints than a message carries.
    #[error("{}: {found} joints, a message carries at most {}", .file.display(), messages::MAX_JOINTS)]
    TooManyJoints {
        /// The description.
        file: PathBuf,
        /// Number of joints.
        found: usize,
    },
    /// The stabiliser has no inverse kinematics for a leg.
    #[error("the {side} leg has no inverse kinematics, which the stabiliser needs")]
    Leg {
        /// Which.
        side: &'static str,
        /// What is wrong with it.
        source: multibody::leg::LegError,
    },
    /// A setting is outside of what has a meaning, or does not fit the robot.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// A setting does not fit the model.
    #[error(transparent)]
    WholeBody(#[from] wholebody::WholeBodyError),
}

impl ControllerSettings {
    /// Is every number one that can be? [`wholebody`] asks this of its own.
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        self.integration.check(CONTROL_PERIOD_S)?;
        self.settle.check(CONTROL_PERIOD_S)
    }

    /// What the whole-body step is made with: the robot's figures and these.
    ///
    /// # Errors
    /// [`OutOfRange`] with the key.
    pub fn whole_body(&self, robot: &Robot, model: &Model) -> Result<WholeBodySettings, OutOfRange> {
        self.check_friction(robot)?;
        let description = &robot.description;
        let [length_m, width_m] = robot.sole_outline().carrying_m;
        let foot = |index: usize| FootSettings {
            ankle_link: description.feet[index].ankle_frame.clone(),
            ankle_in_sole_m: Vec3::from(robot.sole.foot.ankle_in_sole_m(index)),
        };
        let posture = (model.joints().iter())
            .map(|joint| PostureJoint {
                joint: joint.name.clone(),
                position_rad: description.half_sitting_rad(&joint.name),
            })
            .collect();
        let capsule = |capsule: &robot::Capsule| LinkCapsule {
            name: capsule.name.clone(),
            link: capsule.link.clone(),
            from_m: Vec3::from(capsule.from_m),
            to_m: Vec3::from(capsule.to_m),
            radius_m: capsule.radius_m,
        };
        let limits = &description.limits;
        Ok(WholeBodySettings {
            feet: [foot(0), foot(1)],
            sole: SoleFace { length_m, width_m, friction: robot.sole.friction.smallest() },
            torso_link: description.torso_link.clone(),
            posture,
            tasks: self.tasks,
            constraints: ConstraintSettings {
                torque_factor: limits.torque_factor,
                velocity_factor: limits.velocity_factor,
                position_margin_rad: limits.position_margin_deg.to_radians(),
                ..self.constraints
            },
            collision: CollisionSettings {
                capsules: description.capsules.iter().map(capsule).collect(),
                pairs: description.collision_pairs.clone(),
                ..self.collision.clone()
            },
            relaxation: self.relaxation.clone(),
            solver: self.solver,
        })
    }

    /// Forces that the sole cannot carry must not be planned.
    fn check_friction(&self, robot: &Robot) -> Result<(), OutOfRange> {
        let smallest = robot.sole.friction.smallest();
        match self.constraints.friction {
            Some(found) if found > smallest => {
                let expected =
                    format!("at most {smallest}, from which on the sole slips ({})", robot.sole_file.display());
                Err(OutOfRange::new("constraints.friction", found, expected, "without the key it is the sole's"))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use robot::Friction;
    use std::path::Path;

    fn shipped(changes: &[scenario::Setting]) -> ControllerSettings {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        scenario::load(&root.join("config/controller.toml"), changes).expect("it ships")
    }

    #[test]
    fn the_shipped_file_shows_the_defaults() {
        let shipped = shipped(&[]);
        let bare: ControllerSettings = toml::from_str("robot = 'x'").expect("the rest has defaults");
        assert_eq!(ControllerSettings { robot: bare.robot.clone(), ..shipped }, bare);
    }

    #[test]
    fn forces_that_the_sole_cannot_carry_are_not_planned() {
        let mut settings = shipped(&[]);
        let mut robot = Robot::load(&settings.robot).expect("it ships");
        let (model, _) = robot_model::walking_model(&robot).expect("it ships");
        for slippery in [Friction::Uniform(0.6), Friction::PerPatch(vec![0.7, 0.6, 0.65])] {
            robot.sole.friction = slippery;
            settings.constraints.friction = None;
            assert_eq!(settings.whole_body(&robot, &model).expect("the sole's own").friction(), 0.6);
            settings.constraints.friction = Some(0.5);
            assert_eq!(settings.whole_body(&robot, &model).expect("less than the sole's").friction(), 0.5);
            settings.constraints.friction = Some(0.65);
            let refused = settings.whole_body(&robot, &model).expect_err("0.65 is planned with").to_string();
            for said in ["`constraints.friction` is 0.65", "at most 0.6", "sole.toml"] {
                assert!(refused.contains(said), "no `{said}` in {refused}");
            }
        }
    }

    #[test]
    fn a_key_that_was_renamed_says_its_new_name() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let old = "solver.reserve=none".parse().expect("a setting");
        let refused =
            scenario::load::<ControllerSettings>(&root.join("config/controller.toml"), &[old]).expect_err("old");
        assert!(
            refused.to_string().contains("`solver.reserve`: no longer a key: it is called solver.backup"),
            "{refused}"
        );
    }

    #[test]
    fn what_the_robot_says_is_no_key_of_the_configuration() {
        for key in ["constraints.torque_factor = 0.5", "collision.pairs = []"] {
            let refused = toml::from_str::<ControllerSettings>(&format!("robot = 'x'\n{key}")).expect_err(key);
            assert!(refused.to_string().contains("unknown field"), "{refused}");
        }
    }
}
