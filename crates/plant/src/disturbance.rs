//! What pushes the robot.

use ranges::{OutOfRange, Range};
use serde::{Deserialize, Serialize};

/// A force on a point of a link during a window of time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Push {
    /// Name of the link.
    pub link: String,
    /// Point of attack in the link's frame (m).
    pub point_in_link_m: [f64; 3],
    /// Force in world axes (N).
    pub force_n: [f64; 3],
    /// When it begins, in time since [`crate::Plant::start_clock`] (s).
    pub start_s: f64,
    /// How long it lasts (s).
    pub duration_s: f64,
}

impl Default for Push {
    fn default() -> Self {
        Self { link: String::new(), point_in_link_m: [0.0; 3], force_n: [0.0; 3], start_s: 0.0, duration_s: 0.1 }
    }
}

impl Push {
    /// Share of the step `[t_s, t_s + step_s]` during which the force acts: the impulse does not depend on how the window
    /// falls between steps.
    #[must_use]
    pub fn active_share(&self, t_s: f64, step_s: f64) -> f64 {
        let overlap = (t_s + step_s).min(self.start_s + self.duration_s) - t_s.max(self.start_s);
        (overlap / step_s).clamp(0.0, 1.0)
    }

    pub(crate) fn check(&self, index: usize) -> Result<(), OutOfRange> {
        let key = |name: &str| format!("pushes[{index}].{name}");
        let times = "seconds since time zero of the walk";
        Range::above_zero_to(3600.0).demand(key("duration_s"), self.duration_s, "a tenth of a second is usual")?;
        Range::between(0.0, 86_400.0).demand(key("start_s"), self.start_s, times)?;
        Range::within(1e5).demand_each(&key("force_n"), &self.force_n, "some tens of newtons are usual")?;
        Range::within(10.0).demand_each(
            &key("point_in_link_m"),
            &self.point_in_link_m,
            "a point of the link, in metres",
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impulse_does_not_depend_on_the_step() {
        let push = Push { start_s: 0.1003, duration_s: 0.0501, ..Push::default() };
        for steps in [7u32, 100, 1000] {
            let h = 0.3 / f64::from(steps);
            let time: f64 = (0..steps).map(|i| push.active_share(f64::from(i) * h, h) * h).sum();
            assert!((time - 0.0501).abs() < 1e-12);
        }
    }
}
