//! Rotations, poses, twists, wrenches and inertias of three-dimensional mechanics.
//!
//! The vocabulary of every other crate. Monogram notation: `X_WF` is the pose of frame F in frame W, `p_WG` the position of
//! point G measured from the origin of W and expressed in W, `R_WF` a rotation, `V_WB` a twist, `F_S_W` a wrench on S
//! expressed in W. Neighbours cancel: `X_WS = X_WF * X_FS`.
//!
//! SI units and radians throughout. Six-vectors are **linear part first**. Wrenches and twists refer to a stated point; the
//! types here do not remember it, the functions that move them say which one they mean.
//!
//! | type | meaning |
//! |---|---|
//! | [`Transform`] | pose as rotation matrix and translation |
//! | [`Twist`] | linear and angular velocity |
//! | [`Wrench`] | force and moment; the zero-moment point and back |
//! | [`Inertia`] | mass, centre of mass, rotational inertia about the centre of mass |
//! | [`so3`] | exponential, logarithm and Jacobians of rotations; Euler angles |
//! | [`polygon`] | convex polygons of the ground plane |
//!
//! References: Featherstone, *Rigid Body Dynamics Algorithms* (2008), chapter 2; Solà, Deray, Atchuthan, *A micro Lie theory
//! for state estimation in robotics* (arXiv 1812.01537).
#![allow(non_snake_case)] // monogram notation

mod inertia;
pub mod polygon;
pub mod so3;
mod transform;
mod twist;
mod wrench;

pub use inertia::{Inertia, InertiaError};
pub use transform::Transform;
pub use twist::Twist;
pub use wrench::Wrench;

/// Three-vector, column.
pub type Vec3 = nalgebra::Vector3<f64>;
/// Six-vector, linear part first.
pub type Vec6 = nalgebra::Vector6<f64>;
/// 3 x 3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// 6 x 6 matrix, linear rows and columns first.
pub type Mat6 = nalgebra::Matrix6<f64>;
