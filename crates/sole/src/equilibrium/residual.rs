//! How far the present point is from carrying the load and from the sliding laws, and the step that factors of an earlier point
//! give.

use super::{Equilibrium, MOMENT_ARM_M, Target, block, parts, stack};
use friction::dense::lu_solve;
use spatial::Vec3;

impl Equilibrium {
    /// Misfit of force and moment about the fixed point O (world axes) and of the sliding points' conditions, which go behind the
    /// six columns of `js`. Returns the largest, scaled by the load.
    pub(super) fn residual(&mut self, target: &Target) -> f64 {
        let (r, o) = (self.stance.pose.rotation, self.stance.pose.translation);
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for slot in 0..self.stiffness.len() {
            let f = r * block(&self.scratch.f, slot);
            force += f;
            moment += (self.scratch.world[slot] - o).cross(&f);
        }
        self.scratch.misfit = stack(&force, &moment) - target.wrench(&o)[0];
        let load = target.force[0].norm();
        let (force, moment) = parts(&self.scratch.misfit);
        let about_zmp = moment - (target.point(0) - o).cross(&force);
        let mut scaled = (force.amax() / load).max(about_zmp.amax() / (MOMENT_ARM_M * load));
        for i in 0..self.scratch.sliding.len() {
            let law = self.law(self.scratch.sliding[i], &(r * block(&self.scratch.f, self.scratch.sliding_slots[i])));
            scaled = scaled.max(law.residual.amax() / load);
            self.scratch.js[[2 * i, 6]] = law.residual.x;
            self.scratch.js[[2 * i + 1, 6]] = law.residual.y;
        }
        scaled
    }

    /// Eliminates the sliding points from the present residual with the factors of an earlier point of the same sliding set:
    /// the right-hand side of a simplified Newton step.
    pub(super) fn reduce_with_old_factors(&mut self) {
        let s = self.scratch.sliding.len();
        self.scratch.right_hand = self.scratch.misfit;
        if s > 0 {
            self.solve_slips();
            for i in 0..2 * s {
                self.scratch.right_hand.axpy(-self.scratch.js[[i, 6]], &self.scratch.jxs[i], 1.0);
            }
        }
    }

    /// `J_ss^-1` of the last column of `js`, with the factors at hand.
    pub(super) fn solve_slips(&mut self) {
        let scratch = &mut self.scratch;
        let (rows, count) = (scratch.jss.rows(), 2 * scratch.sliding.len());
        lu_solve(scratch.jss.from(0), rows, count, &scratch.pivots, scratch.js.from_mut(6), 1);
    }
}
