//! Plays the robot: HRP-4 on soft soles, behind the messages a real robot's driver would speak.
//!
//! The physics are in [`plant`]; this process gives it the robot's folder, the commands and the time of `robot/state`:
//!
//! - State -1 is the robot before it stands: at half-sitting, without load. The command that answers it holds the start
//!   configuration and its base pose; the robot is *placed* there, and time begins with state 0.
//! - State *k* is sampled at *t_k*. Command *k* answers it and is applied from *t_(k+1)* on, its joint references being reached
//!   at *t_(k+2)*: while the others compute command *k*, the plant moves under command *k - 1*.
//!
//! A command that does not come: the last joint references stay, rates are zero, the feed-forward torque fades within 20 ms,
//! and it is counted ([`SimulatorProcess::late`]). A command of the past is not used.
//!
//! The run is over when the controller says that the walk is finished and some time has passed, or when the robot falls.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod command;
mod convert;
mod settings;
mod step;

pub use command::ImpossibleCommand;
pub use settings::{RunSettings, SimulatorError, SimulatorSettings};
pub use step::{SimulatorOutput, SimulatorProcess};
