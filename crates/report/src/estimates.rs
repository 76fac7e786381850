//! What the estimator's solver did, foot by foot under load.

use messages::SoleDeformation;
use messages::code::Outcome;
use serde::{Deserialize, Serialize};

/// Counts over a walk.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Estimates {
    /// Feet under load that were solved to tolerance.
    pub solved: u64,
    /// Feet under load that were not.
    pub not_solved: u64,
    /// Iterations of those that were.
    pub iterations: u64,
    /// Most of them in one.
    pub iterations_max: u32,
    /// Largest residual of those that were solved.
    pub residual_max: f64,
}

impl Estimates {
    /// Takes a deformation.
    pub(crate) fn take(&mut self, deformation: &SoleDeformation) {
        for foot in deformation.feet.iter().filter(|foot| foot.loaded == 1) {
            match Outcome::from_code(foot.status) {
                Some(Outcome::Solved) => {
                    self.solved += 1;
                    self.iterations += u64::from(foot.iterations);
                    self.iterations_max = self.iterations_max.max(foot.iterations);
                    self.residual_max = self.residual_max.max(foot.residual);
                }
                Some(Outcome::None) => {}
                _ => self.not_solved += 1,
            }
        }
    }

    /// Iterations per foot that was solved.
    #[must_use]
    pub fn iterations_mean(&self) -> f64 {
        self.iterations as f64 / self.solved.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feet_under_load_count_by_how_they_ended() {
        let mut estimates = Estimates::default();
        let mut deformation = SoleDeformation::default();
        let [left, right] = &mut deformation.feet;
        (left.loaded, left.status, left.iterations, left.residual) = (1, Outcome::Solved.code(), 4, 1e-9);
        (right.loaded, right.status, right.iterations, right.residual) = (1, Outcome::Held.code(), 50, 1.0);
        estimates.take(&deformation);
        let [left, right] = &mut deformation.feet;
        (left.iterations, left.residual, right.loaded) = (7, 3e-9, 0);
        estimates.take(&deformation);
        assert_eq!((estimates.solved, estimates.not_solved, estimates.iterations_max), (2, 1, 7));
        assert_eq!((estimates.iterations_mean(), estimates.residual_max), (5.5, 3e-9));
    }
}
