//! The measured state of a tick.
//!
//! **Time.** The robot is behind the plan, by the ramp of its drives and by the age of its measurements: joints are anchored at the soles
//! of that earlier tick, and held against the model of that tick. What is measured is then carried forward to the present by as much as the
//! model has moved since,
//!
//! ```text
//! p_now = p_m + p_i(now) - p_i(then)      R_now = R_i(now) R_i(then)' R_m      v_now = v_i(now) + lowpass(v_m - v_i(then))
//! ```
//!
//! so a robot that follows its plan late is not taken for one that is pushed. Carried forward with its own velocity, which says nothing of
//! the acceleration since and is late by its low-pass besides, it is: by 1 cm/s in every single support, whose 0.7 m/s^2 act for 15 ms.

use crate::anchors::AnchorHistory;
use crate::gate::{Measured, Refused, plausible};
use crate::internal::InternalState;
use crate::observer::{BaseEstimate, BaseObserver, FootAnchor, Measurement, ObserverSettings};
use crate::settings::IntegrationSettings;
use multibody::{Model, ModelError};
use nalgebra::DVector;
use spatial::{Transform, Twist, Vec3, so3};
use wholebody::RobotState;

/// Frames that the measurements are about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FeedbackFrames {
    /// Link whose frame is that of accelerometer and gyro.
    pub imu_link: String,
    /// Links of the ankle frames, left and right.
    pub ankle_links: [String; 2],
}

/// Gate, anchors and observer together. Allocates when made, never afterwards.
pub struct Feedback {
    distance_max_m: f64,
    distance_max_rad: f64,
    period_s: f64,
    velocity_time_s: f64,
    /// Low-passed difference between the measured velocity of the base and the model's, world axes (m/s).
    velocity_error: Option<Vec3>,
    observer: BaseObserver,
    anchors: AnchorHistory,
    state: RobotState,
    last_tick: Option<i64>,
}

impl Feedback {
    /// For drives that are some ticks behind the plan, and a control period (s).
    ///
    /// # Errors
    /// A link is not in the model.
    pub fn new(
        settings: &IntegrationSettings,
        model: &Model,
        frames: FeedbackFrames,
        drives_behind_ticks: usize,
        period_s: f64,
    ) -> Result<Self, ModelError> {
        let behind_ticks = settings.measurement_delay_ticks as usize + drives_behind_ticks;
        let observer_settings = ObserverSettings {
            imu_link: frames.imu_link,
            ankle_links: frames.ankle_links,
            yaw: settings.yaw,
            bias_time_s: settings.gyro_bias_time_s,
            // The model says what has happened since, and its difference is what is smoothed.
            velocity_time_s: 0.0,
            delay_s: 0.0,
        };
        Ok(Self {
            distance_max_m: settings.distance_max_m,
            distance_max_rad: settings.distance_max_rad,
            period_s,
            velocity_time_s: settings.velocity_time_s,
            velocity_error: None,
            observer: BaseObserver::new(model.clone(), observer_settings)?,
            anchors: AnchorHistory::new(behind_ticks),
            state: RobotState { q: model.neutral(), v: DVector::zeros(model.nv()) },
            last_tick: None,
        })
    }

    /// The last estimate of the base.
    #[must_use]
    pub fn estimate(&self) -> &BaseEstimate {
        self.observer.estimate()
    }

    /// Forgets where the soles were: another walk is to be walked.
    pub fn restart(&mut self) {
        self.anchors.clear();
        self.velocity_error = None;
    }

    /// Remembers where the soles are at a tick, whatever is measured.
    pub fn remember(&mut self, tick: i64, feet: [FootAnchor; 2]) {
        self.anchors.remember(tick, feet);
    }

    /// The measured state, carried forward to the present tick. `internal` is what it should be near.
    ///
    /// # Errors
    /// [`Refused`] for a measurement that must not be used.
    pub fn observe(
        &mut self,
        model: &Model,
        measured: &Measured,
        internal: &InternalState,
    ) -> Result<&RobotState, Refused> {
        let ticks = self.last_tick.map_or(1, |last| measured.tick - last);
        if ticks <= 0 {
            return Err(Refused::Stale);
        }
        let imu_rotation = plausible(measured, model)?;
        let feet = self.anchors.at(measured.tick).ok_or(Refused::Soles)?;
        let measurement = Measurement {
            joints: &measured.joints,
            joint_rates: &measured.joint_rates,
            imu_rotation,
            gyro: measured.gyro,
            feet,
        };
        if ticks > 1 {
            // One reading of the gyro says nothing of a turn over several ticks.
            self.observer.forget_rotation();
        }
        let estimate = self.observer.update(&measurement, ticks as f64 * self.period_s);
        self.last_tick = Some(measured.tick);
        let (then, now) = (internal.when_measured(), internal.now());
        let R_WB = estimate.pose.rotation;
        let pose = Transform::new(
            now.pose.rotation * then.pose.rotation.transpose() * R_WB,
            estimate.pose.translation + now.pose.translation - then.pose.translation,
        );
        let away_m = (pose.translation - now.pose.translation).norm();
        let away_rad = so3::log(&(pose.rotation * now.pose.rotation.transpose())).norm();
        let error = R_WB * estimate.twist.linear - then.linear;
        let keep = (-ticks as f64 * self.period_s / self.velocity_time_s).exp(); // 0 without a low-pass
        let error = self.velocity_error.map_or(error, |last| keep * last + (1.0 - keep) * error);
        self.velocity_error = Some(error);
        let twist = Twist {
            linear: pose.rotation.tr_mul(&(now.linear + error)),
            angular: pose.rotation.tr_mul(&(now.angular + R_WB * estimate.twist.angular - then.angular)),
        };
        if away_m > self.distance_max_m || away_rad > self.distance_max_rad {
            return Err(Refused::Distance);
        }
        self.state.q.base = pose;
        self.state.q.joints.copy_from(&measured.joints);
        let base = model.base_dofs();
        self.state.v.rows_mut(0, base).copy_from(&twist.to_vector());
        self.state.v.rows_mut(base, measured.joint_rates.len()).copy_from(&measured.joint_rates);
        Ok(&self.state)
    }
}
