//! The public algorithms. Each asks once whether joints follow others: then it spreads over the tree and collects.

use crate::coupled::Acting;
use crate::model::{Configuration, FrameIndex, Model};
use crate::placed::{Moving, Placed};
use crate::tree;
use crate::tree::whole_body::{WholeBodyTerms, frame_terms};
use crate::workspace::Workspace;
use nalgebra::{DMatrix, DVector};
use spatial::Wrench;

/// Placements of all frames.
#[must_use = "what is placed is in what is returned"]
pub fn forward_kinematics<'a>(model: &'a Model, ws: &'a mut Workspace, q: &Configuration) -> Placed<'a> {
    match ws.parts(model) {
        (tree, None) => tree::kinematics::kinematics(model, tree, q),
        (tree, Some(mut coupled)) => coupled.kinematics(tree, q),
    }
    Placed::new(model, ws)
}

/// Placements and velocities of all frames.
#[must_use = "what is placed is in what is returned"]
pub fn forward_kinematics_velocity<'a>(
    model: &'a Model,
    ws: &'a mut Workspace,
    q: &Configuration,
    v: &'a DVector<f64>,
) -> Moving<'a> {
    match ws.parts(model) {
        (tree, None) => tree::kinematics::kinematics_velocity(model, tree, q, v),
        (tree, Some(mut coupled)) => coupled.kinematics_velocity(tree, q, v),
    }
    Moving::new(model, ws, v)
}

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
    match ws.parts(model) {
        (tree, None) => tree::rnea::inverse_dynamics(model, tree, q, v, a, external, out),
        (tree, Some(mut coupled)) => coupled.inverse_dynamics(tree, &Acting { q, v, external }, a, out),
    }
}

/// `out = h(q, v)`: Coriolis, centrifugal and gravity forces.
pub fn bias_forces(model: &Model, ws: &mut Workspace, q: &Configuration, v: &DVector<f64>, out: &mut DVector<f64>) {
    match ws.parts(model) {
        (tree, None) => tree::rnea::bias_forces(model, tree, q, v, out),
        (tree, Some(mut coupled)) => coupled.bias_forces(tree, q, v, out),
    }
}

/// `out = h(q, 0)`: what holds the robot still.
pub fn gravity_forces(model: &Model, ws: &mut Workspace, q: &Configuration, out: &mut DVector<f64>) {
    match ws.parts(model) {
        (tree, None) => tree::rnea::gravity_forces(model, tree, q, out),
        (tree, Some(mut coupled)) => coupled.gravity_forces(tree, q, out),
    }
}

/// `out = M(q)^-1 (tau - h(q, v))`: the accelerations that generalised forces cause.
///
/// Every movable joint must carry mass or have a rotor inertia ([`Model::massless_joint`] is `None`); where it does not,
/// its acceleration is not defined. Where M is nearly singular digits are lost; [`aba_refined`](crate::aba_refined) tells
/// how many. Robots with [followers](Model::followers) go through M instead; if that is not positive definite, all is NaN.
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
    match ws.parts(model) {
        (tree, None) => tree::aba::forward_dynamics(model, tree, q, v, tau, external, out),
        (tree, Some(mut coupled)) => coupled.forward_dynamics(tree, &Acting { q, v, external }, tau, out),
    }
}

/// `out = M(q)`, full and symmetric, nv x nv.
pub fn crba(model: &Model, ws: &mut Workspace, q: &Configuration, out: &mut DMatrix<f64>) {
    match ws.parts(model) {
        (tree, None) => tree::crba::mass_matrix(model, tree, q, out),
        (tree, Some(mut coupled)) => coupled.mass_matrix(tree, q, out),
    }
}

/// Fills `out` for a configuration and velocity: all that a whole-body controller needs, in one pass.
pub fn whole_body_terms<'a>(
    model: &'a Model,
    ws: &'a mut Workspace,
    q: &Configuration,
    v: &'a DVector<f64>,
    out: &mut WholeBodyTerms,
) -> Moving<'a> {
    match ws.parts(model) {
        (tree, None) => {
            tree::whole_body::terms(model, tree, q, v, out);
            for terms in &mut out.frames {
                frame_terms(model, tree, terms);
                tree::jacobian::write_jacobian(model, tree, terms.frame, &mut terms.jacobian);
            }
        }
        (tree, Some(mut coupled)) => coupled.whole_body_terms(tree, q, v, out),
    }
    Moving::new(model, ws, v)
}
