//! Why a problem is infeasible: which rows contradict each other, and by how much.
//!
//! An interior point that meets an infeasible problem ends with *some* certificate, usually one that leans a little on
//! every row there is. The relaxed problem
//!
//! ```text
//! minimise t   subject to   A x = b,   l - t <= C x <= u + t,   lb - t <= x <= ub + t,   t >= 0
//! ```
//!
//! has the smallest possible largest violation as its value, and its multipliers are again a certificate, but one that
//! is zero on every row that has room at that point.

use crate::{QuadraticProgram, Row, SparseMatrix, Triplets};
use nalgebra::DVector;

/// The relaxed problem and where its rows come from.
pub(crate) struct Relaxation {
    /// Unknowns `(x, t)`.
    pub problem: QuadraticProgram,
    /// For each inequality row of `problem` the row it relaxes.
    pub origins: Vec<Row>,
}

/// Writes the relaxed problem down.
pub(crate) fn relax(problem: &QuadraticProgram) -> Relaxation {
    let n = problem.variables();
    let mut c = DVector::zeros(n + 1);
    c[n] = 1.0;
    let mut relaxed = QuadraticProgram::unconstrained(SparseMatrix::zeros(n + 1, n + 1), c);
    relaxed.lb[n] = 0.0;
    let mut equalities = Triplets::with_capacity(problem.A.entries());
    problem.A.iter().for_each(|(i, j, value)| equalities.add(i, j, value));
    relaxed.A = equalities.into_matrix(problem.b.len(), n + 1);
    relaxed.b = problem.b.clone();

    let m = problem.l.len();
    let sides = (problem.l.iter().zip(&problem.u).enumerate().map(|(i, (l, u))| (Row::Inequality(i), *l, *u)))
        .chain(problem.lb.iter().zip(&problem.ub).enumerate().map(|(i, (l, u))| (Row::Bound(i), *l, *u)));
    let (mut origins, mut lower, mut upper) = (Vec::new(), Vec::new(), Vec::new());
    let mut rows = Triplets::with_capacity(2 * problem.C.entries());
    let mut places: Vec<[Option<usize>; 2]> = Vec::with_capacity(m + n);
    for (origin, l, u) in sides {
        let mut place = [None; 2];
        for (side, place) in [u, l].into_iter().zip(&mut place) {
            if side.is_finite() {
                *place = Some(origins.len());
                origins.push(origin);
                lower.push(f64::NEG_INFINITY);
                upper.push(f64::INFINITY);
            }
        }
        if let Some(row) = place[0] {
            upper[row] = u;
            rows.add(row, n, -1.0);
        }
        if let Some(row) = place[1] {
            lower[row] = l;
            rows.add(row, n, 1.0);
        }
        places.push(place);
    }
    for (i, j, value) in problem.C.iter().chain((0..n).map(|i| (m + i, i, 1.0))) {
        places[i].into_iter().flatten().for_each(|row| rows.add(row, j, value));
    }
    relaxed.C = rows.into_matrix(origins.len(), n + 1);
    relaxed.l = DVector::from_vec(lower);
    relaxed.u = DVector::from_vec(upper);
    Relaxation { problem: relaxed, origins }
}
