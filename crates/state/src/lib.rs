//! What the robot measures, made into the state from which a whole-body step starts.
//!
//! A step starts from the controller's **internal state** ([`InternalState`]): configuration `q` and velocity `v`. In open loop (the
//! paper's way) it is the result of the last step. In feedback it is blended with what is measured, at rates that are set:
//!
//! ```text
//! encoders, inertial unit, soles --- gate ---> observer ---> q_m, v_m          soles and model of the time of the measurement
//! q <- q (+) alpha (q_m (-) q),   v <- v + alpha (v_m - v),   alpha = 1 - exp(-rate dt)
//! ```
//!
//! | part | what it does |
//! |---|---|
//! | [`Refused`] (gate) | refuses a measurement that no standing robot makes, with its reason |
//! | [`AnchorHistory`] | remembers where the feet stood when the robot was as it is measured now |
//! | [`observer`] | finds pose and twist of the base |
//! | [`Feedback`] | does all three for a tick |
//! | [`InternalState`] | blends, and takes over a step's result |
//! | [`SettleDetector`] | says when a standing robot is still enough to walk |
//!
//! Nothing here knows messages, files or clocks: periods and ticks are handed in.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod anchors;
mod feedback;
mod gate;
mod internal;
pub mod observer;
mod settings;
mod settle;

pub use anchors::AnchorHistory;
pub use feedback::{Feedback, FeedbackFrames};
pub use gate::{Measured, Refused, unit_rotation};
pub use internal::{BaseMotion, InternalState, StateDistance};
pub use settings::{IntegrationMode, IntegrationSettings};
pub use settle::{Criterion, NotSettled, SettleDetector, SettleSettings, Stance, Unmet};
