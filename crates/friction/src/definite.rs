//! Whether a symmetric matrix is positive semi-definite, and of what rank.
//!
//! Cholesky with the largest remaining diagonal as pivot, on `D W D` with unit diagonal: congruence keeps the signs of
//! the eigenvalues, and "rounding" then means the same for metres and radians. What is left when no pivot is above
//! rounding decides: of a semi-definite matrix nothing is.

use nalgebra::DMatrix;

/// A remainder below this, of a matrix with unit diagonal, is rounding: some thousand units, for the elimination
/// multiplies them.
const ROUNDING: f64 = 1e-10;

/// Whether `matrix` is positive semi-definite to rounding.
pub(crate) fn is_semi_definite(matrix: &DMatrix<f64>) -> bool {
    let n = matrix.nrows();
    let mut rest = unit_diagonal(matrix);
    let mut order: Vec<usize> = (0..n).collect();
    for k in 0..n {
        let pivot =
            (k..n).max_by(|i, j| rest[(order[*i], order[*i])].total_cmp(&rest[(order[*j], order[*j])])).unwrap_or(k);
        order.swap(k, pivot);
        let p = order[k];
        let value = rest[(p, p)];
        if value <= ROUNDING {
            // |w_ij| <= max(w_ii, w_jj) of a semi-definite matrix.
            return order[k..].iter().all(|i| order[k..].iter().all(|j| rest[(*i, *j)].abs() <= ROUNDING));
        }
        let column: Vec<f64> = rest.column(p).iter().copied().collect();
        for j in &order[k + 1..] {
            let factor = column[*j] / value;
            if factor != 0.0 {
                rest.column_mut(*j).iter_mut().zip(&column).for_each(|(x, c)| *x = factor.mul_add(-c, *x));
            }
        }
    }
    true
}

/// `D W D` with ones on the diagonal; rows with none keep the scale of the largest.
fn unit_diagonal(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let largest = matrix.diagonal().amax();
    let scale = matrix.diagonal().map(|w| {
        let floor = f64::EPSILON * largest;
        1.0 / w.abs().max(floor).max(f64::MIN_POSITIVE).sqrt()
    });
    // Where the floor counts, the entry is rounding of the largest, and so are its neighbours' products.
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        let is_rounding = matrix[(i, j)].abs() <= f64::EPSILON * largest;
        if is_rounding { 0.0 } else { matrix[(i, j)] * scale[i] * scale[j] }
    })
}
