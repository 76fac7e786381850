//! Placements and velocities of the tree's bodies.

use super::memory::{BodyMotion, Memory};
use crate::model::{Base, Configuration, JointMotion, Model};
use crate::rigid::{cross, cross_motion, product, rotate, rotate_add, scale_add, scaled_add, turned_about_z};
use nalgebra::DVector;
use spatial::{Mat3, Transform, Twist, Vec3};
use wide::f64x4;

/// Angles up to this (rad) are reduced exactly enough by the vectorised sine; larger ones go through the standard library.
const VECTORISED_MAX_RAD: f64 = 1e3;

/// Placements of all bodies.
pub(crate) fn kinematics(model: &Model, ws: &mut Memory, q: &Configuration) {
    sines(&mut ws.sines, q);
    ws.origin = q.base.translation;
    place(model, &ws.sines, &mut ws.motion, &q.base.rotation, q);
}

/// Placements and axes of all bodies, measured from O, in the axes in which the base has this rotation: the world's, or the
/// base's own (identity) where only quantities in base axes are wanted.
pub(crate) fn place(
    model: &Model,
    sines: &[(f64, f64)],
    motions: &mut [BodyMotion],
    base_rotation: &Mat3,
    q: &Configuration,
) {
    motions[0].placement = Transform { rotation: *base_rotation, translation: Vec3::zeros() };
    for (i, body) in model.bodies.iter().enumerate().skip(1) {
        let parent = &motions[body.parent].placement;
        let rotation = product(&parent.rotation, &body.placement.rotation);
        let translation = rotate_add(&parent.rotation, &body.placement.translation, &parent.translation);
        let axis = Vec3::new(rotation.m13, rotation.m23, rotation.m33);
        let motion = &mut motions[i];
        match body.motion {
            JointMotion::Revolute => {
                motion.placement = Transform { rotation: turned_about_z(&rotation, sines[i - 1]), translation };
                motion.s = Twist { linear: cross(&translation, &axis), angular: axis };
            }
            JointMotion::Prismatic => {
                let translation = scale_add(&axis, q.joints[i - 1], &translation);
                motion.placement = Transform { rotation, translation };
                motion.s = Twist { linear: axis, angular: Vec3::zeros() };
            }
        }
    }
}

/// `(sin q, cos q)` of every joint, four at a time.
pub(crate) fn sines(sines: &mut [(f64, f64)], q: &Configuration) {
    assert_eq!(q.joints.len(), sines.len(), "joint positions");
    let mut four = [0.0; 4];
    for (sines, angles) in sines.chunks_mut(4).zip(q.joints.as_slice().chunks(4)) {
        four[..angles.len()].copy_from_slice(angles);
        if four.iter().all(|angle| angle.abs() < VECTORISED_MAX_RAD) {
            let (sin, cos) = f64x4::from(four).sin_cos();
            let (sin, cos) = (sin.to_array(), cos.to_array());
            sines.iter_mut().enumerate().for_each(|(k, pair)| *pair = (sin[k], cos[k]));
        } else {
            sines.iter_mut().zip(angles).for_each(|(pair, angle)| *pair = angle.sin_cos());
        }
    }
}

/// Placements and velocities of all bodies.
pub(crate) fn kinematics_velocity(model: &Model, ws: &mut Memory, q: &Configuration, v: &DVector<f64>) {
    assert_eq!(v.len(), model.tree_dofs(), "velocities");
    kinematics(model, ws, q);
    ws.motion[0].v = base_motion(model, ws, v);
    let rates = &v.as_slice()[model.base_dofs()..];
    for (i, body) in model.bodies.iter().enumerate().skip(1) {
        let parent = ws.motion[body.parent].v;
        let motion = &mut ws.motion[i];
        motion.v = scaled_add(&motion.s, rates[i - 1], &parent);
    }
}

/// Spatial accelerations of all bodies when `vd = 0`, the base's given, after [`kinematics_velocity`].
pub(crate) fn bias_accelerations(model: &Model, ws: &mut Memory, v: &DVector<f64>, base: Twist) {
    ws.motion[0].a = base;
    let rates = &v.as_slice()[model.base_dofs()..];
    for (i, body) in model.bodies.iter().enumerate().skip(1) {
        let parent = ws.motion[body.parent].a;
        let motion = &mut ws.motion[i];
        motion.a = scaled_add(&cross_motion(&motion.v, &motion.s), rates[i - 1], &parent);
    }
}

/// The base's twist in world axes from the first six entries of `v`.
pub(crate) fn base_motion(model: &Model, ws: &Memory, v: &DVector<f64>) -> Twist {
    match model.base() {
        Base::Fixed => Twist::zero(),
        Base::Floating => {
            let R_WB = &ws.motion[0].placement.rotation;
            Twist {
                linear: rotate(R_WB, &Vec3::new(v[0], v[1], v[2])),
                angular: rotate(R_WB, &Vec3::new(v[3], v[4], v[5])),
            }
        }
    }
}

/// Centre of mass `p_WG` (m) after [`kinematics`].
pub(crate) fn center_of_mass(model: &Model, ws: &Memory) -> Vec3 {
    let first_moment: Vec3 = model
        .bodies
        .iter()
        .zip(&ws.motion)
        .map(|(body, motion)| body.inertia.mass_kg * motion.placement.point(&body.inertia.com))
        .sum();
    ws.origin + first_moment * model.per_mass()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ModelOptions;

    #[test]
    fn vectorised_sines_are_those_of_the_standard_library() {
        let joints: String = (0..7)
            .map(|i| {
                format!(
                    r#"<link name="l{n}"/><joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{n}"/></joint>"#,
                    n = i + 1
                )
            })
            .collect();
        let text = format!(
            r#"<robot name="chain"><link name="l0"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0"
               ixz="0" iyz="0"/></inertial></link>{joints}</robot>"#
        );
        let model = Model::from_urdf(&text, &ModelOptions::default()).unwrap();
        let mut ws = Memory::new(&model);
        let mut q = model.neutral();
        for k in 0..40_000 {
            let scale = [1e-9, 1.0, 7.0, 900.0, 1.1e3, 1e9, 1e15][k % 7];
            q.joints.iter_mut().enumerate().for_each(|(j, angle)| *angle = scale * ((k * 7 + j) as f64 * 0.618).sin());
            sines(&mut ws.sines, &q);
            for (pair, angle) in ws.sines.iter().zip(q.joints.iter()) {
                let (sin, cos) = angle.sin_cos();
                // One unit in the last place of 1.
                let error = (pair.0 - sin).abs().max((pair.1 - cos).abs());
                assert!(error <= f64::EPSILON, "{angle}: {error:e}");
            }
        }
    }
}
