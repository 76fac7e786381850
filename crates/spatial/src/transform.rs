//! Poses, and what they do to points, twists and wrenches.

use crate::{Mat3, Mat6, Twist, Vec3, Wrench, so3};
use std::ops::Mul;

/// Pose `X_AB` of frame B in frame A, without the compiler knowing A and B: for loops over joints, see
/// [`Pose`](crate::Pose) for borders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform {
    /// `R_AB`: the columns are the axes of B expressed in A.
    pub rotation: Mat3,
    /// `p_AB` (m): the origin of B, expressed in A.
    pub translation: Vec3,
}

impl Default for Transform {
    fn default() -> Self {
        Self::identity()
    }
}

impl Transform {
    /// From rotation matrix and translation (m).
    #[must_use]
    pub fn new(rotation: Mat3, translation: Vec3) -> Self {
        Self { rotation, translation }
    }

    /// A and B coincide.
    #[must_use]
    pub fn identity() -> Self {
        Self { rotation: Mat3::identity(), translation: Vec3::zeros() }
    }

    /// Pure translation (m).
    #[must_use]
    pub fn from_translation(translation: Vec3) -> Self {
        Self { rotation: Mat3::identity(), translation }
    }

    /// `X_BA`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// `p_AP` of a point given as `p_BP`.
    #[must_use]
    pub fn point(&self, p_BP: &Vec3) -> Vec3 {
        self.rotation * p_BP + self.translation
    }

    /// Twist of a body: given at the origin of B in the axes of B, returned at the origin of A in the axes of A.
    #[must_use]
    pub fn twist(&self, v: &Twist) -> Twist {
        let angular = self.rotation * v.angular;
        Twist { linear: self.rotation * v.linear + self.translation.cross(&angular), angular }
    }

    /// Inverse of [`Transform::twist`].
    #[must_use]
    pub fn twist_inverse(&self, v: &Twist) -> Twist {
        let linear = v.linear - self.translation.cross(&v.angular);
        Twist { linear: self.rotation.tr_mul(&linear), angular: self.rotation.tr_mul(&v.angular) }
    }

    /// Wrench: given about the origin of B in the axes of B, returned about the origin of A in the axes of A.
    #[must_use]
    pub fn wrench(&self, f: &Wrench) -> Wrench {
        let force = self.rotation * f.force;
        Wrench { force, moment: self.rotation * f.moment + self.translation.cross(&force) }
    }

    /// Inverse of [`Transform::wrench`].
    #[must_use]
    pub fn wrench_inverse(&self, f: &Wrench) -> Wrench {
        let moment = f.moment - self.translation.cross(&f.force);
        Wrench { force: self.rotation.tr_mul(&f.force), moment: self.rotation.tr_mul(&moment) }
    }

    /// 6 x 6 matrix of [`Transform::twist`] (linear rows first): `[R, skew(p) R; 0, R]`.
    #[must_use]
    pub fn twist_matrix(&self) -> Mat6 {
        let mut m = Mat6::zeros();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.rotation);
        m.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.rotation);
        m.fixed_view_mut::<3, 3>(0, 3).copy_from(&(so3::skew(&self.translation) * self.rotation));
        m
    }
}

impl Mul for Transform {
    type Output = Self;

    fn mul(self, X_BC: Self) -> Self {
        Self { rotation: self.rotation * X_BC.rotation, translation: self.point(&X_BC.translation) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(seed: f64) -> Transform {
        Transform::new(so3::exp(&Vec3::new(seed, 0.7 - seed, 0.2 * seed)), Vec3::new(0.3, -seed, 1.1))
    }

    #[test]
    fn inverse_undoes_and_composition_associates() {
        let (a, b, c) = (pose(0.4), pose(-1.3), pose(2.2));
        let unity = a * a.inverse();
        assert!((unity.rotation - Mat3::identity()).norm() < 1e-15 && unity.translation.norm() < 1e-15);
        let (left, right) = ((a * b) * c, a * (b * c));
        assert!(
            (left.rotation - right.rotation).norm() < 1e-14 && (left.translation - right.translation).norm() < 1e-14
        );
    }

    #[test]
    fn power_does_not_depend_on_the_frame() {
        let x = pose(0.9);
        let v = Twist { linear: Vec3::new(0.1, 2.0, -0.4), angular: Vec3::new(-0.6, 0.3, 1.2) };
        let f = Wrench { force: Vec3::new(30.0, -4.0, 9.0), moment: Vec3::new(1.0, 2.0, -0.7) };
        assert!((x.twist(&v).power(&x.wrench(&f)) - v.power(&f)).abs() < 1e-12);
        assert!((x.twist_inverse(&x.twist(&v)).to_vector() - v.to_vector()).norm() < 1e-14);
        assert!((x.wrench_inverse(&x.wrench(&f)).to_vector() - f.to_vector()).norm() < 1e-13);
        assert!((x.twist_matrix() * v.to_vector() - x.twist(&v).to_vector()).norm() < 1e-14);
    }
}
