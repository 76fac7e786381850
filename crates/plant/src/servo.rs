//! Joint drives: position servo with feed-forward torque, limits and friction.
//!
//! ```text
//! tau   = clamp( kp (q_ref - q) + kd (q_ref' - q') + tau_ff,  -tau_max, tau_max )
//! total = tau - d q' - c tanh(q' / v_s)
//! ```
//!
//! `q_ref` runs linearly over a control period from where it was to the new reference, `q_ref'` is the slope of that ramp:
//! position and rate never contradict each other, and a drive that gets no new reference holds with rate zero. The reference
//! is kept within the joint's position limits and its ramp within the speed limit, as a drive's own firmware would; both
//! are counted. The law is evaluated at the *end* of an integration step (`q' = v1`, `q = q0 + h v1`), so that a stiff drive
//! costs no stability; its derivative with respect to `v1` enters the step's matrix.
//!
//! *Not modelled*: motor current dynamics, back-EMF, elasticity and play of the gears, mechanical end stops, temperature.

use multibody::Model;
use nalgebra::DVector;

use crate::settings::{DriveSettings, ServoSettings};

/// One drive with its joint's limits.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Drive {
    settings: DriveSettings,
    torque_max_nm: f64,
    speed_max: f64,
    lower: f64,
    upper: f64,
}

/// Torque of one drive at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveTorque {
    /// Torque of the motor on the joint (N m).
    pub motor_nm: f64,
    /// Torque of friction on the joint (N m).
    pub friction_nm: f64,
    /// Derivative of their sum with respect to the joint's rate at the end of the step (N m s/rad), never positive.
    pub derivative: f64,
    /// The motor is at its limit.
    pub saturated: bool,
}

/// The drives of all joints.
#[derive(Debug, Clone)]
pub struct Servo {
    drives: Vec<Drive>,
    ramp_from: DVector<f64>,
    ramp_to: DVector<f64>,
    feed_forward: DVector<f64>,
    limited_references: u64,
}

/// A drive named in the settings whose joint the model does not have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("servo.joints names the joint {name:?}, which is not among the model's movable joints: {known}")]
pub struct UnknownDrive {
    /// The name in the settings.
    pub name: String,
    /// The joints that are there.
    pub known: String,
}

impl Servo {
    /// Drives for all joints of a model.
    ///
    /// # Errors
    /// The settings name a joint that the model does not have.
    pub fn new(model: &Model, settings: &ServoSettings) -> Result<Self, UnknownDrive> {
        let joints = model.joints();
        for name in settings.joints.keys() {
            if !joints.iter().any(|joint| joint.name == *name) {
                let known = joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>().join(", ");
                return Err(UnknownDrive { name: name.clone(), known });
            }
        }
        let drives = joints
            .iter()
            .map(|joint| Drive {
                settings: *settings.joints.get(&joint.name).unwrap_or(&settings.default),
                torque_max_nm: joint.limits.effort,
                speed_max: joint.limits.velocity,
                lower: joint.limits.lower,
                upper: joint.limits.upper,
            })
            .collect();
        let zero = DVector::zeros(joints.len());
        Ok(Self { drives, ramp_from: zero.clone(), ramp_to: zero.clone(), feed_forward: zero, limited_references: 0 })
    }

    /// Rotor inertia of joint `i` (kg m^2).
    #[must_use]
    pub fn rotor_inertia_kg_m2(&self, i: usize) -> f64 {
        self.drives[i].settings.rotor_inertia_kg_m2
    }

    /// Holds a posture (rad), without feed-forward torque.
    pub fn hold(&mut self, joints: &DVector<f64>) {
        self.ramp_from.copy_from(joints);
        self.ramp_to.copy_from(joints);
        self.feed_forward.fill(0.0);
    }

    /// A new reference (rad) to be reached at the end of the period, and the feed-forward torque (N m) during it.
    pub fn command(&mut self, references: &DVector<f64>, feed_forward: &DVector<f64>, period_s: f64) {
        std::mem::swap(&mut self.ramp_from, &mut self.ramp_to);
        for (i, drive) in self.drives.iter().enumerate() {
            let from = self.ramp_from[i];
            let reach = drive.speed_max * period_s;
            let allowed = references[i].clamp(drive.lower, drive.upper).clamp(from - reach, from + reach);
            self.limited_references += u64::from(allowed != references[i]);
            self.ramp_to[i] = allowed;
        }
        self.feed_forward.copy_from(feed_forward);
    }

    /// How many single joint references were changed by position or speed limits so far.
    #[must_use]
    pub fn limited_references(&self) -> u64 {
        self.limited_references
    }

    /// Position reference (rad) of joint `i` when the given share of the period has passed.
    #[must_use]
    pub fn reference(&self, i: usize, share: f64) -> f64 {
        self.ramp_from[i] + share * (self.ramp_to[i] - self.ramp_from[i])
    }

    /// Torque of joint `i` at the end of a step.
    #[must_use]
    pub fn torque(&self, i: usize, end: &DriveState) -> DriveTorque {
        let Drive { settings, torque_max_nm, .. } = &self.drives[i];
        let rate_ref = (self.ramp_to[i] - self.ramp_from[i]) / end.period_s;
        let wanted = settings.stiffness_nm_per_rad * (self.reference(i, end.share) - end.position)
            + settings.damping_nm_s_per_rad * (rate_ref - end.rate)
            + self.feed_forward[i];
        let motor_nm = wanted.clamp(-torque_max_nm, *torque_max_nm);
        let saturated = motor_nm != wanted;
        let motor_derivative =
            if saturated { 0.0 } else { settings.damping_nm_s_per_rad + end.step_s * settings.stiffness_nm_per_rad };
        let t = (end.rate / settings.coulomb_speed_rad_per_s).tanh();
        let friction_nm = -settings.viscous_friction_nm_s_per_rad * end.rate - settings.coulomb_friction_nm * t;
        let friction_derivative = settings.viscous_friction_nm_s_per_rad
            + settings.coulomb_friction_nm * (1.0 - t * t) / settings.coulomb_speed_rad_per_s;
        DriveTorque { motor_nm, friction_nm, derivative: -motor_derivative - friction_derivative, saturated }
    }
}

/// A joint at the end of an integration step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveState {
    /// Share of the control period that has passed then.
    pub share: f64,
    /// Control period (s).
    pub period_s: f64,
    /// Integration step (s): position changes by it times the rate.
    pub step_s: f64,
    /// Joint position (rad).
    pub position: f64,
    /// Joint rate (rad/s).
    pub rate: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use multibody::{Base, ModelOptions};

    const URDF: &str = r#"<robot name="arm"><link name="base"/><link name="arm"><inertial><mass value="1"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="elbow" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
        <limit lower="-1" upper="1" velocity="2" effort="10"/></joint></robot>"#;

    fn servo() -> Servo {
        let model = Model::from_urdf(URDF, &ModelOptions { base: Base::Fixed, ..Default::default() }).unwrap();
        let default = DriveSettings {
            stiffness_nm_per_rad: 100.0,
            damping_nm_s_per_rad: 2.0,
            viscous_friction_nm_s_per_rad: 0.5,
            coulomb_friction_nm: 0.3,
            ..Default::default()
        };
        Servo::new(&model, &ServoSettings { default, ..Default::default() }).unwrap()
    }

    fn one(value: f64) -> DVector<f64> {
        DVector::from_element(1, value)
    }

    #[test]
    fn derivative_is_that_of_the_torque_with_the_rate() {
        let mut servo = servo();
        servo.command(&one(0.004), &one(0.1), 0.005);
        let step_s = 1e-3;
        // The position at the end of the step follows the rate; the last rate saturates the motor.
        let at = |rate: f64| {
            let state = DriveState { share: 0.4, period_s: 0.005, step_s, position: 0.003 + step_s * rate, rate };
            servo.torque(0, &state)
        };
        for rate in [-0.7, -0.01, 0.0, 0.005, 0.4, 8.0] {
            let (up, down) = (at(rate + 1e-6), at(rate - 1e-6));
            let difference = (up.motor_nm + up.friction_nm - down.motor_nm - down.friction_nm) / 2e-6;
            assert!((difference - at(rate).derivative).abs() < 1e-4 * difference.abs(), "at {rate} rad/s");
        }
        assert!(at(8.0).saturated && at(8.0).motor_nm == -10.0);
        assert!(!at(0.0).saturated);
    }

    #[test]
    fn references_run_linearly_and_stay_within_position_and_speed_limits() {
        let mut servo = servo();
        servo.hold(&one(0.0));
        servo.command(&one(0.004), &one(0.0), 0.005);
        assert_eq!([0.0, 0.5, 1.0].map(|share| servo.reference(0, share)), [0.0, 0.002, 0.004]);
        assert_eq!(servo.limited_references(), 0);
        servo.command(&one(5.0), &one(0.0), 0.005);
        assert!((servo.reference(0, 1.0) - 0.014).abs() < 1e-15, "2 rad/s for 5 ms");
        for _ in 0..200 {
            servo.command(&one(5.0), &one(0.0), 0.005);
        }
        assert_eq!(servo.reference(0, 1.0), 1.0);
        assert_eq!(servo.limited_references(), 201);
    }

    #[test]
    fn a_feed_forward_torque_acts_until_another_comes_or_the_posture_is_held() {
        let mut servo = servo();
        let state = DriveState { share: 1.0, period_s: 0.005, step_s: 1e-3, position: 0.0, rate: 0.0 };
        for torque_nm in [3.0, -4.0] {
            servo.command(&one(0.0), &one(torque_nm), 0.005);
            assert_eq!(servo.torque(0, &state).motor_nm, torque_nm);
        }
        servo.hold(&one(0.0));
        assert_eq!(servo.torque(0, &state).motor_nm, 0.0);
    }

    #[test]
    fn a_joint_that_the_settings_name_has_its_own_drive() {
        let model = Model::from_urdf(URDF, &ModelOptions { base: Base::Fixed, ..Default::default() }).unwrap();
        let own = DriveSettings { stiffness_nm_per_rad: 7.0, rotor_inertia_kg_m2: 0.3, ..Default::default() };
        let settings = ServoSettings { joints: [("elbow".to_owned(), own)].into(), ..Default::default() };
        let servo = Servo::new(&model, &settings).unwrap();
        assert_eq!(servo.rotor_inertia_kg_m2(0), 0.3);
        let state = DriveState { share: 1.0, period_s: 0.005, step_s: 1e-3, position: 0.5, rate: 0.0 };
        assert_eq!(servo.torque(0, &state).motor_nm, -3.5);
    }

    #[test]
    fn a_repeated_reference_is_held_with_rate_zero() {
        let mut servo = servo();
        servo.command(&one(0.004), &one(0.0), 0.005);
        servo.command(&one(0.004), &one(0.0), 0.005);
        let state = DriveState { share: 0.2, period_s: 0.005, step_s: 1e-3, position: 0.004, rate: 0.0 };
        assert_eq!(servo.torque(0, &state).motor_nm, 0.0);
    }
}
