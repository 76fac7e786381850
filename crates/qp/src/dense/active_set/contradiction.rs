//! Rows that depend on each other, and the proof that they contradict each other.

use super::rows::{limit_of, name, row_times};
use super::{ActiveSet, ROUNDOFFS, Violated};
use crate::dense::kernels::{axpy, dot};
use crate::dense::{Outcome, Problem};
use crate::{Conflict, Row};

/// Rows with a smaller share in a vanishing combination are rounding, not part of the conflict.
const CONFLICT_SHARE: f64 = 1e-9;
/// Passes of [`ActiveSet::sharpen`]: the first corrects the combination, the second the remainder.
const SHARPENINGS: usize = 2;

impl ActiveSet {
    /// A short remainder z is what is left of numbers that cancelled, and `d = L⁻¹ a` is only as good as L is well
    /// conditioned. This computes the combination `a - Σ rₖ aₖ` from the data, where it loses nothing, and z, h and r anew
    /// from there. Returns ‖z‖, and whether the rows depend on each other to rounding of the data.
    pub(super) fn sharpen(&mut self, problem: &Problem, row: usize) -> (f64, bool) {
        let q = self.held.len();
        let mut norm = 0.0;
        let mut depends = false;
        for _ in 0..SHARPENINGS {
            let terms = self.combine_rows(problem, row);
            let remainder = dot(&self.z, &self.z).sqrt();
            depends = remainder <= ROUNDOFFS * f64::EPSILON * terms;
            self.cholesky.solve_lower(&mut self.z);
            norm = self.basis.split(&mut self.z, &mut self.w);
            axpy(1.0, &self.w[..q], &mut self.h[..q]);
            self.basis.solve_upper(&mut self.w);
            axpy(1.0, &self.w[..q], &mut self.r[..q]);
        }
        (norm, depends || norm == 0.0)
    }

    /// z <- `a - Σ rₖ aₖ`. Returns the sum of the terms' lengths. Overwrites `gradient`.
    fn combine_rows(&mut self, problem: &Problem, row: usize) -> f64 {
        std::mem::swap(&mut self.d, &mut self.gradient); // d is still needed
        self.gather(problem, row);
        self.z.copy_from_slice(&self.d);
        let mut terms = self.norms[row];
        for k in 0..self.held.len() {
            let (held, r) = (self.held[k], self.r[k]);
            self.gather(problem, held.row);
            axpy(-r, &self.d, &mut self.z);
            terms += (r * self.norms[held.row]).abs();
        }
        std::mem::swap(&mut self.d, &mut self.gradient);
        terms
    }

    /// Whether the combination `a - Σ rₖ aₖ`, which vanishes to rounding, really asks too much of its limits: judged from
    /// the data, for the violation of one row at an inexact point proves nothing.
    pub(super) fn is_proven(&mut self, problem: &Problem, entering: Violated) -> bool {
        let limit = limit_of(problem, self.size, entering.row, entering.sign);
        let (mut demanded, mut terms) = (limit, limit.abs());
        for k in 0..self.held.len() {
            let term = self.r[k] * self.limit(problem, self.held[k]);
            demanded -= term;
            terms += term.abs();
        }
        self.combine_rows(problem, entering.row);
        let remainder = dot(&self.z, &self.z).sqrt();
        let reach = dot(&self.x, &self.x).sqrt();
        let noise = remainder * reach + ROUNDOFFS * f64::EPSILON * terms;
        entering.sign * demanded > noise
    }

    /// The certificate: `a = Σ rₖ aₖ` to rounding, while the limits contradict each other. Multipliers and weights are
    /// positive at upper sides.
    pub(super) fn describe_contradiction(&mut self, problem: &Problem, entering: Violated) {
        self.place_x();
        let value = row_times(problem, self.size, entering.row, &self.x);
        let contradiction = &mut self.outcome.contradiction;
        contradiction.amount = (limit_of(problem, self.size, entering.row, entering.sign) - value).abs();
        contradiction.unmet = Some(name(self.size, entering.row));
        let share = |row: usize, weight: f64| (weight * self.norms[row]).abs();
        let pairs = self.held.iter().zip(&self.r).map(|(k, r)| (k.row, *r));
        let largest = pairs.clone().fold(share(entering.row, 1.0), |s, (row, r)| s.max(share(row, r)));
        contradiction.rows.push(Conflict { row: name(self.size, entering.row), weight: -entering.sign });
        for (row, r) in pairs {
            if share(row, r) > CONFLICT_SHARE * largest {
                contradiction.rows.push(Conflict { row: name(self.size, row), weight: entering.sign * r });
            }
        }
        let heaviest = contradiction.rows.iter().fold(0.0, |s: f64, c| s.max(c.weight.abs()));
        contradiction.rows.iter_mut().for_each(|c| c.weight /= heaviest);
        contradiction.rows.sort_unstable_by(|a, b| b.weight.abs().total_cmp(&a.weight.abs()));
    }

    /// The multipliers of an infeasible program are the certificate.
    pub(super) fn write_certificate(&mut self) {
        let Outcome { report, contradiction, .. } = &mut self.outcome;
        report.y_eq.fill(0.0);
        report.y_in.fill(0.0);
        report.y_bound.fill(0.0);
        for Conflict { row, weight } in &contradiction.rows {
            match *row {
                Row::Equality(i) => report.y_eq[i] += weight,
                Row::Inequality(i) => report.y_in[i] += weight,
                Row::Bound(i) => report.y_bound[i] += weight,
            }
        }
    }
}
