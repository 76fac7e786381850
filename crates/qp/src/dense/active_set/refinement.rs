//! How good the point is, from the data, and how to make it better.

use super::rows::{limit_of, name};
use super::{ActiveSet, ROUNDOFFS};
use crate::dense::kernels::{axpy, combine, dot, project};
use crate::dense::{Problem, Size};
use crate::{Residuals, Row};

/// Stationarity, relative to its largest term, that needs no correction.
const STATIONARITY_GOAL: f64 = 1e-13;

impl ActiveSet {
    /// Writes point, multipliers and residuals into the report. Returns the largest defect, in units of what is accepted.
    pub(super) fn judge(&mut self, problem: &Problem) -> f64 {
        let Size { variables: n, equalities: e, inequalities: m } = self.size;
        self.evaluate(problem, true);
        let report = &mut self.outcome.report;
        report.x.as_mut_slice().copy_from_slice(&self.x);
        report.y_eq.fill(0.0);
        report.y_in.fill(0.0);
        report.y_bound.fill(0.0);
        for (k, u) in self.held.iter().zip(&self.u) {
            match name(self.size, k.row) {
                Row::Equality(i) => report.y_eq[i] = -u,
                Row::Inequality(i) => report.y_in[i] = -u,
                Row::Bound(i) => report.y_bound[i] = -u,
            }
        }
        let gradient = &mut self.gradient;
        gradient.fill(0.0);
        combine(problem.P.as_slice(), n, 0, &self.x, gradient);
        report.objective = 0.5 * dot(gradient, &self.x) + dot(problem.c.as_slice(), &self.x);
        let mut term = largest(gradient).max(largest(problem.c.as_slice())).max(largest(report.y_bound.as_slice()));
        axpy(1.0, problem.c.as_slice(), gradient);
        axpy(1.0, report.y_bound.as_slice(), gradient);
        // d is free here: Aᵀ y, then Cᵀ y.
        for (matrix, rows, y) in [(&problem.A, e, &report.y_eq), (&problem.C, m, &report.y_in)] {
            project(matrix.as_slice(), rows, 0, y.as_slice(), &mut self.d);
            term = term.max(largest(&self.d));
            axpy(1.0, &self.d, gradient);
        }
        let stationarity = largest(gradient) / term.max(1.0);
        // Rounding of P x itself, which may cancel: |P_ij| is at most the largest diagonal entry.
        let steepest = problem.P.as_slice().iter().step_by(n + 1).fold(0.0, |s: f64, p| s.max(*p));
        let evaluation = 4.0 * f64::EPSILON * steepest * dot(&self.x, &self.x).sqrt();
        let mut defect = largest(gradient) / (STATIONARITY_GOAL * term).max(evaluation).max(f64::MIN_POSITIVE);

        let (targets, rows) = (problem.b.as_slice(), &self.values[e..]);
        let missed = self.values[..e].iter().zip(targets).fold(0.0, |s: f64, (v, b)| s.max((v - b).abs()));
        let outside = |values: &[f64], lower: &[f64], upper: &[f64]| {
            let sides = lower.iter().zip(upper);
            values.iter().zip(sides).fold(0.0, |s: f64, (v, (l, u))| s.max(l - v).max(v - u))
        };
        let beyond = outside(rows, problem.l.as_slice(), problem.u.as_slice());
        let out_of_bounds = outside(&self.x, problem.lb.as_slice(), problem.ub.as_slice());
        self.outcome.violation = missed.max(beyond).max(out_of_bounds);
        let (row_scale, x_scale) = (largest(rows).max(1.0), largest(&self.x).max(1.0));
        let target_scale = largest(&self.values[..e]).max(largest(targets)).max(1.0);
        let feasibility = (missed / target_scale).max(beyond / row_scale).max(out_of_bounds / x_scale);

        let y_scale = largest(report.y_in.as_slice()).max(largest(report.y_bound.as_slice())).max(1.0);
        let rounding = ROUNDOFFS * f64::EPSILON * dot(&self.x, &self.x).sqrt();
        let mut complementarity: f64 = 0.0;
        for (k, u) in self.held.iter().zip(&self.u) {
            let is_bound = k.row >= e + m;
            let value = if is_bound { self.x[k.row - e - m] } else { self.values[k.row] };
            let distance = (value - limit_of(problem, self.size, k.row, k.sign)).abs();
            defect = defect.max(distance / (self.settings.feasibility_tolerance + rounding * self.norms[k.row]));
            if k.sign != 0.0 {
                let scale = y_scale * if is_bound { x_scale } else { row_scale };
                complementarity = complementarity.max(distance * u.abs() / scale).max(-k.sign * u / y_scale);
            }
        }
        let report = &mut self.outcome.report;
        report.residuals = Residuals { stationarity, feasibility, complementarity };
        if self.x.iter().all(|x| x.is_finite()) { defect } else { f64::NAN }
    }

    /// One correction of x, y and u from the residuals that [`Self::judge`] left: solves
    /// `P dx - Dᵀ.. du = -gradient`, `a dx = limit - a x` for the held rows with the factors at hand.
    pub(super) fn refine(&mut self, problem: &Problem) {
        let q = self.held.len();
        self.order.arranged(self.gradient.iter().map(|g| -g), &mut self.z);
        self.cholesky.solve_lower(&mut self.z);
        self.basis.project(&self.z, &mut self.h);
        for k in 0..q {
            self.w[k] = self.limit(problem, self.held[k]) - self.value(self.held[k].row);
        }
        self.basis.solve_lower(&mut self.w);
        for (w, h) in self.w[..q].iter_mut().zip(&self.h) {
            *w -= h;
        }
        self.basis.combine(&self.w, &mut self.z);
        axpy(1.0, &self.z, &mut self.y);
        self.cholesky.solve_upper(&mut self.z);
        self.order.restored(&self.z, &mut self.gradient); // free until the next judgement
        axpy(1.0, &self.gradient, &mut self.x);
        self.basis.solve_upper(&mut self.w);
        axpy(1.0, &self.w[..q], &mut self.u[..q]);
    }
}

/// Largest absolute value; not a number if any entry is not.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |s: f64, x| if x.is_nan() { f64::NAN } else { s.max(x.abs()) })
}
