//! Everything that can be chosen about the simulated robot. Plain data with units in the names; [`PlantSettings::check`]
//! names the first value that cannot be.

use ranges::{OutOfRange, Range};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::PI;

use crate::disturbance::Push;
use crate::ground::GroundSettings;
use crate::sensor::SensorSettings;
use stabiliser::StabiliserSettings;

/// Settings of the plant. Every field has a default, so that a file names only what differs.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlantSettings {
    /// Time integration.
    pub step: StepSettings,
    /// Contact of the soles.
    pub contact: ContactSettings,
    /// Joint drives.
    pub servo: ServoSettings,
    /// Sensors.
    pub sensors: SensorSettings,
    /// Built-in stabiliser.
    pub stabiliser: StabiliserSettings,
    /// When a run counts as fallen.
    pub fall: FallSettings,
    /// When the robot counts as being at rest.
    pub rest: RestSettings,
    /// The floor.
    pub ground: GroundSettings,
    /// Pushes.
    pub pushes: Vec<Push>,
}

/// Time integration, see [`crate::step`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StepSettings {
    /// Control period (s): one call of [`crate::Plant::tick`]. Every process has the same, so that no file sets it.
    #[serde(skip)]
    pub control_period_s: f64,
    /// Integration step `h` (s), a whole part of the control period. Error and numerical damping are of order h; contact modes of the
    /// default sole are resolved from about 2 ms down.
    pub step_s: f64,
    /// A step's equations are solved when no generalised force is off by more than this (N, N m). Useful: 1e-9 (to rounding) to 0.1, the
    /// largest that is taken: with more, what is left unbalanced makes energy.
    pub force_tolerance_n: f64,
    /// Newton steps per integration step at most; a step that needs more is kept and counted.
    pub newton_steps_max: usize,
    /// A step whose contact work is off by more than this (J) is taken in shorter ones, see [`crate::step`]. Useful: 1e-5 to 1e-3. No step of
    /// 1 ms in a shipped walk has as much; one in a drop of 2 mm has 1e-2.
    pub work_error_max_j: f64,
}

impl Default for StepSettings {
    fn default() -> Self {
        Self {
            control_period_s: 0.005,
            step_s: 0.001,
            force_tolerance_n: 0.01,
            newton_steps_max: 12,
            work_error_max_j: 5e-5,
        }
    }
}

/// Contact of the soles with the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSettings {
    /// `eta` (s) of the Kelvin-Voigt sole, stress = C (strain + eta strain rate): one decade of foam behaviour is
    /// 0.005-0.05 s; 0 is an elastic sole, which rings. Assumed, not measured on the original foam.
    pub viscosity_time_s: f64,
    /// Relative residual at which a contact problem counts as solved.
    pub tolerance: f64,
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self { viscosity_time_s: 0.02, tolerance: 1e-9 }
    }
}

/// Drives of all joints: one setting, and exceptions by joint name.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ServoSettings {
    /// Every joint that is not named below.
    pub default: DriveSettings,
    /// Exceptions, by the joint's name.
    pub joints: BTreeMap<String, DriveSettings>,
}

/// One joint's drive: `tau = clamp(kp (q_ref - q) + kd (q_ref' - q') + tau_ff, limits) - friction`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DriveSettings {
    /// `kp` (N m/rad). HRP-4's are not public; the default is more than ten times the sole's roll stiffness, so that the
    /// sole and not the drive is the soft part.
    pub stiffness_nm_per_rad: f64,
    /// `kd` (N m s/rad); the default is near critical for rotor plus swinging link: 2 sqrt(kp 0.4 kg m^2).
    pub damping_nm_s_per_rad: f64,
    /// Rotor inertia seen at the joint (kg m^2), added to the mass matrix.
    pub rotor_inertia_kg_m2: f64,
    /// Viscous friction (N m s/rad).
    pub viscous_friction_nm_s_per_rad: f64,
    /// Coulomb friction (N m), as `-c tanh(q'/v_s)`.
    pub coulomb_friction_nm: f64,
    /// `v_s` (rad/s): speed over which Coulomb friction builds up; smaller is closer to dry friction and stiffer.
    pub coulomb_speed_rad_per_s: f64,
}

impl Default for DriveSettings {
    fn default() -> Self {
        Self {
            stiffness_nm_per_rad: 1.5e4,
            damping_nm_s_per_rad: 155.0,
            rotor_inertia_kg_m2: 0.1,
            viscous_friction_nm_s_per_rad: 0.0,
            coulomb_friction_nm: 0.0,
            coulomb_speed_rad_per_s: 0.01,
        }
    }
}

/// When a run counts as fallen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FallSettings {
    /// Lowest height of the base above the ground below it (m).
    pub base_height_min_m: f64,
    /// Largest angle between the base's z axis and the vertical (rad).
    pub tilt_max_rad: f64,
    /// Lowest height of the origin of any link but the feet above the ground below it (m): stands for contact of that
    /// link's body.
    pub link_height_min_m: f64,
}

impl Default for FallSettings {
    fn default() -> Self {
        Self { base_height_min_m: 0.5, tilt_max_rad: PI / 4.0, link_height_min_m: 0.05 }
    }
}

/// When the robot counts as being at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RestSettings {
    /// Largest speed of the base (m/s).
    pub base_speed_max_m_per_s: f64,
    /// Largest angular speed of the base (rad/s).
    pub base_rate_max_rad_per_s: f64,
    /// For how long (s).
    pub duration_s: f64,
}

impl Default for RestSettings {
    fn default() -> Self {
        Self { base_speed_max_m_per_s: 1e-3, base_rate_max_rad_per_s: 0.2f64.to_radians(), duration_s: 0.5 }
    }
}

/// Integration steps per control period: 5 microseconds each.
const STEPS_MAX: f64 = 1000.0;
/// As good as no bound: more than any robot has.
const WORK_ERROR_J: Range = Range::above_zero_to(1e9);
/// How far a control period may be from a whole number of steps: digits that a file does not give.
const WHOLE: f64 = 1e-6;

const STEP_S: Range = Range::above_zero_to(0.1);
const FORCE_TOLERANCE_N: Range = Range::between(1e-12, 0.1);
const NEWTON_STEPS: Range = Range::between(1.0, 1000.0);
const VISCOSITY_TIME_S: Range = Range::between(0.0, 1.0);
const CONTACT_TOLERANCE: Range = Range::between(1e-14, 1e-3);

impl PlantSettings {
    /// Is every value one that can be?
    ///
    /// # Errors
    /// The first that is not, by name.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.step.check()?;
        let ContactSettings { viscosity_time_s, tolerance } = self.contact;
        VISCOSITY_TIME_S.demand("contact.viscosity_time_s", viscosity_time_s, "0.005 to 0.05 is plausible for foam")?;
        CONTACT_TOLERANCE.demand("contact.tolerance", tolerance, "1e-9 is usual")?;
        self.servo.default.check("servo.default")?;
        for (name, drive) in &self.servo.joints {
            drive.check(&format!("servo.joints.{name}"))?;
        }
        self.sensors.check()?;
        self.stabiliser.check()?;
        self.fall.check()?;
        self.rest.check()?;
        self.ground.check()?;
        self.pushes.iter().enumerate().try_for_each(|(i, push)| push.check(i))
    }
}

impl StepSettings {
    fn check(&self) -> Result<(), OutOfRange> {
        let Self { control_period_s, step_s, force_tolerance_n, newton_steps_max, work_error_max_j } = *self;
        STEP_S.demand("step.control_period_s", control_period_s, "0.005 is usual")?;
        let steps = Range::between(control_period_s / STEPS_MAX, control_period_s);
        steps.demand("step.step_s", step_s, "a fifth of the control period is usual")?;
        let count = control_period_s / step_s;
        if (count - count.round()).abs() > WHOLE {
            let [shorter_s, longer_s] = [count.ceil(), count.floor()].map(|whole| control_period_s / whole);
            let expected = format!("a whole part of the control period, as {shorter_s} or {longer_s}");
            return Err(OutOfRange::new("step.step_s", step_s, expected, "a fifth of the control period is usual"));
        }
        WORK_ERROR_J.demand("step.work_error_max_j", work_error_max_j, "1e-5 to 1e-3 is useful")?;
        FORCE_TOLERANCE_N.demand("step.force_tolerance_n", force_tolerance_n, "1e-9 to 0.1 is useful")?;
        NEWTON_STEPS.demand("step.newton_steps_max", newton_steps_max as f64, "12 is usual")
    }
}

impl FallSettings {
    fn check(&self) -> Result<(), OutOfRange> {
        let height_m = Range::above_zero_to(10.0);
        height_m.demand(
            "fall.base_height_min_m",
            self.base_height_min_m,
            "two thirds of the standing height is usual",
        )?;
        Range::above_zero_to(PI).demand("fall.tilt_max_rad", self.tilt_max_rad, "an eighth of a turn is usual")?;
        height_m.demand("fall.link_height_min_m", self.link_height_min_m, "some centimetres are usual")
    }
}

impl RestSettings {
    fn check(&self) -> Result<(), OutOfRange> {
        let speed = Range::above_zero_to(10.0);
        speed.demand("rest.base_speed_max_m_per_s", self.base_speed_max_m_per_s, "a millimetre per second is usual")?;
        speed.demand("rest.base_rate_max_rad_per_s", self.base_rate_max_rad_per_s, "0.0035 is usual")?;
        Range::between(0.0, 3600.0).demand("rest.duration_s", self.duration_s, "half a second is usual")
    }
}

impl DriveSettings {
    fn check(&self, path: &str) -> Result<(), OutOfRange> {
        for (name, value, most) in [
            ("stiffness_nm_per_rad", self.stiffness_nm_per_rad, 1e7),
            ("damping_nm_s_per_rad", self.damping_nm_s_per_rad, 1e6),
            ("rotor_inertia_kg_m2", self.rotor_inertia_kg_m2, 1e3),
            ("viscous_friction_nm_s_per_rad", self.viscous_friction_nm_s_per_rad, 1e5),
            ("coulomb_friction_nm", self.coulomb_friction_nm, 1e4),
        ] {
            Range::between(0.0, most).demand(format!("{path}.{name}"), value, DRIVE_REMEDY)?;
        }
        let speed = self.coulomb_speed_rad_per_s;
        Range::above_zero_to(100.0).demand(format!("{path}.coulomb_speed_rad_per_s"), speed, "0.01 is usual")
    }
}

const DRIVE_REMEDY: &str = "the robot's own drives are in its robot.toml";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_can_be() {
        assert_eq!(PlantSettings::default().check(), Ok(()));
    }

    #[test]
    fn unknown_keys_are_rejected_by_name() {
        let error = toml::from_str::<PlantSettings>("[step]\nsteps_s = 0.001\n").unwrap_err().to_string();
        assert!(error.contains("steps_s"), "{error}");
    }

    #[test]
    fn the_control_period_is_nobody_s_setting() {
        let error = toml::from_str::<PlantSettings>("[step]\ncontrol_period_s = 0.005\n").unwrap_err().to_string();
        assert!(error.contains("control_period_s"), "{error}");
        for step_s in [0.005, 0.0025, 0.001, 0.000_333_333_33] {
            let settings = StepSettings { step_s, ..Default::default() };
            assert_eq!(PlantSettings { step: settings, ..Default::default() }.check(), Ok(()), "{step_s}");
        }
    }

    #[test]
    fn what_cannot_be_is_named() {
        let wrong = |text: &str| toml::from_str::<PlantSettings>(text).unwrap().check().unwrap_err().to_string();
        assert!(wrong("[step]\nstep_s = 0.0").contains("step.step_s"));
        assert!(wrong("[step]\nstep_s = 0.006").contains("at most 0.005"));
        let uneven = wrong("[step]\nstep_s = 0.004");
        assert!(uneven.contains("`step.step_s` is 0.004") && uneven.contains("0.0025 or 0.005"), "{uneven}");
        assert!(wrong("[step]\nstep_s = 0.002").contains("a whole part of the control period"));
        assert!(wrong("[step]\nforce_tolerance_n = 1.0").contains("`step.force_tolerance_n` is 1, must be"));
        assert!(wrong("[contact]\nviscosity_time_s = -1.0").contains("contact.viscosity_time_s"));
        assert!(
            wrong("[servo.joints.L_KNEE_P]\nstiffness_nm_per_rad = nan").contains("servo.joints.L_KNEE_P.stiffness")
        );
        assert!(wrong("[stabiliser]\nroll_damping_nm_s_per_rad = 0.0").contains("stabiliser.roll_damping"));
        assert!(wrong("[sensors]\njoint_noise_rad = -1.0").contains("sensors.joint_noise_rad"));
        assert!(
            wrong("[[pushes]]\nlink = \"body\"\nstart_s = 1.0\nduration_s = 0.0\nforce_n = [1.0, 0.0, 0.0]")
                .contains("pushes[0]")
        );
        let field = "[ground.shape]\nkind = \"height-field\"\norigin_m = [0.0, 0.0]\nspacing_m = 0.1\ncolumns = 3\nheights_m = [0.0, 0.0]";
        assert!(wrong(field).contains("heights_m` is a list of 2"));
    }

    #[test]
    fn settings_survive_a_file() {
        let mut settings = PlantSettings::default();
        settings
            .servo
            .joints
            .insert("L_KNEE_P".to_owned(), DriveSettings { stiffness_nm_per_rad: 2e4, ..Default::default() });
        settings.pushes.push(Push { link: "torso".to_owned(), start_s: 1.0, ..Push::default() });
        let text = toml::to_string(&settings).unwrap();
        assert_eq!(toml::from_str::<PlantSettings>(&text).unwrap(), settings);
    }
}
