//! Joints: what the file says of them, and who follows whom.

use super::configuration::Configuration;
use crate::urdf::Limits;

/// Position of a joint in [`Model::joints`](crate::Model::joints); its column in `v` is `model.base_dofs() + index`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JointIndex(pub usize);

/// Position of a joint in [`Model::followers`](crate::Model::followers).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FollowerIndex(pub usize);

/// What a joint's coordinate measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointMotion {
    /// A rotation about the axis (rad).
    Revolute,
    /// A displacement along the axis (m).
    Prismatic,
}

/// A movable joint with a coordinate of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name in the URDF.
    pub name: String,
    /// What its coordinate measures.
    pub motion: JointMotion,
    /// What it may do; position and speed also such that its followers stay within their limits.
    pub limits: Limits,
    /// The body that it moves, beside those of its followers.
    pub(crate) body: usize,
}

/// A joint that another one carries along (`<mimic>`): it is at `multiplier * q[joint] + offset` and has no coordinate.
#[derive(Debug, Clone, PartialEq)]
pub struct Follower {
    /// Name in the URDF.
    pub name: String,
    /// What its position measures.
    pub motion: JointMotion,
    /// What the file says of it; the leader's position and speed are bounded accordingly.
    pub limits: Limits,
    /// The joint that it follows. Chains of followers are resolved: this one has a coordinate.
    pub joint: JointIndex,
    /// Its motion over the leader's; never zero.
    pub multiplier: f64,
    /// Its position (rad, m) when the leader is at zero.
    pub offset: f64,
    /// The body that it moves.
    pub(crate) body: usize,
}

impl Follower {
    /// Where it is (rad, m).
    #[must_use]
    pub fn position(&self, q: &Configuration) -> f64 {
        self.multiplier * q.joints[self.joint.0] + self.offset
    }
}
