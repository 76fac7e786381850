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
//! ([`WholeBody::last_program`]) and solved again with `soleus-inspect qp`.
//!
//! # State
//! [`StateIntegrator`] turns accelerations into the state of the next step, open loop (the paper's) or drawn towards what
//! [`observer::BaseObserver`] makes of the measurements. With feedback the step asks the ground for other wrenches than planned;
//! [`SoleYield`] moves the stance ankles as the soles give way under them.
//!
//! # Time
//! Libraries know no clock: [`WholeBody::set_clock`] takes one, and [`StepReport::timings`] then tells the stages apart.
//!
//! # Speed against error
//! `cargo bench -p wholebody --bench step -- FOLDER/walk.npz` walks four steps on an ideal plant (5 ms period, 41 collision pairs,
//! soft soles) and times every step by the thread's CPU time; *ratio* is to Clarabel with data updates at 1e-8 on recorded
//! walking programs of a 38-dof robot in the same run, *torque diff.* to the second row. On a shared two-core machine, built
//! with `--profile dev`:
//!
//! | model | dofs | single us | double us | ratio | p99/median | max us | COM error mm | torque diff. N m | not solved |
//! |---|---|---|---|---|---|---|---|---|---|
//! | HRP-4 legs, chest | 20 | 26.9 | 39.3 | 0.0165 | 1.85 | 62.8 | 0.49 | 0.0e0 | 0 |
//! | HRP-4 walking | 28 | 33.7 | 47.1 | 0.0206 | 1.76 | 85.9 | 0.48 | 0.0e0 | 0 |
//! | HRP-4 full | 40 | 46.5 | 61.2 | 0.0283 | 1.62 | 107.7 | 0.48 | 0.0e0 | 0 |
//! | HRP-4, thumbs locked | 38 | 45.2 | 60.5 | 0.0276 | 1.66 | 99.5 | 0.48 | 0.0e0 | 0 |
//! | JVRC-1, fingers locked, 61 pairs | 38 | 47.3 | 63.3 | 0.0286 | 1.61 | 95.7 | 0.10 | 0.0e0 | 0 |
//! | HRP-4 walking, 8 generators per point | 28 | 41.9 | 67.1 | 0.0254 | 2.34 | 118.8 | 0.48 | 3.9e-1 | 0 |
//! | HRP-4 walking, 16 generators per point | 28 | 71.7 | 134.6 | 0.0439 | 3.41 | 360.4 | 0.48 | 4.7e-1 | 0 |
//! | HRP-4 walking, no collision pairs | 28 | 25.7 | 38.1 | 0.0158 | 1.91 | 62.4 | 0.48 | 0.0e0 | 0 |
//! | HRP-4 walking, Clarabel 1e-6 | 28 | 1234.0 | 1785.2 | 0.8839 | 1.41 | 2184.6 | 0.48 | 1.1e-1 | 0 |
//!
//! JVRC-1 is any robot: the benchmark takes a URDF and a file with feet, posture and capsules (`benches/jvrc1.toml`).
//! The centre of mass's error is what sampling at 5 ms leaves, whoever solves. More generators than four per point buy 8 % of
//! friction and cost a factor of 1.2 to 3; locking hands, wrists and neck saves a third. The slowest steps are those in which a
//! foot takes or gives up its load and its generators enter or leave one after the other: with 16 of them per point, up to twenty
//! in a step.
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
mod sole_yield;
mod solvers;
mod step;
mod task;

pub use collision::{
    Capsule, CollisionSettings, LinkCapsule, PairProposal, ProposalSettings, Proximity, SMOOTHING_M, Verdict,
    propose_pairs, proximity,
};
pub use constraint::friction::FrictionCones;
pub use constraint::limits::JointLimits;
pub use error::WholeBodyError;
pub use integration::{FeedbackRates, Integration, StateDistance, StateIntegrator};
pub use inverse_kinematics::{ConfigurationError, ConfigurationTargets, initial_configuration};
pub use layout::ConstraintId;
pub use reference::{FootTarget, RobotState, WholeBodyReference};
pub use report::{
    ActiveConstraint, AnsweredBy, ContactError, FootForce, Relaxation, StepReport, StepStatus, TaskId, TaskReport,
    Timings,
};
pub use settings::{
    Backend, ConstraintSettings, FootSettings, Gains, Limit, PostureJoint, RelaxationSettings, SoleRectangle,
    TaskSettings, WholeBodySettings,
};
pub use sole_yield::{LoadedSole, SoleYield, SoleYieldSettings};
pub use step::{Clock, WholeBody};
