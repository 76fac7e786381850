//! All that a whole-body controller needs, in one pass.

use super::crba::{in_base_axes, write_mass_matrix};
use super::jacobian::classical;
use super::kinematics::{bias_accelerations, kinematics_velocity};
use super::memory::Memory;
use crate::model::{Base, Configuration, FrameIndex, Model};
use crate::rigid::{RigidInertia, cross, cross_force, power, scale_add};
use nalgebra::{DMatrix, DVector};
use spatial::{Mat3, Transform, Twist, Vec3, Vec6, Wrench, so3};

/// A frame's part of [`WholeBodyTerms`].
#[derive(Debug, Clone, PartialEq)]
pub struct FrameTerms {
    /// Which frame.
    pub frame: FrameIndex,
    /// `X_WF`.
    pub placement: Transform,
    /// Velocity of the frame's origin and angular velocity, world axes.
    pub velocity: Twist,
    /// 6 x nv, at the frame's origin, world axes, linear first.
    pub jacobian: DMatrix<f64>,
    /// `Jdot v`: acceleration when `vd = 0`.
    pub drift: Vec6,
}

/// Result of [`whole_body_terms`](crate::whole_body_terms). Entries that are zero for every configuration (a leg's joints do not move the other
/// leg) are set once, here, and never written again.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeBodyTerms {
    /// `M`, nv x nv.
    pub mass_matrix: DMatrix<f64>,
    /// `h`, nv: Coriolis, centrifugal and gravity forces.
    pub bias: DVector<f64>,
    /// In the order they were asked for.
    pub frames: Vec<FrameTerms>,
    /// `p_WG` (m).
    pub com: Vec3,
    /// Velocity of the centre of mass (m/s).
    pub com_velocity: Vec3,
    /// 3 x nv.
    pub com_jacobian: DMatrix<f64>,
    /// Acceleration of the centre of mass when `vd = 0` (m/s^2).
    pub com_drift: Vec3,
    /// `Ag`, 6 x nv: momentum about the centre of mass per unit of `v`, world axes, linear first.
    pub centroidal_matrix: DMatrix<f64>,
    /// `Ag v`.
    pub momentum: Vec6,
    /// Rate of the momentum when `vd = 0`.
    pub centroidal_drift: Vec6,
}

impl WholeBodyTerms {
    /// Memory for a model and the frames that the controller uses.
    #[must_use]
    pub fn new(model: &Model, frames: &[FrameIndex]) -> Self {
        Self::with_columns(model.nv(), frames)
    }

    pub(crate) fn with_columns(nv: usize, frames: &[FrameIndex]) -> Self {
        let frame = |frame: &FrameIndex| FrameTerms {
            frame: *frame,
            placement: Transform::identity(),
            velocity: Twist::zero(),
            jacobian: DMatrix::zeros(6, nv),
            drift: Vec6::zeros(),
        };
        Self {
            mass_matrix: DMatrix::zeros(nv, nv),
            bias: DVector::zeros(nv),
            frames: frames.iter().map(frame).collect(),
            com: Vec3::zeros(),
            com_velocity: Vec3::zeros(),
            com_jacobian: DMatrix::zeros(3, nv),
            com_drift: Vec3::zeros(),
            centroidal_matrix: DMatrix::zeros(6, nv),
            momentum: Vec6::zeros(),
            centroidal_drift: Vec6::zeros(),
        }
    }
}

/// All but the frames, in the coordinates of the tree.
pub(crate) fn terms(model: &Model, ws: &mut Memory, q: &Configuration, v: &DVector<f64>, out: &mut WholeBodyTerms) {
    kinematics_velocity(model, ws, q, v);
    bias_accelerations(model, ws, v, against_gravity(model));
    for (body, ((motion, inertia), force)) in
        model.bodies.iter().zip(ws.motion.iter().zip(&mut ws.inertia).zip(&mut ws.force))
    {
        *inertia = RigidInertia::of(&body.inertia, &motion.placement);
        let turning = cross_force(&motion.v, &inertia.apply(&motion.v));
        let pushing = inertia.apply(&motion.a);
        *force = Wrench { force: pushing.force + turning.force, moment: pushing.moment + turning.moment };
    }
    // One sweep towards the base: what is below a joint is done when the joint is reached.
    let base_dofs = model.base_dofs();
    for (i, body) in model.bodies.iter().enumerate().skip(1).rev() {
        let (inertia, force) = (ws.inertia[i], ws.force[i]);
        out.bias[base_dofs + i - 1] = power(&ws.motion[i].s, &force);
        ws.inertia[body.parent].add(&inertia);
        let parent = &mut ws.force[body.parent];
        parent.force += force.force;
        parent.moment += force.moment;
    }
    let R_WB = ws.motion[0].placement.rotation;
    write_mass_matrix(model, &ws.motion, &ws.inertia, &mut ws.axis_force, Some(&R_WB), &mut out.mass_matrix);
    centroidal(model, ws, v, out);
}

/// All of a frame but its Jacobian, after [`terms`].
pub(crate) fn frame_terms(model: &Model, ws: &Memory, terms: &mut FrameTerms) {
    let motion = &ws.motion[model.frames()[terms.frame.0].body];
    let p_OF = ws.frame_position(model, terms.frame);
    terms.placement = ws.placement(model, terms.frame);
    terms.velocity = motion.v.at(&p_OF);
    let a = Twist { linear: motion.a.linear + model.gravity(), angular: motion.a.angular };
    terms.drift = classical(&a, &motion.v, &p_OF).to_vector();
}

/// Centre of mass and momentum from composite inertias, axis forces and summed forces.
fn centroidal(model: &Model, ws: &Memory, v: &DVector<f64>, out: &mut WholeBodyTerms) {
    let total = &ws.inertia[0];
    let R_WB = ws.motion[0].placement.rotation;
    let per_mass = model.per_mass();
    let p_OG = total.first_moment * per_mass;
    let base_dofs = model.base_dofs();
    let mut momentum = total.apply(&ws.motion[0].v);
    let (ag, jcom) = (out.centroidal_matrix.as_mut_slice(), out.com_jacobian.as_mut_slice());
    for i in 1..model.bodies.len() {
        let f = &ws.axis_force[i];
        let moment = f.moment - cross(&p_OG, &f.force);
        let column = base_dofs + i - 1;
        ag[6 * column..6 * column + 3].copy_from_slice(f.force.as_slice());
        ag[6 * column + 3..6 * column + 6].copy_from_slice(moment.as_slice());
        jcom[3 * column..3 * column + 3].copy_from_slice((f.force * per_mass).as_slice());
        momentum.force = scale_add(&f.force, v[column], &momentum.force);
        momentum.moment = scale_add(&f.moment, v[column], &momentum.moment);
    }
    if model.base() == Base::Floating {
        let lever = -so3::skew(&p_OG) * R_WB;
        let k = so3::skew(&p_OG);
        let about_com: Mat3 = total.about_origin.full() + total.mass * (k * k);
        out.com_jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&R_WB);
        out.com_jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
        out.centroidal_matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&(total.mass * R_WB));
        out.centroidal_matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&(total.mass * lever));
        out.centroidal_matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&(about_com * R_WB));
        let base = in_base_axes(Some(&R_WB), &ws.force[0]);
        out.bias.fixed_rows_mut::<6>(0).copy_from(&base.to_vector());
    }
    let momentum = momentum.about(&p_OG);
    let weight = total.mass * model.gravity();
    out.com = ws.origin + p_OG;
    out.com_velocity = momentum.force * per_mass;
    out.momentum = momentum.to_vector();
    // The summed forces hold the robot against gravity, whose moment about G is zero.
    let rate = ws.force[0].about(&p_OG);
    out.centroidal_drift = Wrench { force: rate.force + weight, moment: rate.moment }.to_vector();
    out.com_drift = (rate.force + weight) * per_mass;
}

/// Gravity is a base that accelerates upwards.
pub(crate) fn against_gravity(model: &Model) -> Twist {
    Twist { linear: -model.gravity(), angular: Vec3::zeros() }
}
