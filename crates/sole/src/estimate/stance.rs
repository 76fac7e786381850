//! What the estimator is told: where a foot stands, what it must carry, how well.

use nalgebra::Vector2;
use spatial::{Mat3, Vec3, so3};
use std::f64::consts::{PI, TAU};

/// What a contact point does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NodeState {
    /// Off the ground.
    #[default]
    Free,
    /// On the ground, where it was at the tick before.
    Stick,
    /// On the ground and sliding, its friction at the bound.
    Slip,
}

/// Where a foot lands: position of the sole's origin on the ground and heading, world.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Foothold {
    /// Forward (m).
    pub x_m: f64,
    /// Left (m).
    pub y_m: f64,
    /// About the vertical (rad).
    pub yaw_rad: f64,
}

impl Foothold {
    /// Is it a place and a heading that a foot could have?
    pub(super) fn is_believed(&self) -> bool {
        [self.x_m, self.y_m, self.yaw_rad].iter().all(|x| x.abs() <= LARGEST)
    }

    /// The same heading without whole turns, whose digits it would lose.
    pub(super) fn yaw_within_a_turn_rad(&self) -> f64 {
        let yaw = self.yaw_rad;
        if yaw.abs() <= PI { yaw } else { yaw - TAU * (yaw / TAU).round() }
    }
}

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

/// Limits and tolerances of the estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatorSettings {
    /// Largest residual: force over the load, moment about the ZMP over 0.1 m times the load. 1e-12 is reachable at any load; a
    /// rounding floor applies below about 0.1 N.
    pub tolerance: f64,
    /// Time from tick to tick (s): the references' rates over it predict the next pose, from which the iteration starts. Has no
    /// influence on the answer beyond the tolerance.
    pub period_s: f64,
    /// Newton iterations per attempt.
    pub iterations_max: usize,
    /// Newton iterations of each of up to three ways when the direct attempt fails and the load is followed step by step, before a search on the
    /// pose alone. Those ways may take tens of milliseconds and allocate. 0: never, and the time of a tick is bounded.
    pub continuation_iterations_max: usize,
    /// Multiplications of a tick after which no further iteration is begun; see [`StanceEstimator::bound_work`](super::StanceEstimator::bound_work)
    /// and, for the slow ways, [`StanceEstimator::slow_work_max`](super::StanceEstimator::slow_work_max).
    pub multiplications_max: u64,
    /// `|F_t| > friction_use_max * mu F_n` is refused. Near 1 the sliding distance diverges (31 mm at 0.9999).
    pub friction_use_max: f64,
    /// Tilt beyond which linear elasticity is doubtful (rad); reported, not refused.
    pub tilt_doubtful_rad: f64,
    /// [`StanceReport::compression`](super::StanceReport::compression) beyond which linear elasticity is doubtful; reported, not refused. At 0.1 the stress of confined
    /// Neo-Hookean foam, `mu (l - 1/l) + lambda ln l / l` with `l = 0.9`, is 11 % above Hooke's: as much as at the limit of the tilt.
    pub compression_doubtful: f64,
    /// See [`EulerOrder`].
    pub euler_order: EulerOrder,
}

impl Default for EstimatorSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            period_s: 0.005,
            iterations_max: 60,
            continuation_iterations_max: 800,
            multiplications_max: u64::MAX,
            friction_use_max: 0.99,
            tilt_doubtful_rad: 5.0_f64.to_radians(),
            compression_doubtful: 0.1,
            euler_order: EulerOrder::default(),
        }
    }
}

/// Largest number of a reference that is believed, each in its own unit (N, m, s): the weight of a hundred thousand tonnes, or the way to the
/// moon and back. Beyond 1e154 the norm of a force overflows, and every residual measured by it is zero.
const LARGEST: f64 = 1e9;

/// What the ground must do to one foot at this tick: the pattern's plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StanceReference {
    /// Force of the ground on the sole, world (N).
    pub force: Vec3,
    /// Its rate (N/s).
    pub force_rate: Vec3,
    /// Its second rate (N/s^2).
    pub force_acceleration: Vec3,
    /// Zero-moment point on the ground, world (m), its rate and second rate.
    pub zmp: [Vector2<f64>; 3],
}

impl StanceReference {
    /// Constant force and ZMP.
    #[must_use]
    pub fn constant(force: Vec3, zmp: Vector2<f64>) -> Self {
        let zero = Vector2::zeros();
        Self { force, force_rate: Vec3::zeros(), force_acceleration: Vec3::zeros(), zmp: [zmp, zero, zero] }
    }

    /// Are its numbers such that a foot could meet them? NaN and infinity are not.
    pub(super) fn is_believed(&self) -> bool {
        self.force
            .iter()
            .chain(self.force_rate.iter())
            .chain(self.force_acceleration.iter())
            .chain(self.zmp.iter().flat_map(|z| z.iter()))
            .all(|x| x.abs() <= LARGEST)
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
