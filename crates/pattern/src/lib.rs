//! The walk as data: phases, polynomials and footholds, evaluated at any time.
//!
//! A [`WalkPattern`] is what the planner makes and everybody else reads: plain numbers, serialisable, no solver behind it.
//! [`WalkPattern::evaluate`] gives the references of one instant with their derivatives, exactly (from the closed forms, not
//! from samples) and without allocating. [`SwingTrajectory`] moves the foot in the air.
//!
//! # Equations
//! De Magistris, Pajon, Miossec, Kheddar, *Humanoid walking with compliant soles using a deformation estimator* (Robotics and
//! Autonomous Systems, 2017), section 3 and appendices; numbers in brackets are that paper's. One [`Phase`] is one polynomial
//! piece; `t` is its local time, 0 at its start, `T` at its end; `w^2 = g / z_COM`. Per horizontal axis:
//!
//! | quantity | form | |
//! |---|---|---|
//! | ZMP | `x_Z(t) = sum a_i t^i`, i = 0..5 | (7) |
//! | COM | `x(t) = V exp(-w t) + W exp(-w (T - t)) + sum A_i t^i`, solves `x'' = w^2 (x - x_Z)` | (8), (9) |
//! | load of foot 2 | `F_Z2 = k F_Z`, `k` a quintic; foot 1 carries `1 - k` | (B.2), (B.3) |
//! | ZMP of foot 1 | `x_1(t)`, a quintic | 3.4 |
//! | ZMP of foot 2 | `x_2 = x_1 - (x_1 - x_Z)/k` | (B.4) |
//!
//! Foot 1 leaves the ground at the end of a double support, foot 2 has come into contact at its beginning.
//!
//! **Bounded exponentials.** The paper's `V cosh + W sinh` loses every digit on long phases (`w T = 36` in 10 s); the basis
//! above stays between 0 and 1. On phases shorter than `1/w` both forms cancel instead, and the solution is written from its start
//! ([`ComSolution`]).
//!
//! **No division of zero by zero.** Where foot 2 lands, `k` and `x_1 - x_Z` both start with value, first and second
//! derivative zero: as quintics they share the factor `t^3` *exactly*. A phase stores both divided by it ([`Load`]), so that
//! `x_2` and its derivatives are regular rational functions at landing; there is no epsilon anywhere.
//!
//! # What is not modelled
//! A constant COM height, no angular momentum about the COM, no vertical moment at the ZMP; the ground is the plane z = 0.
//! The forces are those of the cart-table: `share * (M x'', M y'', M g)`.
//!
//! # Frames and points
//! World: x forward, y left, z up. Feet are indexed left = 0, right = 1 ([`Side`]). A [`Foothold`] is a point of the ground
//! with a yaw; it is said each time whether it lies under the ankle or under the centre of the sole.
#![allow(non_snake_case)] // A_i, V, W as in the paper

mod change;
mod check;
mod foothold;
mod heading;
mod phase;
mod polynomial;
mod reference;
mod shift;
mod swing;
mod walk;

pub use change::PlanChange;
pub use check::PatternError;
pub use foothold::{Foothold, Side};
pub use phase::{ComSolution, FootPhase, Load, Phase, PhaseKind, Swing};
pub use polynomial::Quintic;
pub use reference::{FootReference, Planar, PlanarMotion, Reference, Scalar, SwingReference};
pub use shift::{SHIFT_INTERVALS, SHIFT_KNOTS, ZmpShift};
pub use swing::{AnkleState, SwingTrajectory};
pub use walk::{PATTERN_VERSION, WalkPattern};
