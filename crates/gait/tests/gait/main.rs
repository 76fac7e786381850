//! Public API of the planner. One binary: linking several costs more than running them.
#![allow(non_snake_case)] // M, T as in the paper

mod checks;
mod cost;
mod hard_cases;
mod heading;
mod infeasible;
mod motion;
mod routes;
mod second_formulation;
mod settings;
mod support;
mod trends;
