//! Inverse dynamics by the recursive Newton-Euler algorithm (Featherstone 2008, table 5.1).

use crate::kinematics::{accelerations, base_motion, forward_kinematics_velocity};
use crate::rigid::{RigidInertia, cross_force, sum};
use crate::{Base, Configuration, FrameIndex, Model, Workspace};
use nalgebra::DVector;
use spatial::{Twist, Vec3, Wrench};

/// `out = M(q) a + h(q, v)`: the generalised force that makes the robot accelerate with `a`.
pub fn rnea(
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
    a: &DVector<f64>,
    out: &mut DVector<f64>,
) {
    rnea_with_external(model, ws, q, v, a, &[], out);
}

/// `out = M(q) a + h(q, v) - sum J' F`: as [`rnea`] while external wrenches act, each about the origin of its frame in
/// world axes.
pub fn rnea_with_external(
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
    a: &DVector<f64>,
    external: &[(FrameIndex, Wrench)],
    out: &mut DVector<f64>,
) {
    assert_eq!(a.len(), model.nv(), "accelerations");
    forward_kinematics_velocity(model, ws, q, v);
    let base = sum(&base_motion(model, ws, a), &against_gravity(model));
    accelerations(model, ws, v, Some(a), base);
    body_forces(model, ws);
    for (frame, wrench) in external {
        let about_origin = wrench.about(&-ws.frame_position(model, *frame));
        let force = &mut ws.force[model.frames()[frame.0].body];
        *force = *force - about_origin;
    }
    gather(model, ws, out);
    for i in 1..model.bodies.len() {
        let column = model.base_dofs() + i - 1;
        out[column] += model.bodies[i].rotor_inertia * a[column];
    }
}

/// `out = h(q, v)`: Coriolis, centrifugal and gravity forces.
pub fn bias_forces(model: &Model, ws: &mut Workspace, q: &Configuration, v: &DVector<f64>, out: &mut DVector<f64>) {
    forward_kinematics_velocity(model, ws, q, v);
    accelerations(model, ws, v, None, against_gravity(model));
    body_forces(model, ws);
    gather(model, ws, out);
}

/// `out = h(q, 0)`: what holds the robot still.
pub fn gravity_forces(model: &Model, ws: &mut Workspace, q: &Configuration, out: &mut DVector<f64>) {
    crate::forward_kinematics(model, ws, q);
    let base = against_gravity(model);
    for (motion, _) in ws.motion.iter_mut().zip(&model.bodies) {
        motion.v = Twist::zero();
        motion.a = base;
    }
    body_forces(model, ws);
    gather(model, ws, out);
}

/// Gravity is a base that accelerates upwards.
pub(crate) fn against_gravity(model: &Model) -> Twist {
    Twist { linear: -model.gravity(), angular: Vec3::zeros() }
}

/// `f = I a + v x* I v` of every body.
pub(crate) fn body_forces(model: &Model, ws: &mut Workspace) {
    for ((body, motion), force) in model.bodies.iter().zip(&ws.motion).zip(&mut ws.force) {
        let inertia = RigidInertia::of(&body.inertia, &motion.placement);
        *force = inertia.apply(&motion.a) + cross_force(&motion.v, &inertia.apply(&motion.v));
    }
}

/// Sums forces towards the base and projects them on the joints.
fn gather(model: &Model, ws: &mut Workspace, out: &mut DVector<f64>) {
    assert_eq!(out.len(), model.nv(), "generalised forces");
    let base_dofs = model.base_dofs();
    for i in (1..model.bodies.len()).rev() {
        out[base_dofs + i - 1] = ws.motion[i].s.power(&ws.force[i]);
        let parent = model.bodies[i].parent;
        ws.force[parent] = ws.force[parent] + ws.force[i];
    }
    if model.base() == Base::Floating {
        let R_WB = &ws.motion[0].placement.rotation;
        out.fixed_rows_mut::<3>(0).copy_from(&R_WB.tr_mul(&ws.force[0].force));
        out.fixed_rows_mut::<3>(3).copy_from(&R_WB.tr_mul(&ws.force[0].moment));
    }
}
