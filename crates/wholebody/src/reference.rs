//! What comes in: state and references of one tick.

use multibody::Configuration;
use nalgebra::{DVector, Vector2};
use spatial::{Mat3, Transform, Twist, Vec3, Wrench};

/// Where the robot is and how it moves.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotState {
    /// Configuration.
    pub q: Configuration,
    /// Velocity: base linear, base angular (both in the base frame), joint rates.
    pub v: DVector<f64>,
}

/// What one foot shall do. World axes; twist and acceleration are those of the ankle frame's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootTarget {
    /// The foot stands: its ankle motion is a hard constraint and it carries load.
    pub in_contact: bool,
    /// Planned part of the weight that it carries, 0 to 1.
    pub load_share: f64,
    /// Pose: the estimator's while standing, the swing trajectory's in the air.
    pub ankle_pose: Transform,
    /// Velocity.
    pub ankle_twist: Twist,
    /// Acceleration.
    pub ankle_acceleration: Twist,
    /// Planned wrench of the ground on the foot, about the planned ZMP (standing only).
    pub wrench: Wrench,
    /// Planned ZMP on the ground (m).
    pub zmp: Vector2<f64>,
}

impl FootTarget {
    /// At rest, in the air.
    #[must_use]
    pub fn hanging(ankle_pose: Transform) -> Self {
        Self {
            in_contact: false,
            load_share: 0.0,
            ankle_pose,
            ankle_twist: Twist::zero(),
            ankle_acceleration: Twist::zero(),
            wrench: Wrench::zero(),
            zmp: Vector2::new(ankle_pose.translation.x, ankle_pose.translation.y),
        }
    }

    /// At rest on the ground, carrying a part of the weight (N) at a point of the ground.
    #[must_use]
    pub fn standing(ankle_pose: Transform, load_share: f64, weight_n: f64, zmp: Vector2<f64>) -> Self {
        let force = Vec3::new(0.0, 0.0, load_share * weight_n);
        Self {
            in_contact: true,
            load_share,
            wrench: Wrench { force, moment: Vec3::zeros() },
            zmp,
            ..Self::hanging(ankle_pose)
        }
    }
}

/// What the robot shall do at this tick.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeBodyReference {
    /// Position of the centre of mass (m).
    pub com_position: Vec3,
    /// Its velocity (m/s).
    pub com_velocity: Vec3,
    /// Its acceleration (m/s²).
    pub com_acceleration: Vec3,
    /// Left, right.
    pub feet: [FootTarget; 2],
    /// `R_WT` of the torso.
    pub torso_rotation: Mat3,
    /// Its angular velocity, world axes (rad/s).
    pub torso_angular_velocity: Vec3,
    /// Its angular acceleration, world axes (rad/s²).
    pub torso_angular_acceleration: Vec3,
}
