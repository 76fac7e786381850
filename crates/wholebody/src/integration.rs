//! From accelerations to the state of the next step: two modes.
//!
//! **Open loop** (the paper's, default): the controller integrates its own full state; measurements serve health only, and
//! the distance between the two is reported. It cannot be destabilised by sensors, and cannot react to anything either.
//!
//! **Feedback**: before each step the own state is drawn towards the measured one, `q <- q (+) alpha (q_m (-) q)`,
//! `v <- v + alpha (v_m - v)` with `alpha = 1 - exp(-rate dt)`, separately for the base's pose and twist and for the joints. An infinite
//! rate takes the measurement as it is. With position-controlled joints a rate of 2 to 20 /s for the base and 0 for the joints reacts to
//! what happens to the body without feeding the servos' lag back into the references: a rate of 1 /s for the joints is an integral of that
//! lag. On soft soles it takes [`SoleYield`](crate::SoleYield), too.

use crate::reference::RobotState;
use crate::report::StepReport;
use multibody::Model;
use nalgebra::DVector;

/// Which state a step starts from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Integration {
    /// The last step's result.
    #[default]
    OpenLoop,
    /// The last step's result, drawn towards the measurement.
    Feedback(FeedbackRates),
}

/// How fast the own state goes to the measured one (1/s); 0 = not at all, infinite = the measurement itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FeedbackRates {
    /// Pose of the base.
    pub base_pose: f64,
    /// Twist of the base.
    pub base_twist: f64,
    /// Joint positions and rates.
    pub joints: f64,
}

/// How far the controller's own state is from the measured one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StateDistance {
    /// Base position (m).
    pub base_m: f64,
    /// Base orientation (rad).
    pub base_rad: f64,
    /// Largest joint difference (rad).
    pub joints_rad: f64,
}

/// The controller's own state over time.
pub struct StateIntegrator {
    mode: Integration,
    state: RobotState,
    difference: DVector<f64>,
    next: RobotState,
    distance: StateDistance,
}

impl StateIntegrator {
    /// Starts at a state.
    #[must_use]
    pub fn new(mode: Integration, start: RobotState) -> Self {
        let difference = DVector::zeros(start.v.len());
        Self { mode, next: start.clone(), state: start, difference, distance: StateDistance::default() }
    }

    /// The state from which the next step starts. Call once per period, with the measured state if there is one.
    pub fn begin(&mut self, model: &Model, measured: Option<&RobotState>, dt_s: f64) -> &RobotState {
        let Some(measured) = measured else { return &self.state };
        model.difference(&self.state.q, &measured.q, &mut self.difference);
        let base = model.base_dofs();
        let d = self.difference.as_slice();
        let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        self.distance = StateDistance {
            base_m: norm(&d[..3.min(base)]),
            base_rad: norm(&d[3.min(base)..base]),
            joints_rad: d[base..].iter().fold(0.0, |s: f64, x| s.max(x.abs())),
        };
        if let Integration::Feedback(rates) = self.mode {
            let [pose, twist, joints] =
                [rates.base_pose, rates.base_twist, rates.joints].map(|rate| 1.0 - (-rate * dt_s).exp());
            for i in 0..self.difference.len() {
                let (gain, velocity_gain) = if i < base { (pose, twist) } else { (joints, joints) };
                self.difference[i] *= gain;
                self.state.v[i] += velocity_gain * (measured.v[i] - self.state.v[i]);
            }
            model.integrate(&self.state.q, &self.difference, &mut self.next.q);
            std::mem::swap(&mut self.state.q, &mut self.next.q);
        }
        &self.state
    }

    /// Takes over a step's result.
    pub fn advance(&mut self, report: &StepReport) {
        self.state.q.base = report.q_next.base;
        self.state.q.joints.copy_from(&report.q_next.joints);
        self.state.v.copy_from(&report.v_next);
    }

    /// Brings the own state to rest where it is.
    pub fn rest(&mut self) {
        self.state.v.fill(0.0);
    }

    /// The controller's own state.
    #[must_use]
    pub fn state(&self) -> &RobotState {
        &self.state
    }

    /// Distance from the last measurement, before it was taken into account.
    #[must_use]
    pub fn distance(&self) -> StateDistance {
        self.distance
    }
}
