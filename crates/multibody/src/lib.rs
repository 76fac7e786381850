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
//! | `J_k` | Jacobian of a frame: `[velocity of its origin; angular velocity] = J v`, world axes ([`frame_jacobian`]) | 6 x nv | – |
//! | `Jdot v` | drift: the frame's acceleration when `vd = 0` (the origin's classical acceleration) | 6 | m/s^2, rad/s^2 |
//! | `Ag` | centroidal momentum matrix: `[linear; angular about G] momentum = Ag v`, world axes | 6 x nv | – |
//!
//! Six-vectors are linear part first. `W` is the world, `B` the base, `G` the centre of mass, `O` the origin of the base.
//!
//! # How
//!
//! Fixed joints, and joints that a scene locks, are merged at load: HRP-4 with its hands, wrists and neck locked costs what
//! a robot without them costs. What remains is one [`Body`](model::Body) per joint, whose frame is chosen such that **every
//! joint moves along or about its own z axis**, so that no algorithm asks which axis it is.
//!
//! All recursions work in **world axes about the origin O of the base** (in an inertial frame that momentarily coincides with
//! it). There, a child's twist is its parent's *plus* the joint's, and a parent's composite inertia and force are its own
//! *plus* its children's: no coordinate transformation enters the tree recursions. Measuring from O and not from the world's
//! origin keeps every number at the robot's size, so nothing is lost 100 m from the origin.
//!
//! All memory is in [`Workspace`] and in the outputs; no algorithm allocates.
//!
//! # What is not modelled
//! Closed kinematic chains, joints other than revolute, continuous and prismatic, flexible links, joint friction. `<mimic>`
//! joints are independent coordinates unless [`ModelOptions`] says otherwise.
//!
//! # References
//! R. Featherstone, *Rigid Body Dynamics Algorithms*, Springer 2008: RNEA (table 5.1), CRBA (table 6.2), ABA (table 7.1).
//! D. E. Orin, A. Goswami, S.-H. Lee, *Centroidal dynamics of a humanoid robot*, Autonomous Robots 35 (2013).
//! P. M. Wensing, D. E. Orin, *Improved computation of the humanoid centroidal dynamics*, IJHR 13 (2016): `Ag` and its
//! drift from the quantities of the CRBA and the RNEA.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod aba;
mod cholesky;
mod configuration;
mod crba;
mod error;
mod jacobian;
mod kinematics;
pub mod leg;
mod model;
mod rigid;
mod rnea;
mod urdf;
mod whole_body;
mod workspace;

pub use aba::{aba, aba_with_external};
pub use cholesky::{MassFactor, NotPositiveDefinite};
pub use configuration::Configuration;
pub use crba::crba;
pub use error::{Item, ModelError};
pub use jacobian::{com_jacobian, frame_drift, frame_jacobian};
pub use kinematics::{center_of_mass, forward_kinematics, forward_kinematics_velocity};
pub use model::{Base, Frame, FrameIndex, InertiaCheck, Joint, JointIndex, JointMotion, Limits, Model, ModelOptions};
pub use rnea::{bias_forces, gravity_forces, rnea, rnea_with_external};
pub use whole_body::{FrameTerms, WholeBodyTerms, whole_body_terms};
pub use workspace::Workspace;
