//! A walk before anybody walks it: the controller's whole-body step on an ideal plant, which moves exactly as the step says, and on rigid
//! footholds.
//!
//! What comes out is what the pattern's cart-table does not know:
//!
//! - **The body's own ZMP** ([`RehearsedTick::zmp_m`]). The swinging leg's angular momentum moves it by about a centimetre.
//! - **Limits of joints and drives** ([`Rehearsal::tightest`]): which joint comes how near to its limits of position, speed and torque, and
//!   when; and which joints are as fast as they may be ([`Rehearsal::at_speed`]), so that the foot in the air is late.
//!
//! # What is not modelled
//! The soles: on rigid footholds the ankles stand still. On soft ones they move by a millimetre and two degrees, which changes the ZMP by
//! less than a tenth of what the leg does. Nor may the soles be in it: a shift found with them holds the ankle accelerations that it causes
//! itself, and told to the soles again it grows.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod smoothing;
mod walk;

pub use smoothing::{HALF_WIDTH_MIN_PERIODS, Samples, local_cubic};
pub use walk::{AtSpeed, Demand, LimitKind, NotRehearsed, Rehearsal, RehearsedTick, rehearse};
