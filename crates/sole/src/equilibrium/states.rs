//! Which points are free, stick or slide: forces and gaps at the present pose decide.

use super::{Change, Equilibrium, SCREEN, block, flat, rows};
use crate::NodeState;
use friction::dense::{add_one, add_three, dot};
use nalgebra::Vector2;
use spatial::Vec3;

impl Equilibrium {
    /// `f = K_c u` and the world positions of the points in contact at the present pose and slips.
    pub(super) fn evaluate(&mut self) {
        let (m, ld) = (3 * self.stiffness.len(), self.stiffness.ld());
        let families = self.families();
        let (count, q) = families;
        let f = &mut self.f[..m];
        f.fill(0.0);
        for k in 0..count {
            let offset = if k == 0 { self.pose.translation } else { Vec3::zeros() };
            let c = self.pose.rotation.tr_mul(&(q[k] - offset));
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
        self.sliding.clear();
        self.sliding_slots.clear();
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            if self.states[*point] == NodeState::Slip {
                self.sliding.push(*point);
                self.sliding_slots.push(slot);
                let c = self.pose.rotation.tr_mul(&flat(&self.slips[*point]));
                let j = 3 * slot;
                let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
                add_three(f, x, y, z, c.x, c.y, c.z);
            }
        }
        self.force_full[..ld].fill(0.0);
        for slot in 0..self.stiffness.len() {
            let point = self.stiffness.points()[slot];
            self.force_full[3 * point..3 * point + 3].copy_from_slice(&self.f[3 * slot..3 * slot + 3]);
            self.world[slot] = self.reference(point, &families) + flat(&self.slips[point]);
        }
    }

    /// Height of a free point above the ground.
    pub(super) fn gap(&self, point: usize) -> f64 {
        let up = self.pose.rotation.row(2);
        let p = &self.model.contact_points()[point];
        let c = self.model.compliance().as_slice();
        let ld = self.stiffness.ld();
        let u = |axis: usize| dot(&c[(3 * point + axis) * ld..(3 * point + axis + 1) * ld], &self.force_full);
        self.pose.translation.z + up[0] * (p.x + u(0)) + up[1] * (p.y + u(1)) + up[2] * (p.z + u(2))
    }

    /// Largest displacement of a point in contact (m).
    pub(super) fn largest_displacement(&self) -> f64 {
        let mut largest = 0.0_f64;
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let local = self.pose.rotation.tr_mul(&(self.world[slot] - self.pose.translation));
            largest = largest.max((local - self.model.contact_points()[*point]).norm_squared());
        }
        largest.sqrt()
    }

    /// World position of a free point.
    pub(super) fn free_position(&self, point: usize) -> Vec3 {
        let c = self.model.compliance().as_slice();
        let ld = self.stiffness.ld();
        let u =
            Vec3::from_fn(|axis, _| dot(&c[(3 * point + axis) * ld..(3 * point + axis + 1) * ld], &self.force_full));
        self.pose.point(&(self.model.contact_points()[point] + u))
    }

    /// New states from the present forces and gaps; true when any changed.
    pub(super) fn update_states(&mut self) -> bool {
        self.changes.clear();
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let force = self.pose.rotation * block(&self.f, slot);
            let (tangential, normal) = (Vector2::new(force.x, force.y), force.z);
            let bound = self.model.friction()[*point] * normal;
            let change = |to: NodeState| Change { point: *point, to };
            if normal < -self.floor_n {
                self.changes.push(change(NodeState::Free));
            } else if self.states[*point] == NodeState::Stick {
                let excess = tangential.norm() - bound;
                if excess > self.floor_n {
                    self.changes.push(change(NodeState::Slip));
                }
            } else {
                let slack = bound - (tangential - self.rho[*point] * self.slips[*point]).norm();
                if slack > self.floor_n {
                    self.changes.push(change(NodeState::Stick));
                }
            }
        }
        let far = if self.screening { SCREEN * self.largest_displacement() } else { f64::INFINITY };
        for point in 0..self.states.len() {
            if self.states[point] == NodeState::Free && self.pose.point(&self.model.contact_points()[point]).z < far {
                let gap = self.gap(point);
                if gap < -self.floor_m {
                    self.changes.push(Change { point, to: NodeState::Stick });
                }
            }
        }
        let families = self.families();
        for k in 0..self.changes.len() {
            let Change { point, to } = self.changes[k];
            if self.states[point] == NodeState::Free {
                // Lands: sliding when its way since the reference is more sideways than friction can hold.
                let away = self.free_position(point) - self.reference(point, &families);
                let tangential = Vector2::new(away.x, away.y);
                let slides = tangential.norm() > self.model.friction()[point] * away.z.abs();
                self.states[point] = if slides { NodeState::Slip } else { NodeState::Stick };
                self.slips[point] = if slides { tangential } else { Vector2::zeros() };
                self.land(point);
            } else if to == NodeState::Free {
                self.lift(point);
            } else {
                self.states[point] = to;
                self.slips[point] = Vector2::zeros();
            }
        }
        !self.changes.is_empty()
    }

    pub(super) fn land(&mut self, point: usize) {
        self.work.landings += 1;
        let count = self.families().0;
        let z = rows(&self.scalars(point)[..count], &self.model.contact_points()[point]);
        self.stiffness.land(&self.model, point, &z);
    }

    pub(super) fn lift(&mut self, point: usize) {
        self.work.lift_offs += 1;
        self.states[point] = NodeState::Free;
        self.slips[point] = Vector2::zeros();
        self.stiffness.lift(point);
    }
}
