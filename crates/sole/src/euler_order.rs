//! Whose yaw is held.

use spatial::{Mat3, Vec3, so3};

/// Order of the Euler angles whose yaw is held at the first tick (35). It matters by 0.2-0.4 mm at a corner of the sole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EulerOrder {
    /// `R = Rz(yaw) Ry(pitch) Rx(roll)`.
    #[default]
    YawPitchRoll,
    /// `R = Rx(roll) Ry(pitch) Rz(yaw)`: the order of the co-author's public code.
    RollPitchYaw,
}

impl EulerOrder {
    /// Rotation with the roll and pitch of `r` and the given yaw.
    pub(crate) fn with_yaw(self, r: &Mat3, yaw_rad: f64) -> Mat3 {
        match self {
            Self::YawPitchRoll => so3::about_z(yaw_rad - r[(1, 0)].atan2(r[(0, 0)])) * r,
            Self::RollPitchYaw => r * so3::about_z(yaw_rad - (-r[(0, 1)]).atan2(r[(0, 0)])),
        }
    }

    /// Derivative of [`EulerOrder::with_yaw`] when `r` turns with the angular velocity `w`.
    pub(crate) fn with_yaw_rate(self, r: &Mat3, yaw_rad: f64, w: &Vec3) -> Mat3 {
        let held = self.with_yaw(r, yaw_rad);
        match self {
            Self::YawPitchRoll => {
                let yaw = r[(1, 0)].atan2(r[(0, 0)]);
                let tangent = -r[(2, 0)] / r[(0, 0)].hypot(r[(1, 0)]);
                let yaw_rate = w.z + tangent * (yaw.cos() * w.x + yaw.sin() * w.y);
                so3::about_z(yaw_rad - yaw) * so3::skew(w) * r - yaw_rate * so3::skew(&Vec3::z()) * held
            }
            Self::RollPitchYaw => {
                let roll = (-r[(1, 2)]).atan2(r[(2, 2)]);
                let cosine = r[(1, 2)].hypot(r[(2, 2)]);
                let yaw_rate = (roll.cos() * w.z - roll.sin() * w.y) / cosine;
                so3::skew(w) * held - yaw_rate * held * so3::skew(&Vec3::z())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_of_a_rotation_with_its_yaw_held_is_its_derivative() {
        let r = so3::from_roll_pitch_yaw(0.2, -0.15, 0.7);
        let w = Vec3::new(0.8, -0.5, 0.3);
        // The error of central differences, the square of the step, and rounding, 1e-16 over it, are both small here.
        let step = 1e-5;
        for order in [EulerOrder::YawPitchRoll, EulerOrder::RollPitchYaw] {
            let at = |t: f64| order.with_yaw(&(so3::exp(&(t * w)) * r), 0.4);
            let difference = (at(step) - at(-step)) / (2.0 * step);
            let away = (difference - order.with_yaw_rate(&r, 0.4, &w)).norm();
            assert!(away < 1e-9, "{order:?}: {away}");
        }
        // What is held is the yaw, and roll and pitch are those of the rotation.
        let held = so3::roll_pitch_yaw(&EulerOrder::YawPitchRoll.with_yaw(&r, 0.4));
        assert!((held - Vec3::new(0.2, -0.15, 0.4)).norm() < 1e-14, "{held}");
    }
}
