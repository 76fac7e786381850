//! What a person may tune, as plain data: the tables `[tasks]`, `[constraints]`, `[collision]`, `[relaxation]` and `[solver]` of the
//! controller's configuration. Every field names the formula it enters; the module `validate` says what it may be. Fields marked *robot's*
//! come from the robot's folder: no key sets them.

use crate::collision::CollisionSettings;
use serde::Deserialize;
use spatial::Vec3;

/// Weight and stiffness of a task `a_des = a_ref + kd (v_ref - v) + kp (x_ref - x)` with critical damping `kd = 2 sqrt(kp)`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// alpha in `alpha |E|²`. Ratios matter, not values.
    pub weight: f64,
    /// kp (1/s²). Useful: up to about `0.1 / dt²`.
    pub stiffness_per_s2: f64,
}

impl Gains {
    /// kd = 2 sqrt(kp) (1/s).
    #[must_use]
    pub fn damping(&self) -> f64 {
        2.0 * self.stiffness_per_s2.sqrt()
    }
}

/// Weight of the angular momentum about the centre of mass, and how fast it shall vanish: `h' = -rate h`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MomentumSettings {
    /// alpha per (N m)²; 0 = no such objective.
    pub weight: f64,
    /// Rate of decay (1/s). Useful: 1 to 20; limited to `0.5 / dt`.
    pub rate_per_s: f64,
}

/// One foot.
#[derive(Debug, Clone, PartialEq)]
pub struct FootSettings {
    /// Link whose frame is the ankle frame: origin where the ankle's axes meet, axes of the foot.
    pub ankle_link: String,
    /// Ankle in the sole frame (m). The sole frame's origin is the centre of the undeformed sole's bottom face.
    pub ankle_in_sole_m: Vec3,
}

/// The undeformed sole's bottom face, centred at the sole frame's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoleFace {
    /// Along x (m).
    pub length_m: f64,
    /// Along y (m).
    pub width_m: f64,
    /// Coulomb friction between it and the ground.
    pub friction: f64,
}

/// A joint's posture: where it shall be, and how strongly.
#[derive(Debug, Clone, PartialEq)]
pub struct PostureJoint {
    /// Name of the joint.
    pub joint: String,
    /// Position (rad).
    pub position_rad: f64,
}

/// Weights and stiffnesses of the tasks.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TaskSettings {
    /// Position of a swinging ankle.
    pub swing_position: Gains,
    /// Orientation of a swinging ankle.
    pub swing_orientation: Gains,
    /// Centre of mass.
    pub com: Gains,
    /// The weight of the vertical part of the centre of mass is multiplied by this.
    pub com_height_factor: f64,
    /// Absolute orientation of the torso.
    pub torso: Gains,
    /// Posture of all joints that are not in a leg.
    pub posture: Gains,
    /// Posture of the legs' joints: makes the Hessian definite, so keep it above zero.
    pub leg_posture: Gains,
    /// `alpha (|F - F_ref|² + |N - N_ref|² / lever²)`: each stance foot's planned wrench, N about the ankle.
    pub wrench_weight: f64,
    /// Length that makes moments comparable with forces (m): about half a foot's width.
    pub wrench_lever_m: f64,
    /// `alpha |f|²` on the intensities along the cones' generators (per N²). At least 1e-5: below, an intensity is known
    /// only to some newtons.
    pub intensity_damping: f64,
    /// Angular momentum about the centre of mass towards zero.
    pub angular_momentum: MomentumSettings,
    /// `alpha |tau|²`, least joint torques (per (N m)²); 0 = no such objective.
    pub torque_weight: f64,
}

impl Default for TaskSettings {
    fn default() -> Self {
        Self {
            swing_position: Gains { weight: 1e5, stiffness_per_s2: 5000.0 },
            swing_orientation: Gains { weight: 1e4, stiffness_per_s2: 4e4 },
            com: Gains { weight: 1e4, stiffness_per_s2: 150.0 },
            com_height_factor: 0.1,
            torso: Gains { weight: 200.0, stiffness_per_s2: 100.0 },
            posture: Gains { weight: 10.0, stiffness_per_s2: 100.0 },
            leg_posture: Gains { weight: 1e-2, stiffness_per_s2: 100.0 },
            wrench_weight: 1e-3,
            wrench_lever_m: 0.065,
            intensity_damping: 1e-5,
            angular_momentum: MomentumSettings { weight: 0.0, rate_per_s: 10.0 },
            torque_weight: 0.0,
        }
    }
}

/// Limits of contacts and joints.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ConstraintSettings {
    /// Stance ankles follow the estimator: stiffness of position and orientation (1/s²), critical damping. Limited to
    /// `0.25 / dt²`, at which an error is gone in a few steps.
    pub contact_position_stiffness_per_s2: f64,
    /// See above.
    pub contact_orientation_stiffness_per_s2: f64,
    /// Coulomb friction that the forces may use; by default the sole's own ([`SoleFace::friction`]).
    pub friction: Option<f64>,
    /// Generators per contact point of the linearised cone: 4, 8 or 16.
    pub generators_per_point: usize,
    /// A foot whose planned share of the weight is k may carry `(k + min(k, margin)) M g`: it vanishes with k, so that no
    /// force jumps when a foot comes or goes.
    pub load_margin: f64,
    /// Joint torques stay within this part of the robot's limits. *Robot's.*
    #[serde(skip)]
    pub torque_factor: f64,
    /// Joint speeds stay within this part of the robot's limits. *Robot's.*
    #[serde(skip)]
    pub velocity_factor: f64,
    /// Joint positions keep this distance from the robot's limits (rad). *Robot's.*
    #[serde(skip)]
    pub position_margin_rad: f64,
    /// Deceleration on which a joint can count when it approaches a limit (rad/s²): it may go as fast as it can still stop
    /// with it. Useful: 20 to 200.
    pub braking_rad_per_s2: f64,
    /// Largest acceleration of a joint (rad/s²).
    pub acceleration_max_rad_per_s2: f64,
}

impl Default for ConstraintSettings {
    fn default() -> Self {
        Self {
            contact_position_stiffness_per_s2: 5000.0,
            contact_orientation_stiffness_per_s2: 4e4,
            friction: None,
            generators_per_point: 4,
            load_margin: 0.15,
            torque_factor: 1.0,
            velocity_factor: 0.5,
            position_margin_rad: 0.01,
            braking_rad_per_s2: 60.0,
            acceleration_max_rad_per_s2: 1000.0,
        }
    }
}

/// A kind of limit that may give way when limits exclude each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// Load that a foot may carry.
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

/// As the configuration spells it.
impl std::fmt::Display for Limit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Load => "load",
            Self::Collision => "collision",
            Self::JointMotion => "joint-motion",
            Self::Torque => "torque",
            Self::Contact => "contact",
        })
    }
}

impl Limit {
    /// All kinds, in the order in which they give way by default.
    pub const ALL: [Self; 5] = [Self::Load, Self::Collision, Self::JointMotion, Self::Torque, Self::Contact];
}

/// What gives way when limits exclude each other, in which order and how far at most, all re-solves of a step together. An
/// allowance of zero keeps a limit whatever comes.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RelaxationSettings {
    /// First gives way first; a kind that is not listed never does.
    pub order: Vec<Limit>,
    /// Load of a foot beyond what its share allows (N): at most a few times the robot's weight.
    pub load_n: f64,
    /// Acceleration of two bodies towards each other beyond the damper's (m/s²).
    pub collision_m_per_s2: f64,
    /// Acceleration of a joint beyond its bound (rad/s²); times the period it is the excess of speed.
    pub joint_motion_rad_per_s2: f64,
    /// Torques give way up to this part of the motor's limit, 0 to 1; no effect below
    /// [`ConstraintSettings::torque_factor`].
    pub torque_factor: f64,
    /// Acceleration by which a stance ankle may leave its target (m/s², rad/s²).
    pub contact_m_per_s2: f64,
}

impl Default for RelaxationSettings {
    fn default() -> Self {
        Self {
            order: Limit::ALL.to_vec(),
            load_n: 1000.0,
            collision_m_per_s2: 20.0,
            joint_motion_rad_per_s2: 200.0,
            torque_factor: 1.0,
            contact_m_per_s2: 1e4,
        }
    }
}

impl RelaxationSettings {
    /// Position of a kind in the order: the later it gives way, the worse. `None` for a kind that never does.
    #[must_use]
    pub fn rank(&self, limit: Limit) -> Option<usize> {
        self.order.iter().position(|listed| *listed == limit)
    }
}

/// Which solver takes the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// Own warm-started dual active set: no allocation, exact vertices.
    ActiveSet,
    /// Clarabel with data updates, at [`SolverSettings::interior_tolerance`]; allocates.
    Interior,
}

/// Which solver takes a step when the first one runs out of iterations or fails numerically. It should be another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backup {
    /// As [`Backend::ActiveSet`].
    ActiveSet,
    /// As [`Backend::Interior`].
    Interior,
    /// None: the joints are brought to rest instead.
    None,
}

impl Backup {
    /// The solver, if there is one.
    #[must_use]
    pub fn backend(self) -> Option<Backend> {
        match self {
            Self::ActiveSet => Some(Backend::ActiveSet),
            Self::Interior => Some(Backend::Interior),
            Self::None => None,
        }
    }
}

/// Who solves, and for how long.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolverSettings {
    /// Takes the steps.
    pub backend: Backend,
    /// Stands in for it.
    pub backup: Backup,
    /// Clarabel's tolerances. At 1e-9 forces are known to some hundredths of a newton.
    pub interior_tolerance: f64,
    /// Changes of the active set after which the backup takes over.
    pub iterations_max: usize,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self { backend: Backend::ActiveSet, backup: Backup::Interior, interior_tolerance: 1e-9, iterations_max: 300 }
    }
}

/// Everything that [`WholeBody`](crate::WholeBody) needs beside the model.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeBodySettings {
    /// Left, right.
    pub feet: [FootSettings; 2],
    /// Both soles.
    pub sole: SoleFace,
    /// Link whose absolute orientation is controlled.
    pub torso_link: String,
    /// Joints that are not named stay at zero.
    pub posture: Vec<PostureJoint>,
    /// Objectives.
    pub tasks: TaskSettings,
    /// Limits.
    pub constraints: ConstraintSettings,
    /// Bodies that must not touch each other.
    pub collision: CollisionSettings,
    /// What gives way when limits exclude each other.
    pub relaxation: RelaxationSettings,
    /// Solvers.
    pub solver: SolverSettings,
}

impl WholeBodySettings {
    /// HRP-4's soles; everything else at its default, no posture and no collision pairs.
    #[must_use]
    pub fn new(ankle_links: [&str; 2], torso_link: &str) -> Self {
        let foot = |link: &str, outward: f64| FootSettings {
            ankle_link: link.to_owned(),
            ankle_in_sole_m: Vec3::new(-0.015, -0.011 * outward, 0.103),
        };
        Self {
            feet: [foot(ankle_links[0], 1.0), foot(ankle_links[1], -1.0)],
            sole: SoleFace { length_m: 0.23, width_m: 0.13, friction: 0.65 },
            torso_link: torso_link.to_owned(),
            posture: Vec::new(),
            tasks: TaskSettings::default(),
            constraints: ConstraintSettings::default(),
            collision: CollisionSettings::default(),
            relaxation: RelaxationSettings::default(),
            solver: SolverSettings::default(),
        }
    }

    /// Coulomb friction that the forces may use.
    #[must_use]
    pub fn friction(&self) -> f64 {
        self.constraints.friction.unwrap_or(self.sole.friction)
    }
}
