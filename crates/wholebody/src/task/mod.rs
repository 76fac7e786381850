//! Objectives as weighted rows: `alpha |J vd + Jdot v - a_des|²`.

mod normal;

pub(crate) use normal::{NormalEquations, mirror};

use crate::settings::Gains;
use multibody::FrameTerms;
use spatial::{Mat3, Transform, Twist, Vec3, Vec6, so3};

/// Largest `kp dt²` of a task in discrete time: both poles of the sampled error then lie at 0.70 and 0.18; at 1 an error
/// would oscillate for ever. A stiffness above `0.25 / dt²` is lowered to it.
const STIFFNESS_TIMES_PERIOD_SQUARED: f64 = 0.25;

impl Gains {
    /// Stiffness as it can be used with a period.
    #[must_use]
    pub fn stiffness_at(&self, dt_s: f64) -> f64 {
        usable_stiffness(self.stiffness_per_s2, dt_s)
    }
}

/// Stiffness as it can be used with a period.
pub(crate) fn usable_stiffness(stiffness: f64, dt_s: f64) -> f64 {
    stiffness.min(STIFFNESS_TIMES_PERIOD_SQUARED / (dt_s * dt_s))
}

/// `a_ref + kd (v_ref - v) + kp e`, critically damped.
pub(crate) fn desired(acceleration: &Vec3, velocity_error: &Vec3, error: &Vec3, stiffness: f64) -> Vec3 {
    acceleration + 2.0 * stiffness.sqrt() * velocity_error + stiffness * error
}

/// Rotation vector in world axes that turns R into R_ref.
pub(crate) fn rotation_error(reference: &Mat3, rotation: &Mat3) -> Vec3 {
    so3::log(&(reference * rotation.transpose()))
}

/// `x_ref - x` of a frame, linear first.
pub(crate) fn pose_error(reference: &Transform, placement: &Transform) -> Vec6 {
    let linear = reference.translation - placement.translation;
    let angular = rotation_error(&reference.rotation, &placement.rotation);
    Vec6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// Desired acceleration of a frame that follows pose, twist and acceleration, linear first.
pub(crate) fn desired_motion(
    frame: &FrameTerms,
    error: &Vec6,
    twist: &Twist,
    acceleration: &Twist,
    stiffness: [f64; 2],
) -> Vec6 {
    let part = |k: usize| Vec3::new(error[3 * k], error[3 * k + 1], error[3 * k + 2]);
    let linear = desired(&acceleration.linear, &(twist.linear - frame.velocity.linear), &part(0), stiffness[0]);
    let angular = desired(&acceleration.angular, &(twist.angular - frame.velocity.angular), &part(1), stiffness[1]);
    Vec6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}
