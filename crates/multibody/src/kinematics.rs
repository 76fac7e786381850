//! Forward kinematics.

use crate::rigid::{cross_motion, scaled, sum};
use crate::{Base, Configuration, JointMotion, Model, Workspace};
use nalgebra::{DVector, Vector3};
use spatial::{Mat3, Transform, Twist, Vec3};

/// Placements of all bodies. Afterwards [`Workspace::placement`] answers for every frame.
pub fn forward_kinematics(model: &Model, ws: &mut Workspace, q: &Configuration) {
    assert_eq!(q.joints.len(), model.joint_count(), "joint positions");
    ws.origin = q.base.translation;
    ws.motion[0].placement = Transform::new(q.base.rotation, Vec3::zeros());
    for i in 1..model.bodies.len() {
        let body = &model.bodies[i];
        let at_zero = ws.motion[body.parent].placement * body.placement;
        let axis = Vec3::from(at_zero.rotation.column(2));
        let (placement, s) = match body.motion {
            JointMotion::Revolute => {
                let rotation = turned_about_z(&at_zero.rotation, q.joints[i - 1]);
                let s = Twist { linear: at_zero.translation.cross(&axis), angular: axis };
                (Transform::new(rotation, at_zero.translation), s)
            }
            JointMotion::Prismatic => {
                let translation = at_zero.translation + axis * q.joints[i - 1];
                (Transform::new(at_zero.rotation, translation), Twist { linear: axis, angular: Vec3::zeros() })
            }
        };
        ws.motion[i].placement = placement;
        ws.motion[i].s = s;
    }
}

/// `R Rz(angle)`.
fn turned_about_z(r: &Mat3, angle_rad: f64) -> Mat3 {
    let (sin, cos) = angle_rad.sin_cos();
    let (x, y) = (r.column(0), r.column(1));
    Mat3::from_columns(&[x * cos + y * sin, y * cos - x * sin, r.column(2).into()])
}

/// Placements and velocities of all bodies. Afterwards [`Workspace::placement`] and [`Workspace::velocity`] answer for
/// every frame.
pub fn forward_kinematics_velocity(model: &Model, ws: &mut Workspace, q: &Configuration, v: &DVector<f64>) {
    assert_eq!(v.len(), model.nv(), "velocities");
    forward_kinematics(model, ws, q);
    ws.motion[0].v = base_motion(model, ws, v);
    for i in 1..model.bodies.len() {
        let parent = ws.motion[model.bodies[i].parent].v;
        let body = &mut ws.motion[i];
        body.v = sum(&parent, &scaled(&body.s, v[model.base_dofs() + i - 1]));
    }
}

/// Accelerations of all bodies after [`forward_kinematics_velocity`], the base's given. With `vd = None`: all joint
/// accelerations are zero.
pub(crate) fn accelerations(
    model: &Model,
    ws: &mut Workspace,
    v: &DVector<f64>,
    vd: Option<&DVector<f64>>,
    base: Twist,
) {
    let base_dofs = model.base_dofs();
    ws.motion[0].a = base;
    for i in 1..model.bodies.len() {
        let parent = ws.motion[model.bodies[i].parent].a;
        let body = &mut ws.motion[i];
        let rate = v[base_dofs + i - 1];
        body.a = sum(&parent, &scaled(&cross_motion(&body.v, &body.s), rate));
        if let Some(vd) = vd {
            body.a = sum(&body.a, &scaled(&body.s, vd[base_dofs + i - 1]));
        }
    }
}

/// The base's twist or spatial acceleration in world axes from the first six entries of `v` or `vd`.
pub(crate) fn base_motion(model: &Model, ws: &Workspace, v: &DVector<f64>) -> Twist {
    match model.base() {
        Base::Fixed => Twist::zero(),
        Base::Floating => {
            let R_WB = &ws.motion[0].placement.rotation;
            Twist { linear: R_WB * Vector3::new(v[0], v[1], v[2]), angular: R_WB * Vector3::new(v[3], v[4], v[5]) }
        }
    }
}

/// Centre of mass `p_WG` (m) after any algorithm that computes the kinematics.
#[must_use]
pub fn center_of_mass(model: &Model, ws: &Workspace) -> Vec3 {
    let first_moment: Vec3 = model
        .bodies
        .iter()
        .zip(&ws.motion)
        .map(|(body, motion)| body.inertia.mass_kg * motion.placement.point(&body.inertia.com))
        .sum();
    ws.origin + first_moment * model.per_mass()
}
