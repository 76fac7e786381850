//! Rows of a program counted through: equalities, inequalities, bounds.

use super::{ActiveSet, Held};
use crate::Row;
use crate::dense::{Active, Problem, Side, Size};

impl ActiveSet {
    /// d <- gradient of a row, in the order of the unknowns.
    pub(super) fn gather(&mut self, problem: &Problem, row: usize) {
        let Size { equalities: e, inequalities: m, .. } = self.size;
        if row < e + m {
            let (matrix, rows, row) = if row < e { (&problem.A, e, row) } else { (&problem.C, m, row - e) };
            let entries = matrix.as_slice()[row..].iter().step_by(rows).copied();
            self.order.arranged(entries, &mut self.d);
        } else {
            self.d.fill(0.0);
            self.d[self.order.place(row - e - m)] = 1.0;
        }
    }

    pub(super) fn sides(&self, problem: &Problem, row: usize) -> (f64, f64) {
        (limit_of(problem, self.size, row, 1.0), limit_of(problem, self.size, row, -1.0))
    }

    pub(super) fn limit(&self, problem: &Problem, held: Held) -> f64 {
        limit_of(problem, self.size, held.row, held.sign)
    }

    pub(super) fn value(&self, row: usize) -> f64 {
        if row < self.values.len() { self.values[row] } else { self.x[row - self.values.len()] }
    }
}

/// Euclidean lengths of the rows of a matrix stored by columns.
pub(super) fn lengths_of_rows(matrix: &[f64], columns: usize, out: &mut [f64]) {
    let rows = out.len();
    out.fill(0.0);
    for j in 0..columns {
        for (sum, a) in out.iter_mut().zip(&matrix[j * rows..(j + 1) * rows]) {
            *sum = a.mul_add(*a, *sum);
        }
    }
    for x in out {
        *x = x.sqrt();
    }
}

pub(super) fn limit_of(problem: &Problem, size: Size, row: usize, sign: f64) -> f64 {
    match name(size, row) {
        Row::Equality(i) => problem.b[i],
        Row::Inequality(i) if sign > 0.0 => problem.l[i],
        Row::Inequality(i) => problem.u[i],
        Row::Bound(i) if sign > 0.0 => problem.lb[i],
        Row::Bound(i) => problem.ub[i],
    }
}

pub(super) fn row_times(problem: &Problem, size: Size, row: usize, x: &[f64]) -> f64 {
    let strided = |matrix: &[f64], rows: usize, row: usize| {
        matrix[row..].iter().step_by(rows).zip(x).fold(0.0, |sum, (a, x)| a.mul_add(*x, sum))
    };
    match name(size, row) {
        Row::Equality(i) => strided(problem.A.as_slice(), size.equalities, i),
        Row::Inequality(i) => strided(problem.C.as_slice(), size.inequalities, i),
        Row::Bound(i) => x[i],
    }
}

pub(super) fn name(size: Size, row: usize) -> Row {
    let Size { equalities: e, inequalities: m, .. } = size;
    if row < e {
        Row::Equality(row)
    } else if row < e + m {
        Row::Inequality(row - e)
    } else {
        Row::Bound(row - e - m)
    }
}

pub(super) fn label(size: Size, held: Held) -> Active {
    let row = name(size, held.row);
    let side = match row {
        Row::Equality(_) => Side::Both,
        _ if held.sign > 0.0 => Side::Lower,
        _ => Side::Upper,
    };
    Active { row, side }
}
