//! The program of a step for one set of contacts: `x = (vd, f)`, see the crate's documentation.
//!
//! Built once with its size and its constant entries; a tick writes numbers only.

use crate::constraint::friction::FrictionCones;
use crate::constraint::limits::JointLimits;
use crate::layout::Layout;
use crate::settings::WholeBodySettings;
use crate::solvers::Solvers;
use multibody::WholeBodyTerms;
use nalgebra::DMatrix;
use qp::dense::Problem;
use spatial::Vec6;

/// Program and solvers for one set of contacts.
pub(crate) struct Formulation {
    pub layout: Layout,
    pub problem: Problem,
    pub solvers: Solvers,
}

impl Formulation {
    pub fn new(layout: Layout, settings: &WholeBodySettings) -> Self {
        let size = layout.size();
        let solvers = Solvers::new(size, &settings.solver);
        let mut problem = Problem::new(size);
        for foot in layout.standing() {
            let (first, row) = (layout.force(foot), layout.load(foot));
            problem.C.view_mut((row, first), (1, layout.intensities)).fill(1.0); // normal parts are 1
            problem.lb.rows_mut(first, layout.intensities).fill(0.0);
        }
        Self { layout, problem, solvers }
    }

    /// Equations of motion: base rows are equalities, joint rows are bounded torques.
    ///
    /// `M_b vd - (J_bᵀ G) f = -h_b`,  `-tau_max - h_a <= M_a vd - (J_aᵀ G) f <= tau_max - h_a`
    pub fn write_dynamics(&mut self, terms: &WholeBodyTerms, limits: &[JointLimits]) {
        let Layout { nv, joints, .. } = self.layout;
        let base = nv - joints;
        let (rows_A, rows_C) = (self.problem.A.nrows(), self.problem.C.nrows());
        for (j, column) in terms.mass_matrix.as_slice().chunks_exact(nv).enumerate() {
            self.problem.A.as_mut_slice()[j * rows_A..j * rows_A + base].copy_from_slice(&column[..base]);
            self.problem.C.as_mut_slice()[j * rows_C..j * rows_C + joints].copy_from_slice(&column[base..]);
        }
        for i in 0..base {
            self.problem.b[i] = -terms.bias[i];
        }
        for (i, limit) in limits.iter().enumerate() {
            let h = terms.bias[base + i];
            self.problem.l[i] = -limit.torque - h;
            self.problem.u[i] = limit.torque - h;
        }
    }

    /// A stance foot's part of the equations of motion: `-Jᵀ G`, for the columns of v that move it.
    pub fn write_forces(&mut self, foot: usize, columns: &[usize], jacobian: &DMatrix<f64>, cones: &FrictionCones) {
        let Layout { nv, joints, .. } = self.layout;
        let base = nv - joints;
        let first = self.layout.force(foot);
        let (rows_A, rows_C) = (self.problem.A.nrows(), self.problem.C.nrows());
        for (k, g) in cones.map.as_slice().chunks_exact(6).enumerate() {
            let column_A = &mut self.problem.A.as_mut_slice()[(first + k) * rows_A..][..base];
            let column_C = &mut self.problem.C.as_mut_slice()[(first + k) * rows_C..][..joints];
            for &j in columns {
                let s = &jacobian.as_slice()[6 * j..6 * j + 6];
                let product = -(s[0] * g[0] + s[1] * g[1] + s[2] * g[2] + s[3] * g[3] + s[4] * g[4] + s[5] * g[5]);
                if j < base {
                    column_A[j] = product;
                } else {
                    column_C[j - base] = product;
                }
            }
        }
    }

    /// `J vd = a_des - Jdot v` for a stance ankle.
    pub fn write_contact(&mut self, foot: usize, columns: &[usize], jacobian: &DMatrix<f64>, target: &Vec6) {
        let row = self.layout.contact(foot);
        let rows_A = self.problem.A.nrows();
        for &j in columns {
            self.problem.A.as_mut_slice()[j * rows_A + row..][..6]
                .copy_from_slice(&jacobian.as_slice()[6 * j..6 * j + 6]);
        }
        self.problem.b.as_mut_slice()[row..row + 6].copy_from_slice(target.as_slice());
    }
}
