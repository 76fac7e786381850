//! What must hold at every tick of a walk, and what is measured on the way.

use super::PERIOD_S;
use nalgebra::DVector;
use qp::dense::Side;
use std::collections::VecDeque;
use wholebody::{ConstraintId, StepReport, StepStatus, WholeBody, WholeBodyReference};

/// Relative optimality residuals: rounding of terms up to 1e7.
pub const RESIDUAL: f64 = 1e-11;
/// Rounding of accelerations times a period (rad, rad/s).
const ROUNDING: f64 = 1e-9;
/// Rounding of torques and forces (N m, N).
const FORCE_ROUNDING: f64 = 1e-6;
/// A signal that goes back by more than this part of its limit has turned.
const TURN: f64 = 0.01;

/// Checks every tick and gathers figures.
pub struct Watch {
    dt_s: f64,
    lower: Vec<f64>,
    upper: Vec<f64>,
    speed: Vec<f64>,
    torque: Vec<f64>,
    torques: Vec<Turns>,
    accelerations: Vec<Turns>,
    friction: f64,
    safety_m: f64,
    last: Option<StepReport>,
    /// Ticks seen.
    pub ticks: usize,
    /// Ticks at which some torque is at its limit.
    pub torque_bound: usize,
    /// Ticks at which some joint is at a limit of position or speed.
    pub motion_bound: usize,
    /// Ticks at which some collision pair is at its limit.
    pub collision_bound: usize,
    /// Largest part of a torque limit that was used.
    pub torque_used: f64,
    /// Largest part of a speed limit that was used.
    pub speed_used: f64,
    /// Centre of mass from its reference (m).
    pub com_error_m: f64,
    /// Stance ankles from their references.
    pub contact_error_m: f64,
    /// The same (rad).
    pub contact_error_rad: f64,
    /// Smallest distance of a collision pair (m).
    pub distance_min_m: f64,
    /// Fastest change of a foot's vertical load (N/s).
    pub load_slope_n_per_s: f64,
    /// Fastest change of a corner's vertical force (N/s).
    pub corner_slope_n_per_s: f64,
    /// Fastest change of a corner's tangential force (N/s).
    pub tangential_slope_n_per_s: f64,
}

/// How often a signal turns back by more than a threshold within [`WINDOW`] periods, whatever the rhythm. An event makes it
/// turn a few times; chatter goes on and on.
#[derive(Debug, Clone, Default)]
pub struct Turns {
    extremum: f64,
    rising: Option<bool>,
    period: usize,
    turns: VecDeque<usize>,
    most: usize,
}

/// Periods in which turns are counted.
pub const WINDOW: usize = 20;

impl Turns {
    /// Takes the next value; turning back by less than the threshold does not count.
    pub fn push(&mut self, x: f64, threshold: f64) {
        self.period += 1;
        let Some(rising) = self.rising else {
            if self.period == 1 {
                self.extremum = x;
            } else if (x - self.extremum).abs() > threshold {
                self.rising = Some(x > self.extremum);
                self.extremum = x;
            }
            return;
        };
        let back = if rising { self.extremum - x } else { x - self.extremum };
        if back > threshold {
            self.rising = Some(!rising);
            self.extremum = x;
            self.turns.push_back(self.period);
            while self.turns.front().is_some_and(|first| first + WINDOW <= self.period) {
                self.turns.pop_front();
            }
            self.most = self.most.max(self.turns.len());
        } else if back < 0.0 {
            self.extremum = x;
        }
    }

    /// Most turns within the window.
    pub fn most(&self) -> usize {
        self.most
    }
}

impl Watch {
    /// With the limits as the settings cut them.
    pub fn new(body: &WholeBody) -> Self {
        Self::with_period(body, PERIOD_S)
    }

    /// The same for another period.
    pub fn with_period(body: &WholeBody, dt_s: f64) -> Self {
        let constraints = &body.settings().constraints;
        let of = |f: &dyn Fn(&multibody::Limits) -> f64| -> Vec<f64> {
            body.model().joints().iter().map(|joint| f(&joint.limits)).collect()
        };
        let joints = body.model().joint_count();
        Self {
            dt_s,
            lower: of(&|l| l.lower + constraints.position_margin_rad),
            upper: of(&|l| l.upper - constraints.position_margin_rad),
            speed: of(&|l| l.velocity * constraints.velocity_factor),
            torque: of(&|l| l.effort * constraints.torque_factor),
            torques: vec![Turns::default(); joints],
            accelerations: vec![Turns::default(); joints],
            friction: body.settings().friction(),
            safety_m: body.settings().collision.safety_m,
            last: None,
            ticks: 0,
            torque_bound: 0,
            motion_bound: 0,
            collision_bound: 0,
            torque_used: 0.0,
            speed_used: 0.0,
            com_error_m: 0.0,
            contact_error_m: 0.0,
            contact_error_rad: 0.0,
            distance_min_m: f64::INFINITY,
            load_slope_n_per_s: 0.0,
            corner_slope_n_per_s: 0.0,
            tangential_slope_n_per_s: 0.0,
        }
    }

    /// Asserts that the step was solved with every limit as set, nothing relaxed.
    pub fn look(&mut self, tick: usize, reference: &WholeBodyReference, report: &StepReport) {
        assert_eq!(report.status, StepStatus::Solved, "tick {tick}: {:?} {:?}", report.relaxed, report.contradiction);
        assert!(report.residuals.max() < RESIDUAL, "tick {tick}: {:?}", report.residuals);
        self.joints(tick, report);
        self.forces(tick, reference, report);
        assert!(report.distance_min_m > self.safety_m, "tick {tick}: {} m apart", report.distance_min_m);
        self.distance_min_m = self.distance_min_m.min(report.distance_min_m);
        self.com_error_m = self.com_error_m.max(report.body_error.fixed_rows::<3>(0).norm());
        for error in report.contact_errors {
            self.contact_error_m = self.contact_error_m.max(error.position_m);
            self.contact_error_rad = self.contact_error_rad.max(error.orientation_rad);
        }
        let bound = |kind: fn(&ConstraintId) -> bool| usize::from(report.active.iter().any(|active| kind(&active.id)));
        self.torque_bound += bound(|id| matches!(id, ConstraintId::Torque(_)));
        self.motion_bound += bound(|id| matches!(id, ConstraintId::JointMotion(_)));
        self.collision_bound += bound(|id| matches!(id, ConstraintId::Collision(_)));
        self.ticks += 1;
        self.last = Some(report.clone());
    }

    fn joints(&mut self, tick: usize, report: &StepReport) {
        let joints = self.lower.len();
        let rates = DVector::from_column_slice(&report.v_next.as_slice()[report.v_next.len() - joints..]);
        let accelerations = &report.acceleration.as_slice()[report.acceleration.len() - joints..];
        for i in 0..joints {
            let (q, v, tau) = (report.q_next.joints[i], rates[i], report.torques[i]);
            assert!(q > self.lower[i] - ROUNDING && q < self.upper[i] + ROUNDING, "tick {tick} joint {i}: {q} rad");
            assert!(v.abs() < self.speed[i] + ROUNDING, "tick {tick} joint {i}: {v} rad/s");
            assert!(tau.abs() < self.torque[i] + FORCE_ROUNDING, "tick {tick} joint {i}: {tau} N m");
            for active in report.active.iter().filter(|active| active.id == ConstraintId::Torque(i)) {
                let side = if tau > 0.0 { Side::Upper } else { Side::Lower };
                assert!(
                    (tau.abs() - self.torque[i]).abs() < FORCE_ROUNDING,
                    "tick {tick} joint {i}: {tau} N m is no limit"
                );
                assert_eq!(active.side, side, "tick {tick} joint {i}: {tau} N m");
                assert!(active.multiplier * tau >= 0.0, "tick {tick} joint {i}: {active:?} presses inwards");
            }
            self.torque_used = self.torque_used.max(tau.abs() / self.torque[i]);
            self.speed_used = self.speed_used.max(v.abs() / self.speed[i]);
            self.torques[i].push(tau, TURN * self.torque[i]);
            // The acceleration that changes the speed by that part of its limit within a period.
            self.accelerations[i].push(accelerations[i], TURN * self.speed[i] / self.dt_s);
        }
    }

    fn forces(&mut self, tick: usize, reference: &WholeBodyReference, report: &StepReport) {
        for (i, (foot, target)) in report.feet.iter().zip(&reference.feet).enumerate() {
            let sum = foot.corners.iter().sum::<spatial::Vec3>();
            assert!((sum - foot.wrench.force).norm() < FORCE_ROUNDING, "tick {tick}: corners sum to the foot's force");
            assert!(target.in_contact || sum.norm() == 0.0, "tick {tick}: no force in the air");
            assert!(sum.z < foot.load_max_n + FORCE_ROUNDING, "tick {tick}: {} N", sum.z);
            for corner in &foot.corners {
                assert!(corner.z > -FORCE_ROUNDING, "tick {tick}: the ground pulls with {} N", corner.z);
                let tangential = corner.xy().norm();
                assert!(tangential < self.friction * corner.z + FORCE_ROUNDING, "tick {tick}: {corner} slips");
            }
            let Some(last) = &self.last else { continue };
            let per_second = 1.0 / self.dt_s;
            let jump = (sum.z - last.feet[i].wrench.force.z).abs() * per_second;
            self.load_slope_n_per_s = self.load_slope_n_per_s.max(jump);
            for (now, before) in foot.corners.iter().zip(&last.feet[i].corners) {
                let jump = (now - before) * per_second;
                self.corner_slope_n_per_s = self.corner_slope_n_per_s.max(jump.z.abs());
                self.tangential_slope_n_per_s = self.tangential_slope_n_per_s.max(jump.xy().norm());
            }
        }
    }

    /// Most turns within [`WINDOW`] periods of any torque, by more than 1 % of its limit, or of any acceleration, by what changes
    /// the speed by 1 % of its limit in a period.
    pub fn turns(&self) -> usize {
        self.torques.iter().chain(&self.accelerations).map(Turns::most).max().unwrap_or(0)
    }

    /// All figures in a line, for failures.
    pub fn figures(&self) -> String {
        format!(
            "{} ticks; bound: torque {}, motion {}, collision {}; used: torque {:.3}, speed {:.3}; COM {:.2e} m; contacts {:.2e} m {:.2e} rad; \
             distance {:.4} m; slopes: load {:.0}, corner {:.0}, tangential {:.0} N/s; turns {}",
            self.ticks,
            self.torque_bound,
            self.motion_bound,
            self.collision_bound,
            self.torque_used,
            self.speed_used,
            self.com_error_m,
            self.contact_error_m,
            self.contact_error_rad,
            self.distance_min_m,
            self.load_slope_n_per_s,
            self.corner_slope_n_per_s,
            self.tangential_slope_n_per_s,
            self.turns(),
        )
    }
}
