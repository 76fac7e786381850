//! What all solvers share: settings, memory, report.

use crate::obstruction::Obstruction;
use crate::problem::{ContactProblem, Residual};
use crate::single_contact::ContactState;
use nalgebra::DVector;

/// Limits and tolerance of all solvers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest relative residual, of force and of gap alike, see the crate. 1e-4 to 1e-8 are common; 1e-12 is reachable
    /// with Newton.
    pub tolerance: f64,
    /// Gauss-Seidel sweeps. [`solve`](crate::solve()) takes up to four turns, of at most 60, 20, 100 and this many.
    pub sweeps_max: usize,
    /// Newton iterations; in each of the turns of [`solve`](crate::solve()).
    pub newton_iterations_max: usize,
    /// Outer iterations of the proximal method; each costs up to `sweeps_max` sweeps.
    pub proximal_iterations_max: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: 1e-8, sweeps_max: 500, newton_iterations_max: 30, proximal_iterations_max: 200 }
    }
}

/// Outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Status {
    /// The residual meets the tolerance.
    #[default]
    Solved,
    /// Iterations ran out; the residual says how far it came. There may be a solution.
    IterationLimit,
    /// There is no solution: [`Report::obstruction`] is the proof. Only [`solve`](crate::solve()) looks for it.
    Impossible,
    /// A linear system was singular, or a contact's own block is.
    Singular,
}

/// Answer with its judgement.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Outcome.
    pub status: Status,
    /// `F` (N), rows (t1, t2, n) per contact.
    pub force: DVector<f64>,
    /// `delta = W F + q`.
    pub delta: DVector<f64>,
    /// Judged afresh from `F` and `W`.
    pub residual: Residual,
    /// Sweeps, or Newton iterations, or all together.
    pub iterations: usize,
    /// Of a problem without solution: the contacts that no forces keep apart.
    pub obstruction: Option<Obstruction>,
}

/// All memory of the solvers for up to a number of contacts. Also the warm start: forces and states stay from call to
/// call.
#[derive(Debug, Clone)]
pub struct Workspace {
    /// Present forces (N): the start of the next solve and, after it, its answer.
    pub force: Vec<f64>,
    /// `W F + q` of these.
    pub delta: Vec<f64>,
    pub(crate) lambda: Vec<f64>,
    pub(crate) states: Vec<ContactState>,
    pub(crate) matrix: Vec<f64>,
    pub(crate) right: Vec<f64>,
    pub(crate) pivots: Vec<usize>,
    pub(crate) active: Vec<usize>,
}

impl Workspace {
    /// For `contacts` contacts, forces zero.
    #[must_use]
    pub fn new(contacts: usize) -> Self {
        Self {
            force: vec![0.0; 3 * contacts],
            delta: vec![0.0; 3 * contacts],
            lambda: vec![0.0; contacts],
            states: vec![ContactState::Open; contacts],
            matrix: Vec::new(),
            right: Vec::new(),
            pivots: Vec::new(),
            active: Vec::with_capacity(contacts),
        }
    }

    /// Cold start: as new.
    pub fn reset(&mut self) {
        self.force.fill(0.0);
        self.lambda.fill(0.0);
        self.states.fill(ContactState::Open);
    }

    /// States of the contacts after a solve.
    #[must_use]
    pub fn states(&self) -> &[ContactState] {
        &self.states
    }

    /// Reserves what Newton needs, so that it does not allocate later.
    pub fn reserve_newton(&mut self) {
        let rows = self.force.len();
        self.matrix.resize(rows * rows, 0.0);
        self.right.resize(rows, 0.0);
        self.pivots.resize(rows, 0);
    }

    pub(crate) fn report(
        &mut self,
        problem: &ContactProblem,
        tolerance: f64,
        iterations: usize,
        otherwise: Status,
    ) -> Report {
        problem.displacement_into(&self.force, &mut self.delta);
        let residual = problem.residual_at(&self.force, &self.delta);
        let status = if residual.relative <= tolerance { Status::Solved } else { otherwise };
        Report {
            status,
            force: DVector::from_column_slice(&self.force),
            delta: DVector::from_column_slice(&self.delta),
            residual,
            iterations,
            obstruction: None,
        }
    }
}
