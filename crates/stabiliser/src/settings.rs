//! Gains and limits of the stabiliser.

use ranges::{OutOfRange, Range};
use serde::{Deserialize, Serialize};

/// Gains and limits of the stabiliser; the formulas are on the [crate's page](crate).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StabiliserSettings {
    /// Corrects the command (otherwise the command goes to the drives as it is).
    pub enabled: bool,
    /// `k_p` (1/s): rate at which an error of the divergent component decays. Useful: 1 to 5, well below `K/D`.
    pub dcm_gain_per_s: f64,
    /// `k_i` (1/s).
    pub dcm_integral_gain_per_s: f64,
    /// `D` about the foot's roll axis (N m s/rad). Not zero; with a negative one the foot pushes against the moment instead of
    /// yielding, and the robot falls: tests show so.
    pub roll_damping_nm_s_per_rad: f64,
    /// `D` about its pitch axis (N m s/rad); the same holds.
    pub pitch_damping_nm_s_per_rad: f64,
    /// `D_z` (N s/m).
    pub vertical_damping_n_s_per_m: f64,
    /// `T` of feet in contact (s).
    pub relaxation_s: f64,
    /// `T` of a foot in the air, and of the vertical shift in single support (s).
    pub swing_relaxation_s: f64,
    /// Largest roll or pitch added to a foot (rad).
    pub foot_rotation_max_rad: f64,
    /// Largest vertical shift between the feet (m).
    pub vertical_shift_max_m: f64,
    /// `l` (m): a force moved between the feet counts as much as a moment of that force times this length. Smaller shifts load,
    /// larger turns feet.
    pub load_shift_length_m: f64,
    /// Half length of the rectangle about the sole's centre where a foot's ZMP may be (m), see `stabiliser`.
    pub zmp_half_length_m: f64,
    /// Half width of that rectangle (m).
    pub zmp_half_width_m: f64,
    /// `k` of the torso (1/s).
    pub torso_gain_per_s: f64,
    /// `T` of the torso (s).
    pub torso_relaxation_s: f64,
    /// Largest roll or pitch added to the base (rad).
    pub torso_rotation_max_rad: f64,
}

impl Default for StabiliserSettings {
    fn default() -> Self {
        Self {
            enabled: true,
            dcm_gain_per_s: 3.0,
            dcm_integral_gain_per_s: 0.5,
            roll_damping_nm_s_per_rad: 30.0,
            pitch_damping_nm_s_per_rad: 90.0,
            vertical_damping_n_s_per_m: 2.5e4,
            relaxation_s: 2.0,
            swing_relaxation_s: 0.1,
            foot_rotation_max_rad: 0.15,
            vertical_shift_max_m: 0.02,
            load_shift_length_m: 0.05,
            zmp_half_length_m: 0.092,
            zmp_half_width_m: 0.047,
            torso_gain_per_s: 1.0,
            torso_relaxation_s: 1.0,
            torso_rotation_max_rad: 0.1,
        }
    }
}

impl StabiliserSettings {
    /// Is every value one that can be? Keys stand below `stabiliser`.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        for (name, value, most) in [
            ("roll_damping_nm_s_per_rad (magnitude)", self.roll_damping_nm_s_per_rad.abs(), 1e6),
            ("pitch_damping_nm_s_per_rad (magnitude)", self.pitch_damping_nm_s_per_rad.abs(), 1e6),
            ("vertical_damping_n_s_per_m", self.vertical_damping_n_s_per_m, 1e9),
            ("relaxation_s", self.relaxation_s, 1e4),
            ("swing_relaxation_s", self.swing_relaxation_s, 1e4),
            ("load_shift_length_m", self.load_shift_length_m, 10.0),
            ("zmp_half_length_m", self.zmp_half_length_m, 1.0),
            ("zmp_half_width_m", self.zmp_half_width_m, 1.0),
            ("torso_relaxation_s", self.torso_relaxation_s, 1e4),
        ] {
            Range::above_zero_to(most).demand(format!("stabiliser.{name}"), value, REMEDY)?;
        }
        for (name, value, most) in [
            ("dcm_gain_per_s", self.dcm_gain_per_s, 200.0),
            ("dcm_integral_gain_per_s", self.dcm_integral_gain_per_s, 200.0),
            ("foot_rotation_max_rad", self.foot_rotation_max_rad, 1.0),
            ("vertical_shift_max_m", self.vertical_shift_max_m, 1.0),
            ("torso_gain_per_s", self.torso_gain_per_s, 200.0),
            ("torso_rotation_max_rad", self.torso_rotation_max_rad, 1.0),
        ] {
            Range::between(0.0, most).demand(format!("stabiliser.{name}"), value, REMEDY)?;
        }
        Ok(())
    }
}

const REMEDY: &str = "the shipped configuration shows what was tried on HRP-4";
