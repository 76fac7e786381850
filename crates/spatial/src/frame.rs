use crate::{Mat3, Transform, Vec3};
use std::marker::PhantomData;
use std::ops::Mul;

/// A frame that the compiler knows by name. Types do not see time: the same frame at another tick is the caller's to watch.
pub trait Frame: Copy + std::fmt::Debug + 'static {}

macro_rules! frames {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct $name;
        impl Frame for $name {}
    )*};
}

frames! {
    /// `W`: x forward, y left, z up, ground at z = 0.
    World
    /// `B`: the floating base.
    Body
    /// `F`: the foot link, origin at the ankle (where its pitch and roll axes meet).
    Foot
    /// Same origin and axes as [`Foot`]; the name used where only the ankle's motion matters.
    Ankle
    /// `S`: origin at the centre of the undeformed sole's bottom face, axes as the foot's.
    SoleFrame
}

/// Pose `X_AB` of frame `B` in frame `A`; products only compile when neighbours match.
#[derive(Debug)]
pub struct Pose<A, B> {
    transform: Transform,
    frames: PhantomData<fn() -> (A, B)>,
}

impl<A, B> Clone for Pose<A, B> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<A, B> Copy for Pose<A, B> {}

impl<A, B> PartialEq for Pose<A, B> {
    fn eq(&self, other: &Self) -> bool {
        self.transform == other.transform
    }
}

impl<A, B> Pose<A, B> {
    /// Declares what an untyped pose means.
    #[must_use]
    pub fn from_transform(transform: Transform) -> Self {
        Self { transform, frames: PhantomData }
    }

    /// From rotation matrix `R_AB` and translation `p_AB` (m).
    #[must_use]
    pub fn new(rotation: Mat3, translation: Vec3) -> Self {
        Self::from_transform(Transform::new(rotation, translation))
    }

    /// The untyped pose.
    #[must_use]
    pub fn transform(&self) -> Transform {
        self.transform
    }

    /// `R_AB`.
    #[must_use]
    pub fn rotation(&self) -> &Mat3 {
        &self.transform.rotation
    }

    /// `p_AB` (m).
    #[must_use]
    pub fn translation(&self) -> &Vec3 {
        &self.transform.translation
    }

    /// `X_BA`.
    #[must_use]
    pub fn inverse(&self) -> Pose<B, A> {
        Pose::from_transform(self.transform.inverse())
    }
}

impl<A, B, C> Mul<Pose<B, C>> for Pose<A, B> {
    type Output = Pose<A, C>;

    fn mul(self, X_BC: Pose<B, C>) -> Pose<A, C> {
        Pose::from_transform(self.transform * X_BC.transform)
    }
}
