//! Forward dynamics by the articulated-body algorithm (Featherstone 2008, table 7.1).

use crate::rigid::{RigidInertia, cross_force, cross_motion, scaled_add};
use crate::whole_body::against_gravity;
use crate::{Base, Configuration, FrameIndex, Model, Workspace, forward_kinematics_velocity};
use nalgebra::DVector;
use spatial::{Mat6, Transform, Twist, Vec3, Vec6, Wrench, so3};

/// `out = M(q)^-1 (tau - h(q, v))`: the accelerations that generalised forces cause.
///
/// Every movable joint must carry mass or have a rotor inertia ([`Model::massless_joint`] is `None`); where it does not,
/// its acceleration is not defined.
pub fn aba(
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
    tau: &DVector<f64>,
    out: &mut DVector<f64>,
) {
    aba_with_external(model, ws, q, v, tau, &[], out);
}

/// `out = M(q)^-1 (tau + sum J' F - h(q, v))`: as [`aba`] while external wrenches act, each about the origin of its frame
/// in world axes.
pub fn aba_with_external(
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
    tau: &DVector<f64>,
    external: &[(FrameIndex, Wrench)],
    out: &mut DVector<f64>,
) {
    assert_eq!((tau.len(), out.len()), (model.nv(), model.nv()), "generalised forces and accelerations");
    forward_kinematics_velocity(model, ws, q, v);
    let base_dofs = model.base_dofs();
    for i in 0..model.bodies.len() {
        let (motion, part) = (&ws.motion[i], &mut ws.articulated[i]);
        let inertia = RigidInertia::of(&model.bodies[i].inertia, &motion.placement);
        part.inertia = matrix(&inertia);
        part.force = cross_force(&motion.v, &inertia.apply(&motion.v)).to_vector();
        let rate = if i == 0 { 0.0 } else { v[base_dofs + i - 1] };
        part.c = scaled_add(&cross_motion(&motion.v, &motion.s), rate, &Twist::zero()).to_vector();
    }
    for (frame, wrench) in external {
        let about_origin = wrench.about(&-ws.frame_position(model, *frame));
        ws.articulated[model.frames()[frame.0].body].force -= about_origin.to_vector();
    }
    for i in (1..model.bodies.len()).rev() {
        let body = &model.bodies[i];
        let s = ws.motion[i].s.to_vector();
        let part = &mut ws.articulated[i];
        part.u = part.inertia * s;
        part.d = s.dot(&part.u) + body.rotor_inertia;
        part.rest = tau[base_dofs + i - 1] - s.dot(&part.force);
        let inertia = part.inertia - part.u * (part.u / part.d).transpose();
        let force = part.force + inertia * part.c + part.u * (part.rest / part.d);
        let parent = &mut ws.articulated[body.parent];
        parent.inertia += inertia;
        parent.force += force;
    }
    let gravity = against_gravity(model).to_vector();
    let base = match model.base() {
        Base::Fixed => gravity,
        Base::Floating => {
            let R_WB = ws.motion[0].placement.rotation;
            let wrench = Transform::new(R_WB, Vec3::zeros())
                .wrench(&Wrench { force: tau.fixed_rows::<3>(0).into(), moment: tau.fixed_rows::<3>(3).into() })
                .to_vector();
            // M is positive definite as soon as the robot has an extent; a point mass cannot be turned.
            let a = solve(ws.articulated[0].inertia, wrench - ws.articulated[0].force);
            let free = Twist::from_vector(&(a - gravity));
            out.fixed_rows_mut::<3>(0).copy_from(&R_WB.tr_mul(&free.linear));
            out.fixed_rows_mut::<3>(3).copy_from(&R_WB.tr_mul(&free.angular));
            a
        }
    };
    ws.motion[0].a = Twist::from_vector(&base);
    for i in 1..model.bodies.len() {
        let part = ws.articulated[i];
        let a = ws.motion[model.bodies[i].parent].a.to_vector() + part.c;
        let joint = (part.rest - part.u.dot(&a)) / part.d;
        out[base_dofs + i - 1] = joint;
        ws.motion[i].a = Twist::from_vector(&(a + ws.motion[i].s.to_vector() * joint));
    }
}

fn matrix(inertia: &RigidInertia) -> Mat6 {
    let mut m = Mat6::zeros();
    let k = so3::skew(&inertia.first_moment);
    for i in 0..3 {
        m[(i, i)] = inertia.mass;
    }
    m.fixed_view_mut::<3, 3>(0, 3).copy_from(&-k);
    m.fixed_view_mut::<3, 3>(3, 0).copy_from(&k);
    m.fixed_view_mut::<3, 3>(3, 3).copy_from(&inertia.about_origin.full());
    m
}

fn solve(mut a: Mat6, mut b: Vec6) -> Vec6 {
    // LDL' of a symmetric positive definite matrix, in place, lower triangle.
    for j in 0..6 {
        for k in 0..j {
            let l = a[(j, k)];
            for i in j..6 {
                a[(i, j)] -= a[(i, k)] * l * a[(k, k)];
            }
        }
        for i in j + 1..6 {
            a[(i, j)] /= a[(j, j)];
        }
    }
    for i in 0..6 {
        for k in 0..i {
            b[i] -= a[(i, k)] * b[k];
        }
    }
    for i in 0..6 {
        b[i] /= a[(i, i)];
    }
    for i in (0..6).rev() {
        for k in i + 1..6 {
            b[i] -= a[(k, i)] * b[k];
        }
    }
    b
}
