//! The whole-body controller on HRP-4.
#![allow(non_snake_case)] // monogram notation

#[path = "../support/mod.rs"]
mod support;

mod collision;
mod fallback;
mod invariance;
mod limits;
mod settings;
mod start;
mod tasks;
mod walking;
