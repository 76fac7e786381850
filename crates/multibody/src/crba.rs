//! Mass matrix by the composite-rigid-body algorithm (Featherstone 2008, table 6.2).

use crate::rigid::RigidInertia;
use crate::{Base, Configuration, Model, Workspace, forward_kinematics};
use nalgebra::DMatrix;
use spatial::{Mat3, Wrench, so3};

/// `out = M(q)`, full and symmetric, nv x nv.
pub fn crba(model: &Model, ws: &mut Workspace, q: &Configuration, out: &mut DMatrix<f64>) {
    forward_kinematics(model, ws, q);
    out.fill(0.0);
    composite_inertias(model, ws);
    mass_matrix(model, ws, out);
}

/// Inertia of every body together with all bodies below it.
pub(crate) fn composite_inertias(model: &Model, ws: &mut Workspace) {
    for ((body, motion), inertia) in model.bodies.iter().zip(&ws.motion).zip(&mut ws.inertia) {
        *inertia = RigidInertia::of(&body.inertia, &motion.placement);
    }
    for i in (1..model.bodies.len()).rev() {
        let composite = ws.inertia[i];
        ws.inertia[model.bodies[i].parent].add(&composite);
    }
}

/// The structurally non-zero entries of M from composite inertias; the others are not touched.
pub(crate) fn mass_matrix(model: &Model, ws: &mut Workspace, out: &mut DMatrix<f64>) {
    assert_eq!(out.shape(), (model.nv(), model.nv()), "mass matrix");
    let base_dofs = model.base_dofs();
    let R_WB = ws.motion[0].placement.rotation;
    for i in 1..model.bodies.len() {
        let f = ws.inertia[i].apply(&ws.motion[i].s);
        ws.axis_force[i] = f;
        let row = base_dofs + i - 1;
        out[(row, row)] = ws.motion[i].s.power(&f) + model.bodies[i].rotor_inertia;
        let mut j = model.bodies[i].parent;
        while j > 0 {
            let column = base_dofs + j - 1;
            let m = ws.motion[j].s.power(&f);
            out[(row, column)] = m;
            out[(column, row)] = m;
            j = model.bodies[j].parent;
        }
        if model.base() == Base::Floating {
            write_base_column(out, row, &R_WB, &f);
        }
    }
    if model.base() == Base::Floating {
        let total = &ws.inertia[0];
        let first_moment = so3::skew(&R_WB.tr_mul(&total.first_moment));
        out.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Mat3::identity() * total.mass));
        out.fixed_view_mut::<3, 3>(3, 0).copy_from(&first_moment);
        out.fixed_view_mut::<3, 3>(0, 3).copy_from(&-first_moment);
        let about_origin = R_WB.transpose() * total.about_origin * R_WB;
        // Symmetric to the last bit, as every other block.
        out.fixed_view_mut::<3, 3>(3, 3).copy_from(&(0.5 * (about_origin + about_origin.transpose())));
    }
}

fn write_base_column(out: &mut DMatrix<f64>, row: usize, R_WB: &Mat3, f: &Wrench) {
    let (force, moment) = (R_WB.tr_mul(&f.force), R_WB.tr_mul(&f.moment));
    for k in 0..3 {
        out[(k, row)] = force[k];
        out[(row, k)] = force[k];
        out[(3 + k, row)] = moment[k];
        out[(row, 3 + k)] = moment[k];
    }
}
