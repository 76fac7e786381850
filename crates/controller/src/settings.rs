//! The controller's configuration.

use messages::CONTROL_PERIOD_S;
use multibody::Model;
use robot::{Robot, RobotError};
use robot_model::RobotModelError;
use serde::Deserialize;
use spatial::Vec3;
use std::path::PathBuf;
use wholebody::{
    Backend, CollisionSettings, ConstraintSettings, FootSettings, Gains, Limit, LinkCapsule, PostureJoint,
    RelaxationSettings, SoleRectangle, TaskSettings, WholeBodySettings,
};

use crate::integration::IntegrationSettings;
use crate::settle::SettleSettings;

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
    pub tasks: Tasks,
    /// Limits.
    #[serde(default)]
    pub constraints: Constraints,
    /// Self-collision.
    #[serde(default)]
    pub collision: Collision,
    /// What gives way when limits exclude each other.
    #[serde(default)]
    pub relaxation: Relaxation,
    /// Solver of the quadratic program.
    #[serde(default)]
    pub solver: Solver,
    /// From accelerations to the next state.
    #[serde(default)]
    pub integration: IntegrationSettings,
    /// When the walk may start.
    #[serde(default)]
    pub settle: SettleSettings,
    /// Quadratic programs to be written down.
    #[serde(default)]
    pub programs: Programs,
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

/// Weight and stiffness of a task.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskGains {
    /// Weight in the cost.
    pub weight: f64,
    /// Stiffness (1/s^2); damping is critical.
    pub stiffness_per_s2: f64,
}

impl From<Gains> for TaskGains {
    fn from(gains: Gains) -> Self {
        Self { weight: gains.weight, stiffness_per_s2: gains.stiffness }
    }
}

impl From<TaskGains> for Gains {
    fn from(gains: TaskGains) -> Self {
        Self { weight: gains.weight, stiffness: gains.stiffness_per_s2 }
    }
}

/// Section `[tasks]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tasks {
    /// Position of a swinging ankle.
    pub swing_position: TaskGains,
    /// Orientation of a swinging ankle.
    pub swing_orientation: TaskGains,
    /// Centre of mass.
    pub com: TaskGains,
    /// Factor on the weight of its vertical part.
    pub com_height_factor: f64,
    /// Absolute orientation of the torso.
    pub torso: TaskGains,
    /// Posture of the joints that are not in a leg.
    pub posture: TaskGains,
    /// Posture of the legs.
    pub leg_posture: TaskGains,
    /// Weight of the planned foot wrenches.
    pub wrench_weight: f64,
    /// Length that makes moments comparable with forces (m).
    pub wrench_lever_m: f64,
    /// Damping of the contact intensities.
    pub intensity_damping: f64,
    /// Angular momentum about the centre of mass towards zero; weight 0 = off.
    pub angular_momentum: MomentumGains,
    /// Least joint torques; 0 = off.
    pub torque_weight: f64,
}

/// Weight of the angular momentum and how fast it shall vanish.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MomentumGains {
    /// Weight in the cost; 0 = off.
    pub weight: f64,
    /// Rate at which it decays (1/s).
    pub rate_per_s: f64,
}

impl Default for MomentumGains {
    fn default() -> Self {
        Self { weight: 0.0, rate_per_s: 10.0 }
    }
}

impl MomentumGains {
    /// None when off. What is no weight is passed on, to be refused by name.
    fn gains(self) -> Option<Gains> {
        (self.weight != 0.0).then_some(Gains { weight: self.weight, stiffness: self.rate_per_s })
    }
}

impl Default for Tasks {
    fn default() -> Self {
        let d = TaskSettings::default();
        Self {
            swing_position: d.swing_position.into(),
            swing_orientation: d.swing_orientation.into(),
            com: d.com.into(),
            com_height_factor: d.com_height_factor,
            torso: d.torso.into(),
            posture: d.posture.into(),
            leg_posture: d.leg_posture.into(),
            wrench_weight: d.wrench_weight,
            wrench_lever_m: d.wrench_lever_m,
            intensity_damping: d.intensity_damping,
            angular_momentum: MomentumGains::default(),
            torque_weight: 0.0,
        }
    }
}

/// Section `[constraints]`; joint limits come from the robot's folder.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Constraints {
    /// Friction the forces may use.
    pub friction: f64,
    /// Edges of the linearised cone per contact point: 4, 8 or 16.
    pub generators_per_point: usize,
    /// Load a foot may carry beyond its planned share, as a share of the weight.
    pub load_margin: f64,
    /// Deceleration that joints can count on near a limit (rad/s^2).
    pub braking_rad_per_s2: f64,
    /// Largest acceleration of a joint (rad/s^2).
    pub acceleration_max_rad_per_s2: f64,
    /// Stiffness with which stance ankles follow the estimator's position (1/s^2).
    pub contact_position_stiffness_per_s2: f64,
    /// The same for their orientation (1/s^2).
    pub contact_orientation_stiffness_per_s2: f64,
}

impl Default for Constraints {
    fn default() -> Self {
        let d = ConstraintSettings::default();
        Self {
            friction: d.friction,
            generators_per_point: d.generators_per_point,
            load_margin: d.load_margin,
            braking_rad_per_s2: d.braking_rad_per_s2,
            acceleration_max_rad_per_s2: d.acceleration_max_rad_per_s2,
            contact_position_stiffness_per_s2: d.contact_position_stiffness,
            contact_orientation_stiffness_per_s2: d.contact_orientation_stiffness,
        }
    }
}

/// Section `[collision]`; capsules and pairs come from the robot's folder.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Collision {
    /// Whether pairs are watched at all.
    pub on: bool,
    /// Distance from which the damper acts (m).
    pub interaction_m: f64,
    /// Distance that is kept (m).
    pub safety_m: f64,
    /// Speed of approach allowed at the interaction distance (m/s).
    pub damping_m_per_s: f64,
}

impl Default for Collision {
    fn default() -> Self {
        let d = CollisionSettings::default();
        Self { on: true, interaction_m: d.interaction_m, safety_m: d.safety_m, damping_m_per_s: d.damping_m_per_s }
    }
}

/// Section `[relaxation]`; see [`RelaxationSettings`].
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Relaxation {
    /// First gives way first; what is not listed never does.
    pub order: Vec<Yielding>,
    /// Load of a foot beyond its plan and margin (N).
    pub load_n: f64,
    /// Acceleration of two bodies towards each other (m/s^2).
    pub collision_m_per_s2: f64,
    /// Acceleration of a joint beyond its bound (rad/s^2).
    pub joint_motion_rad_per_s2: f64,
    /// Torques give way up to this part of the motor's limit.
    pub torque_factor: f64,
    /// Acceleration by which a stance ankle may leave its target (m/s^2, rad/s^2).
    pub contact_m_per_s2: f64,
}

/// Kinds of limits that may give way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Yielding {
    /// Load of a foot.
    Load,
    /// Damper between bodies.
    Collision,
    /// Position and speed of a joint.
    JointMotion,
    /// Torque of a joint.
    Torque,
    /// Motion of a stance ankle.
    Contact,
}

impl From<Limit> for Yielding {
    fn from(limit: Limit) -> Self {
        match limit {
            Limit::Load => Self::Load,
            Limit::Collision => Self::Collision,
            Limit::JointMotion => Self::JointMotion,
            Limit::Torque => Self::Torque,
            Limit::Contact => Self::Contact,
        }
    }
}

impl From<Yielding> for Limit {
    fn from(yielding: Yielding) -> Self {
        match yielding {
            Yielding::Load => Self::Load,
            Yielding::Collision => Self::Collision,
            Yielding::JointMotion => Self::JointMotion,
            Yielding::Torque => Self::Torque,
            Yielding::Contact => Self::Contact,
        }
    }
}

impl Relaxation {
    fn whole_body(&self) -> RelaxationSettings {
        RelaxationSettings {
            order: self.order.iter().copied().map(Limit::from).collect(),
            load_n: self.load_n,
            collision_m_per_s2: self.collision_m_per_s2,
            joint_motion_rad_per_s2: self.joint_motion_rad_per_s2,
            torque_factor: self.torque_factor,
            contact_m_per_s2: self.contact_m_per_s2,
        }
    }
}

impl Default for Relaxation {
    fn default() -> Self {
        let d = RelaxationSettings::default();
        Self {
            order: d.order.into_iter().map(Yielding::from).collect(),
            load_n: d.load_n,
            collision_m_per_s2: d.collision_m_per_s2,
            joint_motion_rad_per_s2: d.joint_motion_rad_per_s2,
            torque_factor: d.torque_factor,
            contact_m_per_s2: d.contact_m_per_s2,
        }
    }
}

/// Section `[solver]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Which.
    pub backend: SolverBackend,
    /// Takes a step when `backend` runs out of iterations or fails.
    pub reserve: ReserveBackend,
    /// Tolerance of the interior-point method; the active-set method is exact.
    pub interior_tolerance: f64,
    /// Changes of the active set after which the reserve takes over.
    pub iterations_max: usize,
}

/// Which solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolverBackend {
    /// Own warm-started dual active set.
    ActiveSet,
    /// Clarabel.
    Interior,
}

/// Which solver stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReserveBackend {
    /// Own warm-started dual active set.
    ActiveSet,
    /// Clarabel.
    Interior,
    /// None: the joints are brought to rest instead.
    None,
}

impl Default for Solver {
    fn default() -> Self {
        Self {
            backend: SolverBackend::ActiveSet,
            reserve: ReserveBackend::Interior,
            interior_tolerance: 1e-9,
            iterations_max: 300,
        }
    }
}

impl Solver {
    fn backend(&self) -> Backend {
        match self.backend {
            SolverBackend::ActiveSet => Backend::ActiveSet,
            SolverBackend::Interior => Backend::Interior { tolerance: self.interior_tolerance },
        }
    }

    fn reserve(&self) -> Option<Backend> {
        match self.reserve {
            ReserveBackend::ActiveSet => Some(Backend::ActiveSet),
            ReserveBackend::Interior => Some(Backend::Interior { tolerance: self.interior_tolerance }),
            ReserveBackend::None => None,
        }
    }
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
    /// Forces would be planned that the sole cannot carry.
    #[error(
        "constraints.friction = {found}, but the sole slips from {smallest} on ({}): at most {smallest}", .file.display()
    )]
    Friction {
        /// The controller's.
        found: f64,
        /// The sole's smallest.
        smallest: f64,
        /// The description of the sole.
        file: PathBuf,
    },
    /// A setting is outside of what has a meaning.
    #[error("`{key}` is {found}, must be {expected}")]
    Setting {
        /// Key in the controller's configuration.
        key: &'static str,
        /// What it says.
        found: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// A setting does not fit the model.
    #[error(transparent)]
    WholeBody(#[from] wholebody::WholeBodyError),
}

/// Weights, stiffnesses and limits beyond this have no meaning in SI units and f64: their products lose every digit.
const SETTING_MAX: f64 = 1e9;
pub(crate) fn positive(key: &'static str, found: f64) -> Result<(), ControllerError> {
    if found > 0.0 && found <= SETTING_MAX { Ok(()) } else { Err(wrong(key, found, "positive and at most 1e9")) }
}

pub(crate) fn wrong(key: &'static str, found: f64, expected: &'static str) -> ControllerError {
    ControllerError::Setting { key, found, expected }
}

impl ControllerSettings {
    /// Is every number one that can be? `wholebody` asks this of all that it is given; here is what it never sees: the rate of a task
    /// without weight, the tolerance of a solver that does not answer.
    pub(crate) fn check(&self) -> Result<(), ControllerError> {
        positive("tasks.angular_momentum.rate_per_s", self.tasks.angular_momentum.rate_per_s)?;
        let tolerance = self.solver.interior_tolerance;
        if !(tolerance > 0.0 && tolerance < 1.0) {
            return Err(wrong("solver.interior_tolerance", tolerance, "above 0 and below 1"));
        }
        self.integration.check()?;
        self.settle.check(CONTROL_PERIOD_S)
    }

    /// What the whole-body step is made with: the robot's figures and these.
    pub(crate) fn whole_body(&self, robot: &Robot, model: &Model) -> Result<WholeBodySettings, ControllerError> {
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
        let limits = &description.limits;
        let tasks = &self.tasks;
        Ok(WholeBodySettings {
            feet: [foot(0), foot(1)],
            sole: SoleRectangle { length_m, width_m },
            torso_link: description.torso_link.clone(),
            posture,
            tasks: TaskSettings {
                swing_position: tasks.swing_position.into(),
                swing_orientation: tasks.swing_orientation.into(),
                com: tasks.com.into(),
                com_height_factor: tasks.com_height_factor,
                torso: tasks.torso.into(),
                posture: tasks.posture.into(),
                leg_posture: tasks.leg_posture.into(),
                wrench_weight: tasks.wrench_weight,
                wrench_lever_m: tasks.wrench_lever_m,
                intensity_damping: tasks.intensity_damping,
                angular_momentum: tasks.angular_momentum.gains(),
                torque_weight: (tasks.torque_weight != 0.0).then_some(tasks.torque_weight),
            },
            constraints: ConstraintSettings {
                friction: self.constraints.friction,
                generators_per_point: self.constraints.generators_per_point,
                load_margin: self.constraints.load_margin,
                braking_rad_per_s2: self.constraints.braking_rad_per_s2,
                acceleration_max_rad_per_s2: self.constraints.acceleration_max_rad_per_s2,
                contact_position_stiffness: self.constraints.contact_position_stiffness_per_s2,
                contact_orientation_stiffness: self.constraints.contact_orientation_stiffness_per_s2,
                torque_fraction: limits.torque_factor,
                velocity_fraction: limits.velocity_factor,
                position_margin_rad: limits.position_margin_deg.to_radians(),
            },
            collision: self.collision(robot),
            relaxation: self.relaxation.whole_body(),
            backend: self.solver.backend(),
            reserve: self.solver.reserve(),
            iterations_max: self.solver.iterations_max,
        })
    }

    fn check_friction(&self, robot: &Robot) -> Result<(), ControllerError> {
        let (found, smallest) = (self.constraints.friction, robot.sole.friction.smallest());
        if found > smallest {
            return Err(ControllerError::Friction { found, smallest, file: robot.sole_file.clone() });
        }
        Ok(())
    }

    fn collision(&self, robot: &Robot) -> CollisionSettings {
        let c = &self.collision;
        let (capsules, pairs): (Vec<_>, Vec<_>) = if c.on {
            let capsule = |capsule: &robot::Capsule| LinkCapsule {
                name: capsule.name.clone(),
                link: capsule.link.clone(),
                from_m: Vec3::from(capsule.from_m),
                to_m: Vec3::from(capsule.to_m),
                radius_m: capsule.radius_m,
            };
            (robot.description.capsules.iter().map(capsule).collect(), robot.description.collision_pairs.clone())
        } else {
            (Vec::new(), Vec::new())
        };
        CollisionSettings {
            capsules,
            pairs,
            interaction_m: c.interaction_m,
            safety_m: c.safety_m,
            damping_m_per_s: c.damping_m_per_s,
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
    fn optional_tasks_are_off_until_they_have_a_weight() {
        let whole_body = |settings: &ControllerSettings| {
            let robot = Robot::load(&settings.robot).expect("it ships");
            let (model, _) = robot_model::walking_model(&robot).expect("it ships");
            settings.whole_body(&robot, &model).expect("it fits").tasks
        };
        let mut settings = shipped(&[]);
        let off = whole_body(&settings);
        assert_eq!((off.angular_momentum, off.torque_weight), (None, None));
        settings.tasks.angular_momentum.weight = 2.0;
        settings.tasks.torque_weight = 1e-3;
        let on = whole_body(&settings);
        assert_eq!(on.angular_momentum, Some(Gains { weight: 2.0, stiffness: 10.0 }));
        assert_eq!(on.torque_weight, Some(1e-3));
    }

    #[test]
    fn forces_that_the_sole_cannot_carry_are_not_planned() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let settings: ControllerSettings = scenario::load(&root.join("config/controller.toml"), &[]).expect("it ships");
        let mut robot = Robot::load(&settings.robot).expect("it ships");
        settings.check_friction(&robot).expect("what ships fits");
        for slippery in [Friction::Uniform(0.6), Friction::PerPatch(vec![0.7, 0.6, 0.65])] {
            robot.sole.friction = slippery;
            let refused = settings.check_friction(&robot).expect_err("0.65 is planned with").to_string();
            for said in ["constraints.friction = 0.65", "at most 0.6", "sole.toml"] {
                assert!(refused.contains(said), "no `{said}` in {refused}");
            }
        }
    }
}
