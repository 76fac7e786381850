//! The linear system of one Newton step: sliding unknowns eliminated first, then six equations for the pose.

use super::{Equilibrium, SlidingLaw, block, flat};
use friction::dense::{add_three, lu_factor, upper_solve};
use nalgebra::Vector2;
use spatial::{Mat3, Mat6, Vec3, so3};

/// What the references of the first tick (35) do while the pose moves; those of later ticks stay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum References {
    /// They follow roll and pitch.
    Follow,
    /// They are held, as they will be from the next tick on.
    Held,
}

/// How the elimination of the sliding points ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub(super) enum Reduction {
    /// Tangent, right-hand side and slip solves are those of the present point.
    Done,
    /// The sliding points' own equations are singular: there is no step.
    Singular,
}

/// World axes.
fn axes() -> [Vec3; 3] {
    [Vec3::x(), Vec3::y(), Vec3::z()]
}

impl Equilibrium {
    /// Jacobian at the present point, whose residual is already there; leaves the reduced tangent, its right-hand side and the slip solves in
    /// place.
    pub(super) fn assemble(&mut self, references: References) -> Reduction {
        let (m, s) = (3 * self.stiffness.len(), self.scratch.sliding.len());
        // The sliding points' columns, 15 m each, and 12 s^2 to gather from; elimination; the six columns of the pose.
        self.work.multiplications += (15 * s * m + 12 * s * s + (2 * s).pow(3) / 3 + 28 * s * s + 36 * m) as u64;
        self.pose_columns(m);
        let moved = match (self.stance.first, references) {
            (Some(yaw_rad), References::Follow) => Some(self.reference_columns(yaw_rad, m)),
            _ => None,
        };
        let tangent = self.resultant_rates(moved.as_ref());
        self.sliding_rows(moved.is_some());
        self.slip_columns(m);
        self.eliminate(tangent)
    }

    /// `A = K B`: rates of the forces with `O'` (columns 0-2) and the angular velocity (3-5).
    fn pose_columns(&mut self, m: usize) {
        let r = self.stance.pose.rotation;
        let (count, q) = self.families();
        let (axes, y) = (axes(), |j: usize| self.stiffness.y(j));
        for l in 0..3 {
            let linear = self.scratch.a.cleared(l, m);
            add_three(linear, y(0), y(1), y(2), -r[(l, 0)], -r[(l, 1)], -r[(l, 2)]);
            let angular = self.scratch.a.cleared(3 + l, m);
            for k in 0..count {
                let direction = if k == 0 { q[k] - self.stance.pose.translation } else { q[k] };
                let c = r.tr_mul(&direction.cross(&axes[l]));
                add_three(angular, y(3 * k), y(3 * k + 1), y(3 * k + 2), c.x, c.y, c.z);
            }
        }
        // Point by point, so that its columns of K are fetched once.
        for (point, slot) in self.scratch.sliding.iter().zip(self.scratch.sliding_slots.iter()) {
            let v = self.stance.slips[*point];
            if v.x == 0.0 && v.y == 0.0 {
                continue;
            }
            let j = 3 * slot;
            let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
            for l in 0..3 {
                let c = r.tr_mul(&flat(&v).cross(&axes[l]));
                add_three(self.scratch.a.head_mut(3 + l, m), x, y, z, c.x, c.y, c.z);
            }
        }
    }

    /// What references that follow roll and pitch (35) add; returns their rates with the angular velocity.
    fn reference_columns(&mut self, yaw_rad: f64, m: usize) -> [Mat3; 3] {
        let r = self.stance.pose.rotation;
        let mut rates = [Mat3::zeros(); 3];
        for (l, axis) in axes().iter().enumerate() {
            let rate = self.sole.euler.with_yaw_rate(&r, yaw_rad, axis);
            let column = self.scratch.a_first.cleared(l, m);
            for k in 0..3 {
                let moved = Vec3::new(rate[(0, k)], rate[(1, k)], 0.0);
                rates[k].set_column(l, &moved);
                let c = r.tr_mul(&moved);
                let j = 3 * (k + 1);
                let (x, y, z) = (self.stiffness.y(j), self.stiffness.y(j + 1), self.stiffness.y(j + 2));
                add_three(column, x, y, z, c.x, c.y, c.z);
            }
        }
        rates
    }

    /// Rates of force and moment about the fixed point O with the pose, slips held. `moved`: the references' own rates, if they follow.
    fn resultant_rates(&self, moved: Option<&[Mat3; 3]>) -> Mat6 {
        let (r, o) = (self.stance.pose.rotation, self.stance.pose.translation);
        let (mut force, mut geometric) = (Vec3::zeros(), Mat3::zeros());
        let mut weighted = [Vec3::zeros(); 3];
        let (mut sum_a, mut sum_xa) = ([Vec3::zeros(); 6], [Vec3::zeros(); 6]);
        for slot in 0..self.stiffness.len() {
            let arm = self.scratch.world[slot] - o;
            let f = r * block(&self.scratch.f, slot);
            force += f;
            // arm x (w x f) = (w (arm.f) - f (arm.w))
            geometric += arm.dot(&f) * Mat3::identity() - f * arm.transpose();
            let local = r.tr_mul(&arm);
            for l in 0..6 {
                let a = self.force_rate(l, slot, moved.is_some());
                sum_a[l] += a;
                sum_xa[l] += local.cross(&a);
            }
            if moved.is_some() {
                let p = &self.sole.model.contact_points()[self.stiffness.points()[slot]];
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
        if let Some(rates) = moved {
            for k in 0..3 {
                turning -= so3::skew(&weighted[k]) * rates[k];
            }
        }
        j.fixed_view_mut::<3, 3>(3, 3).copy_from(&turning);
        j
    }

    /// Rate of a point's force (sole axes) with coordinate `l` of the pose.
    fn force_rate(&self, l: usize, slot: usize, references_follow: bool) -> Vec3 {
        let mut a = block(self.scratch.a.column(l), slot);
        if l >= 3 && references_follow {
            a += block(self.scratch.a_first.column(l - 3), slot);
        }
        a
    }

    /// Per sliding point the rates of its condition with the pose, those of the wrench with its slip, and its condition's own gradients.
    fn sliding_rows(&mut self, references_follow: bool) {
        let (r, axes) = (self.stance.pose.rotation, axes());
        for i in 0..self.scratch.sliding.len() {
            let point = self.scratch.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let f = r * block(&self.scratch.f, slot);
            let law = self.law(point, &f);
            for l in 0..6 {
                // Transposed use: the wrench rate by this slip is -(K B)' R' e_t.
                let back = r * block(self.scratch.a.column(l), slot);
                let mut rate = r * self.force_rate(l, slot, references_follow);
                if l >= 3 {
                    rate += axes[l - 3].cross(&f);
                }
                let g = law.rate(&rate, &Vector2::zeros());
                self.scratch.js[[2 * i, l]] = g.x;
                self.scratch.js[[2 * i + 1, l]] = g.y;
                self.scratch.jxs[2 * i][l] = -back.x;
                self.scratch.jxs[2 * i + 1][l] = -back.y;
            }
            for t in 0..2 {
                let turn = axes[t].cross(&f);
                for l in 0..3 {
                    self.scratch.jxs[2 * i + t][3 + l] += turn[l];
                }
            }
            // G' = M f' + N v', with M in the sole's axes.
            self.scratch.gradients[i] = [law.gradient(0) * r, law.gradient(1) * r];
            for t in 0..2 {
                let mut slip_rate = Vector2::zeros();
                slip_rate[t] = 1.0;
                self.scratch.own_rates[i][t] = law.rate(&Vec3::zeros(), &slip_rate);
            }
        }
    }

    /// `J_ss` column by column: `f' = K_:k R' e_t`, then `M_i f'_i` of every sliding point.
    fn slip_columns(&mut self, m: usize) {
        let r = self.stance.pose.rotation;
        let scratch = &mut self.scratch;
        let s = scratch.sliding.len();
        for k in 0..s {
            let j = 3 * scratch.sliding_slots[k];
            let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
            for t in 0..2 {
                let column = &mut scratch.slip_column[..m];
                column.fill(0.0);
                add_three(column, x, y, z, r[(t, 0)], r[(t, 1)], r[(t, 2)]);
                let target = scratch.jss.head_mut(2 * k + t, 2 * s);
                for ((g, slot), [m0, m1]) in
                    target.chunks_exact_mut(2).zip(scratch.sliding_slots.iter()).zip(&scratch.gradients)
                {
                    let f = &column[3 * slot..3 * slot + 3];
                    g[0] = m0[0] * f[0] + m0[1] * f[1] + m0[2] * f[2];
                    g[1] = m1[0] * f[0] + m1[1] * f[1] + m1[2] * f[2];
                }
                target[2 * k] += scratch.own_rates[k][t].x;
                target[2 * k + 1] += scratch.own_rates[k][t].y;
            }
        }
    }

    /// Eliminates the slips from the tangent and the right-hand side.
    fn eliminate(&mut self, mut tangent: Mat6) -> Reduction {
        let scratch = &mut self.scratch;
        let (s, rows) = (scratch.sliding.len(), scratch.jss.rows());
        let mut right = scratch.misfit;
        if s > 0 {
            // The seven right-hand sides ride along behind the matrix.
            scratch.jss.from_mut(2 * s)[..7 * rows].copy_from_slice(&scratch.js.from(0)[..7 * rows]);
            let ratio = lu_factor(scratch.jss.from_mut(0), rows, 2 * s, 7, &mut scratch.pivots);
            if ratio < f64::EPSILON {
                scratch.tangent = Mat6::zeros();
                return Reduction::Singular;
            }
            scratch.js.from_mut(0)[..7 * rows].copy_from_slice(&scratch.jss.from(2 * s)[..7 * rows]);
            upper_solve(scratch.jss.from(0), rows, 2 * s, scratch.js.from_mut(0), 7);
            for i in 0..2 * s {
                let back = scratch.jxs[i];
                for l in 0..6 {
                    let mut column = tangent.column_mut(l);
                    column.axpy(-scratch.js[[i, l]], &back, 1.0);
                }
                right.axpy(-scratch.js[[i, 6]], &back, 1.0);
            }
        }
        scratch.tangent = tangent;
        scratch.right_hand = right;
        Reduction::Done
    }

    pub(super) fn law(&self, point: usize, force: &Vec3) -> SlidingLaw {
        SlidingLaw::new(self.sole.model.friction()[point], self.sole.rho[point], force, &self.stance.slips[point])
    }
}
