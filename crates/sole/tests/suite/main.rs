//! Tests of the public interface.
#![allow(non_snake_case)] // monogram notation

mod reference_cases;
