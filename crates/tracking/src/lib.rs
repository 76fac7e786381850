//! The whole body follows a pattern: its references at a tick, and where it starts.
//!
//! The controller asks for both at 200 Hz and before the walk; the planner's rehearsal asks the same functions.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod reference;
mod start;

pub use reference::reference;
pub use start::{Start, start};
