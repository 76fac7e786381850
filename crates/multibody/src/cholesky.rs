//! Factorisation of the mass matrix along the tree (Featherstone 2008, table 6.3).
//!
//! `M = L' L` with `L` lower triangular. Eliminated from the leaves, M fills in nowhere: `L_ij` is zero wherever joint `j`
//! does not move joint `i`, so the work grows with the depth of the tree and not with nv.

use crate::Model;
use nalgebra::{DMatrix, DVector};

/// The factor `L` of a mass matrix, and the memory for it.
#[derive(Debug, Clone)]
pub struct MassFactor {
    nv: usize,
    /// Column that moves this one, `None` at the root; the base's six columns form a chain.
    parents: Vec<Option<usize>>,
    /// Row-major lower triangle.
    l: Vec<f64>,
}

/// M is not positive definite: some joint moves nothing, see [`Model::massless_joint`].
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("the mass matrix is not positive definite: pivot {pivot} in column {column}")]
pub struct NotPositiveDefinite {
    /// Column of `v`.
    pub column: usize,
    /// What should have been positive.
    pub pivot: f64,
}

impl MassFactor {
    /// Memory for a model's mass matrix.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let (nv, base_dofs) = (model.nv(), model.base_dofs());
        let base = (0..base_dofs).map(|k| k.checked_sub(1));
        let joints = model.bodies.iter().skip(1).map(|body| match body.parent {
            0 => base_dofs.checked_sub(1),
            parent => Some(base_dofs + parent - 1),
        });
        Self { nv, parents: base.chain(joints).collect(), l: vec![0.0; nv * nv] }
    }

    /// Factors `M`, of which the lower triangle is read.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`]; the previous factor is lost.
    pub fn factor(&mut self, mass_matrix: &DMatrix<f64>) -> Result<(), NotPositiveDefinite> {
        let n = self.nv;
        assert_eq!(mass_matrix.shape(), (n, n), "mass matrix");
        // Symmetric: a column of M is a row of it.
        self.l.copy_from_slice(mass_matrix.as_slice());
        for k in (0..n).rev() {
            let pivot = self.l[k * n + k];
            if pivot <= 0.0 || pivot.is_nan() {
                return Err(NotPositiveDefinite { column: k, pivot });
            }
            let (above, below) = self.l.split_at_mut(k * n);
            let row = &mut below[..n];
            let root = pivot.sqrt();
            row[k] = root;
            let mut next = self.parents[k];
            while let Some(i) = next {
                row[i] /= root;
                next = self.parents[i];
            }
            let mut next = self.parents[k];
            while let Some(i) = next {
                let factor = row[i];
                let target = &mut above[i * n..(i + 1) * n];
                let mut inner = Some(i);
                while let Some(j) = inner {
                    target[j] -= factor * row[j];
                    inner = self.parents[j];
                }
                next = self.parents[i];
            }
        }
        Ok(())
    }

    /// `b <- M^-1 b`.
    pub fn solve(&self, b: &mut DVector<f64>) {
        let n = self.nv;
        assert_eq!(b.len(), n, "right-hand side");
        for i in (0..n).rev() {
            let row = &self.l[i * n..(i + 1) * n];
            b[i] /= row[i];
            let mut next = self.parents[i];
            while let Some(j) = next {
                b[j] -= row[j] * b[i];
                next = self.parents[j];
            }
        }
        for i in 0..n {
            let row = &self.l[i * n..(i + 1) * n];
            let mut next = self.parents[i];
            while let Some(j) = next {
                b[i] -= row[j] * b[j];
                next = self.parents[j];
            }
            b[i] /= row[i];
        }
    }
}
