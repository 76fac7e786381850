//! Observer and internal state on HRP-4's walks.
#![allow(non_snake_case)] // monogram notation

#[path = "../../../wholebody/tests/support/mod.rs"]
mod support;

mod allocation;
mod internal;
mod observer;
