//! Where the feet were when the robot was as it is measured now.

use crate::observer::FootAnchor;
use std::collections::VecDeque;

/// Soles known of this many ticks before stand in for those of a tick of which none are known: as long as the controller goes on without
/// them.
const AGE_MAX_TICKS: i64 = 2;

/// The feet of the last ticks. Its memory is allocated when it is made.
#[derive(Debug, Clone)]
pub struct AnchorHistory {
    /// Ticks by which what is measured is older than the plan's present.
    behind_ticks: i64,
    /// Oldest first: one that is needed, or the last before it, and the later ones.
    anchors: VecDeque<(i64, [FootAnchor; 2])>,
}

impl AnchorHistory {
    /// Nothing known yet.
    #[must_use]
    pub fn new(behind_ticks: usize) -> Self {
        Self { behind_ticks: behind_ticks as i64, anchors: VecDeque::with_capacity(behind_ticks + 2) }
    }

    /// Forgets everything: another walk is to be walked.
    pub fn clear(&mut self) {
        self.anchors.clear();
    }

    /// Remembers the feet of a tick, whatever is measured. Ticks may be missing, and the last ones may come again.
    pub fn remember(&mut self, tick: i64, feet: [FootAnchor; 2]) {
        if self.anchors.back().is_some_and(|(last, _)| *last >= tick) {
            return;
        }
        let needed_tick = tick.saturating_sub(self.behind_ticks);
        while self.anchors.get(1).is_some_and(|(next, _)| *next <= needed_tick) {
            self.anchors.pop_front();
        }
        self.anchors.push_back((tick, feet));
    }

    /// Where the feet were when the robot was as it is measured at this tick: at the last tick up to then, or, when there is no past, at
    /// the first one. `None` if that was long before.
    #[must_use]
    pub fn at(&self, measured_tick: i64) -> Option<[FootAnchor; 2]> {
        let tick = measured_tick.saturating_sub(self.behind_ticks);
        let known = self.anchors.iter().rev().find(|(at, _)| *at <= tick).or(self.anchors.front());
        known.filter(|(at, _)| tick.saturating_sub(*at) <= AGE_MAX_TICKS).map(|(_, feet)| *feet)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spatial::{Transform, Twist};

    fn at(tick: i64) -> [FootAnchor; 2] {
        let ankle_pose = Transform::from_translation(spatial::Vec3::new(tick as f64, 0.0, 0.0));
        [FootAnchor { in_contact: true, load_share: 0.5, ankle_pose, ankle_twist: Twist::zero() }; 2]
    }

    #[test]
    fn the_feet_of_the_right_tick_are_known_within_the_first_memory() {
        for behind_ticks in [1, 4] {
            let mut history = AnchorHistory::new(behind_ticks);
            let capacity = history.anchors.capacity();
            // Every seventh tick is missing: the one before stands in for it.
            for tick in (0..100).filter(|tick| tick % 7 != 3) {
                history.remember(tick, at(tick));
                history.remember(tick, at(-1));
                let wanted = (tick - behind_ticks as i64).max(0);
                let known = if wanted % 7 == 3 { wanted - 1 } else { wanted };
                assert_eq!(history.at(tick), Some(at(known)), "tick {tick}");
                assert!(history.anchors.len() <= behind_ticks + 2 && history.anchors.capacity() == capacity);
            }
        }
    }
}
