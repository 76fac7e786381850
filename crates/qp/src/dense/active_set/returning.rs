//! Sets of rows that return: rounding makes the solver go in a circle.

use super::ActiveSet;

/// Active sets remembered to notice one that returns.
pub(super) const HISTORY: usize = 64;
/// The tolerance is raised at most this far when sets return.
pub(super) const LOOSENING_MAX: f64 = 1e6;

impl ActiveSet {
    /// Loosens the tolerance when an active set returns.
    pub(super) fn notice_return(&mut self) {
        let mark = self.held.iter().fold(1, |sum, k| sum ^ scrambled(2 * k.row as u64 + u64::from(k.sign > 0.0)));
        if self.history.contains(&mark) {
            self.loosening = (10.0 * self.loosening).min(LOOSENING_MAX);
            self.history.fill(0);
        }
        self.history.copy_within(..HISTORY - 1, 1);
        self.history[0] = mark;
    }
}

/// One step of SplitMix64 (Steele, Lea, Flood 2014): a hash whose exclusive-or over a set marks the set.
fn scrambled(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::super::{ActiveSetSettings, Held, Solver};
    use super::*;
    use crate::dense::{Problem, Size};

    #[test]
    fn a_set_that_returns_raises_the_tolerance_until_the_next_program() {
        let problem = Problem::new(Size { variables: 3, equalities: 0, inequalities: 2 });
        let mut solver = ActiveSet::new(problem.size(), ActiveSetSettings::default());
        let (lower, upper, other) =
            (Held { row: 1, sign: 1.0 }, Held { row: 1, sign: -1.0 }, Held { row: 4, sign: 1.0 });
        let mut raised = |held: &[Held]| {
            solver.held = held.to_vec();
            solver.notice_return();
            solver.loosening
        };
        assert_eq!(raised(&[lower]), 1.0);
        assert_eq!(raised(&[upper]), 1.0, "the other side is another set");
        assert_eq!(raised(&[upper, other]), 1.0);
        assert_eq!(raised(&[other, upper]), 10.0, "in another order it is the same set");
        assert_eq!(raised(&[lower]), 1.0 * 10.0, "what was before the tolerance was raised does not count");
        for _ in 0..20 {
            raised(&[lower]);
        }
        assert_eq!(raised(&[lower]), LOOSENING_MAX);
        solver.solve(&problem);
        assert_eq!(solver.loosening, 1.0);
    }
}
