//! What the estimator is told: where a foot stands, what it must carry, how well.

use crate::euler_order::EulerOrder;
use nalgebra::Vector2;
use spatial::Vec3;
use std::f64::consts::{PI, TAU};

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
