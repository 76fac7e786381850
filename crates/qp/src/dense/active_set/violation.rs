//! Which rows a point violates.

use super::{ActiveSet, ROUNDOFFS};
use crate::dense::kernels::dot;
use crate::dense::{Problem, Size};

/// Which violations count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tolerance {
    /// Those beyond the settings' tolerance.
    Strict,
    /// Less, after sets of rows have returned or rows have proved to follow from others.
    Loosened,
}

/// A row found violated.
#[derive(Debug, Clone, Copy)]
pub(super) struct Violated {
    pub(super) row: usize,
    pub(super) sign: f64,
    /// Violation relative to the length of the row's gradient.
    pub(super) relative: f64,
    /// Violation that is accepted.
    pub(super) tolerance: f64,
}

impl ActiveSet {
    /// All rows that are violated, the largest violation last.
    pub(super) fn find_violated(&mut self, problem: &Problem, tolerance: Tolerance) {
        let Size { equalities: e, inequalities: m, .. } = self.size;
        let rounding = ROUNDOFFS * f64::EPSILON * dot(&self.x, &self.x).sqrt();
        let is_loose = tolerance == Tolerance::Loosened;
        let loosening = if is_loose { self.loosening } else { 1.0 };
        let (is_held, is_tolerated, settings, pending) =
            (&self.is_held, &self.is_tolerated, &self.settings, &mut self.pending);
        pending.clear();
        let mut look = |row: usize, value: f64, lower: f64, upper: f64, norm: f64| {
            let (below, above) = (lower - value, value - upper);
            let violation = below.max(above);
            if violation <= 0.0 || is_held[row] || (is_loose && is_tolerated[row]) {
                return;
            }
            let tolerance = loosening * (settings.feasibility_tolerance + rounding * norm);
            if violation > tolerance {
                let relative = if norm > 0.0 { violation / norm } else { violation };
                pending.push(Violated { row, sign: if below > above { 1.0 } else { -1.0 }, relative, tolerance });
            }
        };
        for &row in &self.postponed {
            let target = problem.b[row];
            look(row, self.values[row], target, target, self.norms[row]);
        }
        let (lower, upper) = (problem.l.as_slice(), problem.u.as_slice());
        for i in 0..m {
            look(e + i, self.values[e + i], lower[i], upper[i], self.norms[e + i]);
        }
        let (lower, upper) = (problem.lb.as_slice(), problem.ub.as_slice());
        for (i, x) in self.x.iter().enumerate() {
            look(e + m + i, *x, lower[i], upper[i], 1.0);
        }
        pending.sort_unstable_by(|a, b| a.relative.total_cmp(&b.relative).then(b.row.cmp(&a.row)));
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ActiveSetSettings, Solver};
    use super::*;
    use crate::dense::active_set::returning::LOOSENING_MAX;

    #[test]
    fn a_raised_tolerance_counts_on_the_way_and_not_in_the_end() {
        let mut problem = Problem::new(Size { variables: 1, equalities: 0, inequalities: 0 });
        problem.lb[0] = 1.0;
        let mut solver = ActiveSet::new(problem.size(), ActiveSetSettings::default());
        solver.solve(&problem);
        solver.is_held.fill(false);
        (solver.x[0], solver.loosening) = (1.0 - 1e-8, LOOSENING_MAX);
        for (tolerance, found) in [(Tolerance::Loosened, 0), (Tolerance::Strict, 1)] {
            solver.find_violated(&problem, tolerance);
            assert_eq!(solver.pending.len(), found, "{tolerance:?}");
        }
    }
}
