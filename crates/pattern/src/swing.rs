//! The foot in the air: quintics in position and orientation from the ankle's state at take-off to the flat foothold.
//!
//! Horizontally one quintic; vertically two, joined at half time in the highest point, where the velocity is zero and the
//! acceleration is the one that makes the jerk continuous (the stationary point of the squared jerk over that acceleration).
//! Orientation: `R(t) = exp(φ(t)) R_end` with a quintic `φ` from `log(R_start R_end')` to 0, so the foot arrives flat, at
//! rest; its start meets the given angular velocity `w = J φ'` and acceleration `J φ'' + J' φ'`, `J` the left Jacobian.

use crate::Quintic;
use spatial::{Mat3, Transform, Twist, Vec3, so3};

/// Pose, twist and acceleration of the ankle frame, velocities at its origin in world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnkleState {
    /// `X_WA`.
    pub pose: Transform,
    /// Velocity (m/s, rad/s).
    pub twist: Twist,
    /// Its time derivative (m/s^2, rad/s^2).
    pub acceleration: Twist,
}

impl AnkleState {
    /// At rest.
    #[must_use]
    pub fn at_rest(pose: Transform) -> Self {
        Self { pose, twist: Twist::zero(), acceleration: Twist::zero() }
    }
}

/// One flight of the ankle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwingTrajectory {
    t_start_s: f64,
    t_end_s: f64,
    horizontal: [Quintic; 2],
    rising: Quintic,
    sinking: Quintic,
    rotation: [Quintic; 3],
    to: Transform,
}

impl SwingTrajectory {
    /// From the state `from` at `t_start_s` to rest in `to` at `t_end_s`, `apex_m` above the higher of the two at half time.
    ///
    /// # Panics
    /// If the flight has no duration.
    #[must_use]
    pub fn new(from: &AnkleState, to: &Transform, t_start_s: f64, t_end_s: f64, apex_m: f64) -> Self {
        let duration = t_end_s - t_start_s;
        assert!(duration > 0.0, "a swing from {t_start_s} s to {t_end_s} s");
        let start =
            |axis: usize| [from.pose.translation[axis], from.twist.linear[axis], from.acceleration.linear[axis]];
        let horizontal = [0, 1].map(|axis| Quintic::hermite(duration, start(axis), [to.translation[axis], 0.0, 0.0]));

        let half = duration / 2.0;
        let apex = from.pose.translation.z.max(to.translation.z) + apex_m;
        let vertical = |acceleration: f64| {
            let top = [apex, 0.0, acceleration];
            [Quintic::hermite(half, start(2), top), Quintic::hermite(half, top, [to.translation.z, 0.0, 0.0])]
        };
        // The step of the jerk at the apex is affine in the acceleration there; find its zero from two values.
        let jerk_step = |acceleration: f64| {
            let [rising, sinking] = vertical(acceleration);
            sinking.derivatives::<4>(0.0)[3] - rising.derivatives::<4>(half)[3]
        };
        let (at_zero, at_one) = (jerk_step(0.0), jerk_step(1.0));
        let [rising, sinking] = vertical(at_zero / (at_zero - at_one));

        let phi = so3::log(&(from.pose.rotation * to.rotation.transpose()));
        let to_rate = so3::left_jacobian_inverse(&phi);
        let phi_rate = to_rate * from.twist.angular;
        let phi_acceleration = to_rate * (from.acceleration.angular - left_jacobian_rate(&phi, &phi_rate) * phi_rate);
        let rotation =
            [0, 1, 2].map(|i| Quintic::hermite(duration, [phi[i], phi_rate[i], phi_acceleration[i]], [0.0; 3]));
        Self { t_start_s, t_end_s, horizontal, rising, sinking, rotation, to: *to }
    }

    /// The ankle at walk time `t_s`; the ends outside the flight.
    #[must_use]
    pub fn evaluate(&self, t_s: f64) -> AnkleState {
        let duration = self.t_end_s - self.t_start_s;
        let t = (t_s - self.t_start_s).clamp(0.0, duration);
        let half = duration / 2.0;
        let [x, y] = self.horizontal.map(|axis| axis.derivatives::<3>(t));
        let z = if t < half { self.rising.derivatives::<3>(t) } else { self.sinking.derivatives::<3>(t - half) };
        let phi = self.rotation.map(|axis| axis.derivatives::<3>(t));
        let [phi, phi_rate, phi_acceleration] = [0, 1, 2].map(|d| Vec3::new(phi[0][d], phi[1][d], phi[2][d]));
        let J = so3::left_jacobian(&phi);
        AnkleState {
            pose: Transform::new(so3::exp(&phi) * self.to.rotation, Vec3::new(x[0], y[0], z[0])),
            twist: Twist { linear: Vec3::new(x[1], y[1], z[1]), angular: J * phi_rate },
            acceleration: Twist {
                linear: Vec3::new(x[2], y[2], z[2]),
                angular: J * phi_acceleration + left_jacobian_rate(&phi, &phi_rate) * phi_rate,
            },
        }
    }
}

/// Time derivative of the left Jacobian `J = 1 + a [φ] + b [φ]^2` with `a = (1 - cos θ)/θ^2`, `b = (θ - sin θ)/θ^3`.
fn left_jacobian_rate(phi: &Vec3, phi_rate: &Vec3) -> Mat3 {
    let n = phi.norm_squared();
    // Derivatives of a and b with respect to n = θ^2. Below 0.1 by their series: the closed forms cancel.
    let (a, b, da, db) = if n < 0.01 {
        (
            0.5 - n / 24.0 + n * n / 720.0 - n.powi(3) / 40320.0,
            1.0 / 6.0 - n / 120.0 + n * n / 5040.0 - n.powi(3) / 362_880.0,
            -1.0 / 24.0 + n / 360.0 - n * n / 13440.0 + n.powi(3) / 907_200.0,
            -1.0 / 120.0 + n / 2520.0 - n * n / 120_960.0 + n.powi(3) / 9_979_200.0,
        )
    } else {
        let theta = n.sqrt();
        let (sin, cos) = theta.sin_cos();
        let (a, b) = ((1.0 - cos) / n, (theta - sin) / (n * theta));
        let da = (sin / theta - 2.0 * a) / (2.0 * n);
        let db = ((1.0 - cos) / n - 3.0 * b) / (2.0 * n);
        (a, b, da, db)
    };
    let n_rate = 2.0 * phi.dot(phi_rate);
    let (S, S_rate) = (so3::skew(phi), so3::skew(phi_rate));
    (da * n_rate) * S + a * S_rate + (db * n_rate) * (S * S) + b * (S_rate * S + S * S_rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tilted() -> AnkleState {
        AnkleState {
            pose: Transform::new(so3::from_roll_pitch_yaw(0.04, -0.02, 0.3), Vec3::new(0.1, -0.08, 0.101)),
            twist: Twist { linear: Vec3::new(0.002, -0.001, 0.01), angular: Vec3::new(0.1, -0.2, 0.05) },
            acceleration: Twist { linear: Vec3::new(0.1, 0.2, 0.3), angular: Vec3::new(-1.0, 0.5, 2.0) },
        }
    }

    fn flight(from: &AnkleState) -> SwingTrajectory {
        let to = Transform::new(so3::about_z(-0.2), Vec3::new(0.2, -0.09, 0.103));
        SwingTrajectory::new(from, &to, 1.2, 2.0, 0.04)
    }

    #[test]
    fn starts_in_the_given_state_and_ends_flat_at_rest() {
        let from = tilted();
        let swing = flight(&from);
        let start = swing.evaluate(1.2);
        assert!((start.pose.rotation - from.pose.rotation).norm() < 1e-14);
        assert!((start.pose.translation - from.pose.translation).norm() < 1e-15);
        assert!((start.twist.to_vector() - from.twist.to_vector()).norm() < 1e-13);
        assert!((start.acceleration.to_vector() - from.acceleration.to_vector()).norm() < 1e-12);
        let end = swing.evaluate(2.0);
        assert!((end.pose.rotation - so3::about_z(-0.2)).norm() < 1e-13);
        assert!((end.pose.translation - Vec3::new(0.2, -0.09, 0.103)).norm() < 1e-13);
        assert!(end.twist.to_vector().norm() < 1e-11 && end.acceleration.to_vector().norm() < 1e-10);
    }

    #[test]
    fn velocities_and_accelerations_are_derivatives_of_the_pose() {
        for from in [tilted(), AnkleState::at_rest(tilted().pose)] {
            let swing = flight(&from);
            let h = 1e-5;
            for i in 1..40 {
                let t = 1.2 + 0.8 * f64::from(i) / 40.0 + 1e-3;
                let (before, now, after) = (swing.evaluate(t - h), swing.evaluate(t), swing.evaluate(t + h));
                let linear = (after.pose.translation - before.pose.translation) / (2.0 * h);
                let angular = so3::log(&(after.pose.rotation * before.pose.rotation.transpose())) / (2.0 * h);
                assert!((linear - now.twist.linear).norm() < 1e-8, "{t}");
                assert!((angular - now.twist.angular).norm() < 1e-8, "{t}");
                let rate = (after.twist.to_vector() - before.twist.to_vector()) / (2.0 * h);
                assert!((rate - now.acceleration.to_vector()).norm() < 1e-6, "{t}");
            }
        }
    }

    #[test]
    fn the_highest_point_is_the_apex_at_half_time_with_continuous_jerk() {
        let from = AnkleState::at_rest(Transform::from_translation(Vec3::new(0.0, 0.08, 0.103)));
        let swing =
            SwingTrajectory::new(&from, &Transform::from_translation(Vec3::new(0.1, 0.08, 0.103)), 0.0, 0.8, 0.04);
        let top = swing.evaluate(0.4);
        assert!((top.pose.translation.z - 0.143).abs() < 1e-15 && top.twist.linear.z.abs() < 1e-15);
        let highest = (0..=800).map(|i| swing.evaluate(f64::from(i) * 1e-3).pose.translation.z).fold(0.0, f64::max);
        assert!(highest <= 0.143 + 1e-15);
        let h = 1e-6;
        let z = |t: f64| swing.evaluate(t).acceleration.linear.z;
        let (left, right) = ((z(0.4) - z(0.4 - h)) / h, (z(0.4 + h) - z(0.4)) / h);
        assert!((left - right).abs() < 1e-2, "jerk {left} before and {right} after the apex");
        assert!((z(0.4 - 1e-9) - z(0.4 + 1e-9)).abs() < 1e-6);
    }

    #[test]
    fn rate_of_the_left_jacobian_is_its_derivative_for_small_and_large_angles() {
        for scale in [1e-6, 0.05, 0.0999, 0.1001, 1.0, 2.5] {
            let direction = Vec3::new(0.48, -0.6, 0.64);
            let (phi, rate) = (scale * direction, Vec3::new(-0.3, 0.8, 0.2));
            let h = 1e-5;
            let difference =
                (so3::left_jacobian(&(phi + h * rate)) - so3::left_jacobian(&(phi - h * rate))) / (2.0 * h);
            assert!((difference - left_jacobian_rate(&phi, &rate)).norm() < 1e-9, "{scale}");
        }
    }
}
