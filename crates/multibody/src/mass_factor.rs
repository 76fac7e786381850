//! Factorisation of the mass matrix along the tree (Featherstone 2008, table 6.3).
//!
//! `M = L' L` with `L` lower triangular. Eliminated from the leaves, M fills in nowhere: `L_ij` is zero wherever joint `j`
//! does not move joint `i`, so the work grows with the depth of the tree and not with nv. Where joints follow others, a
//! coordinate moves several branches at once and M fills in a little: then the elimination tree of M (J. W. H. Liu, *The role
//! of elimination trees in sparse factorization*, SIAM J. Matrix Anal. Appl. 11 (1990)) takes the robot's place. Without
//! followers it is the robot's own tree.

use crate::model::Model;
use nalgebra::{DMatrix, DVector};

/// The factor `L` of a mass matrix, and the memory for it.
#[derive(Debug, Clone)]
pub struct MassFactor {
    nv: usize,
    /// Where each column leads in the elimination tree, `None` at a root.
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
        let nv = model.nv();
        Self { nv, parents: elimination_tree(model), l: vec![0.0; nv * nv] }
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

/// The next column up that each one is coupled to, once all columns after it are eliminated. A row of `L` is zero outside
/// the columns that are reached by going on from there.
fn elimination_tree(model: &Model) -> Vec<Option<usize>> {
    let (n, base_dofs) = (model.nv(), model.base_dofs());
    // Lower triangle of what is not zero: the base moves everything, a joint what is below it.
    let mut coupled = vec![false; n * n];
    for row in 0..n {
        coupled[row * n..row * n + base_dofs.min(row)].fill(true);
    }
    for body in 1..model.bodies.len() {
        let column = base_dofs + model.coordinate(body);
        let mut above = model.bodies[body].parent;
        while above > 0 {
            let other = base_dofs + model.coordinate(above);
            coupled[column.max(other) * n + column.min(other)] = true;
            above = model.bodies[above].parent;
        }
    }
    let mut parents = vec![None; n];
    for row in (0..n).rev() {
        parents[row] = (0..row).rev().find(|column| coupled[row * n + column]);
        if let Some(next) = parents[row] {
            (0..next).for_each(|column| coupled[next * n + column] |= coupled[row * n + column]);
        }
    }
    parents
}
