//! Weighted rows gathered into Hessian and gradient.

use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Rows accumulated together.
const GROUP: usize = 4;

/// Rows `sqrt(alpha) (J x - target)`, whose squares sum to the objective: `P += JᵀJ`, `c -= Jᵀ target`.
#[derive(Debug, Clone)]
pub struct NormalEquations {
    width: usize,
    rows: Vec<f64>,
    targets: Vec<f64>,
}

impl NormalEquations {
    /// Memory for `capacity` rows of `width` entries.
    pub fn new(width: usize, capacity: usize) -> Self {
        let capacity = capacity.next_multiple_of(GROUP);
        Self { width, rows: Vec::with_capacity(capacity * width), targets: Vec::with_capacity(capacity) }
    }

    pub fn clear(&mut self) {
        self.rows.clear();
        self.targets.clear();
    }

    pub fn len(&self) -> usize {
        self.targets.len()
    }

    /// Adds row `row` of a matrix with the weight alpha.
    pub fn push(&mut self, matrix: &DMatrix<f64>, row: usize, target: f64, weight: f64) {
        let root = weight.sqrt();
        let height = matrix.nrows();
        self.rows.extend(matrix.as_slice()[row..].iter().step_by(height).take(self.width).map(|x| root * x));
        self.targets.push(root * target);
    }

    /// `sqrt(alpha) (J x - target)` of one row.
    pub fn weighted_defect(&self, row: usize, x: &[f64]) -> f64 {
        let j = &self.rows[row * self.width..(row + 1) * self.width];
        j.iter().zip(x).fold(0.0, |sum, (a, b)| a.mul_add(*b, sum)) - self.targets[row]
    }

    /// Writes the sums to the lower triangle of the block of P that starts at (`first`, `first`) and to the entries of c
    /// there, replacing what was there.
    pub fn write(&mut self, first: usize, hessian: &mut DMatrix<f64>, gradient: &mut DVector<f64>) {
        let (width, n) = (self.width, hessian.nrows());
        while !self.targets.len().is_multiple_of(GROUP) {
            self.rows.resize(self.rows.len() + width, 0.0);
            self.targets.push(0.0);
        }
        gradient.as_mut_slice()[first..first + width].fill(0.0);
        for j in 0..width {
            let start = (first + j) * n + first;
            hessian.as_mut_slice()[start + j..start + width].fill(0.0);
        }
        for (rows, targets) in self.rows.chunks_exact(GROUP * width).zip(self.targets.chunks_exact(GROUP)) {
            let (r0, rest) = rows.split_at(width);
            let (r1, rest) = rest.split_at(width);
            let (r2, r3) = rest.split_at(width);
            let c = &mut gradient.as_mut_slice()[first..first + width];
            for i in 0..width {
                c[i] -= r0[i] * targets[0] + r1[i] * targets[1] + r2[i] * targets[2] + r3[i] * targets[3];
            }
            for j in 0..width {
                let a = [r0[j], r1[j], r2[j], r3[j]];
                if a == [0.0; GROUP] {
                    continue;
                }
                let start = (first + j) * n + first;
                let column = &mut hessian.as_mut_slice()[start + j..start + width];
                let tails = (&r0[j..], &r1[j..], &r2[j..], &r3[j..]);
                let length = column.len();
                let (t0, t1, t2, t3) = (&tails.0[..length], &tails.1[..length], &tails.2[..length], &tails.3[..length]);
                for i in 0..length {
                    column[i] =
                        a[3].mul_add(t3[i], a[2].mul_add(t2[i], a[1].mul_add(t1[i], a[0].mul_add(t0[i], column[i]))));
                }
            }
        }
    }
}

/// Copies the lower triangle of a block on the diagonal to its upper one.
pub fn mirror(matrix: &mut DMatrix<f64>, block: Range<usize>) {
    let n = matrix.nrows();
    let values = matrix.as_mut_slice();
    for j in block.clone() {
        for i in j + 1..block.end {
            values[i * n + j] = values[j * n + i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_the_normal_equations() {
        let (m, width, n, first) = (6, 7, 12, 3);
        let j = DMatrix::from_fn(m, width, |i, k| ((i * 5 + k * 3) % 7) as f64 - 3.0);
        let target = DVector::from_fn(m, |i, _| i as f64 - 1.5);
        let weights = DVector::from_fn(m, |i, _| 1.0 + i as f64);
        let mut rows = NormalEquations::new(width, m);
        for i in 0..m {
            rows.push(&j, i, target[i], weights[i]);
        }
        let (mut p, mut c) = (DMatrix::from_element(n, n, 9.0), DVector::from_element(n, 9.0));
        rows.write(first, &mut p, &mut c);
        let w = DMatrix::from_diagonal(&weights);
        let expected = j.transpose() * &w * &j;
        for k in 0..width {
            for i in k..width {
                assert!((p[(first + i, first + k)] - expected[(i, k)]).abs() < 1e-12);
            }
        }
        mirror(&mut p, first..first + width);
        for k in 0..n {
            for i in 0..n {
                assert_eq!(p[(i, k)], p[(k, i)], "blocks are symmetric, what is beside them stays as it was");
            }
        }
        let gradient = -(j.transpose() * &w * target);
        assert!((c.rows(first, width) - gradient).amax() < 1e-12);
        assert_eq!((c[first - 1], c[first + width]), (9.0, 9.0));
    }
}
