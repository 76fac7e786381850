//! Units in which unknowns and rows are alike, by powers of two: scaling and unscaling lose nothing.
//!
//! Unknown j is measured in `1 / sqrt(P_jj)` (without curvature: so that its largest entry in the rows is 1), each row
//! by its largest entry then. A residual of 1e-9 beside terms of 1 says nothing about an unknown of 1e-8; in these
//! units it does.

use super::{Problem, Size};
use crate::Report;
use nalgebra::{DMatrix, DVector};

/// Scales of a program.
#[derive(Debug, Clone)]
pub(super) struct Scaling {
    /// x = `unknowns` times the scaled x.
    unknowns: DVector<f64>,
    /// Row of A, of C, times its entry.
    equalities: DVector<f64>,
    inequalities: DVector<f64>,
}

/// The nearest power of two; 1 for what has none.
fn power_of_two(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() { x.log2().round().clamp(-500.0, 500.0).exp2() } else { 1.0 }
}

impl Scaling {
    /// Memory for programs of one size.
    pub(super) fn new(size: Size) -> Self {
        let ones = |n| DVector::from_element(n, 1.0);
        Self {
            unknowns: ones(size.variables),
            equalities: ones(size.equalities),
            inequalities: ones(size.inequalities),
        }
    }

    /// Takes the scales of a program. Returns how far apart the units are: the largest ratio of two scales of unknowns
    /// or of rows.
    pub(super) fn measure(&mut self, problem: &Problem) -> f64 {
        let Self { unknowns, equalities, inequalities } = self;
        for (j, scale) in unknowns.iter_mut().enumerate() {
            let curvature = problem.P[(j, j)];
            let column = |m: &DMatrix<f64>| m.column(j).iter().fold(0.0, |s: f64, x| s.max(x.abs()));
            let largest = if curvature > 0.0 { curvature.sqrt() } else { column(&problem.A).max(column(&problem.C)) };
            *scale = power_of_two(1.0 / largest);
        }
        let ratio =
            |v: &DVector<f64>| v.iter().copied().fold(0.0, f64::max) / v.iter().copied().fold(f64::INFINITY, f64::min);
        let mut spread = ratio(unknowns);
        for (m, scales) in [(&problem.A, equalities), (&problem.C, inequalities)] {
            scales.fill(0.0);
            for (column, unit) in m.column_iter().zip(unknowns.iter()) {
                scales.iter_mut().zip(&column).for_each(|(l, x)| *l = l.max((x * unit).abs()));
            }
            scales.iter_mut().for_each(|l| *l = power_of_two(1.0 / *l));
            spread = spread.max(ratio(scales));
        }
        spread
    }

    /// The program in these units.
    pub(super) fn scaled(&self, problem: &Problem) -> Problem {
        let Self { unknowns: d, equalities, inequalities } = self;
        let matrix = |m: &DMatrix<f64>, rows: &DVector<f64>| {
            DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] * rows[i] * d[j])
        };
        Problem {
            P: matrix(&problem.P, d),
            c: problem.c.component_mul(d),
            A: matrix(&problem.A, equalities),
            b: problem.b.component_mul(equalities),
            C: matrix(&problem.C, inequalities),
            l: problem.l.component_mul(inequalities),
            u: problem.u.component_mul(inequalities),
            lb: problem.lb.component_div(d),
            ub: problem.ub.component_div(d),
        }
    }

    /// Point and multipliers of the scaled program from those of the program, or (`back`) the reverse.
    pub(super) fn carry(&self, report: &mut Report, back: bool) {
        let turn = |vector: &mut DVector<f64>, by: &DVector<f64>, multiply: bool| {
            vector.zip_apply(by, |x, s| if multiply { *x *= s } else { *x /= s });
        };
        turn(&mut report.x, &self.unknowns, back);
        turn(&mut report.y_eq, &self.equalities, back);
        turn(&mut report.y_in, &self.inequalities, back);
        turn(&mut report.y_bound, &self.unknowns, !back);
    }

    /// Largest residual of a point in these units, relative to its largest terms. The objective's unit is free, so 1 is
    /// no yardstick.
    pub(super) fn residual(&self, problem: &Problem, report: &Report) -> f64 {
        let problem = self.scaled(problem);
        let Size { equalities: e, inequalities: m, variables: n } = problem.size();
        let mut point = report.clone();
        self.carry(&mut point, false);
        let largest = |v: &DVector<f64>| v.iter().fold(0.0, |s: f64, x| s.max(x.abs()));
        let (x, y_eq, y_in, y_bound) = (&point.x, &point.y_eq, &point.y_in, &point.y_bound);
        let (Px, Ay, Cy) = (&problem.P * x, problem.A.tr_mul(y_eq), problem.C.tr_mul(y_in));
        let force = [&Px, &problem.c, &Ay, &Cy, y_bound].into_iter().map(largest).fold(f64::MIN_POSITIVE, f64::max);
        let stationarity = largest(&(&Px + &problem.c + &Ay + &Cy + y_bound)) / force;
        let (Ax, Cx) = (&problem.A * x, &problem.C * x);
        let way = [x, &Ax, &Cx, &problem.b].into_iter().map(largest).fold(f64::MIN_POSITIVE, f64::max);
        let mut missed = if e > 0 { largest(&(&Ax - &problem.b)) } else { 0.0 };
        let mut idle = 0.0_f64;
        let mut look = |value: f64, lower: f64, upper: f64, y: f64| {
            missed = missed.max(lower - value).max(value - upper);
            let distance = if y > 0.0 { upper - value } else { value - lower };
            idle = idle.max(y.abs() * if distance.is_finite() { distance.abs() } else { way });
        };
        (0..m).for_each(|i| look(Cx[i], problem.l[i], problem.u[i], y_in[i]));
        (0..n).for_each(|i| look(x[i], problem.lb[i], problem.ub[i], y_bound[i]));
        stationarity.max(missed / way).max(idle / (force * way))
    }
}
