//! Mass matrix by the composite-rigid-body algorithm (Featherstone 2008, table 6.2).

use super::kinematics::{place, sines};
use super::memory::{BodyMotion, Memory};
use crate::model::{Base, Configuration, Model};
use crate::rigid::{RigidInertia, power, unrotate};
use nalgebra::DMatrix;
use spatial::{Mat3, Wrench, so3};

/// `out = M(q)`, full and symmetric.
pub(crate) fn mass_matrix(model: &Model, ws: &mut Memory, q: &Configuration, out: &mut DMatrix<f64>) {
    // M does not depend on where the base is: in base axes its rows for the base need no rotation. The world's kinematics,
    // which the caller may still want to ask for, are left alone.
    sines(&mut ws.sines, q);
    place(model, &ws.sines, &mut ws.motion_in_base, &Mat3::identity(), q);
    out.as_mut_slice().fill(0.0);
    composite_inertias(model, &ws.motion_in_base, &mut ws.inertia);
    write_mass_matrix(model, &ws.motion_in_base, &ws.inertia, &mut ws.axis_force, None, out);
}

/// Inertia of every body together with all bodies below it.
pub(crate) fn composite_inertias(model: &Model, motions: &[BodyMotion], inertias: &mut [RigidInertia]) {
    for ((body, motion), inertia) in model.bodies.iter().zip(motions).zip(&mut *inertias) {
        *inertia = RigidInertia::of(&body.inertia, &motion.placement);
    }
    for (i, body) in model.bodies.iter().enumerate().skip(1).rev() {
        let composite = inertias[i];
        inertias[body.parent].add(&composite);
    }
}

/// The structurally non-zero entries of the tree's M from composite inertias; the others are not touched. `R_WB` is the base's
/// rotation in the axes of the kinematics, `None` if those are the base's own.
pub(crate) fn write_mass_matrix(
    model: &Model,
    motions: &[BodyMotion],
    composites: &[RigidInertia],
    axis_forces: &mut [Wrench],
    R_WB: Option<&Mat3>,
    out: &mut DMatrix<f64>,
) {
    let nv = model.tree_dofs();
    assert_eq!(out.shape(), (nv, nv), "mass matrix");
    let base_dofs = model.base_dofs();
    let m = out.as_mut_slice();
    for (i, body) in model.bodies.iter().enumerate().skip(1) {
        let f = composites[i].apply(&motions[i].s);
        axis_forces[i] = f;
        let row = base_dofs + i - 1;
        m[row * nv + row] = power(&motions[i].s, &f) + body.rotor_inertia;
        let mut j = body.parent;
        while j > 0 {
            let column = base_dofs + j - 1;
            let entry = power(&motions[j].s, &f);
            m[column * nv + row] = entry;
            m[row * nv + column] = entry;
            j = model.bodies[j].parent;
        }
        if model.base() == Base::Floating {
            let f = in_base_axes(R_WB, &f).to_vector();
            m[row * nv..row * nv + 6].copy_from_slice(f.as_slice());
            for k in 0..6 {
                m[k * nv + row] = f[k];
            }
        }
    }
    if model.base() == Base::Floating {
        base_block(&composites[0], R_WB, out);
    }
}

/// The wrench about O in the axes of the base.
#[inline(always)]
pub(crate) fn in_base_axes(R_WB: Option<&Mat3>, f: &Wrench) -> Wrench {
    R_WB.map_or(*f, |r| Wrench { force: unrotate(r, &f.force), moment: unrotate(r, &f.moment) })
}

fn base_block(total: &RigidInertia, R_WB: Option<&Mat3>, out: &mut DMatrix<f64>) {
    let R_WB = R_WB.copied().unwrap_or_else(Mat3::identity);
    let first_moment = so3::skew(&R_WB.tr_mul(&total.first_moment));
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Mat3::identity() * total.mass));
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(&first_moment);
    out.fixed_view_mut::<3, 3>(0, 3).copy_from(&-first_moment);
    // Symmetric to the last bit, as every other block.
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(&total.about_origin.rotated(&R_WB.transpose()).full());
}
