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
//! # What is not modelled
//! Hands in contact, walls, rolling feet. The ground is z = 0. The sole's stiffness enters only through the estimator's
//! ankle motion.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod collision;
mod constraint;
mod error;
mod fallback;
mod formulation;
mod integration;
mod inverse_kinematics;
mod layout;
pub mod observer;
mod reference;
mod report;
mod settings;
mod step;
mod task;

pub use collision::{Capsule, CollisionSettings, LinkCapsule, Proximity, SMOOTHING_M, proximity};
pub use constraint::friction::FrictionCones;
pub use constraint::limits::JointLimits;
pub use error::WholeBodyError;
pub use integration::{Integration, StateDistance, StateIntegrator};
pub use inverse_kinematics::{ConfigurationError, ConfigurationTargets, initial_configuration};
pub use layout::ConstraintId;
pub use reference::{FootTarget, RobotState, WholeBodyReference};
pub use report::{
    ActiveConstraint, ContactError, FootForce, Relaxation, StepReport, StepStatus, TaskId, TaskReport, Timings,
};
pub use settings::{
    Backend, ConstraintSettings, FootSettings, Gains, PostureJoint, SoleRectangle, TaskSettings, WholeBodySettings,
};
pub use step::{Clock, WholeBody};
