//! Rigid-body inertia.

use crate::{Mat3, Mat6, Transform, Vec3, so3};

/// Mass distribution of a rigid body in a stated frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertia {
    /// Mass (kg).
    pub mass_kg: f64,
    /// Centre of mass from the frame's origin (m).
    pub com: Vec3,
    /// Rotational inertia about the *centre of mass* in the frame's axes (kg m^2), symmetric.
    pub about_com: Mat3,
}

/// Why a mass distribution is not one that a body can have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InertiaError {
    /// A number is NaN or infinite.
    NotFinite,
    /// The mass (kg) is negative.
    NegativeMass(f64),
    /// The smallest principal moment (kg m^2) is negative.
    NegativeMoment(f64),
    /// The largest principal moment exceeds the sum of the two others by this much (kg m^2).
    TriangleInequality(f64),
    /// There is no mass, but a largest principal moment (kg m^2).
    MomentWithoutMass(f64),
}

impl std::fmt::Display for InertiaError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a number is NaN or infinite"),
            Self::NegativeMass(mass) => write!(f, "its mass is {mass} kg"),
            Self::NegativeMoment(moment) => write!(f, "its smallest principal moment of inertia is {moment} kg m^2"),
            Self::TriangleInequality(excess) => {
                write!(f, "its largest principal moment of inertia exceeds the sum of the others by {excess} kg m^2")
            }
            Self::MomentWithoutMass(moment) => {
                write!(f, "it has a moment of inertia of {moment} kg m^2 but no mass")
            }
        }
    }
}

impl std::error::Error for InertiaError {}

/// Principal moments may miss positivity or the triangle inequality by this fraction of the largest one: exporters round.
const ROUNDED_EXPORT: f64 = 1e-3;

/// Radii of gyration below this (m) are zero: a point mass is a body, and rounding makes its moments tiny, not zero.
const POINT_M: f64 = 1e-6;

impl Inertia {
    /// No mass.
    #[must_use]
    pub fn zero() -> Self {
        Self { mass_kg: 0.0, com: Vec3::zeros(), about_com: Mat3::zeros() }
    }

    /// Uniform box with edges `size` (m) centred at `com` (m).
    #[must_use]
    pub fn uniform_box(mass_kg: f64, com: Vec3, size: Vec3) -> Self {
        let s = size.component_mul(&size);
        let diagonal = Vec3::new(s.y + s.z, s.x + s.z, s.x + s.y) * (mass_kg / 12.0);
        Self { mass_kg, com, about_com: Mat3::from_diagonal(&diagonal) }
    }

    /// The same body seen from frame A, given in frame B with `X_AB`.
    #[must_use]
    pub fn seen_from(&self, X_AB: &Transform) -> Self {
        let r = &X_AB.rotation;
        Self { mass_kg: self.mass_kg, com: X_AB.point(&self.com), about_com: r * self.about_com * r.transpose() }
    }

    /// Both bodies rigidly joined; same frame.
    #[must_use]
    pub fn joined(&self, other: &Self) -> Self {
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg == 0.0 {
            return Self { mass_kg, com: Vec3::zeros(), about_com: self.about_com + other.about_com };
        }
        let com = (self.mass_kg * self.com + other.mass_kg * other.com) / mass_kg;
        let moved = |body: &Self| {
            let k = so3::skew(&(body.com - com));
            body.about_com - body.mass_kg * (k * k)
        };
        Self { mass_kg, com, about_com: moved(self) + moved(other) }
    }

    /// Rotational inertia about the frame's origin (kg m^2).
    #[must_use]
    pub fn about_origin(&self) -> Mat3 {
        let k = so3::skew(&self.com);
        self.about_com - self.mass_kg * (k * k)
    }

    /// 6 x 6 spatial inertia about the frame's origin, linear first: momentum = matrix * twist.
    #[must_use]
    pub fn matrix(&self) -> Mat6 {
        let mut m = Mat6::zeros();
        let k = self.mass_kg * so3::skew(&self.com);
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Mat3::identity() * self.mass_kg));
        m.fixed_view_mut::<3, 3>(0, 3).copy_from(&-k);
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&k);
        m.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.about_origin());
        m
    }

    /// Is this a mass distribution that a body can have?
    ///
    /// # Errors
    /// [`InertiaError`] names what is wrong and by how much.
    pub fn check(&self) -> Result<(), InertiaError> {
        let finite = self.mass_kg.is_finite() && self.com.iter().chain(self.about_com.iter()).all(|x| x.is_finite());
        if !finite {
            return Err(InertiaError::NotFinite);
        }
        if self.mass_kg < 0.0 {
            return Err(InertiaError::NegativeMass(self.mass_kg));
        }
        let mut moments: [f64; 3] = self.about_com.symmetric_eigenvalues().into();
        moments.sort_by(f64::total_cmp);
        let slack = ROUNDED_EXPORT * moments[2].abs() + self.mass_kg * POINT_M * POINT_M;
        if moments[0] < -slack {
            return Err(InertiaError::NegativeMoment(moments[0]));
        }
        let excess = moments[2] - moments[0] - moments[1];
        if excess > slack {
            return Err(InertiaError::TriangleInequality(excess));
        }
        if self.mass_kg == 0.0 && moments[2] > 0.0 {
            return Err(InertiaError::MomentWithoutMass(moments[2]));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_halves_make_the_box() {
        let size = Vec3::new(0.2, 0.3, 0.4);
        let half = Vec3::new(0.1, 0.3, 0.4);
        let whole = Inertia::uniform_box(3.0, Vec3::zeros(), size);
        let left = Inertia::uniform_box(1.5, Vec3::new(-0.05, 0.0, 0.0), half);
        let right = Inertia::uniform_box(1.5, Vec3::new(0.05, 0.0, 0.0), half);
        assert!((left.joined(&right).matrix() - whole.matrix()).norm() < 1e-15);
    }

    #[test]
    fn kinetic_energy_does_not_depend_on_the_frame() {
        let body = Inertia::uniform_box(2.0, Vec3::new(0.1, -0.2, 0.05), Vec3::new(0.1, 0.2, 0.5));
        let X_AB = Transform::new(so3::exp(&Vec3::new(0.3, -1.0, 0.8)), Vec3::new(1.0, 0.5, -2.0));
        let v = crate::Twist { linear: Vec3::new(0.3, 1.0, -0.2), angular: Vec3::new(2.0, -0.5, 0.7) };
        let energy = |i: &Inertia, v: crate::Twist| 0.5 * v.to_vector().dot(&(i.matrix() * v.to_vector()));
        assert!((energy(&body, v) - energy(&body.seen_from(&X_AB), X_AB.twist(&v))).abs() < 1e-12);
    }

    #[test]
    fn impossible_bodies_are_named() {
        let diagonal =
            |x, y, z| Inertia { mass_kg: 1.0, com: Vec3::zeros(), about_com: Mat3::from_diagonal(&Vec3::new(x, y, z)) };
        assert_eq!(diagonal(1.0, 1.0, 1.0).check(), Ok(()));
        assert!(matches!(diagonal(1.0, 1.0, 3.0).check(), Err(InertiaError::TriangleInequality(_))));
        assert!(matches!(diagonal(-1.0, 1.0, 1.0).check(), Err(InertiaError::NegativeMoment(_))));
        assert!(matches!(Inertia { mass_kg: -1.0, ..Inertia::zero() }.check(), Err(InertiaError::NegativeMass(_))));
        assert!(matches!(diagonal(f64::NAN, 1.0, 1.0).check(), Err(InertiaError::NotFinite)));
    }
}
