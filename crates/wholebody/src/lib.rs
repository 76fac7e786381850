//! One whole-body control step as a quadratic program.
//!
//! # The problem
//!
//! Unknowns `x = (vd, f)`: accelerations of base and joints, intensities along the edges of linearised friction cones.
//!
//! ```text
//! minimise    sum_i alpha_i |J_i vd + Jdot_i v - a_i|²  +  sum_feet alpha_w |G f - F_ref|²  +  alpha_f |f|²
//! subject to  M_b vd + h_b = J_bᵀ G f                        floating base
//!             J_k vd + Jdot_k v = a_k                        stance ankles, moving as the soles deform
//!             |M_a vd + h_a - J_aᵀ G f| <= tau_max            joint torques
//!             sum f_foot <= (k + min(k, 0.15)) M g            load of a foot
//!             d' + dt d'' >= -xi (d - d_s)/(d_i - d_s)        collision pairs
//!             joint accelerations within viable bounds, f >= 0
//! a_i = a_ref + kd (v_ref - v) + kp (x_ref - x),   kd = 2 sqrt(kp),   orientation errors as rotation vectors
//! ```
//!
//! | letter | meaning | shape | unit |
//! |---|---|---|---|
//! | `vd` | acceleration: base linear, base angular (base frame), joints | nv | m/s², rad/s² |
//! | `f` | intensities; a generator's normal part is 1, so `sum f` is the normal load | 4 points x generators per foot | N |
//! | `G` | wrench of the intensities about the ankle's origin, world axes, force first | 6 x f | –, m |
//! | `M, h` | mass matrix, bias forces; rows b of the base, a of the joints | nv x nv, nv | |
//! | `k` | a foot's planned share of the weight | | – |
//!
//! It is section 5 of De Magistris, Pajon, Miossec, Kheddar, *Humanoid walking with compliant soles using a deformation
//! estimator* (Robotics and Autonomous Systems, 2017). What the paper calls "no sliding" carries the sole here: a stance
//! ankle's acceleration is the estimator's, with feedback on pose and twist, as a hard constraint.
//!
//! # Decisions
//! - **Friction** acts at the corners of the undeformed sole, moved by the ankle's pose and projected on the ground, along
//!   the ground's normal: the soft sole touches there, whatever the tilt of the foot.
//! - **Load limits vanish with k.** A foot that comes or goes can carry nothing at that moment, so forces do not jump.
//! - **Stiffness is limited to 0.25/dt².** Sampled feedback above it oscillates; the recorded robot's 4e4 needs 2.5 ms.
//! - **Feet are left = 0, right = 1.**
//!
//! # Failure
//! A program without a solution is not an error: [`StepReport::status`] says [`StepStatus::Relaxed`] when limits had to give way
//! ([`StepReport::relaxed`] names them and by how much, [`StepReport::contradiction`] what excluded what), [`StepStatus::Held`]
//! when nothing helped and the joints are brought to rest. When the active set runs out of iterations or fails, Clarabel takes
//! the step ([`StepReport::answered_by`]). The ladder is in `fallback.rs`, its order and allowances are
//! [`RelaxationSettings`]; no torque beyond the motor's limit is ever sent. Every program can be written down
//! ([`WholeBody::last_program`]) and solved again with `soleus-inspect qp < FILE`.
//!
//! # State
//! A step is a function of the state that it is handed; whose state that is, the crate `state` says. With feedback the step asks the
//! ground for other wrenches than planned; [`ComplianceFeedForward`] moves the stance ankles as the soles give way under them.
//!
//! # Time
//! Libraries know no clock: [`WholeBody::set_clock`] takes one, and [`StepReport::timings`] then tells the stages apart.
//!
//! What a step costs, and what that buys: `docs/performance.md`.
//!
//! # Example
//! HRP-4 stands with bent knees and shall stay where it is: one step, and the ground carries its weight.
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use multibody::{Model, ModelOptions, Workspace, forward_kinematics};
//! use spatial::Vec3;
//! use wholebody::{FootTarget, RobotState, WholeBody, WholeBodyReference, WholeBodySettings};
//!
//! let urdf = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/hrp4/hrp4.urdf"))?;
//! let model = Model::from_urdf(&urdf, &ModelOptions::default())?;
//! let mut q = model.neutral();
//! for (joint, angle) in [("HIP_P", -0.38), ("KNEE_P", 0.72), ("ANKLE_P", -0.34)] {
//!     q.joints[model.joint(&format!("L_{joint}"))?.0] = angle;
//!     q.joints[model.joint(&format!("R_{joint}"))?.0] = angle;
//! }
//! let ankles = [model.frame("l_ankle")?, model.frame("r_ankle")?];
//! let mut ws = Workspace::new(&model);
//! // The soles are 103 mm below the ankles.
//! q.base.translation.z = 0.103 - forward_kinematics(&model, &mut ws, &q).pose(ankles[0]).translation.z;
//!
//! let placed = forward_kinematics(&model, &mut ws, &q);
//! let (com, weight_n) = (placed.center_of_mass(), 9.81 * model.total_mass_kg());
//! let reference = WholeBodyReference {
//!     com_position: com,
//!     com_velocity: Vec3::zeros(),
//!     com_acceleration: Vec3::zeros(),
//!     feet: ankles.map(|ankle| {
//!         let pose = placed.pose(ankle);
//!         FootTarget::standing(pose, 0.5, weight_n, nalgebra::Vector2::new(com.x, pose.translation.y))
//!     }),
//!     torso_rotation: placed.pose(model.frame("torso")?).rotation,
//!     torso_angular_velocity: Vec3::zeros(),
//!     torso_angular_acceleration: Vec3::zeros(),
//! };
//! let state = RobotState { v: nalgebra::DVector::zeros(model.nv()), q };
//! let mut body = WholeBody::new(model, WholeBodySettings::new(["l_ankle", "r_ankle"], "torso"))?;
//! let report = body.step(&state, &reference, 0.005);
//! let carried_n: f64 = report.feet.iter().map(|foot| foot.wrench.force.z).sum();
//! assert!((carried_n / weight_n - 1.0).abs() < 0.01, "{carried_n} N of {weight_n} N");
//! # Ok(())
//! # }
//! ```
//!
//! # What is not modelled
//! Hands in contact, walls, rolling feet. The ground is z = 0. The sole's stiffness enters only through the estimator's
//! ankle motion.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod collision;
mod compliance;
mod constraint;
mod error;
mod fallback;
mod formulation;
mod inverse_kinematics;
mod layout;
mod reference;
mod report;
mod settings;
mod solvers;
mod step;
mod task;

pub use collision::{
    Capsule, CollisionSettings, LinkCapsule, PairProposal, ProposalSettings, Proximity, SMOOTHING_M, Verdict,
    propose_pairs, proximity,
};
pub use compliance::{ComplianceFeedForward, ComplianceSettings, LoadedSole};
pub use constraint::friction::FrictionCones;
pub use constraint::limits::JointLimits;
pub use error::WholeBodyError;
pub use inverse_kinematics::{ConfigurationError, ConfigurationTargets, initial_configuration};
pub use layout::ConstraintId;
pub use reference::{FootTarget, RobotState, WholeBodyReference};
pub use report::{
    ActiveConstraint, AnsweredBy, ContactError, FootForce, Relaxation, StepReport, StepStatus, TaskId, TaskReport,
    Timings,
};
pub use settings::{
    Backend, Backup, ConstraintSettings, FootSettings, Gains, Limit, MomentumSettings, PostureJoint,
    RelaxationSettings, SoleFace, SolverSettings, TaskSettings, WholeBodySettings,
};
pub use step::{Clock, WholeBody};
