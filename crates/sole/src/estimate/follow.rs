//! The slow ways: where Newton does not find the pose of a load from that of the tick before, the load is followed from the last one carried.
//!
//! The way goes straight from load to load (force and moments), in steps of equal ratios of the vertical force: of what is left of 400 N at
//! 1 N the last half is as far as the first. Where no step leads on, the curve of equilibria itself is followed ([`ArcEnd`]): it turns back, and
//! that is a fold, or it leads on, or it is lost, and that is [`Status::NotFound`].

use super::report::{Cause, Status};
use super::{LEAP_RAD, StanceEstimator};
use crate::equilibrium::{ArcEnd, End, Limits, Target};
use spatial::Vec3;

/// Iterations per step, first and smallest step of the way.
const STEP_ITERATIONS: usize = 25;
const STEP_FIRST: f64 = 0.25;
const STEP_LAST: f64 = 1.0 / 64.0;
/// Smallest step in which the pose alone is iterated where points' states run in circles. Of the 1920 first ticks that
/// `examples/hard_cases.rs` ends with 71 are unsolved without that, 24 with it.
const STEP_ON_POSE: f64 = 1.0 / 32.0;
/// What the slow ways of a tick may cost, in squares of the number of displacements: a landing costs six.
const SLOW_WORK: u64 = 40_000;
/// Part of the way that the curve of equilibria must lead on to be left again for steps.
const ARC_ENOUGH: f64 = 1.0 / 64.0;

impl StanceEstimator {
    /// All slow ways, one after the other; says where the first one stopped if none leads to the load.
    pub(super) fn follow(&mut self, target: &Target, ended: End) -> Option<Status> {
        let cause = match ended {
            _ if self.is_spent() => Cause::Work,
            End::Circling => Cause::Circling,
            _ => Cause::Steps,
        };
        if self.settings.continuation_iterations_max == 0 {
            return Some(Status::NotFound { cause });
        }
        self.report.slow = true;
        let first = self.equilibrium.is_first();
        let mut from = self.last;
        let vertical = Vec3::new(0.0, 0.0, target.force[0].z);
        if first {
            // The same load, vertical and centred: scale does not change where the fold is by much, direction does.
            from.force[0] = vertical;
        }
        self.equilibrium.restore();
        let stopped = self.lead(&from, target)?;
        if first && target.force[0] != vertical && stopped != (Status::NotFound { cause: Cause::Work }) {
            // Two loads are joined by more than one way, and friction lets some end where others do not: the ZMP first, the push after it.
            let mut corner = *target;
            corner.force[0] = vertical;
            self.equilibrium.restore();
            self.lead(&from, &corner).or_else(|| self.lead(&corner, target))?;
        }
        Some(if self.is_spent() && matches!(stopped, Status::NotFound { .. }) {
            Status::NotFound { cause: Cause::Work }
        } else {
            stopped
        })
    }

    /// Multiplications of a tick after which no further iteration of the slow ways is begun. With 104 contacts four thousand million: about
    /// a second. It grows with the square of the contacts, as a landing does.
    #[must_use]
    pub fn slow_work_max(&self) -> u64 {
        let m = 3 * self.model().contact_points().len() as u64;
        self.settings.multiplications_max.min(SLOW_WORK * m * m)
    }

    /// Has this tick cost what a tick may?
    fn is_spent(&self) -> bool {
        self.equilibrium.multiplications() > self.slow_work_max()
    }

    pub(super) fn slow_limits(&self, iterations: usize) -> Limits {
        Limits { tolerance: self.settings.tolerance, iterations, multiplications: self.slow_work_max() }
    }

    /// From the pose of one load on the straight way to another; says where that stops.
    fn lead(&mut self, from: &Target, target: &Target) -> Option<Status> {
        let limits = self.slow_limits(self.settings.iterations_max.min(STEP_ITERATIONS));
        let spent = self.equilibrium.work.iterations;
        let (mut reached, mut step) = (0.0, STEP_FIRST);
        self.equilibrium.save_reached();
        while reached < 1.0 {
            if self.is_spent() {
                return Some(Status::NotFound { cause: Cause::Work });
            }
            if self.equilibrium.work.iterations > spent + self.settings.continuation_iterations_max {
                return Some(Status::NotFound { cause: Cause::Steps });
            }
            let next = f64::min(reached + step, 1.0);
            let wanted = from.between(target, from.fraction_at(target, next));
            let before = self.equilibrium.stance.pose.rotation;
            let mut end = self.equilibrium.newton(&wanted, &limits, false);
            if end == End::Circling && step >= STEP_ON_POSE {
                self.equilibrium.return_to_reached();
                end = self.equilibrium.newton_on_pose(&wanted, &limits);
            }
            if end == End::Converged && self.equilibrium.turned_since(&before) <= LEAP_RAD {
                reached = next;
                step *= 1.5;
                self.equilibrium.save_reached();
                continue;
            }
            self.equilibrium.return_to_reached();
            step *= 0.5;
            if step >= STEP_LAST {
                continue;
            }
            let start = from.fraction_at(target, reached);
            match self.equilibrium.follow_arc([from, target], start, ARC_ENOUGH, &limits) {
                ArcEnd::TurnsBack { fraction } => {
                    let reached_zmp_m = from.between(target, fraction).zmp[0] + self.foothold;
                    return Some(Status::Fold { reached_zmp_m, fraction });
                }
                ArcEnd::Passed { fraction } => {
                    (reached, step) = (from.part_at(target, fraction), STEP_LAST);
                    self.equilibrium.save_reached();
                    if fraction >= 1.0 {
                        // The last equilibrium of the curve may lie beyond the load.
                        reached = f64::min(reached, 1.0 - f64::EPSILON);
                    }
                }
                ArcEnd::Lost if self.is_spent() => return Some(Status::NotFound { cause: Cause::Work }),
                ArcEnd::Lost if end == End::Circling => return Some(Status::NotFound { cause: Cause::Circling }),
                ArcEnd::Lost => return Some(Status::NotFound { cause: Cause::Steps }),
            }
        }
        None
    }
}
