//! Joints that follow others, as the matrix `S` between the robot's coordinates and those of its tree.
//!
//! The recursions go from body to body and know one coordinate per body: those of the *tree*. Where a joint follows another
//! (`q = multiplier q_leader + offset`), the robot has fewer:
//!
//! ```text
//! q_tree = S q + offsets     v_tree = S v     a_tree = S a
//! M = S' M_tree S            h = S' h_tree    tau = S' tau_tree    J = J_tree S    Ag = Ag_tree S
//! ```
//!
//! `S` has one entry per row, 1 or a multiplier, and is constant; therefore drifts, `Jdot v`, are those of the tree. It follows
//! from the principle of virtual power: what couples the joints does no work.

use super::body::Body;
use super::configuration::Configuration;
use nalgebra::{DMatrix, DVector};

/// One row of `S`, of a joint at `multiplier * q[column] + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Law {
    pub column: usize,
    pub multiplier: f64,
    pub offset: f64,
}

impl Law {
    /// The row of a coordinate that follows nobody.
    pub fn of_itself(column: usize) -> Self {
        Self { column, multiplier: 1.0, offset: 0.0 }
    }
}

/// `S` by rows, and the offsets.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Coupling {
    pub base_dofs: usize,
    /// Length of the robot's `v`.
    pub nv: usize,
    /// Of the base's entries and of every other body, in the order of the tree's `v`.
    pub laws: Vec<Law>,
}

impl Coupling {
    /// Tree positions of the robot's.
    pub fn spread_configuration(&self, q: &Configuration, tree: &mut Configuration) {
        assert_eq!(q.joints.len(), self.nv - self.base_dofs, "joint positions");
        tree.base = q.base;
        for (position, law) in tree.joints.iter_mut().zip(&self.laws[self.base_dofs..]) {
            *position = law.multiplier * q.joints[law.column - self.base_dofs] + law.offset;
        }
    }

    /// `tree = S v`.
    pub fn spread(&self, v: &DVector<f64>, tree: &mut DVector<f64>) {
        assert_eq!(v.len(), self.nv, "velocities or accelerations");
        for (rate, law) in tree.iter_mut().zip(&self.laws) {
            *rate = law.multiplier * v[law.column];
        }
    }

    /// What moves a body against its parent.
    pub fn law(&self, body: usize) -> &Law {
        &self.laws[self.base_dofs + body - 1]
    }

    /// `out = S' tree`.
    pub fn collect(&self, tree: &DVector<f64>, out: &mut DVector<f64>) {
        assert_eq!(out.len(), self.nv, "generalised forces");
        out.as_mut_slice().fill(0.0);
        for (force, law) in tree.iter().zip(&self.laws) {
            out[law.column] += law.multiplier * force;
        }
    }

    /// `out = tree S`.
    pub fn collect_columns(&self, tree: &DMatrix<f64>, out: &mut DMatrix<f64>) {
        let rows = tree.nrows();
        assert_eq!(out.shape(), (rows, self.nv), "Jacobian");
        out.as_mut_slice().fill(0.0);
        for (column, law) in tree.as_slice().chunks_exact(rows).zip(&self.laws) {
            let target = &mut out.as_mut_slice()[rows * law.column..rows * (law.column + 1)];
            target.iter_mut().zip(column).for_each(|(target, entry)| *target += law.multiplier * entry);
        }
    }

    /// `out = S' tree S` for the tree's M, of which only what is structurally not zero is read.
    pub fn collect_both(&self, bodies: &[Body], tree: &DMatrix<f64>, out: &mut DMatrix<f64>) {
        let (n, nv) = (self.laws.len(), self.nv);
        assert_eq!((tree.shape(), out.shape()), ((n, n), (nv, nv)), "mass matrix");
        let (from, to) = (tree.as_slice(), out.as_mut_slice());
        to.fill(0.0);
        let mut add = |row: usize, column: usize| {
            let (left, right) = (&self.laws[row], &self.laws[column]);
            let entry = left.multiplier * right.multiplier * from[column * n + row];
            to[right.column * nv + left.column] += entry;
            if row != column {
                to[left.column * nv + right.column] += entry;
            }
        };
        for row in 0..self.base_dofs {
            (0..=row).for_each(|column| add(row, column));
        }
        for body in 1..bodies.len() {
            let row = self.base_dofs + body - 1;
            (0..self.base_dofs).for_each(|column| add(row, column));
            let mut above = body;
            while above > 0 {
                add(row, self.base_dofs + above - 1);
                above = bodies[above].parent;
            }
        }
    }
}
