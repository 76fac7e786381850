//! Small dense programs, solved again and again: one whole-body control step.
//!
//! ```text
//! minimise 1/2 xᵀ P x + cᵀ x   subject to   A x = b,   l <= C x <= u,   lb <= x <= ub
//! ```
//!
//! | type | meaning |
//! |---|---|
//! | [`Problem`] | the data; [`Problem::residuals`] judges any point against it |
//! | [`ActiveSet`] | own dual active-set method: exact vertices, warm start, no allocation, names conflicting rows |
//! | [`Interior`] | Clarabel with data updates: the independent second opinion |
//! | [`Solver`] | what both offer |
//!
//! **Why two.** On recorded walking programs the active-set method takes about a hundredth of Clarabel's time with data
//! updates and ends at the vertex itself (`cargo bench -p qp --bench recorded -- FOLDER` prints the comparison). Clarabel's
//! interior point does not depend on a good guess and shares no code with it: it serves as oracle and as backend to compare
//! with. Status, multipliers and residuals are those of the whole crate.
//!
//! References: Goldfarb and Idnani, *A numerically stable dual method for solving strictly convex quadratic programs*,
//! Math. Programming 27 (1983); Goulart and Chen, *Clarabel* (2024).

mod active_set;
mod basis;
mod cholesky;
mod interior;
mod kernels;
mod problem;
mod report;

pub use active_set::{ActiveSet, ActiveSetSettings};
pub use interior::{Interior, InteriorSettings};
pub use problem::{Problem, ProblemError, Size};
pub use report::{Active, Contradiction, Outcome, Side};

/// A solver of dense programs of one size.
pub trait Solver {
    /// Solves and reports; what was found last is used as a guess where the method can.
    ///
    /// # Panics
    /// The sizes of `problem` are not those the solver was made for.
    fn solve(&mut self, problem: &Problem) -> &Outcome;

    /// What the last call of [`Solver::solve`] found.
    fn outcome(&self) -> &Outcome;

    /// Suggests rows that may hold at the next solution, in place of those of the last one. Any guess is safe; a method
    /// that needs none ignores it.
    fn guess(&mut self, active: &[Active]);

    /// Forgets the past: the next solve starts cold.
    fn forget(&mut self);
}
