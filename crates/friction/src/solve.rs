use crate::{ContactProblem, LocalState, Residual, gauss_seidel, newton, proximal};
use nalgebra::DVector;

/// Limits and tolerance of all solvers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest relative residual, see the crate. 1e-4 to 1e-8 are common; 1e-12 is reachable with Newton.
    pub tolerance: f64,
    /// Gauss-Seidel sweeps. [`solve`] takes up to four turns, of at most 60, 20, 100 and this many.
    pub sweeps_max: usize,
    /// Newton iterations; in each of the turns of [`solve`].
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
    /// Iterations ran out; the residual says how far it came.
    IterationLimit,
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
}

/// All memory of the solvers for up to a number of contacts. Also the warm start: forces and states stay from call to call.
#[derive(Debug, Clone)]
pub struct Workspace {
    /// Present forces (N): the start of the next solve and, after it, its answer.
    pub force: Vec<f64>,
    /// `W F + q` of these.
    pub delta: Vec<f64>,
    pub(crate) lambda: Vec<f64>,
    pub(crate) states: Vec<LocalState>,
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
            states: vec![LocalState::Open; contacts],
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
        self.states.fill(LocalState::Open);
    }

    /// States of the contacts after a solve.
    #[must_use]
    pub fn states(&self) -> &[LocalState] {
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
        }
    }
}

/// Gauss-Seidel for the contact states, Newton for the digits, in turns; the proximal method when both stall. Starts from the
/// workspace.
pub fn solve(problem: &ContactProblem, workspace: &mut Workspace, settings: &Settings) -> Report {
    /// Sweeps before each try of Newton, the last time `sweeps_max`. The first number finds the states of an elastic body. Where
    /// Newton then runs in circles, as at friction 2 on a thick nearly incompressible sole, other starts do.
    const SWEEPS: [usize; 4] = [60, 20, 100, usize::MAX];
    let mut iterations = 0;
    let mut best: Option<(Report, Vec<LocalState>)> = None;
    let mut keep = |report: Report, states: &[LocalState]| {
        let better = best.as_ref().is_none_or(|(best, _)| report.residual.relative < best.residual.relative);
        if better {
            best = Some((report, states.to_vec()));
        }
    };
    for sweeps in SWEEPS {
        let turn = Settings { sweeps_max: settings.sweeps_max.min(sweeps), ..*settings };
        let swept = gauss_seidel(problem, workspace, &turn);
        iterations += swept.iterations;
        if swept.status == Status::Solved {
            return Report { iterations, ..swept };
        }
        let (start, states) = (workspace.force.clone(), workspace.states.clone());
        keep(swept, &states);
        let polished = newton(problem, workspace, settings);
        iterations += polished.iterations;
        if polished.status == Status::Solved {
            return Report { iterations, ..polished };
        }
        keep(polished, &workspace.states);
        // The next turn goes on from the sweeps: a Newton that runs in circles leads nowhere.
        workspace.force.copy_from_slice(&start);
        workspace.states.copy_from_slice(&states);
    }
    let last = proximal(problem, workspace, settings);
    iterations += last.iterations;
    if last.status == Status::Solved {
        return Report { iterations, ..last };
    }
    keep(last, &workspace.states);
    let (best, states) = best.expect("four turns and the proximal method have said something");
    workspace.force.copy_from_slice(best.force.as_slice());
    workspace.delta.copy_from_slice(best.delta.as_slice());
    workspace.states.copy_from_slice(&states);
    Report { iterations, ..best }
}
