//! States and slips found from scratch by the `friction` crate, where the active sets run in circles.

use super::PoseDrivenContact;
use super::history::displacement;
use crate::Ground;
use friction::{ContactProblem, ContactState, Settings, Workspace};
use nalgebra::{DMatrix, DVector, Vector2};
use spatial::Mat3;

/// Memory of the problem.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    turns: Vec<Mat3>,
}

impl Scratch {
    pub fn new(n: usize) -> Self {
        Self { turns: vec![Mat3::identity(); n] }
    }
}

impl PoseDrivenContact {
    /// States and slips from scratch by the `friction` crate; false when it fails too. Allocates: only on this slow path.
    pub(super) fn settle_from_scratch(&mut self, ground: &dyn Ground) -> bool {
        let n = self.states.len();
        for point in 0..n {
            if !self.places[point].exact {
                self.place_exactly(point, ground);
            }
            self.scratch.turns[point] = self.turn(point);
        }
        let (c, beta, keep) = (self.model.compliance(), self.beta, self.keep());
        let mut delassus = DMatrix::zeros(3 * n, 3 * n);
        let mut free = DVector::zeros(3 * n);
        let turns = &self.scratch.turns;
        for b in 0..n {
            for a in 0..n {
                let block = turns[a] * c.fixed_view::<3, 3>(3 * a, 3 * b) * turns[b].transpose() / beta;
                delassus.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(&block);
            }
            let shift = keep * displacement(&self.model, &self.last_elastic, b);
            let undeformed = self.pose.point(&(self.model.contact_points()[b] + shift));
            let place = &self.places[b];
            free.fixed_rows_mut::<3>(3 * b).copy_from(&place.frame.tr_mul(&(undeformed - place.reference)));
        }
        let mu = self.places.iter().map(|place| place.mu).collect();
        let Ok(problem) = ContactProblem::of_model(delassus, free, mu) else { return false };
        let mut workspace = Workspace::new(n);
        let settings = Settings { tolerance: self.settings.tolerance, ..Settings::default() };
        let answer = friction::solve(&problem, &mut workspace, &settings);
        for point in 0..n {
            self.slips[point] = Vector2::zeros();
            self.states[point] = match workspace.states()[point] {
                ContactState::Open => ContactState::Open,
                ContactState::Stick => ContactState::Stick,
                ContactState::Slip => {
                    self.slips[point] = answer.delta.fixed_rows::<2>(3 * point).into();
                    ContactState::Slip
                }
            };
        }
        self.changes += 1;
        self.follow_states();
        self.slide.forget();
        true
    }
}
