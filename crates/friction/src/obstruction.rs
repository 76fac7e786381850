//! The proof that no forces solve a problem.
//!
//! Some forces keep every contact open or touching, `(W F + q)_n >= 0`, or there is `y >= 0` on the normals with `W y =
//! 0` and `q . y < 0` (Farkas). `W` is semi-definite: `W y = 0` says the same as `W_nn y = 0`. With `Z` an orthonormal
//! basis of the null space of `W_nn`
//!
//! ```text
//! y = Z Z' (s - q_n),   s = argmin over s >= 0 of |Z' (s - q_n)|
//! ```
//!
//! is such a `y` if it is not zero: the optimality conditions of `s` say `y >= 0` and `s . y = 0`, so `q . y = -|y|^2`.

use crate::ContactProblem;
use nalgebra::{DMatrix, DVector};

/// Contacts that no forces keep from penetrating.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstruction {
    /// Contact and its weight `y`, heaviest first, the largest being 1.
    pub contacts: Vec<(usize, f64)>,
    /// Whatever the forces, some of these contacts penetrates by at least this: `-q . y / sum y` (m).
    pub least_penetration_m: f64,
}

/// Eigenvalues below this times size and largest eigenvalue are rounding.
const ROUNDING: f64 = 10.0 * f64::EPSILON;
/// A weight below this part of the largest is rounding, and so is a gap below this part of `|q_n|`.
const NEGLIGIBLE: f64 = 1e-9;

/// Looks for the proof. None: some forces keep all contacts apart, to rounding.
pub(crate) fn obstruction(problem: &ContactProblem) -> Option<Obstruction> {
    let n = problem.contact_count();
    let normals = DMatrix::from_fn(n, n, |a, b| problem.delassus()[(3 * a + 2, 3 * b + 2)]);
    let gaps = DVector::from_fn(n, |a, _| problem.free()[3 * a + 2]);
    let basis = null_space(normals);
    if basis.ncols() == 0 {
        return None;
    }
    let y = least_squares_residual(&basis, &gaps);
    let (heaviest, size) = (y.amax(), gaps.amax());
    let is_share = |weight: f64| weight > NEGLIGIBLE * heaviest;
    let total: f64 = y.iter().filter(|weight| is_share(**weight)).sum();
    let lacking: f64 = -y.iter().zip(&gaps).filter(|(weight, _)| is_share(**weight)).map(|(y, q)| y * q).sum::<f64>();
    if heaviest <= NEGLIGIBLE * size || y.min() < -NEGLIGIBLE.sqrt() * heaviest || lacking <= NEGLIGIBLE * total * size
    {
        return None;
    }
    let mut contacts: Vec<(usize, f64)> =
        y.iter().map(|weight| weight / heaviest).enumerate().filter(|(_, weight)| *weight > NEGLIGIBLE).collect();
    contacts.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    Some(Obstruction { contacts, least_penetration_m: lacking / total })
}

/// Orthonormal columns that a semi-definite matrix takes to zero. Scaled to unit diagonal first: zero rows count as
/// zero.
fn null_space(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    let eigen = matrix.symmetric_eigen();
    let least = ROUNDING * n as f64 * eigen.eigenvalues.amax();
    let columns: Vec<_> = (0..n).filter(|k| eigen.eigenvalues[*k] <= least).collect();
    DMatrix::from_fn(n, columns.len(), |i, k| eigen.eigenvectors[(i, columns[k])])
}

/// `Z Z' (s - q)` at its shortest over `s >= 0`: non-negative least squares (Lawson, Hanson 1974).
fn least_squares_residual(basis: &DMatrix<f64>, gaps: &DVector<f64>) -> DVector<f64> {
    let n = gaps.len();
    let target = basis.tr_mul(gaps);
    let mut is_free = vec![false; n];
    let mut s = DVector::zeros(n);
    let residual = |s: &DVector<f64>| basis * (basis.tr_mul(s) - &target);
    // Each step lowers the distance: no set of free entries returns. The limit is against rounding.
    for _ in 0..3 * n {
        let y = residual(&s);
        let tolerance = NEGLIGIBLE * gaps.amax();
        let candidate = (0..n).filter(|i| !is_free[*i] && y[*i] < -tolerance).min_by(|i, j| y[*i].total_cmp(&y[*j]));
        let Some(entering) = candidate else { break };
        is_free[entering] = true;
        loop {
            let free: Vec<usize> = (0..n).filter(|i| is_free[*i]).collect();
            let rows = DMatrix::from_fn(basis.ncols(), free.len(), |k, i| basis[(free[i], k)]);
            let Ok(best) = rows.svd(true, true).solve(&target, f64::EPSILON.sqrt()) else { return residual(&s) };
            let step = free
                .iter()
                .zip(&best)
                .filter(|(_, b)| **b <= 0.0)
                .map(|(i, b)| s[*i] / (s[*i] - b))
                .fold(1.0, f64::min);
            for (i, b) in free.iter().zip(&best) {
                s[*i] += step * (b - s[*i]);
            }
            if step >= 1.0 {
                break;
            }
            for i in free {
                if s[i] <= NEGLIGIBLE * gaps.amax() {
                    (s[i], is_free[i]) = (0.0, false);
                }
            }
        }
    }
    residual(&s)
}
