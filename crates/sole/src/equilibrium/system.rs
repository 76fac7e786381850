//! The linear system of one Newton step: sliding unknowns eliminated first, then six equations for the pose.

use super::{Equilibrium, SlidingLaw, block, flat};
use friction::dense::{add_three, lu_factor, upper_solve};
use nalgebra::Vector2;
use spatial::{Mat3, Mat6, Vec3, Vec6, so3};

impl Equilibrium {
    /// Jacobian at the present point, whose residual is already there. With `frozen` the references do not follow the pose at the
    /// first tick. Leaves the reduced tangent, its right-hand side and the slip solves in place; `false`: singular.
    pub(super) fn assemble(&mut self, frozen: bool) -> bool {
        let (m, ld, s) = (3 * self.stiffness.len(), self.stiffness.ld(), self.sliding.len());
        // The sliding points' columns, 15 m each, and 12 s^2 to gather from; elimination; the six columns of the pose.
        self.work.multiplications += (15 * s * m + 12 * s * s + (2 * s).pow(3) / 3 + 28 * s * s + 36 * m) as u64;
        let r = self.pose.rotation;
        let (count, q) = self.families();
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        // A = K B: displacement rates by O' (columns 0-2) and by the angular velocity (3-5).
        for l in 0..3 {
            let (linear, angular) = self.a.split_at_mut(3 * ld);
            let linear = &mut linear[l * ld..l * ld + m];
            let angular = &mut angular[l * ld..l * ld + m];
            linear.fill(0.0);
            angular.fill(0.0);
            add_three(
                linear,
                self.stiffness.y(0),
                self.stiffness.y(1),
                self.stiffness.y(2),
                -r[(l, 0)],
                -r[(l, 1)],
                -r[(l, 2)],
            );
            for k in 0..count {
                let direction = if k == 0 { q[k] - self.pose.translation } else { q[k] };
                let c = r.tr_mul(&direction.cross(&axes[l]));
                let j = 3 * k;
                add_three(
                    angular,
                    self.stiffness.y(j),
                    self.stiffness.y(j + 1),
                    self.stiffness.y(j + 2),
                    c.x,
                    c.y,
                    c.z,
                );
            }
        }
        // Point by point, so that its columns of K are fetched once.
        for (point, slot) in self.sliding.iter().zip(self.sliding_slots.iter()) {
            let v = self.slips[*point];
            if v.x == 0.0 && v.y == 0.0 {
                continue;
            }
            let j = 3 * slot;
            let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
            for l in 0..3 {
                let c = r.tr_mul(&flat(&v).cross(&axes[l]));
                add_three(&mut self.a[(3 + l) * ld..(3 + l) * ld + m], x, y, z, c.x, c.y, c.z);
            }
        }
        // References that follow roll and pitch (35).
        let first = if frozen { None } else { self.first };
        let mut reference_rates = [Mat3::zeros(); 3];
        if let Some(yaw_rad) = first {
            for l in 0..3 {
                let rate = self.euler.with_yaw_rate(&r, yaw_rad, &axes[l]);
                let column = &mut self.a_first[l * ld..l * ld + m];
                column.fill(0.0);
                for k in 0..3 {
                    let moved = Vec3::new(rate[(0, k)], rate[(1, k)], 0.0);
                    reference_rates[k].set_column(l, &moved);
                    let c = r.tr_mul(&moved);
                    let j = 3 * (k + 1);
                    let (x, y, z) = (self.stiffness.y(j), self.stiffness.y(j + 1), self.stiffness.y(j + 2));
                    add_three(column, x, y, z, c.x, c.y, c.z);
                }
            }
        }
        // Rates of the resultants about the fixed point O.
        let o = self.pose.translation;
        let (mut force, mut geometric) = (Vec3::zeros(), Mat3::zeros());
        let mut weighted = [Vec3::zeros(); 3];
        let (mut sum_a, mut sum_xa) = ([Vec3::zeros(); 6], [Vec3::zeros(); 6]);
        for slot in 0..self.stiffness.len() {
            let arm = self.world[slot] - o;
            let f = r * block(&self.f, slot);
            force += f;
            // arm x (w x f) = (w (arm.f) - f (arm.w))
            geometric += arm.dot(&f) * Mat3::identity() - f * arm.transpose();
            let local = r.tr_mul(&arm);
            for l in 0..6 {
                let mut a = block(&self.a[l * ld..], slot);
                if l >= 3 && first.is_some() {
                    a += block(&self.a_first[(l - 3) * ld..], slot);
                }
                sum_a[l] += a;
                sum_xa[l] += local.cross(&a);
            }
            if first.is_some() {
                let p = &self.model.contact_points()[self.stiffness.points()[slot]];
                for k in 0..3 {
                    weighted[k] += p[k] * f;
                }
            }
        }
        let mut j = Mat6::zeros();
        for l in 0..6 {
            j.fixed_view_mut::<3, 1>(0, l).copy_from(&(r * sum_a[l]));
            j.fixed_view_mut::<3, 1>(3, l).copy_from(&(r * sum_xa[l]));
        }
        let mut angular = j.fixed_view::<3, 3>(0, 3).into_owned();
        angular -= so3::skew(&force);
        j.fixed_view_mut::<3, 3>(0, 3).copy_from(&angular);
        let mut turning = j.fixed_view::<3, 3>(3, 3).into_owned();
        turning += geometric;
        if first.is_some() {
            for k in 0..3 {
                turning -= so3::skew(&weighted[k]) * reference_rates[k];
            }
        }
        j.fixed_view_mut::<3, 3>(3, 3).copy_from(&turning);
        // Sliding points: eliminated.
        let rows_s = 2 * self.states.len();
        for i in 0..s {
            let point = self.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let f = r * block(&self.f, slot);
            let law = self.law(point, &f);
            for l in 0..6 {
                let mut a = block(&self.a[l * ld..], slot);
                // Transposed use: the wrench rate by this slip is -(K B)' R' e_t.
                let back = r * a;
                if l >= 3 && first.is_some() {
                    a += block(&self.a_first[(l - 3) * ld..], slot);
                }
                let mut rate = r * a;
                if l >= 3 {
                    rate += axes[l - 3].cross(&f);
                }
                let g = law.rate(&rate, &Vector2::zeros());
                self.js[l * rows_s + 2 * i] = g.x;
                self.js[l * rows_s + 2 * i + 1] = g.y;
                self.jxs[(2 * i) * 6 + l] = -back.x;
                self.jxs[(2 * i + 1) * 6 + l] = -back.y;
            }
            for t in 0..2 {
                let turn = axes[t].cross(&f);
                for l in 0..3 {
                    self.jxs[(2 * i + t) * 6 + 3 + l] += turn[l];
                }
            }
            // G' = M f' + N v', with M in the sole's axes.
            self.gradients[i] = [law.gradient(0) * r, law.gradient(1) * r];
            for t in 0..2 {
                let mut slip_rate = Vector2::zeros();
                slip_rate[t] = 1.0;
                self.own_rates[i][t] = law.rate(&Vec3::zeros(), &slip_rate);
            }
        }
        // Column by column: f' = K_:k R' e_t, then M_i f'_i of every sliding point.
        for k in 0..s {
            let j = 3 * self.sliding_slots[k];
            let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
            for t in 0..2 {
                let column = &mut self.slip_column[..m];
                column.fill(0.0);
                add_three(column, x, y, z, r[(t, 0)], r[(t, 1)], r[(t, 2)]);
                let target = &mut self.jss[(2 * k + t) * rows_s..(2 * k + t) * rows_s + 2 * s];
                for ((g, slot), [m0, m1]) in
                    target.chunks_exact_mut(2).zip(self.sliding_slots.iter()).zip(&self.gradients)
                {
                    let f = &column[3 * slot..3 * slot + 3];
                    g[0] = m0[0] * f[0] + m0[1] * f[1] + m0[2] * f[2];
                    g[1] = m1[0] * f[0] + m1[1] * f[1] + m1[2] * f[2];
                }
                target[2 * k] += self.own_rates[k][t].x;
                target[2 * k + 1] += self.own_rates[k][t].y;
            }
        }
        let mut right = self.misfit;
        if s > 0 {
            // The seven right-hand sides ride along behind the matrix.
            self.jss[2 * s * rows_s..(2 * s + 7) * rows_s].copy_from_slice(&self.js[..7 * rows_s]);
            let ratio = lu_factor(&mut self.jss, rows_s, 2 * s, 7, &mut self.pivots);
            if ratio < f64::EPSILON {
                self.tangent = Mat6::zeros();
                return false;
            }
            self.js[..7 * rows_s].copy_from_slice(&self.jss[2 * s * rows_s..(2 * s + 7) * rows_s]);
            upper_solve(&self.jss, rows_s, 2 * s, &mut self.js, 7);
            for i in 0..2 * s {
                let back = Vec6::from_column_slice(&self.jxs[6 * i..6 * i + 6]);
                for l in 0..6 {
                    let x = self.js[l * rows_s + i];
                    let mut column = j.column_mut(l);
                    column.axpy(-x, &back, 1.0);
                }
                right.axpy(-self.js[6 * rows_s + i], &back, 1.0);
            }
        }
        self.tangent = j;
        self.right_hand = right;
        true
    }

    pub(super) fn law(&self, point: usize, force: &Vec3) -> SlidingLaw {
        SlidingLaw::new(self.model.friction()[point], self.rho[point], force, &self.slips[point])
    }
}
