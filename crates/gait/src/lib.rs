//! Walking pattern generation: the walk as a quadratic program.
#![allow(non_snake_case)] // T, M, V, W as in the paper

mod basis;
pub mod check;
mod constraint;
mod cost;
mod error;
mod layout;
mod plan;
mod problem;
pub mod quadrature;
mod route;
mod settings;

pub use check::{CheckReport, LegClearance, LegReach, Quantity, RodLegs, TightestReach, Worst, ankle_pose, check};
pub use constraint::{RowLabel, ZmpOf};
pub use cost::CostTerms;
pub use error::GaitError;
pub use plan::{Plan, PlanReport, ProgramReport, plan};
pub use problem::PatternProblem;
pub use route::{Footstep, Route};
pub use settings::{
    BodySettings, CostSettings, DiscretisationSettings, GaitSettings, Landing, LimitSettings, SoleOutline,
    SolverSettings, StartSettings, SwingSettings, TimingSettings, Walk,
};
