use crate::{Vec3, Vec6};
use std::ops::{Add, Neg, Sub};

/// Force and moment about a stated point, both in the same stated axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// Force (N).
    pub force: Vec3,
    /// Moment about the point (N m).
    pub moment: Vec3,
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
