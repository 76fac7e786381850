//! `robot.toml`.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What the URDF cannot say about a robot. Feet are always indexed left = 0, right = 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotDescription {
    /// The robot's name for people.
    pub name: String,
    /// File name of the URDF, in the same folder.
    pub urdf: String,
    /// Root link of the URDF: the floating base.
    pub base_link: String,
    /// Link whose orientation a walking controller keeps.
    pub torso_link: String,
    /// Frame (URDF link) of the accelerometer and gyroscope.
    pub imu_frame: String,
    /// All movable joints in the order of the robot's interface, without those that follow others (`<mimic>`).
    pub joints: Vec<String>,
    /// Joints or groups that a walking scene does not move: they are locked at the half-sitting posture.
    pub walking_locked: Vec<String>,
    /// Named sets of joints.
    pub groups: BTreeMap<String, Vec<String>>,
    /// Standing posture to start from (deg); joints that are not listed are at zero.
    pub half_sitting_deg: BTreeMap<String, f64>,
    /// Left, right.
    pub feet: Feet,
    /// Position servos; every joint exactly once.
    pub servos: Vec<ServoGains>,
    /// Coefficients of the energy integral; every joint exactly once.
    pub energy: Vec<EnergyCoefficients>,
    /// How much of the URDF's limits a whole-body controller may use.
    pub limits: LimitFactors,
    /// Shapes for self-collision.
    pub capsules: Vec<Capsule>,
    /// Pairs of capsule names that must keep their distance.
    pub collision_pairs: Vec<[String; 2]>,
    /// Pairs that the joints' ranges allow to meet and that are not watched all the same.
    #[serde(default)]
    pub collision_pairs_left_out: Vec<LeftOut>,
}

/// Pairs that are not watched, and why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeftOut {
    /// Why.
    pub reason: String,
    /// Pairs of capsule names.
    pub pairs: Vec<[String; 2]>,
}

/// Left and right foot; `[0]` is the left one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Feet {
    /// Left foot.
    pub left: FootDescription,
    /// Right foot.
    pub right: FootDescription,
}

impl std::ops::Index<usize> for Feet {
    type Output = FootDescription;

    fn index(&self, foot: usize) -> &FootDescription {
        [&self.left, &self.right][foot]
    }
}

impl Feet {
    /// Left, right.
    pub fn iter(&self) -> impl Iterator<Item = &FootDescription> {
        [&self.left, &self.right].into_iter()
    }
}

/// Names of a foot's frames in the URDF.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FootDescription {
    /// Link that carries the sole.
    pub link: String,
    /// Frame at the crossing of the ankle's pitch and roll axes, with the foot's axes.
    pub ankle_frame: String,
    /// Frame at which the foot's force sensor reports.
    pub force_sensor_frame: String,
}

/// Position servo `tau = tau_ff + kp (q_ref - q) + kd (qd_ref - qd)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoGains {
    /// Joints or groups that have it.
    pub of: Vec<String>,
    /// Stiffness (N m/rad).
    pub kp_nm_per_rad: f64,
    /// Damping (N m s/rad).
    pub kd_nm_s_per_rad: f64,
    /// The rotor's inertia seen through the gear (kg m^2).
    pub rotor_inertia_kg_m2: f64,
    /// Dry friction of motor and gear (N m).
    pub coulomb_friction_nm: f64,
    /// Friction proportional to speed (N m s/rad).
    pub viscous_friction_nm_s_per_rad: f64,
}

/// `E = integral of a tau^2 + b tau qd + c qd^2` (W): equation (2) of the walking paper.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnergyCoefficients {
    /// Joints or groups that have them.
    pub of: Vec<String>,
    /// `a`: winding loss (W per (N m)^2).
    pub torque_squared_w_per_nm2: f64,
    /// `b`: mechanical power (dimensionless).
    pub power: f64,
    /// `c`: friction loss (W per (rad/s)^2).
    pub speed_squared_w_s2_per_rad2: f64,
}

/// How much of the URDF's limits a whole-body controller may use.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitFactors {
    /// Distance kept from position limits (deg).
    pub position_margin_deg: f64,
    /// Fraction of the speed limits.
    pub velocity_factor: f64,
    /// Fraction of the torque limits.
    pub torque_factor: f64,
}

/// All points closer than a radius to a segment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Capsule {
    /// Name used in `collision_pairs`.
    pub name: String,
    /// Frame (URDF link) in which the segment is given.
    pub link: String,
    /// One end of the segment (m).
    pub from_m: [f64; 3],
    /// The other end (m).
    pub to_m: [f64; 3],
    /// Radius (m).
    pub radius_m: f64,
}

impl RobotDescription {
    /// The joints that a list of joints and groups means, without repetition.
    #[must_use]
    pub fn members<'a>(&'a self, names: &'a [String]) -> Vec<&'a str> {
        let mut found = Vec::new();
        for name in names {
            let group = self.groups.get(name).map_or(std::slice::from_ref(name), Vec::as_slice);
            for joint in group {
                if !found.contains(&joint.as_str()) {
                    found.push(joint.as_str());
                }
            }
        }
        found
    }

    /// Half-sitting position of a joint (rad).
    #[must_use]
    pub fn half_sitting_rad(&self, joint: &str) -> f64 {
        self.half_sitting_deg.get(joint).map_or(0.0, |deg| deg.to_radians())
    }

    /// Joints that a walking scene locks, with their half-sitting positions (rad): what `multibody` takes.
    #[must_use]
    pub fn walking_locked_joints(&self) -> Vec<(String, f64)> {
        let lock = |joint: &str| (joint.to_owned(), self.half_sitting_rad(joint));
        self.members(&self.walking_locked).into_iter().map(lock).collect()
    }

    /// Servo of a joint; `None` only for a name that is no joint of this robot.
    #[must_use]
    pub fn servo(&self, joint: &str) -> Option<&ServoGains> {
        self.shared_by(&self.servos, joint)
    }

    /// Energy coefficients of a joint; `None` only for a name that is no joint of this robot.
    #[must_use]
    pub fn energy_coefficients(&self, joint: &str) -> Option<&EnergyCoefficients> {
        self.shared_by(&self.energy, joint)
    }

    pub(crate) fn shared_by<'a, T: Shared>(&'a self, values: &'a [T], joint: &str) -> Option<&'a T> {
        values.iter().find(|shared| self.members(shared.of()).contains(&joint))
    }
}

/// A value that several joints have in common.
pub(crate) trait Shared {
    /// Joints or groups.
    fn of(&self) -> &[String];
}

impl Shared for ServoGains {
    fn of(&self) -> &[String] {
        &self.of
    }
}

impl Shared for EnergyCoefficients {
    fn of(&self) -> &[String] {
        &self.of
    }
}
