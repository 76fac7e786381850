//! Forces at a given pose: displacements prescribed by the references, slips added.

use super::{COLUMN_OF_ONES, COLUMN_OF_PAST, COLUMN_OF_PLACES, PoseDrivenContact};
use friction::ContactState;
use friction::dense::{add_one, add_three};
use spatial::{Mat3, Vec3};

impl PoseDrivenContact {
    /// Forces as if every point in contact were where it is in the columns.
    pub(super) fn find_base(&mut self) {
        let m = 3 * self.stiffness.len();
        let (beta, rotation) = (self.beta, &self.pose.rotation);
        let (base, k) = (&mut self.base[..m], &self.stiffness);
        base.fill(0.0);
        for a in 0..3 {
            let r = beta * rotation.column(a);
            add_three(base, k.y(3 * a), k.y(3 * a + 1), k.y(3 * a + 2), r.x, r.y, r.z);
        }
        let o = -beta * rotation.tr_mul(&(self.pose.translation - self.anchor));
        let ones = COLUMN_OF_ONES;
        add_three(base, k.y(ones), k.y(ones + 1), k.y(ones + 2), o.x, o.y, o.z);
        add_one(base, k.y(COLUMN_OF_PLACES), -beta);
        add_one(base, k.y(COLUMN_OF_PAST), 1.0 - beta);
    }

    /// How far a point in contact is from where it is in the columns.
    pub(super) fn offset(&self, point: usize) -> Vec3 {
        let place = &self.places[point];
        let mut offset = place.reference - self.anchor - self.columned[point];
        if self.states[point] == ContactState::Slip {
            let (x, y) = (self.slips[point].x, self.slips[point].y);
            offset += place.frame.column(0) * x + place.frame.column(1) * y;
        }
        offset
    }

    /// `f = base + beta K offsets`, world forces by slot, and the list of sliding points.
    pub(super) fn add_slips(&mut self) {
        let m = 3 * self.stiffness.len();
        self.f[..m].copy_from_slice(&self.base[..m]);
        self.sliding.clear();
        for slot in 0..self.stiffness.len() {
            let point = self.stiffness.points()[slot];
            if self.states[point] == ContactState::Slip {
                self.sliding.push(point);
            }
            let offset = self.offset(point);
            if offset != Vec3::zeros() {
                let c = self.beta * self.pose.rotation.tr_mul(&offset);
                let (j, k) = (3 * slot, &self.stiffness);
                add_three(&mut self.f[..m], k.column(j), k.column(j + 1), k.column(j + 2), c.x, c.y, c.z);
            }
        }
        let rotation = &self.pose.rotation;
        for (force, f) in self.forces.iter_mut().zip(self.f[..m].chunks_exact(3)) {
            *force = rotation * Vec3::new(f[0], f[1], f[2]);
        }
    }

    /// Elastic forces at all points.
    pub(super) fn press(&mut self) {
        let keep = self.keep();
        for (elastic, last) in self.elastic.iter_mut().zip(&self.last_elastic) {
            *elastic = keep * last;
        }
        let inverse = 1.0 / self.beta;
        for (point, f) in self.stiffness.points().iter().zip(self.f.chunks_exact(3)) {
            let elastic = &mut self.elastic[3 * point..3 * point + 3];
            for axis in 0..3 {
                elastic[axis] += inverse * f[axis];
            }
        }
        self.screen.take(&self.elastic, &self.last_elastic);
    }

    /// Rotation from the sole's axes to the local frame of a point.
    pub(super) fn turn(&self, point: usize) -> Mat3 {
        self.places[point].frame.tr_mul(&self.pose.rotation)
    }
}
