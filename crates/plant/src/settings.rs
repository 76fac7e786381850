//! Everything that can be chosen about the simulated robot. Plain data with units in the names; [`PlantSettings::check`]
//! names the first value that cannot be.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::disturbance::Push;
use crate::ground::GroundSettings;
use crate::sensor::SensorSettings;
use crate::stabiliser::StabiliserSettings;

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
}

impl Default for StepSettings {
    fn default() -> Self {
        Self { control_period_s: 0.005, step_s: 0.001, force_tolerance_n: 0.01, newton_steps_max: 12 }
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
        Self { base_height_min_m: 0.5, tilt_max_rad: std::f64::consts::FRAC_PI_4, link_height_min_m: 0.05 }
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

/// A setting that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// A number that has to be positive is not, or is larger than anything here can be.
    #[error("{field} has to be positive and at most {SETTING_MAX:e}, it is {value}")]
    NotPositive {
        /// Path of the field.
        field: String,
        /// What it was.
        value: f64,
    },
    /// A number that may be zero but not less is negative, or larger than anything here can be.
    #[error("{field} has to be zero or positive and at most {SETTING_MAX:e}, it is {value}")]
    Negative {
        /// Path of the field.
        field: String,
        /// What it was.
        value: f64,
    },
    /// A number of either sign is not finite, or larger than anything here can be.
    #[error("{field} has to lie between -{SETTING_MAX:e} and {SETTING_MAX:e}, it is {value}")]
    NotInRange {
        /// Path of the field.
        field: String,
        /// What it was.
        value: f64,
    },
    /// A number is larger than its memory or time allow.
    #[error("{field} has to be at most {largest}, it is {value}")]
    TooLarge {
        /// Path of the field.
        field: String,
        /// What it was.
        value: f64,
        /// Largest value.
        largest: f64,
    },
    /// So many steps in a control period that a run would not end.
    #[error("step.step_s = {step_s} s makes {steps:e} steps of a control period, at most {STEPS_MAX} are taken")]
    StepTooShort {
        /// Wanted step (s).
        step_s: f64,
        /// How many they would be.
        steps: f64,
    },
    /// A control period that is no whole number of steps.
    #[error(
        "step.step_s = {step_s} s does not divide the control period of {period_s} s; {shorter_s} s and {longer_s} s do"
    )]
    StepDoesNotDivide {
        /// Wanted step (s).
        step_s: f64,
        /// Control period (s).
        period_s: f64,
        /// The next shorter step that does (s).
        shorter_s: f64,
        /// The next longer one (s).
        longer_s: f64,
    },
    /// A step longer than the control period.
    #[error("step.step_s = {step_s} s is longer than the control period of {control_period_s} s")]
    StepTooLong {
        /// Wanted step (s).
        step_s: f64,
        /// Control period (s).
        control_period_s: f64,
    },
    /// A height field whose table does not have the size it says.
    #[error("ground.shape.heights_m has {found} values; {rows} rows of {columns} columns are expected")]
    HeightField {
        /// Number of values found.
        found: usize,
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
}

/// Nothing that is set here, in SI units, is larger: stiff contacts have 1e8 N/m. Beyond it sums and products of settings would overflow.
const SETTING_MAX: f64 = 1e9;
/// Integration steps per control period: 5 microseconds each.
const STEPS_MAX: f64 = 1000.0;
/// Unbalanced force of a step (N).
const FORCE_TOLERANCE_MAX_N: f64 = 0.1;
/// How far a control period may be from a whole number of steps: digits that a file does not give.
const WHOLE: f64 = 1e-6;
/// Newton steps per integration step.
const NEWTON_STEPS_MAX: f64 = 1000.0;

pub(crate) fn positive(field: &str, value: f64) -> Result<(), SettingsError> {
    if value > 0.0 && value <= SETTING_MAX {
        return Ok(());
    }
    Err(SettingsError::NotPositive { field: field.to_owned(), value })
}

pub(crate) fn not_negative(field: &str, value: f64) -> Result<(), SettingsError> {
    if (0.0..=SETTING_MAX).contains(&value) {
        return Ok(());
    }
    Err(SettingsError::Negative { field: field.to_owned(), value })
}

/// Of either sign.
pub(crate) fn in_range(field: &str, value: f64) -> Result<(), SettingsError> {
    if value.abs() <= SETTING_MAX {
        return Ok(());
    }
    Err(SettingsError::NotInRange { field: field.to_owned(), value })
}

pub(crate) fn at_most(field: &str, value: f64, largest: f64) -> Result<(), SettingsError> {
    if value <= largest {
        return Ok(());
    }
    Err(SettingsError::TooLarge { field: field.to_owned(), value, largest })
}

impl PlantSettings {
    /// Is every value one that can be?
    ///
    /// # Errors
    /// The first that is not, by name.
    pub fn check(&self) -> Result<(), SettingsError> {
        let StepSettings { control_period_s, step_s, force_tolerance_n, newton_steps_max } = self.step;
        positive("step.control_period_s", control_period_s)?;
        positive("step.step_s", step_s)?;
        positive("step.force_tolerance_n", force_tolerance_n)?;
        at_most("step.force_tolerance_n", force_tolerance_n, FORCE_TOLERANCE_MAX_N)?;
        positive("step.newton_steps_max", newton_steps_max as f64)?;
        at_most("step.newton_steps_max", newton_steps_max as f64, NEWTON_STEPS_MAX)?;
        if step_s > control_period_s {
            return Err(SettingsError::StepTooLong { step_s, control_period_s });
        }
        let steps = control_period_s / step_s;
        if steps > STEPS_MAX {
            return Err(SettingsError::StepTooShort { step_s, steps });
        }
        if (steps - steps.round()).abs() > WHOLE {
            let (shorter_s, longer_s) = (control_period_s / steps.ceil(), control_period_s / steps.floor());
            return Err(SettingsError::StepDoesNotDivide { step_s, period_s: control_period_s, shorter_s, longer_s });
        }
        not_negative("contact.viscosity_time_s", self.contact.viscosity_time_s)?;
        positive("contact.tolerance", self.contact.tolerance)?;
        self.servo.default.check("servo.default")?;
        for (name, drive) in &self.servo.joints {
            drive.check(&format!("servo.joints.{name}"))?;
        }
        self.sensors.check()?;
        self.stabiliser.check()?;
        positive("fall.base_height_min_m", self.fall.base_height_min_m)?;
        positive("fall.tilt_max_rad", self.fall.tilt_max_rad)?;
        positive("fall.link_height_min_m", self.fall.link_height_min_m)?;
        positive("rest.base_speed_max_m_per_s", self.rest.base_speed_max_m_per_s)?;
        positive("rest.base_rate_max_rad_per_s", self.rest.base_rate_max_rad_per_s)?;
        not_negative("rest.duration_s", self.rest.duration_s)?;
        self.ground.check()?;
        for (i, push) in self.pushes.iter().enumerate() {
            push.check(i)?;
        }
        Ok(())
    }
}

impl DriveSettings {
    fn check(&self, path: &str) -> Result<(), SettingsError> {
        for (name, value) in [
            ("stiffness_nm_per_rad", self.stiffness_nm_per_rad),
            ("damping_nm_s_per_rad", self.damping_nm_s_per_rad),
            ("rotor_inertia_kg_m2", self.rotor_inertia_kg_m2),
            ("viscous_friction_nm_s_per_rad", self.viscous_friction_nm_s_per_rad),
            ("coulomb_friction_nm", self.coulomb_friction_nm),
        ] {
            not_negative(&format!("{path}.{name}"), value)?;
        }
        positive(&format!("{path}.coulomb_speed_rad_per_s"), self.coulomb_speed_rad_per_s)
    }
}

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
        assert!(wrong("[step]\nstep_s = 0.006").contains("longer than"));
        let uneven = wrong("[step]\nstep_s = 0.004");
        assert!(uneven.contains("step.step_s = 0.004") && uneven.contains("0.0025 s and 0.005 s do"), "{uneven}");
        assert!(wrong("[step]\nstep_s = 0.002").contains("does not divide"));
        assert!(wrong("[step]\nforce_tolerance_n = 1.0").contains("step.force_tolerance_n has to be at most 0.1"));
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
        assert!(wrong(field).contains("heights_m has 2"));
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
