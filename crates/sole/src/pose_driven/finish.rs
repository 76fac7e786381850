//! What is reported when the iteration is over.

use super::{ContactStatus, PoseDrivenContact, WIDTH};
use crate::estimate::about_moving_origin;
use friction::dense::{dot, lu_solve};
use friction::natural_map;
use nalgebra::Vector2;
use spatial::{Mat3, Mat6, Transform, Vec3, Wrench, so3};

impl PoseDrivenContact {
    /// Wrench, tangent, residual.
    pub(super) fn finish(&mut self, pose: &Transform, beta: f64, solved: bool) {
        let report = &mut self.report;
        report.node_states.copy_from_slice(&self.states);
        report.node_forces.fill(Vec3::zeros());
        report.wrench = Wrench::zero();
        report.tangent = Mat6::zeros();
        report.residual = 0.0;
        report.friction_work_j = 0.0;
        report.elastic_energy_j = 0.5 * dot(&self.u, &self.elastic);
        if self.stiffness.len() == 0 {
            report.status = ContactStatus::NoContact;
            return;
        }
        let (m, ld) = (3 * self.stiffness.len(), self.stiffness.ld());
        self.factor_sliding(pose, beta);
        self.prescribe(pose, beta, WIDTH);
        // Column 0 holds the forces already: the rates are columns 1 to 6.
        self.stiffness.multiply_columns(&self.w[ld..], WIDTH - 1, &mut self.f[ld..]);
        let (mut force, mut moment, mut geometric) = (Vec3::zeros(), Vec3::zeros(), Mat3::zeros());
        let (mut sum_a, mut sum_xa) = ([Vec3::zeros(); 6], [Vec3::zeros(); 6]);
        let report = &mut self.report;
        let (mut largest, mut worst) = (0.0_f64, 0.0_f64);
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let place = &self.places[*point];
            let local = Vec3::new(self.f[3 * slot], self.f[3 * slot + 1], self.f[3 * slot + 2]);
            let f = pose.rotation * local;
            report.node_forces[*point] = f;
            let slip = place.frame.fixed_view::<3, 2>(0, 0) * self.slips[*point];
            report.friction_work_j -= f.dot(&slip);
            let arm = place.reference + slip - pose.translation;
            force += f;
            moment += arm.cross(&f);
            geometric += arm.dot(&f) * Mat3::identity() - f * arm.transpose();
            let arm_local = pose.rotation.tr_mul(&arm);
            for l in 0..6 {
                let a = &self.f[(1 + l) * ld + 3 * slot..];
                let a = Vec3::new(a[0], a[1], a[2]);
                sum_a[l] += a;
                sum_xa[l] += arm_local.cross(&a);
            }
            largest = largest.max(f.norm());
        }
        for point in 0..self.states.len() {
            let place = &self.places[point];
            let f = place.frame.tr_mul(&report.node_forces[point]);
            let delta = place.frame.tr_mul(&(report.node_positions[point] - place.reference));
            worst = worst.max(natural_map(place.mu, beta * self.rho[point], &f, &delta).norm());
        }
        report.residual = if largest > 0.0 { worst / largest } else { 0.0 };
        // The laws themselves have the last word.
        let met = solved || report.residual <= self.settings.tolerance;
        report.status = if met { ContactStatus::Solved } else { ContactStatus::NotConverged };
        report.wrench = Wrench { force, moment };
        let mut j = Mat6::zeros();
        for l in 0..6 {
            j.fixed_view_mut::<3, 1>(0, l).copy_from(&(pose.rotation * sum_a[l]));
            j.fixed_view_mut::<3, 1>(3, l).copy_from(&(pose.rotation * sum_xa[l]));
        }
        let upper = j.fixed_view::<3, 3>(0, 3) - so3::skew(&force);
        j.fixed_view_mut::<3, 3>(0, 3).copy_from(&upper);
        let lower = j.fixed_view::<3, 3>(3, 3) + geometric;
        j.fixed_view_mut::<3, 3>(3, 3).copy_from(&lower);
        // Sliding points give way: J - J_xs J_ss^-1 J_sx.
        let s = self.sliding.len();
        if s > 0 {
            let rows = 2 * self.states.len();
            let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
            for i in 0..s {
                let point = self.sliding[i];
                let slot = self.stiffness.slot(point).expect("sliding points touch");
                let law = self.law(pose, beta, point, slot);
                let world = pose.rotation * self.force(slot);
                for l in 0..6 {
                    let a = &self.f[(1 + l) * ld + 3 * slot..];
                    let mut rate = pose.rotation * Vec3::new(a[0], a[1], a[2]);
                    if l >= 3 {
                        rate += axes[l - 3].cross(&world);
                    }
                    let g = law.rate(&self.places[point].frame.tr_mul(&rate), &Vector2::zeros());
                    self.js[l * rows + 2 * i] = g.x;
                    self.js[l * rows + 2 * i + 1] = g.y;
                }
            }
            lu_solve(&self.jss, rows, 2 * s, &self.pivots, &mut self.js, 6);
            for i in 0..s {
                let point = self.sliding[i];
                let slot = self.stiffness.slot(point).expect("sliding points touch");
                let world = pose.rotation * self.force(slot);
                for t in 0..2 {
                    let direction = self.places[point].frame.column(t).into_owned();
                    let turned = direction.cross(&world);
                    let local = pose.rotation.tr_mul(&direction);
                    for row in 0..6 {
                        let a = &self.f[(1 + row) * ld + 3 * slot..];
                        let mut back = -(a[0] * local.x + a[1] * local.y + a[2] * local.z);
                        if row >= 3 {
                            back += turned[row - 3];
                        }
                        for l in 0..6 {
                            j[(row, l)] -= back * self.js[l * rows + 2 * i + t];
                        }
                    }
                }
            }
        }
        debug_assert!(m > 0);
        self.report.tangent = about_moving_origin(&j, &force);
    }
}
