//! Whether a Hessian is positive semidefinite, and if not, by how much.
//!
//! The inertia is that of `D P D` (Sylvester), `D` diagonal so that the largest entry of each row is 1: "rounding" then
//! means the same for unknowns in metres and in micrometres. Eigenvalues down to `-10 n` units of roundoff are rounding
//! and count as zero. A row whose entries are all rounding of the largest entry of `P` counts as a row of zeros.

use crate::SparseMatrix;
use clarabel::algebra::CscMatrix;
use clarabel::qdldl::{QDLDLFactorisation, QDLDLSettings};
use nalgebra::{DMatrix, DVector};

/// Eigenvalues of the scaled matrix above minus this times n are rounding.
const ROUNDING: f64 = 10.0 * f64::EPSILON;
/// Passes of scaling; each takes the square root of what is left of the spread.
const PASSES: usize = 12;
/// Above this size the eigenvalue is not computed: the worst pivot stands for it.
const DENSE_MAX: usize = 800;

/// The most negative curvature of a symmetric matrix beyond rounding, in its own units: its least eigenvalue, or, where
/// scaling shows what the eigenvalues hide, `v' P v / v' v` of the direction found. None: positive semidefinite, or not
/// a matrix of numbers.
pub(crate) fn negative_curvature(hessian: &DMatrix<f64>) -> Option<f64> {
    let n = hessian.nrows();
    if n == 0 || !hessian.iter().all(|x| x.is_finite()) {
        return None;
    }
    let entries: Vec<_> = hessian.iter().enumerate().map(|(k, x)| (k % n, k / n, *x)).collect();
    let scale = scales(n, &entries);
    let scaled = DMatrix::from_fn(n, n, |i, j| hessian[(i, j)] * scale[i] * scale[j]);
    let tolerance = ROUNDING * n as f64;
    if (&scaled + tolerance * DMatrix::identity(n, n)).cholesky().is_some() {
        return None;
    }
    let eigen = scaled.symmetric_eigen();
    let (least, value) = eigen.eigenvalues.argmin();
    if value >= -tolerance {
        return None;
    }
    let direction = eigen.eigenvectors.column(least).component_mul(&scale);
    let along = direction.dot(&(hessian * &direction)) / direction.norm_squared();
    Some(along.min(hessian.symmetric_eigenvalues().min()))
}

/// The same of a sparse matrix with both triangles; of a large one the worst pivot of `D P D`.
pub(crate) fn negative_curvature_sparse(hessian: &SparseMatrix) -> Option<f64> {
    let n = hessian.columns();
    if is_dominated_by_its_diagonal(hessian) || !hessian.iter().all(|(_, _, x)| x.is_finite()) {
        return None;
    }
    let entries: Vec<_> = hessian.iter().collect();
    let scale = scales(n, &entries);
    let tolerance = ROUNDING * n as f64;
    let mut columns: Vec<Vec<(usize, f64)>> = (0..n).map(|j| vec![(j, tolerance)]).collect();
    for (i, j, value) in hessian.iter().filter(|(i, j, _)| i <= j) {
        let scaled = value * scale[i] * scale[j];
        if i == j { columns[j][0].1 += scaled } else { columns[j].push((i, scaled)) }
    }
    let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
    for column in &mut columns {
        column.sort_unstable_by_key(|(i, _)| *i);
        rows.extend(column.iter().map(|(i, _)| *i));
        values.extend(column.iter().map(|(_, value)| *value));
        starts.push(rows.len());
    }
    let upper = CscMatrix::new(n, n, starts, rows, values);
    let settings = QDLDLSettings { regularize_enable: false, ..QDLDLSettings::default() };
    // A pivot of exactly zero ends the factorisation; the lifted diagonal of a semidefinite matrix has none.
    let worst = match QDLDLFactorisation::new(&upper, Some(settings)) {
        Ok(factors) if factors.positive_inertia() == n => return None,
        Ok(factors) => factors.D.iter().copied().fold(0.0, f64::min),
        Err(_) => -tolerance,
    };
    if n <= DENSE_MAX {
        let mut dense = DMatrix::zeros(n, n);
        hessian.iter().for_each(|(i, j, value)| dense[(i, j)] += value);
        return negative_curvature(&dense);
    }
    Some(worst)
}

/// Positive semidefinite by Gershgorin's circles, as diagonal Hessians and zeros are.
fn is_dominated_by_its_diagonal(hessian: &SparseMatrix) -> bool {
    let mut room = DVector::<f64>::zeros(hessian.columns());
    hessian.iter().for_each(|(i, j, value)| room[j] += if i == j { value } else { -value.abs() });
    room.iter().all(|x| *x >= 0.0)
}

/// Diagonal of `D`: symmetric scaling of Ruiz (2001).
fn scales(n: usize, entries: &[(usize, usize, f64)]) -> DVector<f64> {
    let mut scale = DVector::from_element(n, 1.0);
    let mut largest = DVector::<f64>::zeros(n);
    entries.iter().for_each(|(i, _, x)| largest[*i] = x.abs().max(largest[*i]));
    let rounding = f64::EPSILON * n as f64 * largest.amax();
    let is_zero: Vec<bool> = largest.iter().map(|x| *x <= rounding).collect();
    for _ in 0..PASSES {
        largest.fill(0.0);
        entries.iter().for_each(|(i, j, x)| largest[*i] = (x * scale[*i] * scale[*j]).abs().max(largest[*i]));
        scale.iter_mut().zip(&largest).filter(|(_, l)| **l > 0.0).for_each(|(s, l)| *s /= l.sqrt());
    }
    scale.iter_mut().zip(is_zero).filter(|(_, zero)| *zero).for_each(|(s, _)| *s = 0.0);
    scale
}

#[cfg(test)]
mod tests {
    use super::*;

    fn both(matrix: &DMatrix<f64>) -> [Option<f64>; 2] {
        [negative_curvature(matrix), negative_curvature_sparse(&SparseMatrix::from_dense(matrix))]
    }

    /// The sign is that of the construction, whatever the units of the unknowns.
    #[test]
    fn scaled_copies_are_convex_or_not_together() {
        let mut seed = 11_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / f64::from(1_u32 << 31) * 2.0 - 1.0
        };
        for trial in 0..200 {
            let n = 1 + trial % 17;
            let rank = 1 + trial % n;
            let factor = DMatrix::from_fn(n, rank, |_, _| next());
            let semidefinite = &factor * factor.transpose();
            let direction = DVector::from_fn(n, |_, _| next()).normalize();
            let depth = 10_f64.powf(3.0 * next() - 4.0);
            // The direction's curvature becomes -depth at least.
            let pulled = direction.dot(&(&semidefinite * &direction)) + depth;
            let indefinite = &semidefinite - pulled * &direction * direction.transpose();
            for spread in [0.0, 2.0, 4.0] {
                let units = DVector::from_fn(n, |_, _| 10_f64.powf(spread * next()));
                let scaled = |m: &DMatrix<f64>| DMatrix::from_fn(n, n, |i, j| m[(i, j)] * units[i] * units[j]);
                assert_eq!(both(&scaled(&semidefinite)), [None; 2], "trial {trial}, spread {spread}");
                for found in both(&scaled(&indefinite)) {
                    assert!(found.is_some_and(|x| x < 0.0), "trial {trial}, spread {spread}: {found:?}");
                }
            }
            let least = indefinite.symmetric_eigenvalues().min();
            assert!(both(&indefinite).iter().all(|x| x.is_some_and(|x| (x - least).abs() < 1e-12)), "{least}");
        }
    }

    #[test]
    fn rounding_is_not_curvature() {
        // What is left of a Schur complement that should vanish.
        let mut matrix = DMatrix::from_diagonal(&DVector::from_vec(vec![3.0, 1.0, -1e-17]));
        (matrix[(0, 2)], matrix[(2, 0)]) = (2e-17, 2e-17);
        assert_eq!(both(&matrix), [None; 2]);
        matrix[(2, 2)] = -1e-9;
        assert!(both(&matrix).iter().all(|x| x.is_some_and(|x| (x + 1e-9).abs() < 1e-15)), "{:?}", both(&matrix));
        // No diagonal at all: xy.
        matrix = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 1.0, 0.0]);
        assert_eq!(both(&matrix).map(|x| x.map(f64::round)), [Some(-1.0); 2]);
        assert_eq!(both(&DMatrix::zeros(3, 3)), [None; 2]);
    }
}
