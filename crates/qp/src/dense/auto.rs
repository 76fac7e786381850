//! The active set with Clarabel as backup solver.
//!
//! | the active set says | then |
//! |---|---|
//! | solved, infeasible, unbounded, not convex | that is the answer: each is proved from the data |
//! | anything else | Clarabel solves; the rows that hold at its answer are the active set's next guess |
//!
//! Of Clarabel's answer and of the active set's second one the exact vertex is taken when it is solved, else
//! Clarabel's, else the first.

use super::{Active, ActiveSet, ActiveSetSettings, Interior, InteriorSettings, Outcome, Problem, Side, Size, Solver};
use crate::{Row, Status};
use nalgebra::DVector;

/// Who answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backend {
    /// [`ActiveSet`].
    ActiveSet,
    /// [`Interior`].
    Interior,
}

/// See the module's documentation.
pub struct Auto {
    active_set: ActiveSet,
    interior: Interior,
    backend: Backend,
}

impl Auto {
    /// For programs of one size.
    #[must_use]
    pub fn new(size: Size, active_set: ActiveSetSettings, interior: InteriorSettings) -> Self {
        Self {
            active_set: ActiveSet::new(size, active_set),
            interior: Interior::new(size, interior),
            backend: Backend::ActiveSet,
        }
    }

    /// Who gave the last answer.
    #[must_use]
    pub fn backend(&self) -> Backend {
        self.backend
    }

    fn decide(&mut self, problem: &Problem) -> Backend {
        let first = self.active_set.solve(problem).report.status;
        if matches!(first, Status::Solved | Status::Infeasible | Status::Unbounded | Status::NotConvex) {
            return Backend::ActiveSet;
        }
        let second = self.interior.solve(problem).report.status;
        if !second.has_solution() {
            // Proofs count; who gave up is not better than who gave up first.
            let is_proof = matches!(second, Status::Infeasible | Status::Unbounded | Status::NotConvex);
            return if is_proof || !first.has_solution() { Backend::Interior } else { Backend::ActiveSet };
        }
        self.active_set.guess(&rows_that_hold(problem, self.interior.outcome()));
        let third = self.active_set.solve(problem).report.status;
        if third == Status::Solved { Backend::ActiveSet } else { Backend::Interior }
    }
}

/// Rows whose multiplier is larger than their distance from the side: of the two an interior point lets one vanish.
fn rows_that_hold(problem: &Problem, outcome: &Outcome) -> Vec<Active> {
    let report = &outcome.report;
    let values = &problem.C * &report.x;
    let listed = |values: &DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>, y: &DVector<f64>| {
        let side = |i: usize| match y[i] {
            y if y > (upper[i] - values[i]).abs() => Some((i, Side::Upper, y)),
            y if -y > (values[i] - lower[i]).abs() => Some((i, Side::Lower, -y)),
            _ => None,
        };
        (0..values.len()).filter_map(side).collect::<Vec<_>>()
    };
    let rows = listed(&values, &problem.l, &problem.u, &report.y_in);
    let bounds = listed(&report.x, &problem.lb, &problem.ub, &report.y_bound);
    let mut active: Vec<_> = (rows.into_iter().map(|(i, side, y)| (Active { row: Row::Inequality(i), side }, y)))
        .chain(bounds.into_iter().map(|(i, side, y)| (Active { row: Row::Bound(i), side }, y)))
        .collect();
    // The set takes as many as there are unknowns: the heaviest first.
    active.sort_by(|a, b| b.1.total_cmp(&a.1));
    active.into_iter().map(|(row, _)| row).collect()
}

impl Solver for Auto {
    fn solve(&mut self, problem: &Problem) -> &Outcome {
        self.backend = self.decide(problem);
        self.outcome()
    }

    fn outcome(&self) -> &Outcome {
        match self.backend {
            Backend::ActiveSet => self.active_set.outcome(),
            Backend::Interior => self.interior.outcome(),
        }
    }

    fn guess(&mut self, active: &[Active]) {
        self.active_set.guess(active);
    }

    fn forget(&mut self) {
        self.active_set.forget();
        self.interior.forget();
    }
}
