//! Runs one process again from a recording and compares what it says with what it said then.
//!
//! A recording of a run holds every message that crossed a process border, the effective configuration and the
//! robot's files: nothing else is needed. The process's own `step` is handed the recorded inputs in the order in which they came,
//!
//! ```text
//! planner      configuration                      -> pattern
//! estimator    pattern, state k, start            -> deformation k, contact k
//! controller   pattern, state k, deformation k    -> command k, start
//! simulator    command k, start                   -> state k + 1, truth k + 1
//! ```
//!
//! and its answers are held against the recorded ones, number by number. With the same executable, on a processor with the same
//! vector instructions, they are the same to the bit; another build or another compiler may differ in the last digits, which
//! [`Comparison::within`] allows for. With changed settings the comparison shows what the change does to this process alone, all
//! others saying what they said then: a controller with another weight, say, on the very states of the run. Its own commands
//! have no effect on these states (for that, walk again).
//!
//! By the clock a process goes by what is there, so the messages say what that was: a command which deformation it was made from, a truth
//! which command moved the robot there. A replay hands over the same, and waits for nothing; what was missing then is missing again.
//!
//! A replay needs complete inputs: what was used and is not there is named, and nothing is guessed in its place. Of a recording that ends early
//! (a fall, a killed process) everything up to its end is replayed. What is not replayed: health, whose times are of the clock.

mod compare;
mod error;
mod inputs;
mod keep;
mod replay;
mod unpack;

pub use compare::{Comparison, Difference, TopicComparison};
pub use error::ReplayError;
pub use inputs::{Inputs, Messages};
pub use keep::{Keeper, replayed_info};
pub use replay::{Hear, Replayable, Said, replay};
pub use unpack::Unpacked;
