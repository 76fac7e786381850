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
//! The controller's pass ([`whole_body_terms`]) works in **world axes about the origin O of the base** (in an inertial frame
//! that momentarily coincides with it). There, a child's twist is its parent's *plus* the joint's, and a parent's composite
//! inertia and force are its own *plus* its children's: no coordinate transformation enters the recursions, and composite
//! inertias times joint axes give M, `Ag` and `Jcom` alike. Measuring from O and not from the world's origin keeps every
//! number at the robot's size, so nothing is lost 100 m from the origin. [`crba`] does the same in base axes, where M's rows
//! for the base need no rotation. [`rnea`] and [`aba`] work in the bodies' own frames: alone they are cheapest there, and
//! exact for a light hand on a long arm.
//!
//! All memory is in [`Workspace`] and in the outputs; no algorithm allocates (a test counts). Products are written with
//! fused multiply-adds, and sines are computed four at a time.
//!
//! # Accuracy
//! Worst relative error against Pinocchio 4.1.0 (`python3 tools/oracles/dynamics.py --all`: 68 public robots, 20 random
//! trees, 20 states each, joints far outside their limits, base rotations up to half a turn): 3e-14 for all quantities but
//! the forward dynamics; those 2e-12, except 1.1e-9 in one state of an iCub whose head is a point mass (condition number of
//! M: 2e11; Pinocchio itself is 2e-9 from a dense solution there).
//!
//! # Speed
//! `python3 tools/oracles/speed.py` on an AMD EPYC (Zen 5), both sides interleaved in one run, fastest of many batches:
//! Pinocchio's C++ header-only with `-O3 -march=native`, the quicker of its two conventions; Soleus with the workspace's
//! `x86-64-v3`. The bundle is all that a whole-body controller needs: M, h, five Jacobians with drift, centre of mass,
//! its Jacobian and drift, `Ag` and its drift.
//!
//! | ns per call | HRP-4, nv 40 | Pinocchio | ratio | TALOS, nv 38 | Pinocchio | ratio | G1, nv 35 | Pinocchio | ratio |
//! |---|---|---|---|---|---|---|---|---|---|
//! | forward kinematics | 441 | 1060 | 0.42 | 419 | 1016 | 0.41 | 400 | 904 | 0.44 |
//! | RNEA | 941 | 3430 | 0.27 | 900 | 3284 | 0.27 | 848 | 2948 | 0.29 |
//! | bias forces | 903 | 3624 | 0.25 | 866 | 3490 | 0.25 | 810 | 3139 | 0.26 |
//! | CRBA | 1124 | 2142 | 0.53 | 1046 | 2031 | 0.51 | 974 | 1887 | 0.52 |
//! | ABA | 2421 | 7210 | 0.34 | 2339 | 6864 | 0.34 | 2177 | 6164 | 0.35 |
//! | five Jacobians | 586 | 1770 | 0.33 | 566 | 1714 | 0.33 | 561 | 1629 | 0.34 |
//! | whole-body bundle | 1750 | 13303 | 0.13 | 1673 | 13051 | 0.13 | 1566 | 11728 | 0.13 |
//!
//! `cargo bench -p multibody` has the same algorithms beside dynibo 0.5.3 in criterion. On HRP-4, on a machine busy with other
//! work (medians of one run): RNEA 0.44, CRBA 0.32, ABA 0.44, five Jacobians 0.29 of dynibo's time.
//!
//! `target-cpu`: built for plain `x86-64` (no AVX2, no fused multiply-add) the bundle takes 1.13 times as long on HRP-4, RNEA
//! 1.37, ABA 1.27, CRBA 1.06 times. `x86-64-v3` is therefore the workspace's choice: it runs on every machine since 2013, and
//! a recording replays bit for bit between machines with the same features, which `native` would give up.
//!
//! [`leg`] solves six-joint legs whose hip and ankle axes meet in closed form.
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
