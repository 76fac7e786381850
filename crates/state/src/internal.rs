//! From accelerations to the state of the next step: two modes.
//!
//! **Open loop** (the paper's, default): the internal state is integrated from the steps' results alone; measurements serve health only,
//! and the distance between the two is reported. It cannot be destabilised by sensors, and cannot react to anything either.
//!
//! **Feedback**: before each step the internal state is blended with the measured one, `q <- q (+) alpha (q_m (-) q)`,
//! `v <- v + alpha (v_m - v)` with `alpha = 1 - exp(-rate dt)`, separately for the base's pose and twist and for the joints. An infinite
//! rate takes the measurement as it is. With position-controlled joints a rate of 2 to 20 /s for the base and 0 for the joints reacts to
//! what happens to the body without feeding the servos' lag back into the references: a rate of 1 /s for the joints is an integral of that
//! lag. On soft soles it takes [`ComplianceFeedForward`](wholebody::ComplianceFeedForward), too.

use crate::settings::{IntegrationMode, IntegrationSettings};
use multibody::Model;
use nalgebra::DVector;
use wholebody::{RobotState, StepReport};

/// How far the internal state is from the measured one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StateDistance {
    /// Base position (m).
    pub base_m: f64,
    /// Base orientation (rad).
    pub base_rad: f64,
    /// Largest joint difference (rad).
    pub joints_rad: f64,
}

/// The internal state over time.
pub struct InternalState {
    /// Rates (1/s) of the base's pose, of its twist and of the joints; `None` in open loop.
    rates_per_s: Option<[f64; 3]>,
    state: RobotState,
    difference: DVector<f64>,
    next: RobotState,
    distance: StateDistance,
}

impl InternalState {
    /// Starts at a state.
    #[must_use]
    pub fn new(settings: &IntegrationSettings, start: RobotState) -> Self {
        let rates_per_s = match settings.mode {
            IntegrationMode::OpenLoop => None,
            IntegrationMode::Feedback => {
                Some([settings.base_pose_rate_per_s, settings.base_twist_rate_per_s, settings.joint_rate_per_s])
            }
        };
        let difference = DVector::zeros(start.v.len());
        Self { rates_per_s, next: start.clone(), state: start, difference, distance: StateDistance::default() }
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
        if let Some(rates_per_s) = self.rates_per_s {
            let [pose, twist, joints] = rates_per_s.map(|rate| 1.0 - (-rate * dt_s).exp());
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

    /// Brings it to rest where it is.
    pub fn rest(&mut self) {
        self.state.v.fill(0.0);
    }

    /// Configuration and velocity.
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
