//! Public-API tests of `multibody`.
#![allow(non_snake_case)] // monogram notation

mod identities;
mod random_robot;
