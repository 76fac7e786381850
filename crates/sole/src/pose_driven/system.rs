//! Forces at a given pose: displacements prescribed by the references, slips solved for.

use super::{FLOOR_ULPS, Place, PoseDrivenContact};
use crate::equilibrium::SlidingLaw;
use crate::{Ground, NodeState};
use friction::dense::{add_three, lu_factor, lu_solve};
use nalgebra::Vector2;
use spatial::{Mat3, Transform, Vec3};

impl PoseDrivenContact {
    /// References, normals and friction; returns the rounding floor of positions.
    pub(super) fn place(&mut self, pose: &Transform, ground: &dyn Ground) -> f64 {
        let mut reach = 0.0_f64;
        for (point, p) in self.model.contact_points().iter().enumerate() {
            let from = if self.has_history { self.previous[point] } else { pose.point(p) };
            let (height, n) = ground.height_and_normal(from.x, from.y);
            // The tangent plane at the reference: the previous position is projected along the normal.
            let on_ground = Vec3::new(from.x, from.y, height);
            let reference = from - n * n.dot(&(from - on_ground));
            let side = if n.x.abs() < 0.9 { Vec3::x() } else { Vec3::y() };
            let t1 = (side - n * n.dot(&side)).normalize();
            let frame = Mat3::from_columns(&[t1, n.cross(&t1), n]);
            let mu = self.model.friction()[point] * ground.friction_factor(from.x, from.y);
            self.places[point] = Place { reference, frame, mu };
            reach = reach.max(p.norm());
        }
        FLOOR_ULPS * f64::EPSILON * (reach + pose.translation.norm())
    }

    /// Fills `w`: prescribed displacements without slip, and with `columns` 7 their rates with the pose (slips included).
    pub(super) fn prescribe(&mut self, pose: &Transform, beta: f64, columns: usize) {
        let ld = self.stiffness.ld();
        let keep = (beta - 1.0) / beta;
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let place = &self.places[*point];
            let row = 3 * slot;
            let arm = place.reference - pose.translation;
            let local = pose.rotation.tr_mul(&arm) - self.model.contact_points()[*point];
            for axis in 0..3 {
                self.w[row + axis] = beta * (local[axis] - keep * self.previous_u[3 * point + axis]);
            }
            if columns > 1 {
                let arm = arm + place.frame.fixed_view::<3, 2>(0, 0) * self.slips[*point];
                for l in 0..3 {
                    let by_position = -beta * pose.rotation.tr_mul(&axes[l]);
                    let by_rotation = beta * pose.rotation.tr_mul(&arm.cross(&axes[l]));
                    for axis in 0..3 {
                        self.w[(1 + l) * ld + row + axis] = by_position[axis];
                        self.w[(4 + l) * ld + row + axis] = by_rotation[axis];
                    }
                }
            }
        }
    }

    /// Forces without slip.
    pub(super) fn find_base(&mut self, pose: &Transform, beta: f64) {
        self.prescribe(pose, beta, 1);
        self.stiffness.multiply_columns(&self.w, 1, &mut self.f);
        let m = 3 * self.stiffness.len();
        self.base[..m].copy_from_slice(&self.f[..m]);
    }

    /// `f = base + beta K T v`, and the list of sliding points.
    pub(super) fn add_slips(&mut self, pose: &Transform, beta: f64) {
        let m = 3 * self.stiffness.len();
        self.f[..m].copy_from_slice(&self.base[..m]);
        self.sliding.clear();
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            if self.states[*point] == NodeState::Slip {
                self.sliding.push(*point);
                let v = self.places[*point].frame.fixed_view::<3, 2>(0, 0) * self.slips[*point];
                let c = beta * pose.rotation.tr_mul(&v);
                let j = 3 * slot;
                let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
                add_three(&mut self.f[..m], x, y, z, c.x, c.y, c.z);
            }
        }
    }

    pub(super) fn force(&self, slot: usize) -> Vec3 {
        Vec3::new(self.f[3 * slot], self.f[3 * slot + 1], self.f[3 * slot + 2])
    }

    /// Rotation from the sole's axes to the local frame of a point.
    pub(super) fn turn(&self, pose: &Transform, point: usize) -> Mat3 {
        self.places[point].frame.transpose() * pose.rotation
    }

    pub(super) fn law(&self, pose: &Transform, beta: f64, point: usize, slot: usize) -> SlidingLaw {
        let force = self.turn(pose, point) * self.force(slot);
        SlidingLaw::new(self.places[point].mu, beta * self.rho[point], &force, &self.slips[point])
    }

    /// Factorises the sliding conditions; returns their largest error (N), infinite when singular.
    pub(super) fn factor_sliding(&mut self, pose: &Transform, beta: f64) -> f64 {
        let rows = 2 * self.states.len();
        let mut error = 0.0_f64;
        for i in 0..self.sliding.len() {
            let point = self.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let law = self.law(pose, beta, point, slot);
            error = error.max(law.residual.norm());
            self.js[2 * i] = law.residual.x;
            self.js[2 * i + 1] = law.residual.y;
            let to_local = self.turn(pose, point);
            for k in 0..self.sliding.len() {
                let other = self.sliding[k];
                let block = self.stiffness.block(slot, self.stiffness.slot(other).expect("sliding points touch"));
                let rate = beta * to_local * block * self.turn(pose, other).transpose();
                for t in 0..2 {
                    let mut slip = Vector2::zeros();
                    if i == k {
                        slip[t] = 1.0;
                    }
                    let g = law.rate(&rate.column(t).into(), &slip);
                    self.jss[(2 * k + t) * rows + 2 * i] = g.x;
                    self.jss[(2 * k + t) * rows + 2 * i + 1] = g.y;
                }
            }
        }
        let s = 2 * self.sliding.len();
        if lu_factor(&mut self.jss, rows, s, 0, &mut self.pivots) < f64::EPSILON { f64::INFINITY } else { error }
    }

    /// One Newton step of all slips; returns the error before it.
    pub(super) fn slide(&mut self, pose: &Transform, beta: f64) -> f64 {
        if self.sliding.is_empty() {
            return 0.0;
        }
        let error = self.factor_sliding(pose, beta);
        if error.is_finite() {
            let (rows, s) = (2 * self.states.len(), 2 * self.sliding.len());
            lu_solve(&self.jss, rows, s, &self.pivots, &mut self.js, 1);
            for i in 0..self.sliding.len() {
                self.slips[self.sliding[i]] -= Vector2::new(self.js[2 * i], self.js[2 * i + 1]);
            }
        }
        error
    }

    /// Displacements and positions of all points from the compliance, and the elastic forces behind them.
    pub(super) fn displace(&mut self, pose: &Transform, beta: f64) {
        let ld = self.stiffness.ld();
        let c = self.model.compliance().as_slice();
        let keep = (beta - 1.0) / beta;
        for (u, previous) in self.u.iter_mut().zip(&self.previous_u) {
            *u = keep * previous;
        }
        for (elastic, previous) in self.elastic.iter_mut().zip(&self.previous_elastic) {
            *elastic = keep * previous;
        }
        for slot in 0..self.stiffness.len() {
            let f = self.force(slot) / beta;
            let row = 3 * self.stiffness.points()[slot];
            let j = row * ld;
            add_three(&mut self.u, &c[j..j + ld], &c[j + ld..j + 2 * ld], &c[j + 2 * ld..j + 3 * ld], f.x, f.y, f.z);
            for axis in 0..3 {
                self.elastic[row + axis] += f[axis];
            }
        }
        for (point, p) in self.model.contact_points().iter().enumerate() {
            let u = Vec3::new(self.u[3 * point], self.u[3 * point + 1], self.u[3 * point + 2]);
            self.report.node_positions[point] = pose.point(&(p + u));
        }
    }
}
