//! Alart-Curnier's condition of a sliding point.

use nalgebra::{RowVector3, Vector2};
use spatial::Vec3;

/// Alart-Curnier's condition of a sliding point and its derivatives.
pub(crate) struct SlidingLaw {
    mu: f64,
    rho: f64,
    direction: Vector2<f64>,
    length: f64,
    normal: f64,
    pub(crate) residual: Vector2<f64>,
}

impl SlidingLaw {
    pub(crate) fn new(mu: f64, rho: f64, force: &Vec3, slip: &Vector2<f64>) -> Self {
        let tangential = Vector2::new(force.x, force.y);
        let z = tangential - rho * slip;
        let length = z.norm();
        let direction = if length > 0.0 { z / length } else { Vector2::zeros() };
        let residual = tangential - mu * force.z * direction;
        Self { mu, rho, direction, length, normal: force.z, residual }
    }

    fn across(&self, v: &Vector2<f64>) -> Vector2<f64> {
        v - self.direction * self.direction.dot(v)
    }

    fn turning(&self, rate: &Vector2<f64>) -> Vector2<f64> {
        if self.length > 0.0 { self.across(rate) / self.length } else { Vector2::zeros() }
    }

    /// Gradient of one component of the residual with the force (row vector).
    pub(crate) fn gradient(&self, component: usize) -> RowVector3<f64> {
        let rate = |axis: usize| self.rate(&Vec3::ith(axis, 1.0), &Vector2::zeros())[component];
        RowVector3::new(rate(0), rate(1), rate(2))
    }

    /// Rate of the residual with the force's and the slip's.
    pub(crate) fn rate(&self, force: &Vec3, slip: &Vector2<f64>) -> Vector2<f64> {
        let tangential = Vector2::new(force.x, force.y);
        let d = self.turning(&(tangential - self.rho * slip));
        tangential - self.mu * (force.z * self.direction + self.normal * d)
    }

    /// Second derivative along a path with force rates `first`, `second` and constant slip rate.
    pub(super) fn second(&self, first: &Vec3, second: &Vec3, slip: &Vector2<f64>) -> Vector2<f64> {
        let z1 = Vector2::new(first.x, first.y) - self.rho * slip;
        let z2 = Vector2::new(second.x, second.y);
        let d1 = self.turning(&z1);
        let d2 = if self.length > 0.0 {
            (self.across(&z2) - 2.0 * self.direction.dot(&z1) * d1) / self.length - d1.norm_squared() * self.direction
        } else {
            Vector2::zeros()
        };
        z2 - self.mu * (second.z * self.direction + 2.0 * first.z * d1 + self.normal * d2)
    }
}
