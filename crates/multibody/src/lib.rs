//! Kinematic trees from URDF and their rigid-body algorithms.
//!
//! # The problem
//!
//! A robot is a tree of rigid bodies on a floating (or fixed) base. Its configuration `q` is the pose `X_WB` of the base
//! and the joint positions; its velocity is `v = [base linear, base angular, joint rates]`, **both base parts in the base
//! frame B**. The equations of motion are
//!
//! ```text
//! M(q) vd + h(q, v) = tau + sum_k J_k' F_k            v = [v_WB_B, w_WB_B, joint rates]
//! ```
//!
//! | letter | meaning | shape | unit |
//! |---|---|---|---|
//! | `q` | [`Configuration`]: base pose, joint positions | – | m, rad |
//! | `v`, `vd` (also `a`) | velocity and its derivative | nv | m/s, rad/s; per s |
//! | `tau` | generalised force; its first six entries act on the base, in B, about the origin of B | nv | N, N m |
//! | `M` | mass matrix, symmetric positive definite ([`crba`]) | nv x nv | kg, kg m, kg m^2 |
//! | `h` | Coriolis, centrifugal and gravity forces ([`bias_forces`]) | nv | N, N m |
//! | `J_k` | Jacobian of a frame: `[velocity of its origin; angular velocity] = J v`, world axes ([`Placed::jacobian`]) | 6 x nv | – |
//! | `Jdot v` | drift: the frame's acceleration when `vd = 0` (the origin's classical acceleration) | 6 | m/s^2, rad/s^2 |
//! | `Ag` | centroidal momentum matrix: `[linear; angular about G] momentum = Ag v`, world axes | 6 x nv | – |
//!
//! Six-vectors are linear part first. `W` is the world, `B` the base, `G` the centre of mass, `O` the origin of the base.
//!
//! # How
//!
//! Fixed joints, and joints that a scene locks, are merged at load: HRP-4 with its hands, wrists and neck locked costs what
//! a robot without them costs. What remains is one body per joint, whose frame is chosen such that **every
//! joint moves along or about its own z axis**, so that no algorithm asks which axis it is.
//!
//! The controller's pass ([`whole_body_terms`]) works in **world axes about the origin O of the base** (in an inertial frame
//! that momentarily coincides with it). There, a child's twist is its parent's *plus* the joint's, and a parent's composite
//! inertia and force are its own *plus* its children's: no coordinate transformation enters the recursions, and composite
//! inertias times joint axes give M, `Ag` and `Jcom` alike. Measuring from O and not from the world's origin keeps every
//! number at the robot's size, so nothing is lost 100 m from the origin. [`crba`] does the same in base axes, where M's rows
//! for the base need no rotation. [`rnea`] and [`aba`] work in the bodies' own frames: alone they are cheapest there, and
//! exact for a light hand on a long arm.
//!
//! Two storeys: `tree/` has the recursions, which know one coordinate per body and nothing else; [the public
//! functions](forward_kinematics) stand above and ask once whether joints follow others. Kinematics returns what it found
//! ([`Placed`], [`Moving`]) and borrows the workspace for it, so that nobody reads the placements of another configuration.
//!
//! All memory is in [`Workspace`] and in the outputs; no algorithm allocates (a test counts). Products are written with
//! fused multiply-adds, and sines are computed four at a time.
//!
//! # Joints that follow others
//! A joint with `<mimic joint="m" multiplier="a" offset="b"/>` is at `a q_m + b`. It has no coordinate: `q`, `v`, `tau` and all
//! matrices have the entries of the free joints only, and [`Model::followers`] lists the others. The recursions run on the tree
//! with one coordinate per body, and `S` in `v_tree = S v` takes their results to the robot's: `M = S' M_tree S`,
//! `h = S' h_tree`, `J = J_tree S`. Robots without followers skip that by one branch per call. The articulated-body algorithm
//! frees joint after joint and has no such form; [`aba`] then factors M along its elimination tree and improves the
//! solution once with the residual of [`rnea`] (with it the median relative error over 120 states of twelve such robots is
//! 1.6e-16, worst 9e-16, without it 3e-14 and 3e-12; `--exact`). JVRC-1, ten of whose 44 joints follow, takes 1.7 times as
//! long for the bundle without frames as with all joints free, and 3.2 times as long for [`aba`] (`--example speed`).
//!
//! - Chains are resolved: whom a follower follows may follow. Circles, unknown leaders, multipliers that are not finite or above
//!   1e6 are refused, naming the joint.
//! - A leader that is fixed (at zero) or locked holds its followers, as does the multiplier zero; they are merged.
//!   A follower can be locked only if its leader is.
//! - A follower's limits of position and speed bound its leader; if nothing is left the robot is refused. It needs none.
//!   Effort limits are not combined: the leader's drive is the only one.
//! - The rotor of a follower ([`Model::set_follower_rotor_inertia`]) is felt by the leader `a^2` times.
//!
//! How right and how quick it is, beside Pinocchio and 60 digits: `docs/performance.md`.
//!
//! [`leg`] solves six-joint legs: in closed form where the hip's and the ankle's axes meet as HRP-4's do, by damped Newton
//! steps elsewhere.
//!
//! # What is not modelled
//! Closed kinematic chains, joints other than revolute, continuous and prismatic, flexible links, joint friction; couplings
//! other than `<mimic>` (linear, to one joint).
//!
//! # References
//! R. Featherstone, *Rigid Body Dynamics Algorithms*, Springer 2008: RNEA (table 5.1), CRBA (table 6.2), ABA (table 7.1).
//! D. E. Orin, A. Goswami, S.-H. Lee, *Centroidal dynamics of a humanoid robot*, Autonomous Robots 35 (2013).
//! P. M. Wensing, D. E. Orin, *Improved computation of the humanoid centroidal dynamics*, IJHR 13 (2016): `Ag` and its
//! drift from the quantities of the CRBA and the RNEA.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod algorithms;
mod coupled;
mod error;
pub mod leg;
mod links;
mod mass_factor;
mod model;
mod placed;
mod refined;
mod rigid;
mod tree;
mod urdf;
mod workspace;

pub use algorithms::{
    aba, aba_with_external, bias_forces, crba, forward_kinematics, forward_kinematics_velocity, gravity_forces, rnea,
    rnea_with_external, whole_body_terms,
};
pub use error::{Item, ModelError};
pub use links::{HeldLink, Motion, held_links};
pub use mass_factor::{MassFactor, NotPositiveDefinite};
pub use model::{
    Base, CarriedJoint, Configuration, Follower, FollowerIndex, Frame, FrameIndex, InertiaCheck, Joint, JointIndex,
    JointMotion, Model, ModelOptions, carried_joints,
};
pub use placed::{Moving, Placed};
pub use refined::aba_refined;
pub use tree::whole_body::{FrameTerms, WholeBodyTerms};
pub use urdf::Limits;
pub use workspace::Workspace;
