//! The configuration manifold: SE(3) for the base, the reals for every joint.

use nalgebra::DVector;
use spatial::Transform;

/// Where the robot is.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Pose `X_WB` of the base.
    pub base: Transform,
    /// Joint positions (rad, m) in the order of [`Model::joints`](crate::Model::joints).
    pub joints: DVector<f64>,
}
