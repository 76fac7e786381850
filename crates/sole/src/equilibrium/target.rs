//! What the sole must carry, and how it changes.

use super::stack;
use nalgebra::Vector2;
use spatial::{Vec3, Vec6};

/// What the sole must carry, and how it changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Target {
    /// Force of the ground on the sole, world (N), rate, second rate.
    pub force: [Vec3; 3],
    /// Zero-moment point on the ground (m), rate, second rate.
    pub zmp: [Vector2<f64>; 3],
}

impl Target {
    pub(super) fn point(&self, order: usize) -> Vec3 {
        Vec3::new(self.zmp[order].x, self.zmp[order].y, 0.0)
    }

    /// Wrench about the fixed point `c` and its first two time derivatives.
    pub(super) fn wrench(&self, c: &Vec3) -> [Vec6; 3] {
        let [f, fd, fdd] = self.force;
        let (p, pd, pdd) = (self.point(0) - c, self.point(1), self.point(2));
        [
            stack(&f, &p.cross(&f)),
            stack(&fd, &(pd.cross(&f) + p.cross(&fd))),
            stack(&fdd, &(pdd.cross(&f) + 2.0 * pd.cross(&fd) + p.cross(&fdd))),
        ]
    }

    /// On the straight way from one load to another: force and moments in proportion, so the ZMP goes where the larger force is. A load
    /// that grows small keeps its ZMP until it is; moved in proportion too, that would be far out while the force is still large, where
    /// there may be no pose (values only).
    pub(crate) fn between(&self, to: &Self, fraction: f64) -> Self {
        let mut out = *to;
        let (old, new) = ((1.0 - fraction) * self.force[0], fraction * to.force[0]);
        out.force[0] = old + new;
        // Both press: the caller refuses targets that do not.
        out.zmp[0] = (old.z * self.zmp[0] + new.z * to.zmp[0]) / out.force[0].z;
        out
    }

    /// The same with the rates of force and ZMP with the fraction in place of those with time.
    pub(super) fn on_way(&self, to: &Self, fraction: f64) -> Self {
        let mut out = self.between(to, fraction);
        let (old, new) = (self.force[0], to.force[0]);
        out.force[1] = new - old;
        out.zmp[1] = (new.z * (to.zmp[0] - out.zmp[0]) - old.z * (self.zmp[0] - out.zmp[0])) / out.force[0].z;
        out
    }

    /// Fraction at which the vertical force has gone a part of its way in equal ratios: from 400 N to 1 N one half is 20 N.
    pub(crate) fn fraction_at(&self, to: &Self, part: f64) -> f64 {
        let ratio = (to.force[0].z / self.force[0].z).ln();
        if ratio == 0.0 { part } else { (part * ratio).exp_m1() / ratio.exp_m1() }
    }

    /// The part of the way in equal ratios that has been gone at a fraction.
    pub(crate) fn part_at(&self, to: &Self, fraction: f64) -> f64 {
        let ratio = (to.force[0].z / self.force[0].z).ln();
        if ratio == 0.0 { fraction } else { (fraction * ratio.exp_m1()).ln_1p() / ratio }
    }
}
