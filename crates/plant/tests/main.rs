//! The plant as others use it.
#![allow(non_snake_case)] // monogram notation

mod suite;
