//! Linear and angular velocity.

use crate::{Vec3, Vec6, Wrench};

/// Linear velocity of a stated point and angular velocity, both in the same stated axes.
///
/// Also used for spatial accelerations (m/s^2, rad/s^2), where the function that returns it says which derivative is meant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist {
    /// Velocity of the point (m/s).
    pub linear: Vec3,
    /// Angular velocity (rad/s).
    pub angular: Vec3,
}

impl Twist {
    /// Neither moving nor turning.
    #[must_use]
    pub fn zero() -> Self {
        Self::default()
    }

    /// From a six-vector, linear part first.
    #[must_use]
    pub fn from_vector(v: &Vec6) -> Self {
        Self { linear: v.fixed_rows::<3>(0).into(), angular: v.fixed_rows::<3>(3).into() }
    }

    /// Six-vector, linear part first.
    #[must_use]
    pub fn to_vector(&self) -> Vec6 {
        Vec6::new(self.linear.x, self.linear.y, self.linear.z, self.angular.x, self.angular.y, self.angular.z)
    }

    /// Twist of the same body at another point: `offset` (m) leads from the present point to the new one.
    #[must_use]
    pub fn at(&self, offset: &Vec3) -> Self {
        Self { linear: self.linear + self.angular.cross(offset), angular: self.angular }
    }

    /// Power (W) of a wrench about the same point in the same axes.
    #[must_use]
    pub fn power(&self, wrench: &Wrench) -> f64 {
        self.linear.dot(&wrench.force) + self.angular.dot(&wrench.moment)
    }
}
