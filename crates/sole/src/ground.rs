//! The ground under the sole.

use spatial::Vec3;

/// A height field. Each contact point meets the tangent plane of the ground at its reference position.
pub trait Ground {
    /// Height (m) and upward unit normal at a place (m, world).
    fn height_and_normal(&self, x_m: f64, y_m: f64) -> (f64, Vec3);

    /// Is it one plane? Then nothing can lie between two places that were looked at.
    fn is_plane(&self) -> bool {
        false
    }

    /// Factor on the sole's friction coefficient at a place (slippery or rough patches).
    fn friction_factor(&self, _x_m: f64, _y_m: f64) -> f64 {
        1.0
    }
}

/// The plane z = 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Plane;

impl Ground for Plane {
    fn height_and_normal(&self, _x_m: f64, _y_m: f64) -> (f64, Vec3) {
        (0.0, Vec3::z())
    }

    fn is_plane(&self) -> bool {
        true
    }
}

/// A plane through the origin of the world with a given upward normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// Upward unit normal.
    pub normal: Vec3,
    /// Height at x = y = 0 (m).
    pub height_m: f64,
}

impl Ground for Slope {
    fn height_and_normal(&self, x_m: f64, y_m: f64) -> (f64, Vec3) {
        (self.height_m - (self.normal.x * x_m + self.normal.y * y_m) / self.normal.z, self.normal)
    }

    fn is_plane(&self) -> bool {
        true
    }
}
