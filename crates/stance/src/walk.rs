//! Both feet at a tick, from pattern, plan changes and tick alone.

use pattern::{PlanChange, WalkPattern};
use sole::StanceEstimator;

use crate::StanceSettings;
use crate::foot::{Foot, FootEstimate};

/// A walk on its soles: [`WalkOnSoles::at_tick`] answers any tick, and is quick for the one after the last asked.
#[derive(Debug)]
pub struct WalkOnSoles {
    pattern: WalkPattern,
    period_s: f64,
    last_tick: i64,
    feet: [Foot; 2],
    tick: Option<i64>,
}

impl WalkOnSoles {
    /// A walk on the given soles (left, right; `None` for rigid ones), one tick each period.
    #[must_use]
    pub fn new(
        pattern: WalkPattern,
        soles: [Option<StanceEstimator>; 2],
        settings: &StanceSettings,
        period_s: f64,
    ) -> Self {
        let last_tick = (pattern.duration_s() / period_s).ceil() as i64;
        let [left, right] = soles;
        let foot = |index, sole| Foot::new(index, sole, &pattern, settings, period_s);
        let feet = [foot(0, left), foot(1, right)];
        Self { pattern, period_s, last_tick, feet, tick: None }
    }

    /// The pattern it walks.
    #[must_use]
    pub fn pattern(&self) -> &WalkPattern {
        &self.pattern
    }

    /// The soles under load, node by node: left, right.
    #[must_use]
    pub fn stances(&self) -> [Option<&StanceEstimator>; 2] {
        [self.feet[0].stance(), self.feet[1].stance()]
    }

    /// Number of the walk's last tick.
    #[must_use]
    pub fn last_tick(&self) -> i64 {
        self.last_tick
    }

    /// Walk time of a tick (s).
    #[must_use]
    pub fn time_s(&self, walk_tick: i64) -> f64 {
        walk_tick as f64 * self.period_s
    }

    /// Both feet at `walk_tick` (0 is time zero; ticks outside the walk hold its ends), with all changes of the plan so far.
    ///
    /// Ticks that were left out are caught up with, so that a late one costs no more than what was missed. Any other is computed anew from
    /// the touch-down of the present stance: at most the ticks of one stance and one swing. The answer is the same, to the bit.
    pub fn at_tick(&mut self, walk_tick: i64, changes: &[PlanChange]) -> [FootEstimate; 2] {
        // There is no kind of change yet, so that no list holds one.
        debug_assert!(changes.is_empty());
        let tick = walk_tick.clamp(0, self.last_tick);
        if self.tick != Some(tick) {
            for foot in &mut self.feet {
                let first = foot.first_tick_to_advance(&self.pattern, self.tick, tick, self.period_s);
                if self.tick.is_none_or(|last| last + 1 != first) {
                    foot.forget();
                }
                (first..=tick).for_each(|step| foot.advance(&self.pattern, step as f64 * self.period_s));
            }
            self.tick = Some(tick);
        }
        [self.feet[0].estimate(), self.feet[1].estimate()]
    }
}
