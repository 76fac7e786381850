//! Dense LU decomposition in place: the step's matrix is small (about 30), not symmetric (friction), and must not allocate.

use nalgebra::{DMatrix, DVector};

/// The matrix has no inverse to working precision: the column at which no pivot was left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singular(pub usize);

/// Factors of a matrix, kept to be used more than once.
#[derive(Debug, Clone)]
pub struct Factors {
    a: DMatrix<f64>,
    pivots: Vec<usize>,
}

impl Factors {
    /// Room for `n` equations.
    pub fn new(n: usize) -> Self {
        Self { a: DMatrix::zeros(n, n), pivots: vec![0; n] }
    }

    /// The matrix to be filled before [`factorise`](Self::factorise), which destroys it.
    pub fn matrix_mut(&mut self) -> &mut DMatrix<f64> {
        &mut self.a
    }

    /// Gaussian elimination with row pivoting.
    ///
    /// # Errors
    /// [`Singular`] with the column without pivot.
    pub fn factorise(&mut self) -> Result<(), Singular> {
        let a = &mut self.a;
        for k in 0..self.pivots.len() {
            let column = a.column(k);
            let below = column.rows_range(k..);
            let largest = below.iter().map(|x| x.abs()).enumerate();
            let (offset, pivot) = largest.fold((0, 0.0), |best, (i, x)| if x > best.1 { (i, x) } else { best });
            if pivot == 0.0 || !pivot.is_finite() {
                return Err(Singular(k));
            }
            self.pivots[k] = k + offset;
            if offset > 0 {
                a.swap_rows(k, k + offset);
            }
            let inverse = 1.0 / a[(k, k)];
            a.column_mut(k).rows_range_mut(k + 1..).scale_mut(inverse);
            let (left, mut right) = a.columns_range_pair_mut(k..=k, k + 1..);
            let factors = left.column(0);
            let factors = factors.rows_range(k + 1..);
            for mut column in right.column_iter_mut() {
                let top = column[k];
                if top != 0.0 {
                    column.rows_range_mut(k + 1..).axpy(-top, &factors, 1.0);
                }
            }
        }
        Ok(())
    }

    /// `b` becomes `x` with `A x = b`.
    pub fn solve(&self, b: &mut DVector<f64>) {
        for (k, pivot) in self.pivots.iter().enumerate() {
            b.swap_rows(k, *pivot);
        }
        for k in 0..b.len() {
            let top = b[k];
            b.rows_range_mut(k + 1..).axpy(-top, &self.a.column(k).rows_range(k + 1..), 1.0);
        }
        for k in (0..b.len()).rev() {
            b[k] /= self.a[(k, k)];
            let value = b[k];
            b.rows_range_mut(..k).axpy(-value, &self.a.column(k).rows_range(..k), 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Noise;

    #[test]
    fn solution_satisfies_the_equations() {
        let mut noise = Noise::from_seed(11);
        for n in [1, 2, 7, 28] {
            let a = DMatrix::from_fn(n, n, |_, _| noise.normal());
            let b = DVector::from_fn(n, |_, _| noise.normal());
            let mut factors = Factors::new(n);
            factors.matrix_mut().copy_from(&a);
            factors.factorise().unwrap();
            for b in [&b, &(2.0 * &b)] {
                let mut x = b.clone();
                factors.solve(&mut x);
                assert!((&a * &x - b).norm() < 1e-11 * x.norm());
            }
        }
    }

    #[test]
    fn a_singular_matrix_is_named() {
        let mut factors = Factors::new(2);
        factors.matrix_mut().copy_from_slice(&[1.0, 2.0, 2.0, 4.0]);
        assert_eq!(factors.factorise(), Err(Singular(1)));
    }
}
