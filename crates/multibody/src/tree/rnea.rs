//! Inverse dynamics by the recursive Newton-Euler algorithm (Featherstone 2008, table 5.1), in body frames.
//!
//! Alone, the recursion is cheapest in the bodies' own frames: nothing is turned into the world, and since every joint axis
//! is its body's z axis, projecting on the axis costs nothing. The base's entries come out in base axes, as `v` wants them.
//! Accelerations are those of the frame origins as seen by a resting observer ("classical"), so that a force is `m a`.

use super::kinematics::{kinematics, sines};
use super::memory::{Memory, Newton};
use crate::model::{Base, Configuration, FrameIndex, JointMotion, Model};
use crate::rigid::{cross, cross_add, fma, rotate, rotate_add, turned_about_z, unrotate};
use nalgebra::DVector;
use spatial::{Mat3, Vec3, Wrench};

/// `out = M(q) a + h(q, v) - sum J' F`; the wrenches act about the origins of their frames, in world axes.
pub(crate) fn inverse_dynamics(
    model: &Model,
    ws: &mut Memory,
    q: &Configuration,
    v: &DVector<f64>,
    a: &DVector<f64>,
    external: &[(FrameIndex, Wrench)],
    out: &mut DVector<f64>,
) {
    assert_eq!(a.len(), model.tree_dofs(), "accelerations");
    forces::<true>(model, ws, q, v, a);
    if !external.is_empty() {
        kinematics(model, ws, q);
        for (frame, wrench) in external {
            let (body, force, moment) = ws.in_body(model, *frame, wrench);
            ws.newton[body].force -= force;
            ws.newton[body].moment -= moment;
        }
    }
    gather(model, ws, out);
    for (i, body) in model.bodies.iter().enumerate().skip(1) {
        let column = model.base_dofs() + i - 1;
        out[column] = fma(body.rotor_inertia, a[column], out[column]);
    }
}

/// `out = h(q, v)`.
pub(crate) fn bias_forces(model: &Model, ws: &mut Memory, q: &Configuration, v: &DVector<f64>, out: &mut DVector<f64>) {
    forces::<false>(model, ws, q, v, v);
    gather(model, ws, out);
}

/// `out = h(q, 0)`.
pub(crate) fn gravity_forces(model: &Model, ws: &mut Memory, q: &Configuration, out: &mut DVector<f64>) {
    out.as_mut_slice().fill(0.0);
    // The output is the zero velocity until the forces replace it.
    forces::<false>(model, ws, q, out, out);
    gather(model, ws, out);
}

impl Newton {
    /// `[wd] + [w][w]`: a point at `r` of this body accelerates with `acceleration + turning() r`.
    #[inline(always)]
    fn turning(&self) -> Mat3 {
        let (w, wd) = (&self.w, &self.wd);
        let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
        Mat3::new(
            -(yy + zz),
            fma(w.x, w.y, -wd.z),
            fma(w.x, w.z, wd.y),
            fma(w.x, w.y, wd.z),
            -(xx + zz),
            fma(w.y, w.z, -wd.x),
            fma(w.x, w.z, -wd.y),
            fma(w.y, w.z, wd.x),
            -(xx + yy),
        )
    }
}

/// Newton's and Euler's equations of every body; with `ACCELERATED = false` all of `a` counts as zero.
fn forces<const ACCELERATED: bool>(
    model: &Model,
    ws: &mut Memory,
    q: &Configuration,
    v: &DVector<f64>,
    a: &DVector<f64>,
) {
    assert_eq!(v.len(), model.tree_dofs(), "velocities");
    sines(&mut ws.sines, q);
    let base_dofs = model.base_dofs();
    let (rates, accelerations) = (&v.as_slice()[base_dofs..], &a.as_slice()[base_dofs..]);
    let mut base = Newton::new();
    base.acceleration = -unrotate(&q.base.rotation, &model.gravity());
    if model.base() == Base::Floating {
        base.w = Vec3::new(v[3], v[4], v[5]);
        // v is measured along axes that turn with the base.
        base.acceleration += cross(&base.w, &Vec3::new(v[0], v[1], v[2]));
        if ACCELERATED {
            base.wd = Vec3::new(a[3], a[4], a[5]);
            base.acceleration += Vec3::new(a[0], a[1], a[2]);
        }
    }
    ws.newton[0] = base;
    for (i, body) in model.bodies.iter().enumerate() {
        if i > 0 {
            let parent = &ws.newton[body.parent];
            let (rate, acceleration) = (rates[i - 1], if ACCELERATED { accelerations[i - 1] } else { 0.0 });
            let mut placement = body.placement;
            let turning = parent.turning();
            let (w, wd, origin);
            match body.motion {
                JointMotion::Revolute => {
                    placement.rotation = turned_about_z(&body.placement.rotation, ws.sines[i - 1]);
                    let w_parent = unrotate(&placement.rotation, &parent.w);
                    let wd_parent = unrotate(&placement.rotation, &parent.wd);
                    origin = rotate_add(&turning, &placement.translation, &parent.acceleration);
                    w = Vec3::new(w_parent.x, w_parent.y, w_parent.z + rate);
                    wd = Vec3::new(
                        fma(w_parent.y, rate, wd_parent.x),
                        fma(-w_parent.x, rate, wd_parent.y),
                        wd_parent.z + acceleration,
                    );
                    let acceleration = unrotate(&placement.rotation, &origin);
                    ws.newton[i] = Newton { placement, w, wd, acceleration, ..ws.newton[i] };
                }
                JointMotion::Prismatic => {
                    let R = &body.placement.rotation;
                    placement.translation += Vec3::new(R.m13, R.m23, R.m33) * q.joints[i - 1];
                    origin = rotate_add(&turning, &placement.translation, &parent.acceleration);
                    w = unrotate(R, &parent.w);
                    wd = unrotate(R, &parent.wd);
                    let slide = Vec3::new(2.0 * rate * w.y, -2.0 * rate * w.x, acceleration);
                    let acceleration = unrotate(R, &origin) + slide;
                    ws.newton[i] = Newton { placement, w, wd, acceleration, ..ws.newton[i] };
                }
            }
        }
        let part = &mut ws.newton[i];
        let h = &body.first_moment;
        part.force = rotate_add(&part.turning(), h, &(part.acceleration * body.inertia.mass_kg));
        let momentum = body.about_origin.times_add(&part.w, &Vec3::zeros());
        let spin = cross_add(&part.w, &momentum, &cross(h, &part.acceleration));
        part.moment = body.about_origin.times_add(&part.wd, &spin);
    }
}

/// Sums forces towards the base and projects them on the joints.
fn gather(model: &Model, ws: &mut Memory, out: &mut DVector<f64>) {
    assert_eq!(out.len(), model.tree_dofs(), "generalised forces");
    let base_dofs = model.base_dofs();
    for (i, body) in model.bodies.iter().enumerate().skip(1).rev() {
        let part = &ws.newton[i];
        out[base_dofs + i - 1] = match body.motion {
            JointMotion::Revolute => part.moment.z,
            JointMotion::Prismatic => part.force.z,
        };
        let force = rotate(&part.placement.rotation, &part.force);
        let moment = rotate_add(&part.placement.rotation, &part.moment, &cross(&part.placement.translation, &force));
        let parent = &mut ws.newton[body.parent];
        parent.force += force;
        parent.moment += moment;
    }
    if model.base() == Base::Floating {
        out.fixed_rows_mut::<3>(0).copy_from(&ws.newton[0].force);
        out.fixed_rows_mut::<3>(3).copy_from(&ws.newton[0].moment);
    }
}
