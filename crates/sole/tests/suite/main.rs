//! Tests of the public interface.
#![allow(non_snake_case)] // monogram notation

mod pose_driven;
mod reference_cases;
mod walking_stance;
