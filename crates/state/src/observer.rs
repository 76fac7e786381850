//! Where the base is, from what the robot measures.
//!
//! The robot measures joint angles, the orientation and the angular velocity of its inertial unit, but no base pose. A
//! stance foot tells the rest: the estimator knows where its ankle is on the deformed sole, the legs' kinematics lead from
//! there to the base,
//!
//! ```text
//! R_WB = R_WI R_IB                          roll and pitch of the inertial unit; yaw of it or of the legs
//! p_WB = p_WA - R_WB p_BA(q)                per stance foot, blended by the planned load
//! w    = R_WB (R_BI (gyro - bias) - w_BI)       in axes known by the base: the yaw of the unit may be any
//! v_WB = v_A - w x (R_WB p_BA) - R_WB p'_BA(q, q')
//! ```
//!
//! Anchoring at the *deformed* soles matters: a sole's tilt of 2 degrees moves the centre of mass by 27 mm.
//!
//! **Bias.** The gyro's bias is the slow mean of its difference from the turning of the orientation. A difference that no gyro has is a
//! jump of the orientation (a filter that was reset, a wrong message) and teaches nothing. **Delay.** Measurements
//! that are known to be late are carried forward with the velocities found. **In the air** the base moves on with its last
//! velocity, and the status says so.

use multibody::{Configuration, FrameIndex, Model, ModelError, Workspace, forward_kinematics_velocity};
use nalgebra::DVector;
use serde::Deserialize;
use spatial::{Mat3, Transform, Twist, Vec3, so3};

/// From this difference between gyro and turning orientation on (rad/s) the orientation has jumped: noise of 1 mrad on it makes 0.3 at
/// 200 Hz, biases are a hundredth.
const JUMP_RAD_PER_S: f64 = 5.0;

/// Where the yaw comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum YawSource {
    /// The stance feet: free of the inertial unit's drift, and of whatever it calls north.
    #[default]
    Legs,
    /// The inertial unit.
    InertialUnit,
}

/// Settings of [`BaseObserver`].
#[derive(Debug, Clone, PartialEq)]
pub struct ObserverSettings {
    /// Link whose frame is that of accelerometer and gyro.
    pub imu_link: String,
    /// Links of the ankle frames, left and right.
    pub ankle_links: [String; 2],
    /// Where the yaw comes from.
    pub yaw: YawSource,
    /// Time constant of the gyro's bias (s). Useful: 1 to 20; infinite = no estimate.
    pub bias_time_s: f64,
    /// Time constant of the low-pass on the base's linear velocity (s); 0 = none. It is noisy: joint rates times leg length.
    pub velocity_time_s: f64,
    /// Age of the measurements (s): the result is carried forward by it.
    pub delay_s: f64,
}

/// A foot as anchor, from the plan and the estimator, world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootAnchor {
    /// The foot stands.
    pub in_contact: bool,
    /// Part of the weight that it carries.
    pub load_share: f64,
    /// Pose of its ankle on the deformed sole.
    pub ankle_pose: Transform,
    /// Velocity of the ankle.
    pub ankle_twist: Twist,
}

/// What the robot measures at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement<'a> {
    /// Joint positions (rad).
    pub joints: &'a DVector<f64>,
    /// Joint rates (rad/s).
    pub joint_rates: &'a DVector<f64>,
    /// `R_WI` as the robot estimates it.
    pub imu_rotation: Mat3,
    /// Angular velocity in the inertial unit's axes (rad/s).
    pub gyro: Vec3,
    /// Left, right, at the time of the measurement.
    pub feet: [FootAnchor; 2],
}

/// What the estimate rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchoring {
    /// At least one loaded foot.
    Feet,
    /// No foot stands: the last velocity carries on.
    None,
}

/// The observed base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseEstimate {
    /// What it rests on.
    pub anchoring: Anchoring,
    /// `X_WB`.
    pub pose: Transform,
    /// Velocity in the base frame, as in `v`.
    pub twist: Twist,
    /// Distance between where the two feet place the base (m); 0 unless both stand.
    pub disagreement_m: f64,
    /// Estimated bias of the gyro (rad/s).
    pub gyro_bias: Vec3,
}

/// The observer. Allocates when made, never when updated.
pub struct BaseObserver {
    model: Model,
    settings: ObserverSettings,
    imu: FrameIndex,
    ankles: [FrameIndex; 2],
    workspace: Workspace,
    q: Configuration,
    v: DVector<f64>,
    last_rotation: Option<Mat3>,
    velocity: Option<Vec3>,
    estimate: BaseEstimate,
}

impl BaseObserver {
    /// Resolves the names.
    ///
    /// # Errors
    /// A link is not in the model.
    pub fn new(model: Model, settings: ObserverSettings) -> Result<Self, ModelError> {
        let imu = model.frame(&settings.imu_link)?;
        let ankles = [model.frame(&settings.ankle_links[0])?, model.frame(&settings.ankle_links[1])?];
        Ok(Self {
            workspace: Workspace::new(&model),
            q: model.neutral(),
            v: DVector::zeros(model.nv()),
            last_rotation: None,
            velocity: None,
            estimate: BaseEstimate {
                anchoring: Anchoring::None,
                pose: Transform::identity(),
                twist: Twist::zero(),
                disagreement_m: 0.0,
                gyro_bias: Vec3::zeros(),
            },
            model,
            settings,
            imu,
            ankles,
        })
    }

    /// The last estimate.
    #[must_use]
    pub fn estimate(&self) -> &BaseEstimate {
        &self.estimate
    }

    /// Takes one measurement, `dt_s` after the last one.
    pub fn update(&mut self, measured: &Measurement<'_>, dt_s: f64) -> &BaseEstimate {
        // Kinematics in the base frame: base at the origin, at rest.
        let base = self.model.base_dofs();
        self.q.joints.copy_from(measured.joints);
        self.v.rows_mut(base, measured.joint_rates.len()).copy_from(measured.joint_rates);
        let moving = forward_kinematics_velocity(&self.model, &mut self.workspace, &self.q, &self.v);
        let X_BI = moving.pose(self.imu);
        let imu_in_base = moving.velocity(self.imu);
        let legs = self.ankles.map(|ankle| (moving.pose(ankle), moving.velocity(ankle)));

        self.track_bias(measured, dt_s);
        let tilt = measured.imu_rotation * X_BI.rotation.transpose();
        let total: f64 = measured.feet.iter().map(load).sum();
        let R_WB = match self.settings.yaw {
            YawSource::Legs if total > 0.0 => turned_to_legs(&tilt, measured, &legs, total),
            _ => tilt,
        };
        // The unit may turn against the base (it does not on HRP-4).
        // The gyro's axes are known by the base's orientation: the yaw that the unit believes in may be any.
        let w_WB = R_WB * (X_BI.rotation * (measured.gyro - self.estimate.gyro_bias) - imu_in_base.angular);

        if total > 0.0 {
            let (mut p_WB, mut v_WB) = (Vec3::zeros(), Vec3::zeros());
            let mut places = [Vec3::zeros(); 2];
            for (i, (foot, (X_BA, V_BA))) in measured.feet.iter().zip(&legs).enumerate() {
                let lever = R_WB * X_BA.translation;
                places[i] = foot.ankle_pose.translation - lever;
                let part = load(foot) / total;
                p_WB += part * places[i];
                v_WB += part * (foot.ankle_twist.linear - w_WB.cross(&lever) - R_WB * V_BA.linear);
            }
            let keep = (-dt_s / self.settings.velocity_time_s).exp(); // 0 without a low-pass
            let v_WB = self.velocity.map_or(v_WB, |last| keep * last + (1.0 - keep) * v_WB);
            self.velocity = Some(v_WB);
            let both = measured.feet.iter().all(|foot| foot.in_contact);
            self.estimate.disagreement_m = if both { (places[0] - places[1]).norm() } else { 0.0 };
            self.estimate.anchoring = Anchoring::Feet;
            self.place(R_WB, p_WB, v_WB, w_WB, self.settings.delay_s);
        } else {
            let v_WB = self.velocity.unwrap_or_else(Vec3::zeros);
            self.estimate.anchoring = Anchoring::None;
            self.estimate.disagreement_m = 0.0;
            // The last pose already is carried forward by the delay.
            let p_WB = self.estimate.pose.translation + v_WB * (dt_s - self.settings.delay_s);
            self.place(R_WB, p_WB, v_WB, w_WB, self.settings.delay_s);
        }
        &self.estimate
    }

    /// Carries pose and velocity forward by the delay.
    fn place(&mut self, R_WB: Mat3, p_WB: Vec3, v_WB: Vec3, w_WB: Vec3, delay_s: f64) {
        let rotation = so3::exp(&(w_WB * delay_s)) * R_WB;
        self.estimate.pose = Transform::new(rotation, p_WB + v_WB * delay_s);
        self.estimate.twist = Twist { linear: rotation.tr_mul(&v_WB), angular: rotation.tr_mul(&w_WB) };
    }

    fn track_bias(&mut self, measured: &Measurement<'_>, dt_s: f64) {
        let Some(last) = self.last_rotation.replace(measured.imu_rotation) else { return };
        let turned = so3::log(&(last.transpose() * measured.imu_rotation)) / dt_s;
        let missed = measured.gyro - turned - self.estimate.gyro_bias;
        if missed.norm() < JUMP_RAD_PER_S {
            let gain = 1.0 - (-dt_s / self.settings.bias_time_s).exp();
            self.estimate.gyro_bias += gain * missed;
        }
    }

    /// What comes next is not the successor of what came last: measurements in between are missing.
    pub fn forget_rotation(&mut self) {
        self.last_rotation = None;
    }
}

fn load(foot: &FootAnchor) -> f64 {
    if foot.in_contact { foot.load_share.max(0.0) } else { 0.0 }
}

/// Keeps roll and pitch, takes the yaw at which the loaded feet are as their anchors say. First the heavier foot's, which may be far
/// from the unit's: what remains to the mean of both feet is small, and half a round is no jump.
fn turned_to_legs(tilt: &Mat3, measured: &Measurement<'_>, legs: &[(Transform, Twist); 2], total: f64) -> Mat3 {
    let heavier = usize::from(load(&measured.feet[1]) > load(&measured.feet[0]));
    let parts = measured.feet.each_ref().map(|foot| load(foot) / total);
    let turns = |R_WB: &Mat3| {
        [0, 1]
            .map(|i: usize| yaw_between(R_WB, &(measured.feet[i].ankle_pose.rotation * legs[i].0.rotation.transpose())))
    };
    let rough = so3::about_z(turns(tilt)[heavier]) * tilt;
    let [left, right] = turns(&rough);
    so3::about_z(parts[0] * left + parts[1] * right) * rough
}

/// Turn about the vertical that brings one orientation as near to another as such a turn can.
fn yaw_between(from: &Mat3, to: &Mat3) -> f64 {
    let turn = to * from.transpose();
    (turn[(1, 0)] - turn[(0, 1)]).atan2(turn[(0, 0)] + turn[(1, 1)])
}
