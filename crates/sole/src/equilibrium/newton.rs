//! The iteration, the rates of the pose, and what is looked at when it is over.

use super::circles::Circles;
use super::system::{Reduction, References};
use super::{
    End, Equilibrium, Limits, SAME_FACTORS, STEP_MAX_M, STEP_MAX_RAD, Target, block, flat, parts, scaled_solve, stack,
};
use crate::columns::Columns;
use friction::ContactState;
use friction::dense::{add_one, add_three};
use friction::natural_map;
use nalgebra::Vector2;
use spatial::{Vec3, Vec6, so3};

impl Equilibrium {
    /// Newton from the present state. `settled`: the points' states have been looked at since the pose last moved, and fit.
    pub(crate) fn newton(&mut self, target: &Target, limits: &Limits, mut settled: bool) -> End {
        let tolerance = self.reachable(target, limits);
        self.evaluate();
        // Residual of the step before, as long as its factors are those of the present states.
        let mut before = None;
        let mut circles = Circles::default();
        for iteration in 0..=limits.iterations {
            let residual = self.residual(target);
            self.work.residual = residual;
            let converged = settled && residual <= tolerance;
            if !converged && self.multiplications() > limits.multiplications {
                break;
            }
            let near = |before: f64| residual * (residual / before).powi(SAME_FACTORS) <= tolerance;
            if !converged && before.is_some_and(near) {
                self.reduce_with_old_factors();
            } else if self.assemble(References::Follow) == Reduction::Singular {
                break;
            }
            before = Some(residual);
            if converged {
                return if self.scratch.tangent.determinant() > 0.0 { End::Converged } else { End::Unstable };
            }
            if iteration == limits.iterations || !residual.is_finite() {
                break;
            }
            self.work.iterations += 1;
            let Some(step) = scaled_solve(&self.scratch.tangent, &-self.scratch.right_hand) else { break };
            let (linear, angular) = parts(&step);
            let scale = 1.0_f64.min(STEP_MAX_M / linear.norm()).min(STEP_MAX_RAD / angular.norm());
            if !scale.is_finite() {
                break;
            }
            self.advance(&step, scale);
            self.evaluate();
            settled = !self.update_states();
            if !settled {
                if circles.come_round(&self.stance.states) {
                    break;
                }
                self.evaluate();
                before = None;
            }
        }
        if settled { End::Stopped } else { End::Circling }
    }

    /// The tolerance asked for, or what rounding leaves of it at this load.
    pub(super) fn reachable(&self, target: &Target, limits: &Limits) -> f64 {
        limits.tolerance.max(self.sole.floor_n / target.force[0].norm())
    }

    /// Part of a Newton step: the pose, and the slips that belong to it.
    pub(super) fn advance(&mut self, step: &Vec6, scale: f64) {
        for i in 0..self.scratch.sliding.len() {
            for t in 0..2 {
                let row = 2 * i + t;
                let by_pose: f64 = (0..6).map(|l| self.scratch.js[[row, l]] * step[l]).sum();
                self.stance.slips[self.scratch.sliding[i]][t] += scale * (-self.scratch.js[[row, 6]] - by_pose);
            }
        }
        let (linear, angular) = parts(&(scale * step));
        self.stance.pose.translation += linear;
        self.stance.pose.rotation = so3::orthonormalised(&(so3::exp(&angular) * self.stance.pose.rotation));
    }

    /// Twist and acceleration of the sole's origin by implicit differentiation, at frozen references and states. Call after a
    /// converged [`Equilibrium::newton`]; leaves the frozen tangent in place.
    pub(crate) fn rates(&mut self, target: &Target) -> Option<(Vec6, Vec6)> {
        if self.stance.first.is_some() {
            self.residual(target);
            if self.assemble(References::Held) == Reduction::Singular {
                return None;
            }
        }
        let m = 3 * self.stiffness.len();
        let r = self.stance.pose.rotation;
        let o = self.stance.pose.translation;
        let [_, rate, second] = target.wrench(&o);
        let x = scaled_solve(&self.scratch.tangent, &rate)?;
        let (linear, w) = parts(&x);
        let slip_rate =
            |js: &Columns, i: usize| -Vector2::from_fn(|t, _| (0..6).map(|l| js[[2 * i + t, l]] * x[l]).sum::<f64>());
        // f' and f'' along the path with constant rates.
        let (count, q) = self.families();
        let f1 = &mut self.scratch.f_rate[..m];
        let f2 = &mut self.scratch.f_second[..m];
        f1.fill(0.0);
        f2.fill(0.0);
        for l in 0..6 {
            add_one(f1, &self.scratch.a.column(l)[..m], x[l]);
        }
        for k in 0..count {
            let mut direction = w.cross(&w.cross(&q[k]));
            if k == 0 {
                direction = w.cross(&w.cross(&(q[k] - o))) + 2.0 * w.cross(&linear);
            }
            let c = r.tr_mul(&direction);
            let j = 3 * k;
            add_three(f2, self.stiffness.y(j), self.stiffness.y(j + 1), self.stiffness.y(j + 2), c.x, c.y, c.z);
        }
        for (i, point) in self.scratch.sliding.iter().enumerate() {
            let j = 3 * self.stiffness.slot(*point).expect("sliding points touch");
            let v1 = flat(&slip_rate(&self.scratch.js, i));
            let columns = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
            let c = r.tr_mul(&v1);
            add_three(f1, columns.0, columns.1, columns.2, c.x, c.y, c.z);
            let c = r.tr_mul(&(w.cross(&w.cross(&flat(&self.stance.slips[*point]))) - 2.0 * w.cross(&v1)));
            add_three(f2, columns.0, columns.1, columns.2, c.x, c.y, c.z);
        }
        // Second derivative of the wrench along that path, sliding law likewise.
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        let world_rates = |slot: usize, f: &[f64], f1: &[f64], f2: &[f64]| {
            let (force, first, second) = (r * block(f, slot), r * block(f1, slot), r * block(f2, slot));
            (first + w.cross(&force), second + 2.0 * w.cross(&first) + w.cross(&w.cross(&force)))
        };
        for slot in 0..self.stiffness.len() {
            let (_, second) = world_rates(slot, &self.scratch.f, &self.scratch.f_rate, &self.scratch.f_second);
            force += second;
            moment += (self.scratch.world[slot] - o).cross(&second);
        }
        for i in 0..self.scratch.sliding.len() {
            let point = self.scratch.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let (first, second) = world_rates(slot, &self.scratch.f, &self.scratch.f_rate, &self.scratch.f_second);
            let v1 = slip_rate(&self.scratch.js, i);
            moment += 2.0 * flat(&v1).cross(&first);
            let law = self.law(point, &(r * block(&self.scratch.f, slot)));
            let g = law.second(&first, &second, &v1);
            self.scratch.js[[2 * i, 6]] = g.x;
            self.scratch.js[[2 * i + 1, 6]] = g.y;
        }
        let mut right = second - stack(&force, &moment);
        let s = self.scratch.sliding.len();
        if s > 0 {
            self.solve_slips();
            for i in 0..2 * s {
                right.axpy(self.scratch.js[[i, 6]], &self.scratch.jxs[i], 1.0);
            }
        }
        let acceleration = scaled_solve(&self.scratch.tangent, &right)?;
        for i in 0..s {
            let second = -Vector2::from_fn(|t, _| {
                let row = 2 * i + t;
                self.scratch.js[[row, 6]] + (0..6).map(|l| self.scratch.js[[row, l]] * acceleration[l]).sum::<f64>()
            });
            self.stance.slip_rates[self.scratch.sliding[i]] = [slip_rate(&self.scratch.js, i), second];
        }
        self.stance.rate = Some((x, acceleration));
        Some((x, acceleration))
    }

    /// Displacements of all points by the compliance; returns the largest contact-law violation in newtons:
    /// `|F - P_cone(F - rho (delta + mu |delta_t| n))|` with `delta` from `C f`, not from `K`. A free point under the ground counts
    /// with the force that would be needed to keep it out.
    pub(crate) fn settle(&mut self, positions: &mut [Vec3], forces: &mut [Vec3]) -> f64 {
        let ld = self.stiffness.ld();
        let c = self.sole.model.compliance().as_slice();
        self.scratch.u_full.fill(0.0);
        for slot in 0..self.stiffness.len() {
            let f = block(&self.scratch.f, slot);
            let j = 3 * self.stiffness.points()[slot] * ld;
            add_three(
                &mut self.scratch.u_full,
                &c[j..j + ld],
                &c[j + ld..j + 2 * ld],
                &c[j + 2 * ld..j + 3 * ld],
                f.x,
                f.y,
                f.z,
            );
        }
        let families = self.families();
        let mut worst = 0.0_f64;
        for point in 0..self.stance.states.len() {
            let u = block(&self.scratch.u_full, point);
            let position = self.stance.pose.point(&(self.sole.model.contact_points()[point] + u));
            let force = self.stance.pose.rotation * block(&self.scratch.force_full, point);
            positions[point] = position;
            forces[point] = force;
            let delta = position - self.reference(point, &families);
            worst =
                worst.max(natural_map(self.sole.model.friction()[point], self.sole.rho[point], &force, &delta).norm());
        }
        worst
    }

    /// Moves pose and slips along the rates of the last tick: a better start than the pose of before when references change smoothly,
    /// and the same one when they do not change. Says whether all points keep their states there; `None` when there is nothing to go by.
    pub(crate) fn predict(&mut self, dt_s: f64) -> Option<bool> {
        let (rate, second) = self.stance.rate.take()?;
        let step = dt_s * rate + 0.5 * dt_s * dt_s * second;
        let (linear, angular) = parts(&step);
        // NaN compares false.
        let sound = linear.norm() < STEP_MAX_M && angular.norm() < STEP_MAX_RAD;
        if !sound {
            return None;
        }
        self.stance.pose.translation += linear;
        self.stance.pose.rotation = so3::orthonormalised(&(so3::exp(&angular) * self.stance.pose.rotation));
        for point in 0..self.stance.states.len() {
            if self.stance.states[point] == ContactState::Slip {
                let [rate, second] = self.stance.slip_rates[point];
                self.stance.slips[point] = dt_s * rate + 0.5 * dt_s * dt_s * second;
            }
        }
        // Points that lift or slide on the way do so before the first factorisation, not after it.
        self.evaluate();
        Some(!self.update_states())
    }
}
