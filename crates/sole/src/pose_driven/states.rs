//! Which points are free, stick or slide: by their forces and gaps, or found from scratch.

use super::PoseDrivenContact;
use crate::NodeState;
use friction::{ContactProblem, LocalState, Settings, Workspace};
use nalgebra::Vector2;
use spatial::{Mat3, Transform, Vec3};

impl PoseDrivenContact {
    /// New states from forces and gaps; (contact set changed, anything else changed).
    pub(super) fn update_states(&mut self, pose: &Transform, beta: f64, floor_n: f64, floor_m: f64) -> (bool, bool) {
        let (mut set_changed, mut changed) = (false, false);
        for point in 0..self.states.len() {
            let place = self.places[point];
            match self.stiffness.slot(point) {
                Some(slot) => {
                    let force = self.turn(pose, point) * self.force(slot);
                    let bound = place.mu * force.z;
                    let tangential = force.xy();
                    if force.z < -floor_n {
                        self.states[point] = NodeState::Free;
                        self.slips[point] = Vector2::zeros();
                        set_changed = true;
                    } else if self.states[point] == NodeState::Stick {
                        if tangential.norm() > bound + floor_n {
                            self.states[point] = NodeState::Slip;
                            self.slips[point] = Vector2::zeros();
                            changed = true;
                        }
                    } else if (tangential - beta * self.rho[point] * self.slips[point]).norm() < bound - floor_n {
                        self.states[point] = NodeState::Stick;
                        self.slips[point] = Vector2::zeros();
                        changed = true;
                    }
                }
                None => {
                    let away = place.frame.tr_mul(&(self.report.node_positions[point] - place.reference));
                    if away.z < -floor_m {
                        let slides = away.xy().norm() > place.mu * away.z.abs();
                        self.states[point] = if slides { NodeState::Slip } else { NodeState::Stick };
                        self.slips[point] = if slides { away.xy() } else { Vector2::zeros() };
                        set_changed = true;
                    }
                }
            }
        }
        if set_changed {
            self.stiffness.synchronise(&self.model, &self.states);
        }
        (set_changed, changed)
    }

    /// States and slips from scratch by the `friction` crate; false when it fails too. Allocates: only on this slow path.
    pub(super) fn settle_from_scratch(&mut self, pose: &Transform, beta: f64) -> bool {
        let n = self.states.len();
        let keep = (beta - 1.0) / beta;
        let turns: Vec<Mat3> = (0..n).map(|point| self.turn(pose, point)).collect();
        let c = self.model.compliance();
        let mut delassus = nalgebra::DMatrix::zeros(3 * n, 3 * n);
        let mut free = nalgebra::DVector::zeros(3 * n);
        for b in 0..n {
            for a in 0..n {
                let block = turns[a] * c.fixed_view::<3, 3>(3 * a, 3 * b) * turns[b].transpose() / beta;
                delassus.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(&block);
            }
            let shift = Vec3::from_fn(|axis, _| keep * self.previous_u[3 * b + axis]);
            let undeformed = pose.point(&(self.model.contact_points()[b] + shift));
            let place = &self.places[b];
            free.fixed_rows_mut::<3>(3 * b).copy_from(&place.frame.tr_mul(&(undeformed - place.reference)));
        }
        let mu = self.places.iter().map(|place| place.mu).collect();
        let Ok(problem) = ContactProblem::new(delassus, free, mu) else { return false };
        let mut workspace = Workspace::new(n);
        let settings = Settings { tolerance: self.settings.tolerance, ..Settings::default() };
        let answer = friction::solve(&problem, &mut workspace, &settings);
        for point in 0..n {
            self.slips[point] = Vector2::zeros();
            self.states[point] = match workspace.states()[point] {
                LocalState::Open => NodeState::Free,
                LocalState::Stick => NodeState::Stick,
                LocalState::Slide => {
                    self.slips[point] = answer.delta.fixed_rows::<2>(3 * point).into();
                    NodeState::Slip
                }
            };
        }
        self.stiffness.synchronise(&self.model, &self.states);
        true
    }
}
