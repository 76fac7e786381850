//! Public-API tests of `multibody`.
#![allow(non_snake_case)] // monogram notation

mod accuracy;
mod allocations;
mod coupled;
mod hrp4;
mod identities;
mod leg;
mod motion;
mod random_robot;
mod urdf;
