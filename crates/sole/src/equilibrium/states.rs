//! Which points are free, stick or slide: forces and gaps at the present pose decide.

use super::{Change, Equilibrium, SCREEN, block, flat, rows};
use friction::ContactState;
use friction::dense::{add_one, add_three, dot};
use nalgebra::Vector2;
use spatial::Vec3;

impl Equilibrium {
    /// `f = K_c u` and the world positions of the points in contact at the present pose and slips.
    pub(super) fn evaluate(&mut self) {
        let (m, ld) = (3 * self.stiffness.len(), self.stiffness.ld());
        let families = self.families();
        let (count, q) = families;
        let f = &mut self.scratch.f[..m];
        f.fill(0.0);
        for k in 0..count {
            let offset = if k == 0 { self.stance.pose.translation } else { Vec3::zeros() };
            let c = self.stance.pose.rotation.tr_mul(&(q[k] - offset));
            add_three(
                f,
                self.stiffness.y(3 * k),
                self.stiffness.y(3 * k + 1),
                self.stiffness.y(3 * k + 2),
                c.x,
                c.y,
                c.z,
            );
        }
        add_one(f, self.stiffness.y(3 * count), -1.0);
        self.scratch.sliding.clear();
        self.scratch.sliding_slots.clear();
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            if self.stance.states[*point] == ContactState::Slip {
                self.scratch.sliding.push(*point);
                self.scratch.sliding_slots.push(slot);
                let c = self.stance.pose.rotation.tr_mul(&flat(&self.stance.slips[*point]));
                let j = 3 * slot;
                let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
                add_three(f, x, y, z, c.x, c.y, c.z);
            }
        }
        self.scratch.force_full[..ld].fill(0.0);
        for slot in 0..self.stiffness.len() {
            let point = self.stiffness.points()[slot];
            self.scratch.force_full[3 * point..3 * point + 3].copy_from_slice(&self.scratch.f[3 * slot..3 * slot + 3]);
            self.scratch.world[slot] = self.reference(point, &families) + flat(&self.stance.slips[point]);
        }
    }

    /// Height of a free point above the ground.
    pub(super) fn gap(&self, point: usize) -> f64 {
        let up = self.stance.pose.rotation.row(2);
        let p = &self.sole.model.contact_points()[point];
        let c = self.sole.model.compliance().as_slice();
        let ld = self.stiffness.ld();
        let u = |axis: usize| dot(&c[(3 * point + axis) * ld..(3 * point + axis + 1) * ld], &self.scratch.force_full);
        self.stance.pose.translation.z + up[0] * (p.x + u(0)) + up[1] * (p.y + u(1)) + up[2] * (p.z + u(2))
    }

    /// Largest displacement of a point in contact (m).
    pub(super) fn largest_displacement(&self) -> f64 {
        let mut largest = 0.0_f64;
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let local = self.stance.pose.rotation.tr_mul(&(self.scratch.world[slot] - self.stance.pose.translation));
            largest = largest.max((local - self.sole.model.contact_points()[*point]).norm_squared());
        }
        largest.sqrt()
    }

    /// World position of a free point.
    pub(super) fn free_position(&self, point: usize) -> Vec3 {
        let c = self.sole.model.compliance().as_slice();
        let ld = self.stiffness.ld();
        let u = Vec3::from_fn(|axis, _| {
            dot(&c[(3 * point + axis) * ld..(3 * point + axis + 1) * ld], &self.scratch.force_full)
        });
        self.stance.pose.point(&(self.sole.model.contact_points()[point] + u))
    }

    /// New states from the present forces and gaps; true when any changed.
    pub(super) fn update_states(&mut self) -> bool {
        self.scratch.changes.clear();
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let force = self.stance.pose.rotation * block(&self.scratch.f, slot);
            let (tangential, normal) = (Vector2::new(force.x, force.y), force.z);
            let bound = self.sole.model.friction()[*point] * normal;
            let change = |to: ContactState| Change { point: *point, to };
            if normal < -self.sole.floor_n {
                self.scratch.changes.push(change(ContactState::Open));
            } else if self.stance.states[*point] == ContactState::Stick {
                let excess = tangential.norm() - bound;
                if excess > self.sole.floor_n {
                    self.scratch.changes.push(change(ContactState::Slip));
                }
            } else {
                let slack = bound - (tangential - self.sole.rho[*point] * self.stance.slips[*point]).norm();
                if slack > self.sole.floor_n {
                    self.scratch.changes.push(change(ContactState::Stick));
                }
            }
        }
        let far = if self.screening { SCREEN * self.largest_displacement() } else { f64::INFINITY };
        for point in 0..self.stance.states.len() {
            if self.stance.states[point] == ContactState::Open
                && self.stance.pose.point(&self.sole.model.contact_points()[point]).z < far
            {
                let gap = self.gap(point);
                if gap < -self.sole.floor_m {
                    self.scratch.changes.push(Change { point, to: ContactState::Stick });
                }
            }
        }
        let families = self.families();
        for k in 0..self.scratch.changes.len() {
            let Change { point, to } = self.scratch.changes[k];
            if self.stance.states[point] == ContactState::Open {
                // Lands: sliding when its way since the reference is more sideways than friction can hold.
                let away = self.free_position(point) - self.reference(point, &families);
                let tangential = Vector2::new(away.x, away.y);
                let slides = tangential.norm() > self.sole.model.friction()[point] * away.z.abs();
                self.stance.states[point] = if slides { ContactState::Slip } else { ContactState::Stick };
                self.stance.slips[point] = if slides { tangential } else { Vector2::zeros() };
                self.land(point);
            } else if to == ContactState::Open {
                self.lift(point);
            } else {
                self.stance.states[point] = to;
                self.stance.slips[point] = Vector2::zeros();
            }
        }
        !self.scratch.changes.is_empty()
    }

    pub(super) fn land(&mut self, point: usize) {
        self.work.landings += 1;
        let count = self.families().0;
        let z = rows(&self.scalars(point)[..count], &self.sole.model.contact_points()[point]);
        self.stiffness.land(&self.sole.model, point, &z);
    }

    pub(super) fn lift(&mut self, point: usize) {
        self.work.lift_offs += 1;
        self.stance.states[point] = ContactState::Open;
        self.stance.slips[point] = Vector2::zeros();
        self.stiffness.lift(point);
    }
}
