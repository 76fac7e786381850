//! `P = L Lᵀ` and the two triangular solves, in place, without allocation, along the block structure of P.

use super::kernels::{axpy, combine, dot};
use super::order::Order;
use nalgebra::DMatrix;

/// Columns treated together in the triangular solves.
const BLOCK: usize = 4;
/// A pivot below this part of its diagonal entry is what rounding leaves of zero.
const PIVOT_LEAST: f64 = 64.0 * f64::EPSILON;

/// Cholesky factor of a symmetric positive definite matrix.
///
/// Column j of L is zero from row `ends[j]` on. P of a control step is (accelerations | contact intensities), often
/// without coupling: then the factorisation costs the blocks and not the whole, and a fully dense P is found just as
/// well.
#[derive(Debug, Clone)]
pub struct Cholesky {
    n: usize,
    /// L by columns, n x n; above the diagonal unspecified.
    lower: Vec<f64>,
    inverse_diagonal: Vec<f64>,
    ends: Vec<usize>,
}

/// The matrix is not positive definite, to rounding: what was left of this diagonal entry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Indefinite {
    /// Column at which the factorisation stopped.
    pub column: usize,
    /// The pivot found there: not above rounding, or not a number.
    pub pivot: f64,
}

impl Cholesky {
    /// Memory for matrices of size `n`.
    pub fn new(n: usize) -> Self {
        Self { n, lower: vec![0.0; n * n], inverse_diagonal: vec![0.0; n], ends: vec![0; n] }
    }

    /// Factorises a symmetric matrix, rows and columns taken in the given order: left-looking, four columns at a time.
    /// Both triangles are read.
    pub fn factorise(&mut self, matrix: &DMatrix<f64>, order: &Order) -> Result<(), Indefinite> {
        let n = self.n;
        assert_eq!(matrix.shape(), (n, n), "the matrix must have the size the factor was made for");
        let mut end = 0;
        let mut j = 0;
        while j < n {
            let width = BLOCK.min(n - j);
            // Columns whose blocks ended before j contribute nothing.
            let start = self.ends[..j].partition_point(|e| *e <= j);
            for k in j..j + width {
                end = end.max(order.end(k));
            }
            let (done, panel) = self.lower.split_at_mut(j * n);
            let mut diagonal = [0.0; BLOCK];
            for (k, column) in panel.chunks_exact_mut(n).take(width).enumerate() {
                column[j..j + k].fill(0.0);
                order.column(matrix, j + k, j + k, &mut column[j + k..end]);
                diagonal[k] = column[j + k];
                // Rows beyond an earlier block's end hold old numbers, not zeros.
                column[end..].fill(0.0);
            }
            subtract_product(&done[start * n..], n, j, end, j - start, &mut panel[..width * n]);
            for k in j..j + width {
                let (before, rest) = self.lower.split_at_mut(k * n);
                let column = &mut rest[..n];
                for i in j..k {
                    let earlier = &before[i * n..(i + 1) * n];
                    axpy(-earlier[k], &earlier[k..end], &mut column[k..end]);
                }
                let pivot = column[k];
                if !(pivot > PIVOT_LEAST * diagonal[k - j] && pivot.is_finite()) {
                    return Err(Indefinite { column: k, pivot });
                }
                let root = pivot.sqrt();
                let inverse = 1.0 / root;
                column[k] = root;
                self.inverse_diagonal[k] = inverse;
                self.ends[k] = end;
                for x in &mut column[k + 1..end] {
                    *x *= inverse;
                }
            }
            j += width;
        }
        Ok(())
    }

    /// `x <- L⁻¹ x`; leading zeros of x are free.
    pub fn solve_lower(&self, x: &mut [f64]) {
        if let Some(first) = x.iter().position(|v| *v != 0.0) {
            self.solve_lower_from(first, self.n, x);
        }
    }

    /// `x <- L⁻¹ e`, the column of the inverse that belongs to one unknown.
    pub fn inverse_column(&self, position: usize, x: &mut [f64]) {
        x.fill(0.0);
        x[position] = 1.0;
        // A column reaches down to its end, the columns up to there to theirs.
        let mut stop = self.ends[position];
        while stop < self.ends[stop - 1] {
            stop = self.ends[stop - 1];
        }
        self.solve_lower_from(position, stop, x);
    }

    /// The same for an x that is zero before `first`, when the solution is zero from `stop` on.
    fn solve_lower_from(&self, first: usize, stop: usize, x: &mut [f64]) {
        let n = self.n;
        let mut j = first / BLOCK * BLOCK;
        while j < stop {
            let width = BLOCK.min(n - j);
            for k in j..j + width {
                let solved = x[k] * self.inverse_diagonal[k];
                x[k] = solved;
                axpy(-solved, &self.lower[k * n + k + 1..k * n + j + width], &mut x[k + 1..j + width]);
            }
            let mut alpha = [0.0; BLOCK];
            for (a, v) in alpha.iter_mut().zip(&x[j..j + width]) {
                *a = -v;
            }
            let end = self.ends[j + width - 1];
            combine(&self.lower[j * n..], n, j + width, &alpha[..width], &mut x[j + width..end]);
            j += width;
        }
    }

    /// `x <- L⁻ᵀ x`.
    pub fn solve_upper(&self, x: &mut [f64]) {
        let n = self.n;
        let mut stop = n;
        while stop > 0 {
            let start = (stop - 1) / BLOCK * BLOCK;
            let end = self.ends[stop - 1];
            let (head, tail) = x.split_at_mut(stop);
            let tail = &tail[..end - stop];
            let mut products = [0.0; BLOCK];
            super::kernels::project(&self.lower[start * n..], n, stop, tail, &mut products[..stop - start]);
            for k in (start..stop).rev() {
                let inner = dot(&self.lower[k * n + k + 1..k * n + stop], &head[k + 1..stop]);
                head[k] = (head[k] - products[k - start] - inner) * self.inverse_diagonal[k];
            }
            stop = start;
        }
    }
}

/// Rows of a tile of the update below.
const TILE: usize = 8;

/// `panel[rows j..end] -= L[rows j..end, ..depth] L[rows j..j + width, ..depth]ᵀ`, in tiles that stay in registers.
#[inline]
fn subtract_product(lower: &[f64], n: usize, j: usize, end: usize, depth: usize, panel: &mut [f64]) {
    let width = panel.len() / n;
    let mut i = j;
    if width == BLOCK {
        while i + TILE <= end {
            let mut tile = [[0.0; TILE]; BLOCK];
            for column in lower.chunks_exact(n).take(depth) {
                let x: &[f64; TILE] = column[i..i + TILE].try_into().expect("TILE elements");
                let m: &[f64; BLOCK] = column[j..j + BLOCK].try_into().expect("BLOCK elements");
                for c in 0..BLOCK {
                    for l in 0..TILE {
                        tile[c][l] = m[c].mul_add(x[l], tile[c][l]);
                    }
                }
            }
            for (c, sums) in tile.iter().enumerate() {
                for (target, sum) in panel[c * n + i..c * n + i + TILE].iter_mut().zip(sums) {
                    *target -= sum;
                }
            }
            i += TILE;
        }
    }
    if i < end {
        for column in lower.chunks_exact(n).take(depth) {
            for c in 0..width {
                axpy(-column[j + c], &column[i..end], &mut panel[c * n + i..c * n + end]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    fn blocks(sizes: &[usize]) -> DMatrix<f64> {
        let n: usize = sizes.iter().sum();
        let mut out = DMatrix::zeros(n, n);
        let mut at = 0;
        for &size in sizes {
            let m = DMatrix::from_fn(size, size + 2, |i, j| ((i * 5 + j * 3 + size) % 7) as f64 - 3.0);
            let block = &m * m.transpose() + DMatrix::identity(size, size);
            out.view_mut((at, at), (size, size)).copy_from(&block);
            at += size;
        }
        out
    }

    fn found(matrix: &DMatrix<f64>) -> Order {
        let mut order = Order::natural(matrix.nrows());
        order.arrange(matrix, |_| None);
        order
    }

    #[test]
    fn factor_and_solves_agree_with_nalgebra_whatever_the_blocks() {
        let mut reused = Cholesky::new(15);
        for sizes in [&[15][..], &[1; 15], &[7, 1, 1, 6], &[3, 12], &[1, 5, 4, 5]] {
            let p = blocks(sizes);
            reused.factorise(&p, &found(&p)).expect("positive definite");
            let expected = p.clone().cholesky().expect("positive definite").l();
            let rhs = DVector::from_fn(15, |i, _| if i < 2 { 0.0 } else { i as f64 - 4.5 });
            let (mut down, mut up) = (rhs.clone(), rhs.clone());
            reused.solve_lower(down.as_mut_slice());
            reused.solve_upper(up.as_mut_slice());
            assert!((&expected * down - &rhs).amax() < 1e-12, "{sizes:?}");
            assert!((expected.transpose() * up - &rhs).amax() < 1e-12, "{sizes:?}");
        }
    }

    #[test]
    fn a_matrix_in_another_order_is_factorised_in_that_order() {
        let p = blocks(&[6, 1, 8]);
        let mut order = Order::natural(15);
        order.arrange(&p, |i| [0, 3, 6, 9, 14].contains(&i).then_some(-(i as f64)));
        let mut factor = Cholesky::new(15);
        factor.factorise(&p, &order).expect("positive definite");
        let turned = DMatrix::from_fn(15, 15, |i, j| p[(order.unknown(i), order.unknown(j))]);
        let expected = turned.cholesky().expect("positive definite").l();
        let rhs = DVector::from_fn(15, |i, _| i as f64 - 4.5);
        let mut down = rhs.clone();
        factor.solve_lower(down.as_mut_slice());
        assert!((&expected * down - rhs).amax() < 1e-12);
        let mut inverse = DMatrix::zeros(15, 15);
        for (j, mut column) in inverse.column_iter_mut().enumerate() {
            factor.inverse_column(j, column.as_mut_slice());
        }
        assert!((expected * inverse - DMatrix::identity(15, 15)).amax() < 1e-12);
    }

    #[test]
    fn an_indefinite_matrix_is_named_with_its_pivot() {
        let mut p = blocks(&[4, 3]);
        p[(5, 5)] = -2.0;
        let order = found(&p);
        let error = Cholesky::new(7).factorise(&p, &order).expect_err("not positive definite");
        assert_eq!(error.column, 5);
        assert!(error.pivot < 0.0);
        // Two equal unknowns: rounding leaves some pivot, of either sign.
        let factor = DMatrix::from_fn(7, 3, |i, j| ((i * 3 + j * 5) % 7) as f64 / 3.0 - 0.7);
        assert!(Cholesky::new(7).factorise(&(&factor * factor.transpose()), &Order::natural(7)).is_err());
        p[(5, 5)] = f64::NAN;
        assert!(Cholesky::new(7).factorise(&p, &order).expect_err("not a number").pivot.is_nan());
    }
}
