//! Sides and footholds.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use spatial::{Transform, Vec3, so3};

/// Left or right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Index 0, y > 0.
    Left,
    /// Index 1, y < 0.
    Right,
}

impl Side {
    /// Both, in the order of their indices.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// Position in every array of two feet.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::Left => 0,
            Self::Right => 1,
        }
    }

    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// +1 for left, -1 for right: the sign of y on that side.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// A point of the ground and a heading: where a foot stands.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Foothold {
    /// Forward (m).
    pub x_m: f64,
    /// To the left (m).
    pub y_m: f64,
    /// Heading, counterclockwise seen from above (rad).
    pub yaw_rad: f64,
}

impl Foothold {
    /// The point (m).
    #[must_use]
    pub fn position(&self) -> Vector2<f64> {
        Vector2::new(self.x_m, self.y_m)
    }

    /// The point that lies at `offset` (m, axes of the foot) from this one, same heading.
    #[must_use]
    pub fn offset(&self, offset: Vector2<f64>) -> Self {
        let (sin, cos) = self.yaw_rad.sin_cos();
        Self {
            x_m: self.x_m + cos * offset.x - sin * offset.y,
            y_m: self.y_m + sin * offset.x + cos * offset.y,
            yaw_rad: self.yaw_rad,
        }
    }

    /// Pose of a frame that stands upright `height_m` above this point.
    #[must_use]
    pub fn pose_at_height(&self, height_m: f64) -> Transform {
        Transform::new(so3::about_z(self.yaw_rad), Vec3::new(self.x_m, self.y_m, height_m))
    }
}
