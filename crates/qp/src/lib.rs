//! Convex quadratic programs, solver-neutral, with Clarabel behind them.
//!
//! ```text
//! minimise    1/2 x' P x + c' x
//! subject to  A x = b
//!             l <= C x <= u           (an infinite side = none)
//!             lb <= x <= ub           (an infinite side = none)
//! ```
//!
//! | letter | shape | meaning |
//! |---|---|---|
//! | `P` | n x n | symmetric positive semidefinite Hessian |
//! | `c` | n | gradient at the origin |
//! | `A`, `b` | p x n, p | equalities |
//! | `C`, `l`, `u` | m x n, m, m | two-sided inequalities |
//! | `lb`, `ub` | n, n | bounds |
//!
//! **Multipliers.** The Lagrangian's gradient vanishes at a solution:
//!
//! ```text
//! P x + c + A' y_eq + C' y_in + y_bound = 0
//! ```
//!
//! with `y > 0` where an upper side is active, `y < 0` where a lower side is active, `0` elsewhere. Every backend
//! reports in this convention, and [`Residuals`] are computed here from the problem as given, never taken from the
//! backend.
//!
//! **Programs that are not convex** are refused with their curvature ([`Status::NotConvex`],
//! [`Report::negative_curvature`]): a point where the conditions above hold may be a saddle. `P` as a whole counts, not
//! only along the equalities.
//!
//! **Infeasible problems** are an outcome, not an error: the multipliers of the report are then a Farkas certificate,
//! `A' y_eq + C' y_in + y_bound = 0` with a negative support value; the rows that carry it are those that conflict with
//! each other ([`Report::conflict`]), and the least largest violation says by how much
//! ([`QuadraticProgram::least_violation`]).
//!
//! Two forms: [`sparse`] for large banded problems solved once (the walking pattern), [`dense`] for small ones solved
//! at every tick (the whole-body controller).
#![allow(non_snake_case)] // P, A, C as in the literature

pub mod backend;
mod convexity;
pub mod dense;
mod generation;
mod relaxation;
mod report;
pub mod sparse;

pub use generation::solve_generating;
pub use report::{Conflict, Report, Residuals, Row, Status};
pub use sparse::{QuadraticProgram, SparseMatrix, Triplets};
