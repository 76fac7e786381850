//! The constraints of a step, each in its own file.

pub mod friction;
pub mod limits;
