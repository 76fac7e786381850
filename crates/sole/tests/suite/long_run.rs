//! Long runs: `K_c` against the compliance, and an estimator started anew against one that went on.

use crate::walking_stance::{self, TICKS};
use nalgebra::Vector2;
use sole::{EstimatorSettings, Foothold, SoleModel, StanceEstimator, StanceReference};
use spatial::Vec3;
use std::sync::Arc;

/// What a long run has come to.
pub struct LongRun {
    pub ticks: usize,
    /// Largest entry of `K_c C_cc - 1` at the end of any stance, or every 199 ticks of one.
    pub stiffness_error: f64,
    /// Largest violation of the contact laws over the load.
    pub law_violation: f64,
    /// An estimator that is given the last stance only reports the same, to the bit.
    pub restart_is_same: bool,
}

fn tight(model: &Arc<SoleModel>) -> StanceEstimator {
    StanceEstimator::new(Arc::clone(model), EstimatorSettings { tolerance: 1e-12, ..EstimatorSettings::default() })
}

/// Stance after stance, each from touch-down to lift-off, left and right loads in turn.
pub fn on_the_spot(model: &Arc<SoleModel>, ticks: usize) -> LongRun {
    let (mut estimator, mut run) = (tight(model), LongRun::new());
    let foothold = |stance: usize| Foothold { x_m: 1e-3 * (stance % 7) as f64, y_m: 0.1, yaw_rad: 0.01 };
    let moved = |tick: usize, stance: usize| {
        let mut reference = walking_stance::reference(tick, stance % 2 == 1);
        reference.zmp[0] += Vector2::new(foothold(stance).x_m, foothold(stance).y_m);
        reference
    };
    let stances = ticks.div_ceil(TICKS);
    for stance in 0..stances {
        estimator.touch_down(foothold(stance));
        for tick in 0..TICKS {
            run.step(&mut estimator, &moved(tick, stance));
        }
        if stance + 1 < stances {
            run.look(&estimator);
            estimator.lift_off();
        }
    }
    run.look(&estimator);
    let mut anew = tight(model);
    anew.touch_down(foothold(stances - 1));
    for tick in 0..TICKS {
        anew.step(&moved(tick, stances - 1));
    }
    run.restart_is_same = anew.report() == estimator.report();
    run
}

/// One stance as long as the run: the load sways, points land and lift all the time, the foot creeps.
pub fn on_one_foot(model: &Arc<SoleModel>, ticks: usize) -> LongRun {
    let (mut estimator, mut run) = (tight(model), LongRun::new());
    let sway = |estimator: &StanceEstimator, tick: usize| {
        let t = tick as f64 * walking_stance::PERIOD_S;
        let under = Vec3::new(0.08 * (1.3 * t).sin(), 0.045 * (2.1 * t).sin(), 0.0);
        let zmp = estimator.report().sole_pose.point(&under).xy();
        let force = Vec3::new(60.0 * (1.7 * t).sin(), 40.0 * (0.9 * t).cos(), 350.0 + 100.0 * (3.1 * t).sin());
        StanceReference::constant(force, zmp)
    };
    estimator.touch_down(Foothold::default());
    for tick in 0..ticks {
        let reference = sway(&estimator, tick);
        run.step(&mut estimator, &reference);
        if tick % TICKS == 0 {
            run.look(&estimator);
        }
    }
    let mut anew = tight(model);
    anew.touch_down(Foothold::default());
    for tick in 0..ticks {
        let reference = sway(&anew, tick);
        anew.step(&reference);
    }
    run.restart_is_same = anew.report() == estimator.report();
    run
}

impl LongRun {
    fn new() -> Self {
        Self { ticks: 0, stiffness_error: 0.0, law_violation: 0.0, restart_is_same: false }
    }

    fn step(&mut self, estimator: &mut StanceEstimator, reference: &StanceReference) {
        let report = estimator.step(reference);
        assert!(report.status.is_solved(), "tick {}: {:?}", self.ticks, report.status);
        self.law_violation = self.law_violation.max(report.law_violation_n / reference.force.norm());
        self.ticks += 1;
    }

    fn look(&mut self, estimator: &StanceEstimator) {
        self.stiffness_error = self.stiffness_error.max(estimator.stiffness_error());
    }
}

/// `K_c` is never off by more than rounding: updates lose some digits, and every stance begins with all of them.
#[cfg(test)]
#[test]
fn long_runs_lose_no_digits_and_a_restart_is_the_same() {
    let model = crate::stances::small();
    for run in [on_the_spot(&model, 20 * TICKS), on_one_foot(&model, 20 * TICKS)] {
        assert!(run.restart_is_same && run.ticks == 20 * TICKS);
        assert!(run.stiffness_error > 0.0 && run.stiffness_error < STIFFNESS_ERROR, "{}", run.stiffness_error);
        assert!(run.law_violation <= 1e-11, "{}", run.law_violation);
    }
}

/// Ten thousand times the last place: what some thousand updates of a matrix with a condition of 100 lose.
#[cfg(test)]
const STIFFNESS_ERROR: f64 = 1e-11;
