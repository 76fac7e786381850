//! The clock grid: when the ticks are.
//!
//! One process of a domain owns it, the simulator or a robot's driver: `t_k = t_0 + k * 5 ms` on `CLOCK_MONOTONIC`. All others derive
//! their times from the stamp of the state they got, which is the scheduled time and not when somebody woke. Two processes that each kept a
//! grid would beat against each other and lose whole cycles.

use crate::clock_monotonic_ns;
use crate::system;
use messages::CONTROL_PERIOD_NS;

/// A stamp this far in the past is still believed: ten ticks, after which nobody goes on by old inputs (ns).
const PAST_MAX_NS: u64 = messages::missing::HOLD_AFTER_TICKS as u64 * CONTROL_PERIOD_NS;
/// A stamp this far in the future is still believed: none of ours is in the future at all (ns).
const FUTURE_MAX_NS: u64 = CONTROL_PERIOD_NS;

/// Absolute times, one control period apart.
#[derive(Debug, Clone)]
pub struct Grid {
    next_ns: u64,
    slips: u64,
}

impl Grid {
    /// The first time is one period from now.
    #[must_use]
    pub fn start() -> Self {
        Self { next_ns: clock_monotonic_ns() + CONTROL_PERIOD_NS, slips: 0 }
    }

    /// Sleeps until the next time and returns it: the scheduled one, however late it has become. Who wakes more than a period late moves
    /// the grid: what is simulated cannot be skipped, and is not caught up with in a burst.
    pub fn wait(&mut self) -> u64 {
        system::sleep_until_ns(self.next_ns);
        self.woke(clock_monotonic_ns())
    }

    /// The time of this tick for one who woke then.
    fn woke(&mut self, now_ns: u64) -> u64 {
        if now_ns > self.next_ns + CONTROL_PERIOD_NS {
            self.slips += 1;
            self.next_ns = now_ns;
        }
        let due_ns = self.next_ns;
        self.next_ns += CONTROL_PERIOD_NS;
        due_ns
    }

    /// How often it was moved.
    #[must_use]
    pub fn slips(&self) -> u64 {
        self.slips
    }
}

/// Paces lock-step for watching: simulated time passes at most `pace` times as fast as real time.
#[derive(Debug, Clone)]
pub struct Pace {
    period_ns: u64,
    next_ns: u64,
}

impl Pace {
    /// From now on; `pace` is above zero.
    #[must_use]
    pub fn start(pace: f64) -> Self {
        Self { period_ns: (CONTROL_PERIOD_NS as f64 / pace) as u64, next_ns: clock_monotonic_ns() }
    }

    /// Sleeps until the next tick may begin. Who is late is not hurried afterwards.
    pub fn wait(&mut self) {
        system::sleep_until_ns(self.next_ns);
        self.next_ns = (self.next_ns + self.period_ns).max(clock_monotonic_ns());
    }
}

/// When the tick was whose state has this stamp, as seen at `now_ns`. A stamp that no clock of this host can have, far in the past or in
/// the future, is not believed: then it is now, and the second value says so.
#[must_use]
pub fn believed_stamp_ns(stamp_ns: u64, now_ns: u64) -> (u64, bool) {
    let believed = stamp_ns <= now_ns.saturating_add(FUTURE_MAX_NS) && now_ns <= stamp_ns.saturating_add(PAST_MAX_NS);
    if believed { (stamp_ns, true) } else { (now_ns, false) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_keeps_its_times_and_moves_only_when_more_than_a_period_is_lost() {
        let mut grid = Grid { next_ns: 1_000_000_000, slips: 0 };
        // On time, a little late, one period late to the nanosecond: the scheduled times stay.
        for (k, late_ns) in [0, 300_000, CONTROL_PERIOD_NS].into_iter().enumerate() {
            let due_ns = 1_000_000_000 + k as u64 * CONTROL_PERIOD_NS;
            assert_eq!(grid.woke(due_ns + late_ns), due_ns);
        }
        assert_eq!(grid.slips(), 0);
        let woke_ns = 1_000_000_000 + 3 * CONTROL_PERIOD_NS + CONTROL_PERIOD_NS + 1;
        assert_eq!((grid.woke(woke_ns), grid.slips()), (woke_ns, 1));
        assert_eq!(
            grid.woke(woke_ns + CONTROL_PERIOD_NS),
            woke_ns + CONTROL_PERIOD_NS,
            "the grid is where it was moved to"
        );
    }

    #[test]
    fn a_stamp_that_no_clock_can_have_is_not_believed() {
        let now_ns = 1_000_000_000_000;
        for (stamp_ns, believed) in [
            (now_ns, true),
            (now_ns - 300_000, true),
            (now_ns - PAST_MAX_NS, true),
            (now_ns - PAST_MAX_NS - 1, false),
            (now_ns + FUTURE_MAX_NS, true),
            (now_ns + FUTURE_MAX_NS + 1, false),
            (0, false),
            (u64::MAX, false),
        ] {
            let expected = if believed { (stamp_ns, true) } else { (now_ns, false) };
            assert_eq!(believed_stamp_ns(stamp_ns, now_ns), expected, "{stamp_ns}");
        }
    }
}
