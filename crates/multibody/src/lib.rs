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
//! # Accuracy
//! Worst relative error against Pinocchio 4.1.0 (`python3 tools/oracles/dynamics.py --all`: 69 public robots, nine of them
//! with joints that follow others, 20 random trees without such joints and 20 with them, 20 states each, joints far outside
//! their limits, base rotations up to half a turn): 4e-14 for all quantities but the forward dynamics; those 3e-12, except in
//! one state of an iCub whose head is a point mass (condition number of M: 2e11). There the two differ by 1.1e-9, and a
//! solution with 60 digits decides: [`aba`] is 3.8e-10 from it, Pinocchio 6.7e-10, and rounding the entries of the exact M to
//! doubles would alone cost 2.3e-10. With `--exact`, 60 digits judge all 2160 states that have an answer: median 1.8e-16
//! ([`aba`]), 3.2e-16 (Pinocchio; where joints follow others, its M solved by numpy).
//!
//! The error of the forward dynamics has no bound: with the condition number of M it grows, for anything that holds M or
//! articulated inertias in doubles (150 other states of that iCub: at most 2.8e-9, Pinocchio 4.9e-9, M rounded 1.2e-9;
//! `--urdf .../icub.urdf --exact --states 150 --seed 7`). [`aba_refined`] reports it: in these states its estimate is 0.08 to
//! 1.8 times the true error in nine cases of ten.
//!
//! # Speed
//! `python3 tools/oracles/speed.py` on an AMD EPYC (Zen 5), both sides interleaved in one run, fastest of many batches:
//! Pinocchio's C++ header-only with `-O3 -march=native`, the quicker of its two conventions; Soleus with the workspace's
//! `x86-64-v3`. The bundle is all that a whole-body controller needs: M, h, five Jacobians with drift, centre of mass,
//! its Jacobian and drift, `Ag` and its drift.
//!
//! | ns per call | HRP-4, nv 40 | Pinocchio | ratio | TALOS, nv 38 | Pinocchio | ratio | G1, nv 35 | Pinocchio | ratio |
//! |---|---|---|---|---|---|---|---|---|---|
//! | forward kinematics | 443 | 1056 | 0.42 | 435 | 1030 | 0.42 | 397 | 906 | 0.44 |
//! | RNEA | 962 | 3424 | 0.28 | 933 | 3318 | 0.28 | 842 | 3010 | 0.28 |
//! | bias forces | 914 | 3706 | 0.25 | 898 | 3590 | 0.25 | 803 | 3164 | 0.25 |
//! | CRBA | 1117 | 2157 | 0.52 | 1064 | 2104 | 0.51 | 947 | 1866 | 0.51 |
//! | ABA | 2474 | 7535 | 0.33 | 2435 | 7238 | 0.34 | 2182 | 6392 | 0.34 |
//! | five Jacobians | 595 | 1798 | 0.33 | 592 | 1793 | 0.33 | 553 | 1632 | 0.34 |
//! | whole-body bundle | 1771 | 13493 | 0.13 | 1695 | 13258 | 0.13 | 1578 | 11568 | 0.14 |
//!
//! In the same run, of dynibo 0.5.3's time, on HRP-4 and G1: RNEA 0.40 and 0.39, CRBA 0.22 and 0.21, ABA 0.35 and 0.34 (it
//! has no bundle, and refuses TALOS for its mimic joints). `cargo bench -p multibody` has the two side by side in criterion,
//! with `BENCH_URDF` and `BENCH_FRAMES` on any robot. Times move by some 5 % from run to run, ratios by 0.02.
//!
//! `target-cpu`, on the hot paths of the whole workspace (`cargo xtask target-cpu`, best of three rounds), times relative to
//! `x86-64-v3`:
//!
//! | | `x86-64-v3` | plain `x86-64` | `native` (AVX-512) |
//! |---|---|---|---|
//! | whole-body bundle, HRP-4 | 1.80 us | 1.17 | 1.12 |
//! | RNEA | 0.97 us | 1.46 | 0.97 |
//! | CRBA | 1.21 us | 1.08 | 1.16 |
//! | ABA | 2.45 us | 1.19 | 0.99 |
//! | friction, Gauss-Seidel, 104 contacts | 198 us | 15.9 | 0.91 |
//! | friction, Newton, 104 contacts | 1.67 ms | 37 | 0.77 |
//! | estimator, one foot | 56 us | 17.3 | 0.92 |
//! | estimator, double support | 127 us | 15.8 | 0.96 |
//! | plant's contact, 72 patches | 37 us | 19.8 | 0.93 |
//! | whole-body step, single support | 21.7 us | 5.0 | 1.01 |
//! | whole-body step, double support | 29.6 us | 5.8 | 1.01 |
//! | the same by Clarabel | 789 us | 1.16 | 1.05 |
//! | pattern of 11 swings, build | 0.27 ms | 1.22 | 1.41 |
//! | pattern of 11 swings, solve | 3.5 ms | 1.08 | 1.02 |
//! | pattern of 1000 swings, solve | 320 ms | 1.05 | 1.01 |
//! | geometric mean | | 3.7 | 1.01 |
//!
//! Without a fused multiply-add in the instruction set each `mul_add` of the contact solvers is a call. `x86-64-v3` is the workspace's
//! choice: as quick as `native`, on every machine since 2013, and a recording replays bit for bit between builds for the same features.
//!
//! [`leg`] solves six-joint legs whose hip and ankle axes meet in closed form.
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

mod aba;
mod aba_refined;
mod cholesky;
mod configuration;
mod coupling;
mod crba;
mod error;
mod jacobian;
mod kinematics;
pub mod leg;
mod links;
mod mimic;
mod model;
mod rigid;
mod rnea;
mod urdf;
mod whole_body;
mod workspace;

pub use aba::{aba, aba_with_external};
pub use aba_refined::aba_refined;
pub use cholesky::{MassFactor, NotPositiveDefinite};
pub use configuration::Configuration;
pub use crba::crba;
pub use error::{Item, ModelError};
pub use jacobian::{com_jacobian, frame_drift, frame_jacobian};
pub use kinematics::{center_of_mass, forward_kinematics, forward_kinematics_velocity};
pub use links::{HeldLink, Motion, held_links};
pub use mimic::{CarriedJoint, carried_joints};
pub use model::{
    Base, Follower, FollowerIndex, Frame, FrameIndex, InertiaCheck, Joint, JointIndex, JointMotion, Limits, Model,
    ModelOptions,
};
pub use rnea::{bias_forces, gravity_forces, rnea, rnea_with_external};
pub use whole_body::{FrameTerms, WholeBodyTerms, whole_body_terms};
pub use workspace::Workspace;
