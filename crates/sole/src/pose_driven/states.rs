//! Which points are free, stick or slide, by their forces and gaps.

use super::PoseDrivenContact;
use super::history::displacement;
use crate::Ground;
use friction::ContactState;
use nalgebra::Vector2;
use spatial::Vec3;

/// A free point's gap is measured from a plane of the ground near it. Grounds no steeper than three to one are then no nearer than its
/// distance less this many times what the point's place is unsure by.
const UNSURE: f64 = 4.0;

impl PoseDrivenContact {
    /// New states from forces and gaps; (contact set changed, anything else changed).
    pub(super) fn update_states(&mut self, ground: &dyn Ground) -> (bool, bool) {
        let (mut set_changed, mut changed) = (false, false);
        let (floor_n, floor_m) = (self.floor_n(), self.floor_m());
        for slot in 0..self.stiffness.len() {
            let point = self.stiffness.points()[slot];
            let place = &self.places[point];
            let force = place.frame.tr_mul(&self.forces[slot]);
            let bound = place.mu * force.z;
            let tangential = force.xy();
            let to = if force.z < -floor_n {
                set_changed = true;
                ContactState::Open
            } else if self.states[point] == ContactState::Stick {
                if tangential.norm() <= bound + floor_n {
                    continue;
                }
                changed = true;
                ContactState::Slip
            } else if (tangential - self.beta * self.rho[point] * self.slips[point]).norm() < bound - floor_n {
                changed = true;
                ContactState::Stick
            } else {
                continue;
            };
            self.changes += 1;
            self.states[point] = to;
            self.slips[point] = Vector2::zeros();
        }
        let surely = if ground.is_plane() { 1.0 } else { UNSURE };
        for point in 0..self.states.len() {
            if self.states[point] != ContactState::Open || self.stiffness.slot(point).is_some() {
                continue;
            }
            let Some(away) = self.away_from_ground(point, surely, ground) else { continue };
            if away.z < -floor_m {
                let slides = away.xy().norm() > self.places[point].mu * away.z.abs();
                self.states[point] = if slides { ContactState::Slip } else { ContactState::Stick };
                self.slips[point] = if slides { away.xy() } else { Vector2::zeros() };
                self.changes += 1;
                set_changed = true;
            }
        }
        if set_changed {
            self.follow_states();
        }
        (set_changed, changed)
    }

    /// Where a free point is relative to its reference, in the local frame; `None` when it is too far from the ground to land, wherever
    /// exactly it is.
    fn away_from_ground(&mut self, point: usize, surely: f64, ground: &dyn Ground) -> Option<Vec3> {
        let p = self.model.contact_points()[point];
        let far = |contact: &Self, surely: f64| {
            let place = &contact.places[point];
            let at = contact.pose.point(&(p + contact.screen.u[point]));
            let gap_m = place.frame.column(2).dot(&(at - place.reference));
            gap_m > 0.0 && gap_m > surely * contact.screen.reach_m(point, gap_m / surely)
        };
        if !self.places[point].exact {
            if far(self, surely) {
                return None;
            }
            self.place_exactly(point, ground);
        }
        // Its plane is settled for this step: only the point moves.
        if far(self, 1.0) {
            return None;
        }
        let place = &self.places[point];
        let at = self.pose.point(&(p + displacement(&self.model, &self.elastic, point)));
        Some(place.frame.tr_mul(&(at - place.reference)))
    }
}
