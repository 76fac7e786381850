//! Force and moment; the zero-moment point and back.

use crate::{Vec3, Vec6};
use nalgebra::Vector2;
use std::ops::{Add, Neg, Sub};

/// Force and moment about a stated point, both in the same stated axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// Force (N).
    pub force: Vec3,
    /// Moment about the point (N m).
    pub moment: Vec3,
}

/// Vertical force (N) below which a ZMP has no meaning: a thousandth of what a light robot weighs.
const ZMP_FORCE_MIN_N: f64 = 0.1;

/// # Force at a zero-moment point
///
/// A foot's load is planned as a force at a point of the ground, measured as a wrench about a sensor, and computed as a
/// wrench about an ankle. [`Wrench::of_force_at`], [`Wrench::zmp`] and [`Wrench::zmp_arm`] are the ways between them.
impl Wrench {
    /// Of a force (N) that acts at a point, about another point; all in the same axes (m).
    #[must_use]
    pub fn of_force_at(force: &Vec3, point: &Vec3, about: &Vec3) -> Self {
        Self { force: *force, moment: (point - about).cross(force) }
    }

    /// Zero-moment point (m) on the horizontal plane of this height: there the wrench, which is about the point `about`,
    /// has no horizontal moment. World axes, z up. `None` where hardly anything presses.
    #[must_use]
    pub fn zmp(&self, about: &Vec3, height_m: f64) -> Option<Vector2<f64>> {
        let below = Vec3::new(about.x, about.y, height_m);
        (self.force.z > ZMP_FORCE_MIN_N).then(|| below.xy() + self.about(&(below - about)).zmp_arm())
    }

    /// From the point that the wrench is about to its zero-moment point in the same horizontal plane (m). It has no
    /// meaning, and need not be finite, where nothing presses.
    #[must_use]
    pub fn zmp_arm(&self) -> Vector2<f64> {
        Vector2::new(-self.moment.y, self.moment.x) / self.force.z
    }
}

impl Wrench {
    /// No force, no moment.
    #[must_use]
    pub fn zero() -> Self {
        Self::default()
    }

    /// From a six-vector, force first.
    #[must_use]
    pub fn from_vector(v: &Vec6) -> Self {
        Self { force: v.fixed_rows::<3>(0).into(), moment: v.fixed_rows::<3>(3).into() }
    }

    /// Six-vector, force first.
    #[must_use]
    pub fn to_vector(&self) -> Vec6 {
        Vec6::new(self.force.x, self.force.y, self.force.z, self.moment.x, self.moment.y, self.moment.z)
    }

    /// The same action seen about another point: `offset` (m) leads from the present point to the new one.
    #[must_use]
    pub fn about(&self, offset: &Vec3) -> Self {
        Self { force: self.force, moment: self.moment - offset.cross(&self.force) }
    }
}

impl Add for Wrench {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { force: self.force + other.force, moment: self.moment + other.moment }
    }
}

impl Sub for Wrench {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { force: self.force - other.force, moment: self.moment - other.moment }
    }
}

impl Neg for Wrench {
    type Output = Self;

    fn neg(self) -> Self {
        Self { force: -self.force, moment: -self.moment }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_at_a_point_has_its_zmp_there() {
        let (force, point) = (Vec3::new(5.0, -8.0, 200.0), Vec3::new(0.12, 0.07, 0.02));
        for about in [Vec3::zeros(), Vec3::new(0.1, 0.08, 0.103), point] {
            let wrench = Wrench::of_force_at(&force, &point, &about);
            let zmp = wrench.zmp(&about, point.z).expect("it presses");
            assert!((zmp - point.xy()).norm() < 1e-15, "{zmp}");
        }
        // A leaning force meets a lower plane farther back.
        let lower = Wrench::of_force_at(&force, &point, &Vec3::zeros()).zmp(&Vec3::zeros(), 0.0).expect("it presses");
        assert!((lower - (point.xy() - Vector2::new(5.0, -8.0) * (0.02 / 200.0))).norm() < 1e-15, "{lower}");
    }

    #[test]
    fn what_hardly_presses_has_no_zmp() {
        for vertical in [0.0, 0.05, -200.0] {
            assert_eq!(
                Wrench::of_force_at(&Vec3::new(0.0, 0.0, vertical), &Vec3::x(), &Vec3::zeros())
                    .zmp(&Vec3::zeros(), 0.0),
                None
            );
        }
    }
}
