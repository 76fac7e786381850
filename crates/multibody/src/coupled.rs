//! The algorithms where joints follow others: spread over the tree, run there, collect.

use crate::mass_factor::MassFactor;
use crate::model::{Configuration, Coupling, FrameIndex, Model};
use crate::tree::whole_body::{WholeBodyTerms, frame_terms};
use crate::tree::{self, memory};
use nalgebra::{DMatrix, DVector};
use spatial::Wrench;

/// Memory for the tree's coordinates, and for the forward dynamics that go through M.
#[derive(Debug, Clone)]
pub(crate) struct Memory {
    pub q: Configuration,
    pub v: DVector<f64>,
    pub a: DVector<f64>,
    pub terms: WholeBodyTerms,
    pub jacobian: DMatrix<f64>,
    /// In the robot's coordinates, from here on.
    pub mass_matrix: DMatrix<f64>,
    pub factor: MassFactor,
    pub residual: DVector<f64>,
}

impl Memory {
    pub fn new(model: &Model) -> Self {
        let (nv, tree) = (model.nv(), model.tree_dofs());
        Self {
            q: Configuration { joints: DVector::zeros(tree - model.base_dofs()), ..model.neutral() },
            v: DVector::zeros(tree),
            a: DVector::zeros(tree),
            terms: WholeBodyTerms::with_columns(tree, &[]),
            jacobian: DMatrix::zeros(6, tree),
            mass_matrix: DMatrix::zeros(nv, nv),
            factor: MassFactor::new(model),
            residual: DVector::zeros(nv),
        }
    }
}

/// A robot whose joints follow others, and the memory for it. `tree` is the memory of the recursions.
pub(crate) struct Coupled<'a> {
    pub model: &'a Model,
    pub coupling: &'a Coupling,
    pub memory: &'a mut Memory,
}

/// Generalised forces on a moving robot, and wrenches about the origins of frames in world axes.
pub(crate) struct Acting<'a> {
    pub q: &'a Configuration,
    pub v: &'a DVector<f64>,
    pub external: &'a [(FrameIndex, Wrench)],
}

impl Coupled<'_> {
    fn spread_state(&mut self, q: &Configuration, v: &DVector<f64>) {
        self.coupling.spread_configuration(q, &mut self.memory.q);
        self.coupling.spread(v, &mut self.memory.v);
    }

    pub fn kinematics(&mut self, tree: &mut memory::Memory, q: &Configuration) {
        self.coupling.spread_configuration(q, &mut self.memory.q);
        tree::kinematics::kinematics(self.model, tree, &self.memory.q);
    }

    pub fn kinematics_velocity(&mut self, tree: &mut memory::Memory, q: &Configuration, v: &DVector<f64>) {
        self.spread_state(q, v);
        tree::kinematics::kinematics_velocity(self.model, tree, &self.memory.q, &self.memory.v);
    }

    pub fn inverse_dynamics(
        &mut self,
        tree: &mut memory::Memory,
        acting: &Acting<'_>,
        a: &DVector<f64>,
        out: &mut DVector<f64>,
    ) {
        self.spread_state(acting.q, acting.v);
        let Memory { q, v, a: a_tree, terms, .. } = &mut *self.memory;
        self.coupling.spread(a, a_tree);
        tree::rnea::inverse_dynamics(self.model, tree, q, v, a_tree, acting.external, &mut terms.bias);
        self.coupling.collect(&terms.bias, out);
    }

    pub fn bias_forces(
        &mut self,
        tree: &mut memory::Memory,
        q: &Configuration,
        v: &DVector<f64>,
        out: &mut DVector<f64>,
    ) {
        self.spread_state(q, v);
        let Memory { q, v, terms, .. } = &mut *self.memory;
        tree::rnea::bias_forces(self.model, tree, q, v, &mut terms.bias);
        self.coupling.collect(&terms.bias, out);
    }

    pub fn gravity_forces(&mut self, tree: &mut memory::Memory, q: &Configuration, out: &mut DVector<f64>) {
        self.coupling.spread_configuration(q, &mut self.memory.q);
        let Memory { q, terms, .. } = &mut *self.memory;
        tree::rnea::gravity_forces(self.model, tree, q, &mut terms.bias);
        self.coupling.collect(&terms.bias, out);
    }

    pub fn mass_matrix(&mut self, tree: &mut memory::Memory, q: &Configuration, out: &mut DMatrix<f64>) {
        self.coupling.spread_configuration(q, &mut self.memory.q);
        let Memory { q, terms, .. } = &mut *self.memory;
        tree::crba::mass_matrix(self.model, tree, q, &mut terms.mass_matrix);
        self.coupling.collect_both(&self.model.bodies, &terms.mass_matrix, out);
    }

    /// Solves `M vd = tau + J' F - h` through M's factor; NaN where M is not positive definite.
    ///
    /// The articulated-body algorithm frees one joint after the other, which coupled ones are not. It needs a tree whose
    /// own M is regular, while links between coupled joints are often massless. M in axes of the base is the poorer
    /// start: a light finger's share is what is left of the whole arm's. Hence the solution is improved once with the
    /// residual of the inverse dynamics, which lose nothing.
    pub fn forward_dynamics(
        &mut self,
        tree: &mut memory::Memory,
        acting: &Acting<'_>,
        tau: &DVector<f64>,
        out: &mut DVector<f64>,
    ) {
        let (model, coupling) = (self.model, self.coupling);
        assert_eq!((tau.len(), out.len()), (model.nv(), model.nv()), "generalised forces and accelerations");
        self.spread_state(acting.q, acting.v);
        let Memory { q, v, a, terms, mass_matrix, factor, residual, .. } = &mut *self.memory;
        tree::crba::mass_matrix(model, tree, q, &mut terms.mass_matrix);
        coupling.collect_both(&model.bodies, &terms.mass_matrix, mass_matrix);
        if factor.factor(mass_matrix).is_err() {
            out.fill(f64::NAN);
            return;
        }
        out.as_mut_slice().fill(0.0);
        for _ in 0..2 {
            coupling.spread(out, a);
            tree::rnea::inverse_dynamics(model, tree, q, v, a, acting.external, &mut terms.bias);
            coupling.collect(&terms.bias, residual);
            residual.zip_apply(tau, |found, wanted| *found = wanted - *found);
            factor.solve(residual);
            *out += &*residual;
        }
    }

    pub fn jacobian(&mut self, tree: &memory::Memory, frame: FrameIndex, out: &mut DMatrix<f64>) {
        tree::jacobian::jacobian(self.model, tree, frame, &mut self.memory.jacobian);
        self.coupling.collect_columns(&self.memory.jacobian, out);
    }

    pub fn com_jacobian(&mut self, tree: &mut memory::Memory, out: &mut DMatrix<f64>) {
        tree::jacobian::com_jacobian(self.model, tree, &mut self.memory.terms.com_jacobian);
        self.coupling.collect_columns(&self.memory.terms.com_jacobian, out);
    }

    pub fn whole_body_terms(
        &mut self,
        tree: &mut memory::Memory,
        q: &Configuration,
        v: &DVector<f64>,
        out: &mut WholeBodyTerms,
    ) {
        self.spread_state(q, v);
        let (model, coupling) = (self.model, self.coupling);
        let Memory { q, v, terms, jacobian, .. } = &mut *self.memory;
        tree::whole_body::terms(model, tree, q, v, terms);
        coupling.collect_both(&model.bodies, &terms.mass_matrix, &mut out.mass_matrix);
        coupling.collect(&terms.bias, &mut out.bias);
        coupling.collect_columns(&terms.com_jacobian, &mut out.com_jacobian);
        coupling.collect_columns(&terms.centroidal_matrix, &mut out.centroidal_matrix);
        (out.com, out.com_velocity, out.com_drift) = (terms.com, terms.com_velocity, terms.com_drift);
        (out.momentum, out.centroidal_drift) = (terms.momentum, terms.centroidal_drift);
        for frame in &mut out.frames {
            frame_terms(model, tree, frame);
            tree::jacobian::jacobian(model, tree, frame.frame, jacobian);
            coupling.collect_columns(jacobian, &mut frame.jacobian);
        }
    }
}
