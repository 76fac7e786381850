//! How far the present point is from carrying the load and from the sliding laws, and the step that factors of an earlier point
//! give.

use super::{Equilibrium, MOMENT_ARM_M, Target, block, parts, stack};
use friction::dense::lu_solve;
use spatial::{Vec3, Vec6};

impl Equilibrium {
    /// Misfit of force and moment about the fixed point O (world axes) and of the sliding points' conditions, which go behind the
    /// six columns of `js`. Returns the largest, scaled by the load.
    pub(super) fn residual(&mut self, target: &Target) -> f64 {
        let (r, o) = (self.pose.rotation, self.pose.translation);
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for slot in 0..self.stiffness.len() {
            let f = r * block(&self.f, slot);
            force += f;
            moment += (self.world[slot] - o).cross(&f);
        }
        self.misfit = stack(&force, &moment) - target.wrench(&o)[0];
        let load = target.force[0].norm();
        let (force, moment) = parts(&self.misfit);
        let about_zmp = moment - (target.point(0) - o).cross(&force);
        let mut scaled = (force.amax() / load).max(about_zmp.amax() / (MOMENT_ARM_M * load));
        let conditions = 6 * 2 * self.states.len();
        for i in 0..self.sliding.len() {
            let law = self.law(self.sliding[i], &(r * block(&self.f, self.sliding_slots[i])));
            scaled = scaled.max(law.residual.amax() / load);
            self.js[conditions + 2 * i] = law.residual.x;
            self.js[conditions + 2 * i + 1] = law.residual.y;
        }
        scaled
    }

    /// Eliminates the sliding points from the present residual with the factors of an earlier point of the same sliding set:
    /// the right-hand side of a simplified Newton step.
    pub(super) fn reduce_with_old_factors(&mut self) {
        let (rows_s, s) = (2 * self.states.len(), self.sliding.len());
        self.right_hand = self.misfit;
        if s > 0 {
            lu_solve(&self.jss, rows_s, 2 * s, &self.pivots, &mut self.js[6 * rows_s..], 1);
            for i in 0..2 * s {
                let back = Vec6::from_column_slice(&self.jxs[6 * i..6 * i + 6]);
                self.right_hand.axpy(-self.js[6 * rows_s + i], &back, 1.0);
            }
        }
    }
}
