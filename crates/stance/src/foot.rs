//! One foot through its life: planted under load, in the air, planted again.

use crate::StanceSettings;
use crate::load::stance_reference;
use crate::viscosity::Viscosity;
use nalgebra::Vector2;
use pattern::{AnkleState, FootReference, Planar, Reference, SwingTrajectory, WalkPattern};
use sole::{StanceEstimator, Status};
use spatial::{Mat6, Transform, Twist, Vec3, Wrench};

/// How an estimate was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// By geometry alone: in the air, or on a rigid sole.
    Geometric,
    /// The sole's equilibrium was solved.
    Solved,
    /// It could not be solved, as the status says: an older pose is used.
    Held(Status),
}

/// What the estimator knows of a foot at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootEstimate {
    /// The foot carries load.
    pub loaded: bool,
    /// How it was found.
    pub outcome: Outcome,
    /// Ticks since the pose was last solved for; 0 if fresh.
    pub age_ticks: u32,
    /// Where its ZMP is told to be (m): the plan's, and the foot's part of what the body adds. In the air the plan's.
    pub zmp: Vector2<f64>,
    /// `X_WA`, twist and acceleration of the ankle, world axes.
    pub ankle: AnkleState,
    /// `X_WS`: the sole frame.
    pub sole: Transform,
    /// Twist of the sole frame's origin, world axes.
    pub sole_twist: Twist,
    /// Wrench of the ground on the sole about the sole origin, world axes.
    pub wrench: Wrench,
    /// Change of the sole's pose per change of that wrench, world axes; zero in the air and on a rigid sole.
    pub compliance: Mat6,
    /// Iterations spent.
    pub iterations: u32,
    /// Residual of equilibrium, relative to the load.
    pub residual: f64,
    /// Mean compression of the points in contact, a part of the sole's thickness; 0 in the air and on a rigid sole.
    pub compression: f64,
    /// Number of nodes that stick.
    pub nodes_sticking: u32,
    /// Number of nodes that slip.
    pub nodes_slipping: u32,
}

impl FootEstimate {
    fn geometric(loaded: bool, zmp: Vector2<f64>, ankle: AnkleState, ankle_in_sole: &Vec3) -> Self {
        let X_AS = Transform::from_translation(-ankle_in_sole);
        let sole = ankle.pose * X_AS;
        Self {
            loaded,
            outcome: Outcome::Geometric,
            age_ticks: 0,
            zmp,
            ankle,
            sole,
            sole_twist: ankle.twist.at(&(sole.translation - ankle.pose.translation)),
            wrench: Wrench::zero(),
            compliance: Mat6::zeros(),
            iterations: 0,
            residual: 0.0,
            compression: 0.0,
            nodes_sticking: 0,
            nodes_slipping: 0,
        }
    }
}

/// A foot and the sole under it; `None` is a rigid one.
#[derive(Debug)]
pub(crate) struct Foot {
    index: usize,
    sole: Option<StanceEstimator>,
    ankle_in_sole: Vec3,
    settings: StanceSettings,
    viscosity: Viscosity,
    swing: Option<SwingTrajectory>,
    estimate: FootEstimate,
}

impl Foot {
    pub(crate) fn new(
        index: usize,
        sole: Option<StanceEstimator>,
        pattern: &WalkPattern,
        settings: &StanceSettings,
        period_s: f64,
    ) -> Self {
        let [x, y] = pattern.ankle_in_sole_m[index];
        let ankle_in_sole = Vec3::new(x, y, pattern.ankle_height_m);
        let first = pattern.evaluate(0.0).feet[index];
        let start = AnkleState::at_rest(pattern.ankle_pose(&first.ankle_foothold));
        let estimate = FootEstimate::geometric(false, first.zmp.position, start, &ankle_in_sole);
        let viscosity = Viscosity::new(settings.viscosity_time_s, period_s);
        Self { index, sole, ankle_in_sole, settings: *settings, viscosity, swing: None, estimate }
    }

    pub(crate) fn estimate(&self) -> FootEstimate {
        self.estimate
    }

    /// The contact node by node, if there is a deformable sole under load.
    pub(crate) fn stance(&self) -> Option<&StanceEstimator> {
        self.sole.as_ref().filter(|_| self.estimate.loaded)
    }

    fn reference(&self, pattern: &WalkPattern, t_s: f64) -> FootReference {
        pattern.evaluate(t_s).feet[self.index]
    }

    /// The tick from which [`advance`](Self::advance) must be called to know the foot at `tick`, when it is known at `last`: the one after
    /// that, unless the foot has touched down since or `last` is no help.
    pub(crate) fn first_tick_to_advance(
        &self,
        pattern: &WalkPattern,
        last: Option<i64>,
        tick: i64,
        period_s: f64,
    ) -> i64 {
        match last.map(|last| last + 1) {
            Some(next) if next == tick => next,
            Some(next) if next < tick => next.max(self.first_tick_needed(pattern, tick, period_s)),
            _ => self.first_tick_needed(pattern, tick, period_s),
        }
    }

    /// The touch-down of the present stance, or of the one before if the foot is in the air.
    fn first_tick_needed(&self, pattern: &WalkPattern, tick: i64, period_s: f64) -> i64 {
        let loaded =
            |tick: i64| self.reference(pattern, tick as f64 * period_s).force.z > self.settings.touch_down_force_n;
        let last_loaded = (0..=tick).rev().find(|tick| loaded(*tick)).unwrap_or(0);
        (1..=last_loaded).rev().find(|tick| !loaded(tick - 1)).unwrap_or(0)
    }

    /// Forgets the past: the next [`advance`](Self::advance) is a touch-down.
    pub(crate) fn forget(&mut self) {
        if let (Some(sole), true) = (&mut self.sole, self.estimate.loaded) {
            sole.lift_off();
        }
        self.estimate.loaded = false;
    }

    /// One tick on.
    pub(crate) fn advance(&mut self, pattern: &WalkPattern, t_s: f64) {
        let whole = pattern.evaluate(t_s);
        let reference = &whole.feet[self.index];
        if reference.force.z > self.settings.touch_down_force_n {
            self.carry(pattern, &whole, reference);
        } else {
            self.fly(pattern, reference, t_s);
        }
    }

    fn carry(&mut self, pattern: &WalkPattern, whole: &Reference, reference: &FootReference) {
        let flat = AnkleState::at_rest(pattern.ankle_pose(&reference.ankle_foothold));
        let zmp = self.settings.body_zmp.zmp(whole, reference);
        let Some(sole) = &mut self.sole else {
            self.estimate = FootEstimate::geometric(true, zmp.position, flat, &self.ankle_in_sole);
            self.estimate.wrench = wrench_about(reference, &zmp, &self.estimate.sole.translation);
            return;
        };
        if !self.estimate.loaded {
            let at = reference.sole_foothold;
            sole.touch_down(sole::Foothold { x_m: at.x_m, y_m: at.y_m, yaw_rad: at.yaw_rad });
            self.viscosity.begin();
            self.estimate = FootEstimate::geometric(true, zmp.position, flat, &self.ankle_in_sole);
        }
        let report = sole.step(&stance_reference(reference, &zmp));
        if !report.status.is_solved() {
            let age_ticks = self.estimate.age_ticks.saturating_add(1);
            let ankle = AnkleState::at_rest(self.estimate.ankle.pose);
            let (outcome, residual) = (Outcome::Held(report.status), report.residual);
            let sole_twist = Twist::zero();
            self.estimate = FootEstimate { outcome, age_ticks, ankle, sole_twist, residual, ..self.estimate };
            return;
        }
        let elastic =
            AnkleState { pose: report.ankle_pose, twist: report.ankle_twist, acceleration: report.ankle_acceleration };
        let ankle = self.viscosity.follow(&elastic, &flat.pose);
        let late = FootEstimate::geometric(true, zmp.position, ankle, &self.ankle_in_sole);
        self.estimate = FootEstimate {
            outcome: Outcome::Solved,
            iterations: report.iterations as u32,
            residual: report.residual,
            compression: report.compression,
            compliance: report.compliance,
            nodes_sticking: report.sticking as u32,
            nodes_slipping: report.slipping as u32,
            wrench: report.wrench.about(&(late.sole.translation - report.sole_pose.translation)),
            ..late
        };
    }

    fn fly(&mut self, pattern: &WalkPattern, reference: &FootReference, t_s: f64) {
        if self.estimate.loaded {
            if let Some(sole) = &mut self.sole {
                sole.lift_off();
            }
            self.swing = None;
        }
        if let (Some(swing), None) = (reference.swing, &self.swing) {
            let from = AnkleState::at_rest(self.estimate.ankle.pose);
            let to = pattern.ankle_pose(&swing.to_foothold);
            self.swing = Some(SwingTrajectory::new(&from, &to, swing.t_start_s, swing.t_end_s, swing.apex_m));
        }
        // Without a trajectory yet: the last instants of a stance, load below the threshold; the pose rests.
        let at_rest = AnkleState::at_rest(self.estimate.ankle.pose);
        let ankle = self.swing.as_ref().map_or(at_rest, |swing| swing.evaluate(t_s));
        self.estimate = FootEstimate::geometric(false, reference.zmp.position, ankle, &self.ankle_in_sole);
    }
}

/// The planned action of the ground about a point: the force at the ZMP without vertical moment.
fn wrench_about(reference: &FootReference, zmp: &Planar, point: &Vec3) -> Wrench {
    let zmp = Vec3::new(zmp.position.x, zmp.position.y, 0.0);
    Wrench::of_force_at(&reference.force, &zmp, point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gait::GaitSettings;

    const PERIOD_S: f64 = 0.005;

    #[test]
    fn a_late_tick_costs_what_was_missed_and_no_more() {
        #[derive(serde::Deserialize)]
        struct File {
            gait: GaitSettings,
        }
        let file: File = toml::from_str(include_str!("../../../config/planner.toml")).expect("it ships");
        let pattern = gait::plan(&file.gait).expect("it can be planned").pattern;
        let foot = Foot::new(0, None, &pattern, &StanceSettings::default(), PERIOD_S);
        let carries = |tick: i64| foot.reference(&pattern, tick as f64 * PERIOD_S).force.z > 0.05;
        let ticks = (pattern.duration_s() / PERIOD_S) as i64;
        let touch_downs: Vec<i64> = (1..ticks).filter(|tick| carries(*tick) && !carries(tick - 1)).collect();
        let [.., before, latest] = touch_downs[..] else { panic!("a walk: {touch_downs:?}") };
        let first = |last, tick| foot.first_tick_to_advance(&pattern, last, tick, PERIOD_S);
        let (tick, swing) = (latest + 30, latest - 10);
        assert!(carries(tick) && !carries(swing));
        // In time; late within the stance, and since before it; started anew; backwards.
        assert_eq!(
            [tick - 1, tick - 2, latest, before].map(|last| first(Some(last), tick)),
            [tick, tick - 1, latest + 1, latest]
        );
        assert_eq!([None, Some(tick), Some(tick + 40)].map(|last| first(last, tick)), [latest; 3]);
        // In the air the take-off pose is needed, and with it the whole stance before.
        assert_eq!(
            [None, Some(before - 1), Some(before + 20)].map(|last| first(last, swing)),
            [before, before, before + 21]
        );
    }
}
