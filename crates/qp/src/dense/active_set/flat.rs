//! Programs whose P is only semidefinite: the objective is flat in some directions, or linear.
//!
//! Proximal point method (Rockafellar 1976): `xₖ₊₁ = argmin ½ xᵀ P x + cᵀ x + ½ (x - xₖ)ᵀ S (x - xₖ)` with a small
//! diagonal S. Each of these is strictly convex, starts from the rows held before, and differs only in its linear term.
//! On a polyhedron the minimiser is met after finitely many steps, few when S is small; S shrinks while the solves
//! succeed.
//!
//! **Unbounded.** Without a minimiser `d = xₖ₊₁ - xₖ` tends to a direction with `P d = 0`, `A d = 0`, `C d` inward, `cᵀ
//! d < 0`: such a `d` proves it and is the answer.

use super::{ActiveSet, Indefinite};
use crate::Status;
use crate::convexity::negative_curvature;
use crate::dense::{Problem, Size};
use nalgebra::DVector;

/// S relative to the diagonal of P, at first, at least, and its factor from step to step.
const SHIFT_FIRST: f64 = 1e-4;
const SHIFT_LEAST: f64 = 1e-9;
const SHRINKING: f64 = 0.1;
/// Most steps: ten more than S takes to become as small as it gets, and as many again where an unbounded direction
/// turns slowly.
const STEPS_MAX: usize = 30;
/// Stationarity of the program as given that counts as solved: its rounding is that of the shifted factors, 1 /
/// `SHIFT_LEAST` times as large.
const STATIONARITY: f64 = 1e-10;
/// `P d`, `A d` and outward `C d` of an unbounded direction, relative to their terms; and the least `-cᵀ d`.
const FLATNESS: f64 = 1e-11;
const DESCENT: f64 = 1e-9;

/// Memory of the method.
#[derive(Debug, Clone)]
pub(super) struct Flat {
    shifted: Problem,
    shift: DVector<f64>,
    centre: DVector<f64>,
}

impl ActiveSet {
    /// Solves a program whose P has a pivot that is not positive.
    pub(super) fn solve_flat(&mut self, problem: &Problem, stop: Indefinite) -> Status {
        if stop.pivot.is_nan() {
            return Status::NumericalFailure;
        }
        if let Some(curvature) = negative_curvature(&problem.P) {
            self.outcome.report.negative_curvature = Some(curvature);
            return Status::NotConvex;
        }
        let mut flat = self.flat.take().unwrap_or_else(|| {
            let zeros = DVector::zeros(self.size.variables);
            Box::new(Flat { shifted: problem.clone(), shift: zeros.clone(), centre: zeros })
        });
        let status = self.follow(problem, &mut flat);
        self.flat = Some(flat);
        status
    }

    fn follow(&mut self, problem: &Problem, flat: &mut Flat) -> Status {
        flat.shifted.clone_from(problem);
        flat.centre.fill(0.0);
        let natural = natural_diagonal(problem);
        let (mut relative, mut changes) = (SHIFT_FIRST, 0);
        let mut last = Status::NumericalFailure;
        for step in 0..STEPS_MAX {
            flat.shift = &natural * relative;
            for (i, shift) in flat.shift.iter().enumerate() {
                flat.shifted.P[(i, i)] = problem.P[(i, i)] + shift;
                flat.shifted.c[i] = problem.c[i] - shift * flat.centre[i];
            }
            self.outcome.clear();
            let Ok(status) = self.solve_strictly_convex(&flat.shifted) else {
                relative /= SHRINKING;
                continue;
            };
            changes += self.iterations;
            self.iterations = changes;
            if !status.has_solution() {
                // Infeasible rows are infeasible whatever the objective.
                return status;
            }
            self.judge(problem);
            last = status;
            if self.outcome.report.residuals.stationarity <= STATIONARITY {
                return status;
            }
            let moved = DVector::from_column_slice(&self.x) - &flat.centre;
            if step > 0 && is_unbounded_along(problem, &moved) {
                let length = moved.amax();
                self.outcome.report.x.copy_from(&(moved / length));
                return Status::Unbounded;
            }
            flat.centre.copy_from_slice(&self.x);
            self.remember();
            relative = (relative * SHRINKING).max(SHIFT_LEAST);
        }
        if last == Status::Solved { Status::IterationLimit } else { last }
    }
}

/// What S is measured by: the diagonal of P; where it is smaller than its largest by more than `SHIFT_FIRST`, that part
/// of the largest; without any curvature, the slope over the size of the sides, so that steps are as long as the
/// feasible set is wide.
fn natural_diagonal(problem: &Problem) -> DVector<f64> {
    let diagonal = problem.P.diagonal();
    let largest = diagonal.amax();
    if largest > 0.0 {
        return diagonal.map(|p| p.max(SHIFT_FIRST * largest));
    }
    let sides = [&problem.b, &problem.l, &problem.u, &problem.lb, &problem.ub];
    let width = sides.into_iter().flatten().filter(|side| side.is_finite()).fold(1.0, |s: f64, side| s.max(side.abs()));
    let slope = problem.c.amax();
    DVector::from_element(diagonal.len(), if slope > 0.0 { slope / width } else { 1.0 })
}

/// Whether the objective falls for ever along `d` and no row stops it: judged from the data, each product relative to
/// its terms.
fn is_unbounded_along(problem: &Problem, d: &DVector<f64>) -> bool {
    let Size { variables: n, equalities: e, inequalities: m } = problem.size();
    let size = d.amax();
    if !(size > 0.0 && size.is_finite()) {
        return false;
    }
    // Relative to a row's largest entry times the largest of d: small unknowns are no better known than that.
    let along = |matrix: &nalgebra::DMatrix<f64>, i: usize| {
        let row = matrix.row(i);
        row.transpose().dot(d) / (row.amax() * size).max(f64::MIN_POSITIVE)
    };
    let inward = |along: f64, lower: f64, upper: f64| {
        (lower == f64::NEG_INFINITY || along >= -FLATNESS) && (upper == f64::INFINITY || along <= FLATNESS)
    };
    problem.c.dot(d) < -DESCENT * problem.c.amax() * size
        && (0..n).all(|i| along(&problem.P, i).abs() <= FLATNESS)
        && (0..e).all(|i| along(&problem.A, i).abs() <= FLATNESS)
        && (0..m).all(|i| inward(along(&problem.C, i), problem.l[i], problem.u[i]))
        && (0..n).all(|i| inward(d[i] / size, problem.lb[i], problem.ub[i]))
}
