//! The paper's scheme, as the checked alternative: Newton on the pose (33) outside, Gauss-Seidel on the contact problem (30) inside.
//!
//! Written plainly, sharing nothing with the fast path but the model: the Delassus operator `W = H C_S H'` is formed in the world for
//! every pose, forces come from `friction::gauss_seidel` from the forces before, their derivative with the pose from the dense linear
//! system of the active contacts. The precision of the inner problem follows the outer residual, as in the paper.

use crate::{EulerOrder, Foothold, SoleModel, StanceReference};
use friction::{ContactProblem, ContactState, Settings, Workspace, gauss_seidel, newton};
use nalgebra::{DMatrix, DVector, Vector2};
use spatial::{Mat6, Transform, Vec3, Vec6, so3};
use std::sync::Arc;

/// Limits of the nested scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NestedSettings {
    /// Scaled residual of force and moments, as in [`crate::EstimatorSettings`].
    pub tolerance: f64,
    /// Outer iterations.
    pub iterations_max: usize,
    /// Sweeps per inner problem.
    pub sweeps_max: usize,
    /// The inner problem is solved to this fraction of the outer residual, and to the tolerance at least.
    pub inner_fraction: f64,
    /// See [`EulerOrder`].
    pub euler_order: EulerOrder,
}

impl Default for NestedSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            iterations_max: 40,
            sweeps_max: 2000,
            inner_fraction: 1e-2,
            euler_order: EulerOrder::default(),
        }
    }
}

/// Answer of a tick of the nested scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct NestedReport {
    /// Did the outer iteration meet the tolerance?
    pub converged: bool,
    /// Pose `X_WS`.
    pub sole_pose: Transform,
    /// World forces (N).
    pub node_forces: Vec<Vec3>,
    /// World positions (m).
    pub node_positions: Vec<Vec3>,
    /// Scaled residual.
    pub residual: f64,
    /// Outer iterations.
    pub iterations: usize,
    /// Sweeps of all inner problems.
    pub sweeps: usize,
}

/// One stance by the nested scheme. Allocates freely.
#[derive(Debug, Clone)]
pub struct NestedEstimator {
    model: Arc<SoleModel>,
    settings: NestedSettings,
    pose: Transform,
    foothold: Option<Foothold>,
    references: Vec<Vector2<f64>>,
    workspace: Workspace,
}

const MOMENT_ARM_M: f64 = 0.1;
const STEP_MAX_M: f64 = 0.010;
const STEP_MAX_RAD: f64 = 0.2;

impl NestedEstimator {
    /// At a foothold, before its first tick.
    #[must_use]
    pub fn touch_down(model: impl Into<Arc<SoleModel>>, settings: NestedSettings, foothold: Foothold) -> Self {
        let model = model.into();
        let n = model.contact_points().len();
        Self {
            settings,
            pose: Transform::new(so3::about_z(foothold.yaw_rad), Vec3::new(foothold.x_m, foothold.y_m, 0.0)),
            foothold: Some(foothold),
            references: vec![Vector2::zeros(); n],
            workspace: Workspace::new(n),
            model,
        }
    }

    /// Tangential references at a pose (28), (35).
    fn references_at(&self, pose: &Transform) -> Vec<Vector2<f64>> {
        let Some(foothold) = self.foothold else { return self.references.clone() };
        let r = self.settings.euler_order.with_yaw(&pose.rotation, foothold.yaw_rad);
        let origin = Vector2::new(foothold.x_m, foothold.y_m);
        self.model.contact_points().iter().map(|p| origin + (r * p).xy()).collect()
    }

    fn undeformed(&self, pose: &Transform) -> DVector<f64> {
        let references = self.references_at(pose);
        let mut free = DVector::zeros(3 * references.len());
        for (i, (p, q)) in self.model.contact_points().iter().zip(&references).enumerate() {
            let away = pose.point(p) - Vec3::new(q.x, q.y, 0.0);
            free.fixed_rows_mut::<3>(3 * i).copy_from(&away);
        }
        free
    }

    fn delassus(&self, pose: &Transform) -> DMatrix<f64> {
        let n = self.model.contact_points().len();
        let c = self.model.compliance();
        let r = &pose.rotation;
        let mut w = DMatrix::zeros(3 * n, 3 * n);
        for b in 0..n {
            for a in 0..n {
                let block = r * c.fixed_view::<3, 3>(3 * a, 3 * b) * r.transpose();
                w.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(&block);
            }
        }
        w
    }

    /// One tick. `start` continues from the pose of the tick before.
    pub fn step(&mut self, reference: &StanceReference) -> NestedReport {
        let n = self.model.contact_points().len();
        if self.foothold.is_some() {
            // Cold: everything stuck, forces of the linear solution follow from one solve of the bonded sole.
            self.workspace.reset();
            self.pose.translation.z = -reference.force.z / self.model.bonded_stiffness()[(2, 2)];
        }
        let load = reference.force.norm();
        let zmp = Vec3::new(reference.zmp[0].x, reference.zmp[0].y, 0.0);
        let mut outer = 1.0;
        let (mut iterations, mut sweeps, mut converged) = (0, 0, false);
        let mut positions = vec![Vec3::zeros(); n];
        let mut forces = vec![Vec3::zeros(); n];
        while iterations < self.settings.iterations_max {
            iterations += 1;
            let tolerance = (self.settings.inner_fraction * outer).clamp(0.1 * self.settings.tolerance, 1e-3);
            let free = self.undeformed(&self.pose);
            let mu = self.model.friction().to_vec();
            let Ok(problem) = ContactProblem::of_model(self.delassus(&self.pose), free, mu) else { break };
            let settings = Settings { tolerance, sweeps_max: self.settings.sweeps_max, ..Settings::default() };
            let mut answer = gauss_seidel(&problem, &mut self.workspace, &settings);
            sweeps += answer.iterations;
            if answer.residual.relative > tolerance {
                answer = newton(&problem, &mut self.workspace, &settings);
            }
            let references = self.references_at(&self.pose);
            let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
            for i in 0..n {
                forces[i] = answer.force.fixed_rows::<3>(3 * i).into();
                let delta: Vec3 = answer.delta.fixed_rows::<3>(3 * i).into();
                positions[i] = delta + Vec3::new(references[i].x, references[i].y, 0.0);
                force += forces[i];
                moment += (positions[i] - zmp).cross(&forces[i]);
            }
            let (force_error, moment_error) = (force - reference.force, moment);
            outer = (force_error.amax() / load).max(moment_error.amax() / (MOMENT_ARM_M * load));
            if outer <= self.settings.tolerance && tolerance <= self.settings.tolerance.max(0.1 * outer) {
                converged = true;
                break;
            }
            let j = self.jacobian(&problem, &forces, &positions, &zmp);
            let error =
                Vec6::new(force_error.x, force_error.y, force_error.z, moment_error.x, moment_error.y, moment_error.z);
            let Some(step) = crate::equilibrium::scaled_solve(&j, &-error) else { break };
            let (linear, angular): (Vec3, Vec3) = (step.fixed_rows::<3>(0).into(), step.fixed_rows::<3>(3).into());
            let scale = 1.0_f64.min(STEP_MAX_M / linear.norm()).min(STEP_MAX_RAD / angular.norm());
            self.pose.translation += scale * linear;
            self.pose.rotation = so3::orthonormalised(&(so3::exp(&(scale * angular)) * self.pose.rotation));
        }
        if converged {
            self.references = positions.iter().map(|p| p.xy()).collect();
            self.foothold = None;
        }
        NestedReport {
            converged,
            sole_pose: self.pose,
            node_forces: forces,
            node_positions: positions,
            residual: outer,
            iterations,
            sweeps,
        }
    }

    /// Derivative of force and moment about the ZMP with the pose at frozen node states.
    fn jacobian(&self, problem: &ContactProblem, forces: &[Vec3], positions: &[Vec3], zmp: &Vec3) -> Mat6 {
        let active: Vec<usize> =
            (0..forces.len()).filter(|i| self.workspace.states()[*i] != ContactState::Open).collect();
        if active.is_empty() {
            return Mat6::zeros();
        }
        let m = 3 * active.len();
        let (w, o) = (problem.delassus(), self.pose.translation);
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        // d delta = W (dF - w x F) + w x (u) + dO + w x (R p) - dQ, with all of delta + Q - O turning: w x (P - O).
        let first = self.foothold.map(|foothold| {
            axes.map(|axis| self.settings.euler_order.with_yaw_rate(&self.pose.rotation, foothold.yaw_rad, &axis))
        });
        let mut a = DMatrix::zeros(m, m);
        let mut b = DMatrix::zeros(m, 6);
        for (row, i) in active.iter().enumerate() {
            let slides = self.workspace.states()[*i] == ContactState::Slip;
            let mut rates = nalgebra::Matrix3x6::zeros();
            for l in 0..3 {
                rates[(l, l)] = 1.0;
                let mut turning = axes[l].cross(&(positions[*i] - o));
                for k in &active {
                    turning -= w.fixed_view::<3, 3>(3 * i, 3 * k) * axes[l].cross(&forces[*k]);
                }
                if let Some(first) = &first {
                    let moved = first[l] * self.model.contact_points()[*i];
                    turning -= Vec3::new(moved.x, moved.y, 0.0);
                }
                rates.set_column(3 + l, &turning);
            }
            let (f, q) = (forces[*i], self.references_at(&self.pose)[*i]);
            let rho = 3.0 / w.fixed_view::<3, 3>(3 * i, 3 * i).trace();
            let slip = positions[*i].xy() - q;
            let law = crate::equilibrium::SlidingLaw::new(self.model.friction()[*i], rho, &f, &slip);
            let on_force = |axis: usize| law.rate(&Vec3::ith(axis, 1.0), &Vector2::zeros());
            let on_slip = |axis: usize| law.rate(&Vec3::zeros(), &Vector2::ith(axis, 1.0));
            for (column, k) in active.iter().enumerate() {
                let block = w.fixed_view::<3, 3>(3 * i, 3 * k).into_owned();
                for axis in 0..3 {
                    let mut entry = block.column(axis).into_owned();
                    if slides {
                        let g = on_slip(0) * block[(0, axis)] + on_slip(1) * block[(1, axis)];
                        let own = if i == k { on_force(axis) } else { Vector2::zeros() };
                        // Divided by rho: all rows in metres per newton.
                        entry.x = (g.x + own.x) / rho;
                        entry.y = (g.y + own.y) / rho;
                    }
                    a.fixed_view_mut::<3, 1>(3 * row, 3 * column + axis).copy_from(&entry);
                }
            }
            for l in 0..6 {
                let mut entry = rates.column(l).into_owned();
                if slides {
                    let g = on_slip(0) * entry.x + on_slip(1) * entry.y;
                    (entry.x, entry.y) = (g.x / rho, g.y / rho);
                }
                b.fixed_view_mut::<3, 1>(3 * row, l).copy_from(&-entry);
            }
        }
        let Some(rates) = a.lu().solve(&b) else { return Mat6::zeros() };
        let mut j = Mat6::zeros();
        for l in 0..6 {
            let all = |k: usize| -> Vec3 { rates.fixed_view::<3, 1>(3 * k, l).into() };
            for (row, i) in active.iter().enumerate() {
                let df = all(row);
                // The point moves by the displacement rate of the contact: zero where it sticks, the slip where it slides.
                let mut moved = Vec3::zeros();
                if self.workspace.states()[*i] == ContactState::Slip || first.is_some() {
                    for (other, k) in active.iter().enumerate() {
                        let turned = if l >= 3 { axes[l - 3].cross(&forces[*k]) } else { Vec3::zeros() };
                        moved += w.fixed_view::<3, 3>(3 * i, 3 * k) * (all(other) - turned);
                    }
                    moved += if l < 3 { axes[l] } else { axes[l - 3].cross(&(positions[*i] - o)) };
                    moved.z = 0.0;
                }
                let mut column = j.column_mut(l);
                let turn = (positions[*i] - zmp).cross(&df) + moved.cross(&forces[*i]);
                column += Vec6::new(df.x, df.y, df.z, turn.x, turn.y, turn.z);
            }
        }
        j
    }
}
