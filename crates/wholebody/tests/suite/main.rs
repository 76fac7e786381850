//! The whole-body controller on HRP-4.

#[path = "../support/mod.rs"]
mod support;

mod walking;
