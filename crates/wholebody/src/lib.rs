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
//! # Speed against error
//! `cargo bench -p wholebody --bench step -- FOLDER/walk.npz` walks four steps on an ideal plant (5 ms period, 41 collision pairs,
//! soft soles) and times every step by the thread's CPU time; *ratio* is to Clarabel with data updates at 1e-8 on recorded
//! walking programs of a 38-dof robot in the same run, *torque diff.* to the second row. On a shared two-core machine, built
//! with `--profile dev`:
//!
//! | model | dofs | single us | double us | ratio | p99/median | max us | COM error mm | torque diff. N m | not solved |
//! |---|---|---|---|---|---|---|---|---|---|
//! | HRP-4 legs, chest | 20 | 21.4 | 31.4 | 0.0158 | 1.76 | 50.3 | 0.49 | 0.0e0 | 0 |
//! | HRP-4 walking | 28 | 27.0 | 38.2 | 0.0199 | 1.69 | 58.3 | 0.48 | 0.0e0 | 0 |
//! | HRP-4 full | 40 | 38.0 | 50.7 | 0.0279 | 1.57 | 73.7 | 0.48 | 0.0e0 | 0 |
//! | HRP-4, thumbs locked | 38 | 36.9 | 49.8 | 0.0270 | 1.60 | 71.9 | 0.48 | 0.0e0 | 0 |
//! | JVRC-1, fingers locked, 61 pairs | 38 | 39.0 | 52.4 | 0.0284 | 1.58 | 78.0 | 0.10 | 0.0e0 | 0 |
//! | HRP-4 walking, 8 generators per point | 28 | 33.9 | 55.0 | 0.0249 | 2.19 | 95.9 | 0.48 | 3.9e-1 | 0 |
//! | HRP-4 walking, 16 generators per point | 28 | 58.6 | 111.2 | 0.0430 | 2.91 | 271.3 | 0.48 | 4.7e-1 | 0 |
//! | HRP-4 walking, no collision pairs | 28 | 20.9 | 31.2 | 0.0153 | 1.83 | 49.8 | 0.48 | 0.0e0 | 0 |
//! | HRP-4 walking, Clarabel 1e-6 | 28 | 1023.7 | 1501.7 | 0.8747 | 1.41 | 1923.5 | 0.48 | 8.9e-2 | 0 |
//! | HRP-4 walking, Clarabel 1e-8 | 28 | 1138.2 | 1644.0 | 0.9667 | 1.45 | 2177.6 | 0.48 | 5.8e-3 | 0 |
//!
//! JVRC-1 is any robot: the benchmark takes a URDF and a file with feet, posture and capsules (`benches/jvrc1.toml`).
//! The centre of mass's error is what sampling at 5 ms leaves, whoever solves. More generators than four per point buy 8 % of
//! friction and cost a factor of 1.3 to 3; locking hands, wrists and neck saves a third. Feedback (observer, blending, compliance
//! feed-forward) adds 1.4 us (p99 1.5).
//!
//! The slowest steps are those in which a foot takes or gives up its load, below a tenth of the weight: from one period to the next its
//! forces move from one edge of the sole to another, and with 16 generators per point 10 to 20 of them come to rest at zero or leave it.
//! The active sets of neighbouring periods really are that different (nearly every change of the solver is one), and a double support
//! without any change already takes 1.9 times the median, which is that of a single support. So with 16 the slowest hundredth takes 2.9
//! times the median. Guessing the next active set by extrapolating forces and multipliers was tried: the path has kinks there,
//! and of what it saved in one period it lost more in another.
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
