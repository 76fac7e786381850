//! The algorithms where joints follow others: spread over the tree, run there, collect.

use super::{Coupling, TreeMemory};
use crate::crba::tree_mass_matrix;
use crate::jacobian::{tree_com_jacobian, tree_jacobian};
use crate::kinematics::{tree_kinematics, tree_kinematics_velocity};
use crate::rnea::{tree_bias_forces, tree_forces, tree_gravity_forces};
use crate::whole_body::{frame_terms, tree_terms};
use crate::{Configuration, FrameIndex, Model, WholeBodyTerms, Workspace};
use nalgebra::{DMatrix, DVector};
use spatial::Wrench;

fn with_tree(ws: &mut Workspace, work: impl FnOnce(&mut Workspace, &mut TreeMemory)) {
    // Lent out, because the recursions take the whole workspace; moving a box allocates nothing.
    let mut tree = ws.tree.take().expect("a workspace is used with the model that it was made for");
    work(ws, &mut tree);
    ws.tree = Some(tree);
}

pub(crate) fn kinematics(coupling: &Coupling, model: &Model, ws: &mut Workspace, q: &Configuration) {
    with_tree(ws, |ws, tree| {
        coupling.spread_configuration(q, &mut tree.q);
        tree_kinematics(model, ws, &tree.q);
    });
}

pub(crate) fn kinematics_velocity(
    coupling: &Coupling,
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
) {
    with_tree(ws, |ws, tree| {
        coupling.spread_state(q, v, tree);
        tree_kinematics_velocity(model, ws, &tree.q, &tree.v);
    });
}

#[allow(clippy::too_many_arguments)] // those of the public function
pub(crate) fn inverse_dynamics(
    coupling: &Coupling,
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
    a: &DVector<f64>,
    external: &[(FrameIndex, Wrench)],
    out: &mut DVector<f64>,
) {
    with_tree(ws, |ws, tree| {
        coupling.spread_state(q, v, tree);
        coupling.spread(a, &mut tree.a);
        tree_forces(model, ws, &tree.q, &tree.v, &tree.a, external, &mut tree.terms.bias);
        coupling.collect(&tree.terms.bias, out);
    });
}

pub(crate) fn bias_forces(
    coupling: &Coupling,
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
    out: &mut DVector<f64>,
) {
    with_tree(ws, |ws, tree| {
        coupling.spread_state(q, v, tree);
        tree_bias_forces(model, ws, &tree.q, &tree.v, &mut tree.terms.bias);
        coupling.collect(&tree.terms.bias, out);
    });
}

pub(crate) fn gravity_forces(
    coupling: &Coupling,
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    out: &mut DVector<f64>,
) {
    with_tree(ws, |ws, tree| {
        coupling.spread_configuration(q, &mut tree.q);
        tree_gravity_forces(model, ws, &tree.q, &mut tree.terms.bias);
        coupling.collect(&tree.terms.bias, out);
    });
}

pub(crate) fn mass_matrix(
    coupling: &Coupling,
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    out: &mut DMatrix<f64>,
) {
    with_tree(ws, |ws, tree| {
        coupling.spread_configuration(q, &mut tree.q);
        tree_mass_matrix(model, ws, &tree.q, &mut tree.terms.mass_matrix);
        coupling.collect_both(model, &tree.terms.mass_matrix, out);
    });
}

/// Solves `M vd = tau + J' F - h` through M's factor; NaN where M is not positive definite.
///
/// The articulated-body algorithm frees one joint after the other, which coupled ones are not, and it needs a tree whose own
/// M is regular, while links between coupled joints are often massless. M in axes of the base is the poorer start: a light
/// finger's share is what is left of the whole arm's. Hence the solution is improved once with the residual of the inverse
/// dynamics, which lose nothing.
#[allow(clippy::too_many_arguments)] // those of the public function
pub(crate) fn forward_dynamics(
    coupling: &Coupling,
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
    tau: &DVector<f64>,
    external: &[(FrameIndex, Wrench)],
    out: &mut DVector<f64>,
) {
    assert_eq!((tau.len(), out.len()), (model.nv(), model.nv()), "generalised forces and accelerations");
    with_tree(ws, |ws, tree| {
        coupling.spread_state(q, v, tree);
        tree_mass_matrix(model, ws, &tree.q, &mut tree.terms.mass_matrix);
        coupling.collect_both(model, &tree.terms.mass_matrix, &mut tree.mass_matrix);
        if tree.factor.factor(&tree.mass_matrix).is_err() {
            out.fill(f64::NAN);
            return;
        }
        out.as_mut_slice().fill(0.0);
        for _ in 0..2 {
            coupling.spread(out, &mut tree.a);
            tree_forces(model, ws, &tree.q, &tree.v, &tree.a, external, &mut tree.terms.bias);
            coupling.collect(&tree.terms.bias, &mut tree.residual);
            tree.residual.zip_apply(tau, |found, wanted| *found = wanted - *found);
            tree.factor.solve(&mut tree.residual);
            *out += &tree.residual;
        }
    });
}

pub(crate) fn jacobian(
    coupling: &Coupling,
    model: &Model,
    ws: &mut Workspace,
    frame: FrameIndex,
    out: &mut DMatrix<f64>,
) {
    with_tree(ws, |ws, tree| {
        tree_jacobian(model, ws, frame, &mut tree.jacobian);
        coupling.collect_columns(&tree.jacobian, out);
    });
}

pub(crate) fn com_jacobian(coupling: &Coupling, model: &Model, ws: &mut Workspace, out: &mut DMatrix<f64>) {
    with_tree(ws, |ws, tree| {
        tree_com_jacobian(model, ws, &mut tree.terms.com_jacobian);
        coupling.collect_columns(&tree.terms.com_jacobian, out);
    });
}

pub(crate) fn whole_body_terms(
    coupling: &Coupling,
    model: &Model,
    ws: &mut Workspace,
    q: &Configuration,
    v: &DVector<f64>,
    out: &mut WholeBodyTerms,
) {
    with_tree(ws, |ws, tree| {
        coupling.spread_state(q, v, tree);
        let TreeMemory { q, v, terms, jacobian, .. } = tree;
        tree_terms(model, ws, q, v, terms);
        coupling.collect_both(model, &terms.mass_matrix, &mut out.mass_matrix);
        coupling.collect(&terms.bias, &mut out.bias);
        coupling.collect_columns(&terms.com_jacobian, &mut out.com_jacobian);
        coupling.collect_columns(&terms.centroidal_matrix, &mut out.centroidal_matrix);
        (out.com, out.com_velocity, out.com_drift) = (terms.com, terms.com_velocity, terms.com_drift);
        (out.momentum, out.centroidal_drift) = (terms.momentum, terms.centroidal_drift);
        for frame in &mut out.frames {
            frame_terms(model, ws, frame);
            tree_jacobian(model, ws, frame.frame, jacobian);
            coupling.collect_columns(jacobian, &mut frame.jacobian);
        }
    });
}
