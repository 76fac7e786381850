//! Where a robot's frames are, and how they move: what forward kinematics returns.

use crate::model::{FrameIndex, Model};
use crate::tree;
use crate::workspace::Workspace;
use nalgebra::{DMatrix, DVector};
use spatial::{Transform, Twist, Vec3, Vec6};

/// A robot in one configuration. It borrows the workspace, so it cannot outlive what was computed there.
#[derive(Debug)]
pub struct Placed<'a> {
    model: &'a Model,
    ws: &'a mut Workspace,
}

impl<'a> Placed<'a> {
    /// After the kinematics of one configuration.
    pub(crate) fn new(model: &'a Model, ws: &'a mut Workspace) -> Self {
        Self { model, ws }
    }

    /// `X_WF` of a frame.
    #[must_use]
    pub fn pose(&self, frame: FrameIndex) -> Transform {
        self.ws.tree.placement(self.model, frame)
    }

    /// Centre of mass `p_WG` (m).
    #[must_use]
    pub fn center_of_mass(&self) -> Vec3 {
        tree::kinematics::center_of_mass(self.model, &self.ws.tree)
    }

    /// `out = J` (6 x nv): `[velocity of the frame's origin; angular velocity] = J v`, world axes.
    pub fn jacobian(&mut self, frame: FrameIndex, out: &mut DMatrix<f64>) {
        match self.ws.parts(self.model) {
            (tree, None) => tree::jacobian::jacobian(self.model, tree, frame, out),
            (tree, Some(mut coupled)) => coupled.jacobian(tree, frame, out),
        }
    }

    /// `out = Jcom` (3 x nv): `velocity of the centre of mass = Jcom v`, world axes.
    pub fn com_jacobian(&mut self, out: &mut DMatrix<f64>) {
        match self.ws.parts(self.model) {
            (tree, None) => tree::jacobian::com_jacobian(self.model, tree, out),
            (tree, Some(mut coupled)) => coupled.com_jacobian(tree, out),
        }
    }
}

/// A robot in one configuration and at one velocity.
#[derive(Debug)]
pub struct Moving<'a> {
    placed: Placed<'a>,
    v: &'a DVector<f64>,
}

impl<'a> Moving<'a> {
    /// After the kinematics of one configuration and velocity.
    pub(crate) fn new(model: &'a Model, ws: &'a mut Workspace, v: &'a DVector<f64>) -> Self {
        Self { placed: Placed::new(model, ws), v }
    }

    /// Velocity of a frame's origin and its angular velocity, world axes.
    #[must_use]
    pub fn velocity(&self, frame: FrameIndex) -> Twist {
        self.placed.ws.tree.velocity(self.placed.model, frame)
    }

    /// `Jdot v`: acceleration of a frame's origin and its angular acceleration when `vd = 0`, world axes.
    #[must_use]
    pub fn drift(&self, frame: FrameIndex) -> Vec6 {
        let Placed { model, ws } = &self.placed;
        let v = self.v;
        match &model.coupling {
            None => tree::jacobian::drift(model, &ws.tree, frame, |body| v[model.base_dofs() + body - 1]),
            Some(coupling) => tree::jacobian::drift(model, &ws.tree, frame, |body| {
                let law = coupling.law(body);
                law.multiplier * v[law.column]
            }),
        }
    }
}

/// What moves is somewhere.
impl<'a> std::ops::Deref for Moving<'a> {
    type Target = Placed<'a>;

    fn deref(&self) -> &Placed<'a> {
        &self.placed
    }
}

impl std::ops::DerefMut for Moving<'_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.placed
    }
}
