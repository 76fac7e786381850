//! What is reported when the iteration is over.

use super::history::displacement;
use super::{ACCEPTED, ContactReport, ContactStatus, PoseDrivenContact};
use friction::ContactState;
use friction::natural_map;
use nalgebra::Vector2;
use spatial::{Vec3, Wrench};

impl PoseDrivenContact {
    /// Wrench, residual, status.
    pub(super) fn finish(&mut self) {
        let report = &mut self.report;
        report.wrench = Wrench::zero();
        report.residual = 0.0;
        report.friction_work_j = 0.0;
        if self.stiffness.len() == 0 {
            report.status = ContactStatus::NoContact;
            return;
        }
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        let (mut largest, mut worst, mut friction_work_j) = (0.0_f64, 0.0_f64, 0.0);
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let (place, f, slip) = (&self.places[*point], &self.forces[slot], &self.slips[*point]);
            let mut at = place.reference;
            let local = place.frame.tr_mul(f);
            if self.states[*point] == ContactState::Slip {
                at += place.frame.column(0) * slip.x + place.frame.column(1) * slip.y;
                friction_work_j -= local.x * slip.x + local.y * slip.y;
            }
            force += f;
            moment += (at - self.pose.translation).cross(f);
            largest = largest.max(f.norm_squared());
            // Forces in the cone and no motion: both laws hold, whatever the stiffness.
            let holds = *slip == Vector2::zeros() && local.xy().norm() <= place.mu * local.z;
            if !holds {
                let delta = Vec3::new(slip.x, slip.y, 0.0);
                worst = worst.max(natural_map(place.mu, self.beta * self.rho[*point], &local, &delta).norm_squared());
            }
        }
        let (largest, worst) = (largest.sqrt(), worst.sqrt());
        let (floor_n, tolerance) = (self.floor_n(), self.settings.tolerance);
        let report = &mut self.report;
        report.wrench = Wrench { force, moment };
        report.friction_work_j = friction_work_j;
        report.residual = if largest > 0.0 { (worst / largest).max(self.drift) } else { 0.0 };
        // Written so that what is not a number is not solved.
        let met = worst <= ACCEPTED * (tolerance * largest).max(floor_n);
        report.status = if met { ContactStatus::Solved } else { ContactStatus::NotConverged };
    }

    /// Fills the rest of the report but the tangent: states, forces and positions of all points, the elastic energy.
    pub fn complete(&mut self) -> &ContactReport {
        let report = &mut self.report;
        report.node_states.copy_from_slice(&self.states);
        report.node_forces.fill(Vec3::zeros());
        report.elastic_energy_j = 0.0;
        let relaxed = self.elastic.iter().all(|e| *e == 0.0);
        for (point, p) in self.model.contact_points().iter().enumerate() {
            let (at, u) = if let Some(slot) = self.stiffness.slot(point) {
                report.node_forces[point] = self.forces[slot];
                let (place, slip) = (&self.places[point], &self.slips[point]);
                let at = place.reference + place.frame.column(0) * slip.x + place.frame.column(1) * slip.y;
                (at, self.pose.rotation.tr_mul(&(at - self.pose.translation)) - p)
            } else {
                let u = if relaxed { Vec3::zeros() } else { displacement(&self.model, &self.elastic, point) };
                (self.pose.point(&(p + u)), u)
            };
            report.node_positions[point] = at;
            let elastic = &self.elastic[3 * point..3 * point + 3];
            report.elastic_energy_j += 0.5 * (u.x * elastic[0] + u.y * elastic[1] + u.z * elastic[2]);
        }
        report
    }
}
