//! Inverse kinematics of six-joint legs: in closed form where hips turn yaw, roll, pitch, by Newton's method elsewhere.
//!
//! [`LegKinematics`] takes the closed form ([`LegGeometry`]) if the model has its shape, else the chain of axes
//! ([`LegChain`]), which needs angles that are nearly right to begin with: those of the tick before, or of half-sitting.

mod chain;
mod yaw_roll_pitch;

pub use chain::LegChain;
pub use yaw_roll_pitch::LegGeometry;

use crate::model::{FrameIndex, JointIndex, Model};
use spatial::{Transform, Vec3};

/// A leg that no inverse kinematics here holds for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LegError {
    /// A joint axis is not where the closed form needs it.
    #[error("joint {joint} turns about {found:?} at zero angles, {expected:?} is expected (base axes)")]
    Axis {
        /// Name of the joint.
        joint: String,
        /// Axis the closed form needs.
        expected: [f64; 3],
        /// Axis of the model.
        found: [f64; 3],
    },
    /// Hip axes or ankle axes do not meet, or the knee is not straight below the hip.
    #[error("joint {joint}: {relation} is off by {distance_m} m")]
    Offset {
        /// Name of the joint.
        joint: String,
        /// What does not hold.
        relation: &'static str,
        /// By how much (m).
        distance_m: f64,
    },
    /// The foot link's axes are not parallel to the base at zero angles.
    #[error("frame {frame} is turned against the base by {angle_rad} rad at zero angles")]
    Foot {
        /// Name of the frame.
        frame: String,
        /// Angle (rad).
        angle_rad: f64,
    },
    /// A joint moves the foot and is none of the leg's, or is one of them and does not. Remedy: list the six joints between
    /// base and foot, from the hip.
    #[error("joint {joint}: the six joints of a leg must be those that move its foot, and no other one may")]
    OtherJoints {
        /// Name of the joint.
        joint: String,
    },
    /// The joints are not listed from hip to foot.
    #[error("joint {joint} is listed behind one that it carries; a leg's joints are listed from the hip")]
    Order {
        /// Name of the joint.
        joint: String,
    },
    /// A joint slides.
    #[error("joint {joint} slides; legs of revolute joints are solved")]
    Sliding {
        /// Name of the joint.
        joint: String,
    },
    /// The six joints cannot move the foot in every direction, bent or not.
    #[error(
        "the leg from joint {joint} on cannot move its foot in every direction (smallest singular value {share:.1e} of the largest)"
    )]
    NotFree {
        /// Name of its first joint.
        joint: String,
        /// Smallest singular value of the foot's Jacobian over the largest.
        share: f64,
    },
}

/// Joint angles and whether the pose was within reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegAngles {
    /// From the hip (rad); of the closed form: hip yaw, roll, pitch, knee, ankle pitch, roll.
    pub joints_rad: [f64; 6],
    /// How much longer (or, negative, shorter) than possible the leg would have to be (m); 0 = the pose is met exactly. Of a
    /// chain: by how much the foot misses its pose, a radian counted as 0.2 m.
    pub out_of_reach_m: f64,
}

/// A leg, solved by what it allows. Its fourth joint is the knee.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LegKinematics {
    /// Hip yaw, roll, pitch, knee, ankle pitch, roll: in closed form.
    YawRollPitch(LegGeometry),
    /// Any other six revolute joints.
    Chain(LegChain),
}

impl LegKinematics {
    /// The closed form if the leg has its shape, else its chain.
    ///
    /// # Errors
    /// Why the leg is not even a chain: [`LegError::OtherJoints`], [`LegError::Order`],
    /// [`LegError::Sliding`] or [`LegError::NotFree`].
    pub fn of_model(model: &Model, joints: &[JointIndex; 6], ankle: FrameIndex) -> Result<Self, LegError> {
        let chain = LegChain::of_model(model, joints, ankle)?;
        Ok(LegGeometry::of_model(model, joints, ankle).map_or(Self::Chain(chain), Self::YawRollPitch))
    }

    /// Foot pose in the base frame at the given angles (rad).
    #[must_use]
    pub fn forward(&self, joints_rad: &[f64; 6]) -> Transform {
        match self {
            Self::YawRollPitch(geometry) => geometry.forward(joints_rad),
            Self::Chain(chain) => chain.forward(joints_rad),
        }
    }

    /// The angles that bring the foot to the pose `X_BF`; of several those near `near_rad`, which the closed form does not
    /// need. A pose out of reach is met as far as it can be.
    #[must_use]
    pub fn inverse(&self, X_BF: &Transform, near_rad: &[f64; 6]) -> LegAngles {
        match self {
            Self::YawRollPitch(geometry) => geometry.inverse(X_BF),
            Self::Chain(chain) => chain.inverse(X_BF, near_rad),
        }
    }

    /// Where the hip's axes meet, base frame (m).
    #[must_use]
    pub fn hip_in_base(&self) -> Vec3 {
        match self {
            Self::YawRollPitch(geometry) => geometry.hip_in_base,
            Self::Chain(chain) => chain.hip_in_base(),
        }
    }

    /// Distance from hip to ankle with the knee at an angle (rad) and all other joints at zero (m).
    #[must_use]
    pub fn length_m(&self, knee_rad: f64) -> f64 {
        match self {
            Self::YawRollPitch(geometry) => geometry.length_m(knee_rad),
            Self::Chain(chain) => {
                let ankle = chain.forward(&[0.0, 0.0, 0.0, knee_rad, 0.0, 0.0]).translation;
                (ankle - chain.hip_in_base()).norm()
            }
        }
    }
}
