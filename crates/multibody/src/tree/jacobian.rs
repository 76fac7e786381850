//! Jacobians and drifts of frames and of the centre of mass.

use super::crba::composite_inertias;
use super::memory::Memory;
use crate::model::{Base, FrameIndex, Model};
use crate::rigid::{cross_add, cross_motion, scaled_add};
use nalgebra::DMatrix;
use spatial::{Mat3, Vec3, Vec6, so3};

/// `out = J` of a frame, after [`kinematics`](super::kinematics::kinematics).
pub(crate) fn jacobian(model: &Model, ws: &Memory, frame: FrameIndex, out: &mut DMatrix<f64>) {
    assert_eq!(out.shape(), (6, model.tree_dofs()), "Jacobian");
    out.as_mut_slice().fill(0.0);
    write_jacobian(model, ws, frame, out);
}

/// The structurally non-zero columns of a frame's Jacobian on the tree; the others are not touched.
pub(crate) fn write_jacobian(model: &Model, ws: &Memory, frame: FrameIndex, out: &mut DMatrix<f64>) {
    let p_OF = ws.frame_position(model, frame);
    let base_dofs = model.base_dofs();
    let j = out.as_mut_slice();
    let mut i = model.frames()[frame.0].body;
    while i > 0 {
        let s = &ws.motion[i].s;
        let linear = cross_add(&s.angular, &p_OF, &s.linear);
        let column = 6 * (base_dofs + i - 1);
        j[column..column + 3].copy_from_slice(linear.as_slice());
        j[column + 3..column + 6].copy_from_slice(s.angular.as_slice());
        i = model.bodies[i].parent;
    }
    if model.base() == Base::Floating {
        let R_WB = &ws.motion[0].placement.rotation;
        out.fixed_view_mut::<3, 3>(0, 0).copy_from(R_WB);
        out.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-so3::skew(&p_OF) * R_WB));
        out.fixed_view_mut::<3, 3>(3, 3).copy_from(R_WB);
    }
}

/// `Jdot v` from the rate of each body's joint.
pub(crate) fn drift(model: &Model, ws: &Memory, frame: FrameIndex, rate: impl Fn(usize) -> f64) -> Vec6 {
    let mut i = model.frames()[frame.0].body;
    let twist = ws.motion[i].v;
    let mut a = spatial::Twist::zero();
    while i > 0 {
        let motion = &ws.motion[i];
        a = scaled_add(&cross_motion(&motion.v, &motion.s), rate(i), &a);
        i = model.bodies[i].parent;
    }
    classical(&a, &twist, &ws.frame_position(model, frame)).to_vector()
}

/// Acceleration of the body-fixed point at `p` from a spatial acceleration and twist about O.
pub(crate) fn classical(a: &spatial::Twist, v: &spatial::Twist, p: &Vec3) -> spatial::Twist {
    let at_point = a.at(p);
    spatial::Twist { linear: at_point.linear + v.angular.cross(&v.at(p).linear), angular: at_point.angular }
}

/// `out = Jcom`, after [`kinematics`](super::kinematics::kinematics).
pub(crate) fn com_jacobian(model: &Model, ws: &mut Memory, out: &mut DMatrix<f64>) {
    assert_eq!(out.shape(), (3, model.tree_dofs()), "Jacobian of the centre of mass");
    composite_inertias(model, &ws.motion, &mut ws.inertia);
    let per_mass = model.per_mass();
    for i in 1..model.bodies.len() {
        let force = ws.inertia[i].apply(&ws.motion[i].s).force;
        out.fixed_view_mut::<3, 1>(0, model.base_dofs() + i - 1).copy_from(&(force * per_mass));
    }
    if model.base() == Base::Floating {
        let R_WB = ws.motion[0].placement.rotation;
        let lever: Mat3 = -so3::skew(&(ws.inertia[0].first_moment * per_mass)) * R_WB;
        out.fixed_view_mut::<3, 3>(0, 0).copy_from(&R_WB);
        out.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
    }
}
