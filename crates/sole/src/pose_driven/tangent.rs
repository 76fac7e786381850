//! Rate of the wrench with the pose at frozen node states.

use super::{COLUMN_OF_ONES, PoseDrivenContact};
use crate::estimate::about_moving_origin;
use friction::ContactState;
use friction::dense::{add_three, lu_solve};
use nalgebra::Vector2;
use spatial::{Mat3, Mat6, Vec3, so3};

impl PoseDrivenContact {
    /// Rate of the wrench (about the moving origin, world axes) with the pose (position, rotation vector in the world) at the last evaluation
    /// and at frozen node states, within one time step.
    pub fn tangent(&mut self) -> Mat6 {
        if self.stiffness.len() == 0 {
            return Mat6::zeros();
        }
        let slides = !self.sliding.is_empty() && (self.are_factored() || self.factor_sliding());
        self.rates_with_pose();
        let ld = self.stiffness.ld();
        let (mut force, mut geometric) = (Vec3::zeros(), Mat3::zeros());
        let (mut sum_a, mut sum_xa) = ([Vec3::zeros(); 6], [Vec3::zeros(); 6]);
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let f = &self.forces[slot];
            let arm = self.anchor + self.columned[*point] + self.offset(*point) - self.pose.translation;
            force += f;
            geometric += arm.dot(f) * Mat3::identity() - f * arm.transpose();
            let arm_local = self.pose.rotation.tr_mul(&arm);
            for l in 0..6 {
                let a = &self.rates[l * ld + 3 * slot..];
                let a = Vec3::new(a[0], a[1], a[2]);
                sum_a[l] += a;
                sum_xa[l] += arm_local.cross(&a);
            }
        }
        let mut j = Mat6::zeros();
        for l in 0..6 {
            j.fixed_view_mut::<3, 1>(0, l).copy_from(&(self.pose.rotation * sum_a[l]));
            j.fixed_view_mut::<3, 1>(3, l).copy_from(&(self.pose.rotation * sum_xa[l]));
        }
        let upper = j.fixed_view::<3, 3>(0, 3) - so3::skew(&force);
        j.fixed_view_mut::<3, 3>(0, 3).copy_from(&upper);
        let lower = j.fixed_view::<3, 3>(3, 3) + geometric;
        j.fixed_view_mut::<3, 3>(3, 3).copy_from(&lower);
        if slides {
            self.give_way(&mut j);
        }
        about_moving_origin(&j, &force)
    }

    /// Sliding points give way: `J - J_xs J_ss^-1 J_sx`.
    fn give_way(&mut self, j: &mut Mat6) {
        let (s, rows, ld) = (self.sliding.len(), 2 * self.states.len(), self.stiffness.ld());
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        for i in 0..s {
            let point = self.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let (law, world) = (self.law(point, slot), self.forces[slot]);
            for l in 0..6 {
                let a = &self.rates[l * ld + 3 * slot..];
                let mut rate = self.pose.rotation * Vec3::new(a[0], a[1], a[2]);
                if l >= 3 {
                    rate += axes[l - 3].cross(&world);
                }
                let g = law.rate(&self.places[point].frame.tr_mul(&rate), &Vector2::zeros());
                self.slide.js[l * rows + 2 * i] = g.x;
                self.slide.js[l * rows + 2 * i + 1] = g.y;
            }
        }
        lu_solve(&self.slide.jss, rows, 2 * s, &self.slide.pivots, &mut self.slide.js, 6);
        for i in 0..s {
            let point = self.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            for t in 0..2 {
                let direction = self.places[point].frame.column(t).into_owned();
                let turned = direction.cross(&self.forces[slot]);
                let local = self.pose.rotation.tr_mul(&direction);
                for row in 0..6 {
                    let a = &self.rates[row * ld + 3 * slot..];
                    let mut back = -(a[0] * local.x + a[1] * local.y + a[2] * local.z);
                    if row >= 3 {
                        back += turned[row - 3];
                    }
                    for l in 0..6 {
                        j[(row, l)] -= back * self.slide.js[l * rows + 2 * i + t];
                    }
                }
            }
        }
    }

    /// Rates of the forces (sole axes) with the pose at given slips.
    fn rates_with_pose(&mut self) {
        let (ld, m) = (self.stiffness.ld(), 3 * self.stiffness.len());
        let (beta, rotation) = (self.beta, self.pose.rotation);
        let origin = self.pose.translation - self.anchor;
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        let ones = COLUMN_OF_ONES;
        for l in 0..3 {
            let out = &mut self.rates[l * ld..l * ld + m];
            out.fill(0.0);
            let (k, c) = (&self.stiffness, -beta * rotation.tr_mul(&axes[l]));
            add_three(out, k.y(ones), k.y(ones + 1), k.y(ones + 2), c.x, c.y, c.z);
            // The displacement R'(Q - O) turns by -R' (axis x (Q - O)).
            let turn = -beta * rotation.tr_mul(&so3::skew(&axes[l]));
            let o = -(turn * origin);
            let out = &mut self.rates[(3 + l) * ld..(3 + l) * ld + m];
            out.fill(0.0);
            for a in 0..3 {
                let (x, y, z) = (k.y(3 * a), k.y(3 * a + 1), k.y(3 * a + 2));
                add_three(out, x, y, z, turn[(a, 0)], turn[(a, 1)], turn[(a, 2)]);
            }
            add_three(out, k.y(ones), k.y(ones + 1), k.y(ones + 2), o.x, o.y, o.z);
        }
        for slot in 0..self.stiffness.len() {
            let point = self.stiffness.points()[slot];
            let offset = self.offset(point);
            if offset == Vec3::zeros() {
                continue;
            }
            for l in 0..3 {
                let c = -beta * rotation.tr_mul(&axes[l].cross(&offset));
                let (j, k) = (3 * slot, &self.stiffness);
                let out = &mut self.rates[(3 + l) * ld..(3 + l) * ld + m];
                add_three(out, k.column(j), k.column(j + 1), k.column(j + 2), c.x, c.y, c.z);
            }
        }
        debug_assert!(self.states.iter().any(|state| *state != ContactState::Open));
    }
}
