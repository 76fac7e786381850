//! From accelerations to the state of the next step: two modes.
//!
//! **Open loop** (the paper's, default): the controller integrates its own full state; measurements serve health only, and
//! the distance between the two is reported. It cannot be destabilised by sensors, and cannot react to anything either.
//!
//! **Feedback**: before each step the own state is drawn towards the measured one, `q <- q (+) alpha (q_m (-) q)`,
//! `v <- v + alpha (v_m - v)` with `alpha = 1 - exp(-rate dt)`, separately for base and joints. An infinite rate takes the
//! measurement as it is; with position-controlled joints a rate of 1 to 10 /s for the base and 0 for the joints removes
//! drift without feeding the servos' lag back into the references.

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
    Feedback {
        /// For the base's pose and twist (1/s); infinite = the measurement itself.
        base_rate: f64,
        /// For joint positions and rates (1/s).
        joint_rate: f64,
    },
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
        if let Integration::Feedback { base_rate, joint_rate } = self.mode {
            let [base_gain, joint_gain] = [base_rate, joint_rate].map(|rate| 1.0 - (-rate * dt_s).exp());
            for i in 0..self.difference.len() {
                let gain = if i < base { base_gain } else { joint_gain };
                self.difference[i] *= gain;
                self.state.v[i] += gain * (measured.v[i] - self.state.v[i]);
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
