//! Dense LU decomposition in place: the step's matrix is small (about 30), not symmetric (friction), and must not allocate.

use nalgebra::{DMatrix, DVector};

/// The matrix has no inverse to working precision: the column at which no pivot was left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singular(pub usize);

/// Solves `A x = b` by Gaussian elimination with row pivoting; `a` is destroyed, `b` becomes `x`.
///
/// # Errors
/// [`Singular`] with the column without pivot.
pub fn solve_in_place(a: &mut DMatrix<f64>, b: &mut DVector<f64>) -> Result<(), Singular> {
    let n = b.len();
    assert_eq!(a.shape(), (n, n));
    for k in 0..n {
        let (offset, pivot) = a
            .column(k)
            .rows_range(k..)
            .iter()
            .map(|x| x.abs())
            .enumerate()
            .fold((0, 0.0), |best, (i, x)| if x > best.1 { (i, x) } else { best });
        if pivot == 0.0 || !pivot.is_finite() {
            return Err(Singular(k));
        }
        if offset > 0 {
            a.swap_rows(k, k + offset);
            b.swap_rows(k, k + offset);
        }
        let inverse = 1.0 / a[(k, k)];
        a.column_mut(k).rows_range_mut(k + 1..).scale_mut(inverse);
        let (mut left, mut right) = a.columns_range_pair_mut(k..=k, k + 1..);
        let factors = left.column_mut(0);
        let factors = factors.rows_range(k + 1..);
        for mut column in right.column_iter_mut() {
            let top = column[k];
            column.rows_range_mut(k + 1..).axpy(-top, &factors, 1.0);
        }
        let top = b[k];
        b.rows_range_mut(k + 1..).axpy(-top, &factors, 1.0);
    }
    for k in (0..n).rev() {
        b[k] /= a[(k, k)];
        let value = b[k];
        b.rows_range_mut(..k).axpy(-value, &a.column(k).rows_range(..k), 1.0);
    }
    Ok(())
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
            let (mut lu, mut x) = (a.clone(), b.clone());
            solve_in_place(&mut lu, &mut x).unwrap();
            assert!((a * &x - &b).norm() < 1e-11 * x.norm());
        }
    }

    #[test]
    fn a_singular_matrix_is_named() {
        let mut a = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0]);
        assert_eq!(solve_in_place(&mut a, &mut DVector::zeros(2)), Err(Singular(1)));
    }
}
