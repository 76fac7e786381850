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
//! | [`Auto`] | the active set, and where it does not get through, Clarabel as its backup solver |
//! | [`Solver`] | what all of them offer |
//!
//! **Why two.** The active-set method takes less than a fiftieth of Clarabel's time with data updates, ends at the vertex
//! itself, and does not allocate. Clarabel's interior point does not depend on a good guess and shares no code with it: it
//! serves as oracle and as backend to compare with. Status, multipliers and residuals are those of the whole crate.
//!
//! `cargo bench -p qp --bench recorded -- FOLDER` on 800 recorded walking programs (38 dof, 54 or 70 unknowns), thread CPU
//! time on a shared two-core machine, built with `--profile dev`; *violation* in N, N m, m/s²:
//!
//! | solver | median us | p99 | max | ratio | changes or steps | violation |
//! |---|---|---|---|---|---|---|
//! | Clarabel, data updates, 1e-8 | 1392 | 1942 | 2035 | 1 | 14 | 5e-13 |
//! | active set, warm | 23.3 | 41 | 76 | 0.0168 | 0.2 | 1e-12 |
//! | active set, cold | 25.1 | 57 | 62 | 0.0181 | 3.4 | 1e-12 |
//! | noisy: Clarabel | 1390 | 2013 | 2137 | 1 | 14 | 6e-13 |
//! | noisy: active set, warm | 24.7 | 47 | 65 | 0.0178 | 1.1 | 9e-13 |
//!
//! References: Goldfarb and Idnani, *A numerically stable dual method for solving strictly convex quadratic programs*,
//! Math. Programming 27 (1983); Goulart and Chen, *Clarabel* (2024).

mod active_set;
mod auto;
mod basis;
mod cholesky;
mod interior;
mod kernels;
mod order;
mod problem;
mod report;
mod scaling;

pub use active_set::{ActiveSet, ActiveSetSettings};
pub use auto::{Auto, Backend};
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
