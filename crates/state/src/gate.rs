//! Which measurements are used.
//!
//! A measurement is used when it is one of a robot that stands where the plan has it: newer than the last one, without a fault that the
//! driver reports, finite, joints and rates near what they may be, an orientation that is one, and a base within
//! `integration.distance_max_m` and `distance_max_rad` of the internal one.

use multibody::Model;
use nalgebra::DVector;
use spatial::{Mat3, Vec3, so3};
use std::fmt;

/// By how much the length of a unit quaternion may be off: drivers send rounded ones, and broken ones send zeros.
const QUATERNION_LENGTH_ERROR_MAX: f64 = 1e-3;
/// How far beyond its limits a joint may be measured (rad): encoders have offsets, limits have margins.
const JOINT_BEYOND_LIMIT_MAX_RAD: f64 = 0.1;
/// How much faster than its limit a joint may be measured: rates are noisy, and pushes are quick.
const JOINT_RATE_FACTOR_MAX: f64 = 2.0;
/// Fastest turn that is believed (rad/s): the usual range of gyros, 2000 degrees/s.
const GYRO_MAX_RAD_PER_S: f64 = 35.0;

/// What the robot measures at a tick. Numbers are finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// When.
    pub tick: i64,
    /// The driver reports that a sensor is faulty.
    pub faulty: bool,
    /// Joint positions in the model's order (rad).
    pub joints: DVector<f64>,
    /// Joint rates in the model's order (rad/s).
    pub joint_rates: DVector<f64>,
    /// Orientation `R_WI` of the inertial unit; `None` if what it says is no rotation ([`unit_rotation`]).
    pub imu_rotation: Option<Mat3>,
    /// Angular velocity in the inertial unit's axes (rad/s).
    pub gyro: Vec3,
    /// Vertical force on each foot (N).
    pub vertical_n: [f64; 2],
}

impl Measured {
    /// Nothing measured yet.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        Self {
            tick: i64::MIN,
            faulty: false,
            joints: DVector::zeros(model.joint_count()),
            joint_rates: DVector::zeros(model.joint_count()),
            imu_rotation: None,
            gyro: Vec3::zeros(),
            vertical_n: [0.0; 2],
        }
    }
}

/// Why a measurement is not used for feedback.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Refused {
    /// A number is not finite.
    NotFinite,
    /// The driver says that a sensor is faulty.
    SensorFault,
    /// Not newer than the one before.
    Stale,
    /// A joint is where it cannot be, or as fast as it cannot be.
    Joint,
    /// The orientation is none: its quaternion does not have length 1.
    Orientation,
    /// The gyro says more than any gyro can.
    Gyro,
    /// No deformation of the soles is known of its time.
    Soles,
    /// The base would be too far from the internal one.
    Distance,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a number is not finite",
            Self::SensorFault => "a sensor is reported faulty",
            Self::Stale => "it is not newer than the one before",
            Self::Joint => "a joint is where, or as fast as, it cannot be",
            Self::Orientation => "the orientation's quaternion does not have length 1",
            Self::Gyro => "the gyro says more than any gyro can",
            Self::Soles => "where the soles were at its time is not known",
            Self::Distance => {
                "the base would be farther from its plan than integration.distance_max_m or distance_max_rad"
            }
        })
    }
}

/// Does a robot measure that, whose sensors work? Its orientation, if so.
pub(crate) fn plausible(measured: &Measured, model: &Model) -> Result<Mat3, Refused> {
    if measured.faulty {
        return Err(Refused::SensorFault);
    }
    for ((joint, position), rate) in model.joints().iter().zip(&measured.joints).zip(&measured.joint_rates) {
        let limits = &joint.limits;
        let beyond = (position - limits.upper).max(limits.lower - position);
        if beyond > JOINT_BEYOND_LIMIT_MAX_RAD || rate.abs() > JOINT_RATE_FACTOR_MAX * limits.velocity {
            return Err(Refused::Joint);
        }
    }
    let rotation = measured.imu_rotation.ok_or(Refused::Orientation)?;
    if measured.gyro.norm() > GYRO_MAX_RAD_PER_S {
        return Err(Refused::Gyro);
    }
    Ok(rotation)
}

/// Rotation of a quaternion that is one: its length may be off by a thousandth.
#[must_use]
pub fn unit_rotation([x, y, z, w]: [f64; 4]) -> Option<Mat3> {
    let length = (x * x + y * y + z * z + w * w).sqrt();
    // Not a number is not within the limit.
    ((length - 1.0).abs() <= QUATERNION_LENGTH_ERROR_MAX)
        .then(|| so3::from_quaternion(w / length, &(Vec3::new(x, y, z) / length)))
}
