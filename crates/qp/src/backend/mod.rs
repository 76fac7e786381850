//! Solvers behind the common form.

pub mod clarabel;
