//! All that a whole-body controller needs, in one pass.

use crate::crba::{composite_inertias, mass_matrix};
use crate::jacobian::{classical, write_jacobian};
use crate::kinematics::accelerations;
use crate::rnea::{against_gravity, body_forces};
use crate::{Base, Configuration, FrameIndex, Model, Workspace, forward_kinematics_velocity};
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

/// Result of [`whole_body_terms`]. Entries that are zero for every configuration (a leg's joints do not move the other
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
        let nv = model.nv();
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

/// Fills `out` for a configuration and velocity.
pub fn whole_body_terms(
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
    out: &mut WholeBodyTerms,
) {
    forward_kinematics_velocity(model, ws, q, v);
    accelerations(model, ws, v, None, against_gravity(model));
    body_forces(model, ws);
    composite_inertias(model, ws);
    mass_matrix(model, ws, &mut out.mass_matrix);
    let base_dofs = model.base_dofs();
    for i in (1..model.bodies.len()).rev() {
        out.bias[base_dofs + i - 1] = ws.motion[i].s.power(&ws.force[i]);
        let parent = model.bodies[i].parent;
        ws.force[parent] = ws.force[parent] + ws.force[i];
    }
    centroidal(model, ws, v, out);
    for terms in &mut out.frames {
        let motion = &ws.motion[model.frames()[terms.frame.0].body];
        let p_OF = ws.frame_position(model, terms.frame);
        terms.placement = ws.placement(model, terms.frame);
        terms.velocity = motion.v.at(&p_OF);
        let a = Twist { linear: motion.a.linear + model.gravity(), angular: motion.a.angular };
        terms.drift = classical(&a, &motion.v, &p_OF).to_vector();
        write_jacobian(model, ws, terms.frame, &mut terms.jacobian);
    }
}

/// Centre of mass and momentum from composite inertias, axis forces and summed forces.
fn centroidal(model: &Model, ws: &Workspace, v: &DVector<f64>, out: &mut WholeBodyTerms) {
    let total = &ws.inertia[0];
    let R_WB = ws.motion[0].placement.rotation;
    let per_mass = model.per_mass();
    let p_OG = total.first_moment * per_mass;
    let base_dofs = model.base_dofs();
    let mut momentum = total.apply(&ws.motion[0].v);
    for i in 1..model.bodies.len() {
        let f = &ws.axis_force[i];
        let about_com = f.about(&p_OG);
        let column = base_dofs + i - 1;
        out.centroidal_matrix.fixed_view_mut::<3, 1>(0, column).copy_from(&about_com.force);
        out.centroidal_matrix.fixed_view_mut::<3, 1>(3, column).copy_from(&about_com.moment);
        out.com_jacobian.fixed_view_mut::<3, 1>(0, column).copy_from(&(about_com.force * per_mass));
        momentum = momentum + Wrench { force: f.force * v[column], moment: f.moment * v[column] };
    }
    if model.base() == Base::Floating {
        let lever = -so3::skew(&p_OG) * R_WB;
        let k = so3::skew(&p_OG);
        let about_com: Mat3 = total.about_origin + total.mass * (k * k);
        out.com_jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&R_WB);
        out.com_jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
        out.centroidal_matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&(total.mass * R_WB));
        out.centroidal_matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&(total.mass * lever));
        out.centroidal_matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&(about_com * R_WB));
        let base = Wrench { force: R_WB.tr_mul(&ws.force[0].force), moment: R_WB.tr_mul(&ws.force[0].moment) };
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
