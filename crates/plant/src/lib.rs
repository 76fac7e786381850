//! The simulated robot: a floating multibody with position-controlled joints on soft soles, its sensors, and the [stabiliser] that is
//! built into it.
//!
//! # The problem
//!
//! ```text
//! M(q) v' + h(q, v) = S^T tau(q, v, q_ref) + J_l(q)^T F_l + J_r(q)^T F_r + pushes
//! ```
//!
//! | letter | meaning | shape, unit |
//! |---|---|---|
//! | `q` | base pose and joint positions | SE(3) x R^n |
//! | `v` | base twist in the base frame (linear first), joint rates | 6 + n |
//! | `M, h` | mass matrix with rotor inertias; bias forces (gravity, Coriolis) | |
//! | `tau` | [drives](servo): position servo, feed-forward, limits, friction | n, N m |
//! | `F_l, F_r` | wrench of the ground on each sole about the sole frame's origin | 6, N and N m |
//! | `J` | Jacobians of the sole frames, world axes | 6 x (6 + n) |
//!
//! `F` follows from the sole's pose and its history alone: a condensed elastic body (crate `sole`) with exact unilateral contact and
//! Coulomb friction at every contact point, and Kelvin-Voigt viscosity. Such soles are stiff (500 kN/m under a foot of 1.4 kg) and so are the
//! drives, so both are integrated implicitly: [`step`] has the equations, the reasons and the order.
//!
//! # What is in it
//!
//! [`Plant`] is the robot as a control computer sees it: [`Plant::tick`] takes a [`PlantCommand`] for one control period and gives
//! [`PlantSensors`]. [`Truth`] is what really happened, for logs and tests. Between command and drives sits the
//! [`Stabiliser`](stabiliser::Stabiliser) (it can be switched off), which knows the plan and the sensors, never the truth. A [`Fall`] ends a run.
//! The same inputs give the same bits.
//!
//! State `k` is what [`Plant::sensors`] gives before tick `k`. A command given to a tick is *reached* at the end of that tick (the drives
//! ramp linearly to it), one period after it was meant for; the whole robot runs that one period behind its plan, and the stabiliser compares
//! accordingly.
//!
//! # What it costs
//!
//! `docs/plant.md` has the time of a tick within walks, and the command. Most of it is the soles' ([`sole::PoseDrivenContact`] says why and how);
//! a steady step takes one factorised matrix from the steps before, and one or two evaluations of the contact.
//!
//! # What is not modelled
//!
//! Elastic or worn gears, motor currents, temperature; flexible links; air; contact of anything but the soles (a link whose origin
//! comes down to the ground is a [fall](FallReason)); contact between links; inertia of the foam; large strains of the foam (linear elasticity is
//! doubtful past about 5 degrees of tilt); the 1.4 kg of foot below the force sensors in their reading.
//!
//! # References
//!
//! G. De Magistris, A. Pajon, S. Miossec, A. Kheddar, *Humanoid walking with compliant soles using a deformation estimator*, Robotics and
//! Autonomous Systems (2017); R. Featherstone, *Rigid Body Dynamics Algorithms* (2008); D. Baraff, A. Witkin, *Large steps in cloth simulation*, SIGGRAPH 1998
//! (linearly implicit Euler); S. Kajita et al., IROS 2010 and S. Caron et al., ICRA 2019 (stabiliser).
#![allow(non_snake_case)] // monogram notation, see the style guide

mod corners;
pub mod disturbance;
pub mod energy;
mod fall;
mod foot;
pub mod ground;
mod linear;
mod noise;
mod plant;
pub mod sensor;
pub mod servo;
pub mod settings;
mod soles;
pub mod step;
mod truth;

pub use corners::CornerSettings;
pub use fall::{Fall, FallReason};
pub use foot::PlantSole;
pub use plant::{Plant, PlantCommand, PlantError, PlantFrames};
pub use sensor::PlantSensors;
pub use settings::PlantSettings;
pub use soles::{MESH_CELLS, PlantSoleLevel, PlantSoleSettings};
pub use stabiliser::{FootPlan, Plan, StabiliserReport, StabiliserSettings};
pub use truth::{FootTruth, Integration, Truth};
