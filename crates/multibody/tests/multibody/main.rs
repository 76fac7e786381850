//! Public-API tests of `multibody`.
#![allow(non_snake_case)] // monogram notation

mod hrp4;
mod identities;
mod random_robot;
