//! Forward dynamics by the articulated-body algorithm (Featherstone 2008, table 7.1), in body frames.
//!
//! The apparent inertia `D` at a joint is a difference of nearly equal numbers when a light hand hangs on a long arm. In the
//! bodies' own frames nothing larger than the hand enters it, and since every joint axis is its body's z axis, the column
//! `U` of the articulated inertia is read off instead of computed. Joints that follow others cannot be freed one by one:
//! robots that have them are solved through M, in `coupled`.

use super::kinematics::{kinematics, sines};
use super::memory::{Articulated, ArticulatedInertia, Memory};
use crate::model::{Base, Configuration, FrameIndex, JointMotion, Model};
use crate::rigid::{
    Symmetric, cross, cross_add, dot, fma, product, rotate, rotate_add, scale_add, turned_about_z, unrotate,
};
use nalgebra::DVector;
use spatial::{Mat3, Mat6, Transform, Vec3, Vec6, Wrench};

/// `out = M(q)^-1 (tau + sum J' F - h(q, v))`; the wrenches act about the origins of their frames, in world axes.
pub(crate) fn forward_dynamics(
    model: &Model,
    ws: &mut Memory,
    q: &Configuration,
    v: &DVector<f64>,
    tau: &DVector<f64>,
    external: &[(FrameIndex, Wrench)],
    out: &mut DVector<f64>,
) {
    assert_eq!(v.len(), model.nv(), "velocities");
    assert_eq!((tau.len(), out.len()), (model.nv(), model.nv()), "generalised forces and accelerations");
    let base_dofs = model.base_dofs();
    velocities(model, ws, q, v);
    if !external.is_empty() {
        kinematics(model, ws, q);
        for (frame, wrench) in external {
            let (body, force, moment) = ws.in_body(model, *frame, wrench);
            ws.articulated[body].force -= force;
            ws.articulated[body].moment -= moment;
        }
    }
    for (i, body) in model.bodies.iter().enumerate().skip(1).rev() {
        let part = &mut ws.articulated[i];
        part.release(body.motion, body.rotor_inertia, tau[base_dofs + i - 1]);
        let (inertia, force, moment) = part.seen_by_parent();
        let parent = &mut ws.articulated[body.parent];
        parent.inertia.add(&inertia);
        parent.force += force;
        parent.moment += moment;
    }
    // Gravity is a base that accelerates upwards.
    let gravity = unrotate(&q.base.rotation, &model.gravity());
    let base = &mut ws.articulated[0];
    (base.acceleration, base.wd) = (-gravity, Vec3::zeros());
    if model.base() == Base::Floating {
        let wrench = tau.fixed_rows::<6>(0) - Wrench { force: base.force, moment: base.moment }.to_vector();
        let a = solve(base.inertia.matrix(), wrench);
        (base.acceleration, base.wd) = (a.fixed_rows::<3>(0).into(), a.fixed_rows::<3>(3).into());
        out.fixed_rows_mut::<3>(0).copy_from(&(base.acceleration + gravity));
        out.fixed_rows_mut::<3>(3).copy_from(&base.wd);
    }
    for (i, body) in model.bodies.iter().enumerate().skip(1) {
        let parent = &ws.articulated[body.parent];
        let (acceleration, wd) = (parent.acceleration, parent.wd);
        out[base_dofs + i - 1] = ws.articulated[i].follow(body.motion, &acceleration, &wd);
    }
}

impl ArticulatedInertia {
    #[inline(always)]
    fn add(&mut self, other: &Self) {
        self.mass.add(&other.mass);
        self.coupling += other.coupling;
        self.rotational.add(&other.rotational);
    }

    /// In the axes of the parent, about the parent's origin.
    #[inline(always)]
    fn moved(&self, X_PB: &Transform) -> Self {
        let (r, t) = (&X_PB.rotation, &X_PB.translation);
        let mass = self.mass.rotated(r);
        let turned = product(&product(r, &self.coupling), &r.transpose());
        // A - B [t], row by row: (B [t]) has the rows b x t.
        let minus_times_skew = |a: &Mat3, b: &Mat3| {
            let row = |k: usize| {
                let (a, b) = (Vec3::new(a[(k, 0)], a[(k, 1)], a[(k, 2)]), Vec3::new(b[(k, 0)], b[(k, 1)], b[(k, 2)]));
                cross_add(t, &b, &a)
            };
            let (x, y, z) = (row(0), row(1), row(2));
            Mat3::new(x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z)
        };
        let coupling = minus_times_skew(&turned, &mass.full());
        let half = minus_times_skew(&self.rotational.rotated(r).full(), &turned.transpose());
        let column = |k: usize| {
            let of = |m: &Mat3| Vec3::new(m[(0, k)], m[(1, k)], m[(2, k)]);
            cross_add(t, &of(&coupling), &of(&half))
        };
        let rotational = Symmetric::of(&Mat3::from_columns(&[column(0), column(1), column(2)]));
        Self { mass, coupling, rotational }
    }

    fn matrix(&self) -> Mat6 {
        let mut m = Mat6::zeros();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.mass.full());
        m.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.coupling);
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.coupling.transpose());
        m.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.rotational.full());
        m
    }
}

impl Articulated {
    /// Lets the joint go: what the parent feels is the inertia without the share that moves the joint.
    #[inline(always)]
    fn release(&mut self, motion: JointMotion, rotor_inertia: f64, tau: f64) {
        let ArticulatedInertia { mass, coupling, rotational } = &mut self.inertia;
        let (u_force, u_moment) = match motion {
            JointMotion::Revolute => (
                Vec3::new(coupling.m13, coupling.m23, coupling.m33),
                Vec3::new(rotational.xz, rotational.yz, rotational.zz),
            ),
            JointMotion::Prismatic => {
                (Vec3::new(mass.xz, mass.yz, mass.zz), Vec3::new(coupling.m31, coupling.m32, coupling.m33))
            }
        };
        (self.d, self.rest) = match motion {
            JointMotion::Revolute => (u_moment.z + rotor_inertia, tau - self.moment.z),
            JointMotion::Prismatic => (u_force.z + rotor_inertia, tau - self.force.z),
        };
        let per_d = 1.0 / self.d;
        let (f, n) = (u_force * per_d, u_moment * per_d);
        mass.minus(&f, &u_force);
        rotational.minus(&n, &u_moment);
        let entry = |c: f64, f: f64, n: f64| fma(-f, n, c);
        *coupling = Mat3::new(
            entry(coupling.m11, f.x, u_moment.x),
            entry(coupling.m12, f.x, u_moment.y),
            entry(coupling.m13, f.x, u_moment.z),
            entry(coupling.m21, f.y, u_moment.x),
            entry(coupling.m22, f.y, u_moment.y),
            entry(coupling.m23, f.y, u_moment.z),
            entry(coupling.m31, f.z, u_moment.x),
            entry(coupling.m32, f.z, u_moment.y),
            entry(coupling.m33, f.z, u_moment.z),
        );
        let force = mass.times_add(&self.c_linear, &rotate_add(coupling, &self.c_angular, &self.force));
        let moment = rotational.times_add(&self.c_angular, &(unrotate(coupling, &self.c_linear) + self.moment));
        self.force = scale_add(&f, self.rest, &force);
        self.moment = scale_add(&n, self.rest, &moment);
        (self.u_force, self.u_moment) = (u_force, u_moment);
    }

    #[inline(always)]
    fn seen_by_parent(&self) -> (ArticulatedInertia, Vec3, Vec3) {
        let (r, t) = (&self.placement.rotation, &self.placement.translation);
        let force = rotate(r, &self.force);
        (self.inertia.moved(&self.placement), force, rotate_add(r, &self.moment, &cross(t, &force)))
    }

    /// Follows the parent's acceleration; returns the joint's.
    #[inline(always)]
    fn follow(&mut self, motion: JointMotion, parent_acceleration: &Vec3, parent_wd: &Vec3) -> f64 {
        let (r, t) = (&self.placement.rotation, &self.placement.translation);
        let mut acceleration = unrotate(r, &cross_add(parent_wd, t, parent_acceleration)) + self.c_linear;
        let mut wd = unrotate(r, parent_wd) + self.c_angular;
        let joint = (self.rest - dot(&self.u_force, &acceleration) - dot(&self.u_moment, &wd)) / self.d;
        match motion {
            JointMotion::Revolute => wd.z += joint,
            JointMotion::Prismatic => acceleration.z += joint,
        }
        (self.acceleration, self.wd) = (acceleration, wd);
        joint
    }
}

/// Velocities, rigid inertias and velocity-product wrenches of all bodies.
fn velocities(model: &Model, ws: &mut Memory, q: &Configuration, v: &DVector<f64>) {
    sines(&mut ws.sines, q);
    let rates = &v.as_slice()[model.base_dofs()..];
    for (i, body) in model.bodies.iter().enumerate() {
        let mut part = Articulated::default();
        if i > 0 {
            let (parent, rate) = (&ws.articulated[body.parent], rates[i - 1]);
            part.placement = body.placement;
            match body.motion {
                JointMotion::Revolute => {
                    part.placement.rotation = turned_about_z(&body.placement.rotation, ws.sines[i - 1]);
                }
                JointMotion::Prismatic => {
                    let R = &body.placement.rotation;
                    part.placement.translation += Vec3::new(R.m13, R.m23, R.m33) * q.joints[i - 1];
                }
            }
            let (r, t) = (&part.placement.rotation, &part.placement.translation);
            part.v = unrotate(r, &cross_add(&parent.w, t, &parent.v));
            part.w = unrotate(r, &parent.w);
            let turned = |a: &Vec3| Vec3::new(a.y * rate, -(a.x * rate), 0.0);
            match body.motion {
                JointMotion::Revolute => {
                    part.w.z += rate;
                    (part.c_linear, part.c_angular) = (turned(&part.v), turned(&part.w));
                }
                JointMotion::Prismatic => {
                    part.v.z += rate;
                    part.c_linear = turned(&part.w);
                }
            }
        } else if model.base() == Base::Floating {
            (part.v, part.w) = (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]));
        }
        let (m, h) = (body.inertia.mass_kg, &body.first_moment);
        part.inertia = ArticulatedInertia {
            mass: Symmetric { xx: m, yy: m, zz: m, ..Symmetric::default() },
            coupling: Mat3::new(0.0, h.z, -h.y, -h.z, 0.0, h.x, h.y, -h.x, 0.0),
            rotational: body.about_origin,
        };
        let linear = cross_add(&part.w, h, &(part.v * m));
        let angular = body.about_origin.times_add(&part.w, &cross(h, &part.v));
        part.force = cross(&part.w, &linear);
        part.moment = cross_add(&part.w, &angular, &cross(&part.v, &linear));
        ws.articulated[i] = part;
    }
}

/// `a^-1 b` by LDL' of a symmetric positive definite matrix, lower triangle.
fn solve(mut a: Mat6, mut b: Vec6) -> Vec6 {
    for j in 0..6 {
        for k in 0..j {
            let l = a[(j, k)] * a[(k, k)];
            for i in j..6 {
                a[(i, j)] -= a[(i, k)] * l;
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
