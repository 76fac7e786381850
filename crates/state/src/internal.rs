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
use spatial::{Mat3, Transform, Vec3};
use std::collections::VecDeque;
use wholebody::{RobotState, StepReport};

/// Where the model's base is and how it moves, world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseMotion {
    /// `X_WB`.
    pub pose: Transform,
    /// Velocity of its origin (m/s).
    pub linear: Vec3,
    /// Angular velocity (rad/s).
    pub angular: Vec3,
}

impl BaseMotion {
    fn of(state: &RobotState) -> Self {
        let (pose, v) = (state.q.base, &state.v);
        let turned = |first: usize| pose.rotation * Vec3::new(v[first], v[first + 1], v[first + 2]);
        Self { pose, linear: turned(0), angular: turned(3) }
    }

    /// Moved as `to` is from `from`.
    fn move_with(&mut self, from: &Self, to: &Self, turn: &Mat3) {
        self.pose.translation += to.pose.translation - from.pose.translation;
        self.pose.rotation = turn * self.pose.rotation;
        self.linear += to.linear - from.linear;
        self.angular += to.angular - from.angular;
    }
}

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
    /// Ticks by which what is measured is older than the present.
    behind_ticks: usize,
    /// The base at the starts of the last steps, latest first; as many as are needed.
    past: VecDeque<BaseMotion>,
}

impl InternalState {
    /// Starts at a state. What is measured is `behind_ticks` old: measurement and drives together.
    #[must_use]
    pub fn new(settings: &IntegrationSettings, start: RobotState, behind_ticks: usize) -> Self {
        let rates_per_s = match settings.mode {
            IntegrationMode::OpenLoop => None,
            IntegrationMode::Feedback => {
                Some([settings.base_pose_rate_per_s, settings.base_twist_rate_per_s, settings.joint_rate_per_s])
            }
        };
        let difference = DVector::zeros(start.v.len());
        let past = VecDeque::with_capacity(behind_ticks + 1);
        let distance = StateDistance::default();
        Self { rates_per_s, next: start.clone(), state: start, difference, distance, behind_ticks, past }
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
            let before = BaseMotion::of(&self.state);
            let [pose, twist, joints] = rates_per_s.map(|rate| 1.0 - (-rate * dt_s).exp());
            for i in 0..self.difference.len() {
                let (gain, velocity_gain) = if i < base { (pose, twist) } else { (joints, joints) };
                self.difference[i] *= gain;
                self.state.v[i] += velocity_gain * (measured.v[i] - self.state.v[i]);
            }
            model.integrate(&self.state.q, &self.difference, &mut self.next.q);
            std::mem::swap(&mut self.state.q, &mut self.next.q);
            // The past is corrected as the present is: else the same difference would be found, and taken, once for each tick between.
            let after = BaseMotion::of(&self.state);
            let turn = after.pose.rotation * before.pose.rotation.transpose();
            self.past.iter_mut().for_each(|then| then.move_with(&before, &after, &turn));
        }
        &self.state
    }

    /// The base when the robot was as it is measured now, with all corrections since; the first one if there is no such past.
    #[must_use]
    pub fn when_measured(&self) -> BaseMotion {
        match self.behind_ticks {
            0 => self.now(),
            behind => self.past.get(behind - 1).or(self.past.back()).copied().unwrap_or_else(|| self.now()),
        }
    }

    /// The base at present.
    #[must_use]
    pub fn now(&self) -> BaseMotion {
        BaseMotion::of(&self.state)
    }

    /// The step that began here is done.
    fn remember(&mut self) {
        self.past.truncate(self.behind_ticks.saturating_sub(1));
        if self.behind_ticks > 0 {
            self.past.push_front(BaseMotion::of(&self.state));
        }
    }

    /// Takes over a step's result.
    pub fn advance(&mut self, report: &StepReport) {
        self.remember();
        self.state.q.base = report.q_next.base;
        self.state.q.joints.copy_from(&report.q_next.joints);
        self.state.v.copy_from(&report.v_next);
    }

    /// Brings it to rest where it is.
    pub fn rest(&mut self) {
        self.remember();
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
