//! The rotation group SO(3): exponential, logarithm, Jacobians, Euler angles.
//!
//! Rotation vectors `phi` have the axis as direction and the angle in radians as length. All functions are regular at
//! zero angle; [`log`] is accurate up to and including half a turn.

use crate::{Mat3, Vec3};

/// Below this angle (rad) the trigonometric quotients are replaced by their series: the first neglected term is of
/// relative size `angle^6 / 5040`, far below rounding.
const SERIES_ANGLE_RAD: f64 = 1e-2;

/// Cross-product matrix: `skew(a) * b = a x b`.
#[must_use]
pub fn skew(a: &Vec3) -> Mat3 {
    Mat3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Vector of the antisymmetric part: `vee(skew(a)) = a`.
#[must_use]
pub fn vee(m: &Mat3) -> Vec3 {
    0.5 * Vec3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)])
}

/// `(sin a / a, (1 - cos a) / a^2, (a - sin a) / a^3)`.
fn quotients(angle_rad: f64) -> (f64, f64, f64) {
    let a2 = angle_rad * angle_rad;
    if angle_rad < SERIES_ANGLE_RAD {
        (
            1.0 - a2 / 6.0 * (1.0 - a2 / 20.0),
            0.5 * (1.0 - a2 / 12.0 * (1.0 - a2 / 30.0)),
            (1.0 - a2 / 20.0 * (1.0 - a2 / 42.0)) / 6.0,
        )
    } else {
        let half_sine = (0.5 * angle_rad).sin();
        (
            angle_rad.sin() / angle_rad,
            2.0 * half_sine * half_sine / a2,
            (angle_rad - angle_rad.sin()) / (a2 * angle_rad),
        )
    }
}

/// Rotation matrix of a rotation vector (Rodrigues).
#[must_use]
pub fn exp(phi: &Vec3) -> Mat3 {
    let (s, c, _) = quotients(phi.norm());
    let k = skew(phi);
    Mat3::identity() + s * k + c * (k * k)
}

/// Rotation vector of a rotation matrix, length in `[0, pi]`.
///
/// Goes through the unit quaternion, whose largest component is computed first (Shepperd), so that nothing is lost near
/// zero or half a turn.
#[must_use]
pub fn log(r: &Mat3) -> Vec3 {
    let (w, v) = quaternion(r);
    let sine = v.norm();
    if sine == 0.0 {
        return Vec3::zeros();
    }
    // w >= 0 by construction, so the angle is at most pi.
    v * (2.0 * sine.atan2(w) / sine)
}

/// Unit quaternion `(w, xyz)` of a rotation matrix with `w >= 0`.
#[must_use]
pub fn quaternion(r: &Mat3) -> (f64, Vec3) {
    let (xx, yy, zz) = (r[(0, 0)], r[(1, 1)], r[(2, 2)]);
    let squares = [1.0 + xx + yy + zz, 1.0 + xx - yy - zz, 1.0 - xx + yy - zz, 1.0 - xx - yy + zz];
    let largest = (1..4).fold(0, |best, i| if squares[i] > squares[best] { i } else { best });
    let d = [r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]];
    let s = [r[(1, 0)] + r[(0, 1)], r[(0, 2)] + r[(2, 0)], r[(2, 1)] + r[(1, 2)]];
    let four_wxyz = match largest {
        0 => [squares[0], d[0], d[1], d[2]],
        1 => [d[0], squares[1], s[0], s[1]],
        2 => [d[1], s[0], squares[2], s[2]],
        _ => [d[2], s[1], s[2], squares[3]],
    };
    let norm = four_wxyz.iter().map(|x| x * x).sum::<f64>().sqrt();
    let sign = if four_wxyz[0] < 0.0 { -1.0 } else { 1.0 };
    let [w, x, y, z] = four_wxyz.map(|c| sign * c / norm);
    (w, Vec3::new(x, y, z))
}

/// Rotation matrix of a quaternion `(w, xyz)`, which need not be normalised.
#[must_use]
pub fn from_quaternion(w: f64, v: &Vec3) -> Mat3 {
    let n = w * w + v.norm_squared();
    let k = skew(v);
    Mat3::identity() + (2.0 / n) * (w * k + k * k)
}

/// Left Jacobian: for `R(t) = exp(phi(t))`, the angular velocity in the *fixed* frame is `left_jacobian(phi) * phi'`.
#[must_use]
pub fn left_jacobian(phi: &Vec3) -> Mat3 {
    let (_, c, d) = quotients(phi.norm());
    let k = skew(phi);
    Mat3::identity() + c * k + d * (k * k)
}

/// Inverse of [`left_jacobian`]; singular only at a full turn.
#[must_use]
pub fn left_jacobian_inverse(phi: &Vec3) -> Mat3 {
    let a = phi.norm();
    let k = skew(phi);
    let e = if a < SERIES_ANGLE_RAD {
        (1.0 + a * a / 60.0 * (1.0 + a * a / 42.0)) / 12.0
    } else {
        (1.0 - 0.5 * a * (0.5 * a).cos() / (0.5 * a).sin()) / (a * a)
    };
    Mat3::identity() - 0.5 * k + e * (k * k)
}

/// Nearest rotation to a matrix that has drifted from one (one Newton step of the polar decomposition is enough for
/// drifts of rounding size; it is repeated until the defect is at rounding level, at most eight times).
#[must_use]
pub fn orthonormalised(r: &Mat3) -> Mat3 {
    let mut out = *r;
    for _ in 0..8 {
        let defect = Mat3::identity() - out.transpose() * out;
        out *= Mat3::identity() + 0.5 * defect;
        if defect.norm() < 1e-15 {
            break;
        }
    }
    out
}

/// `Rx(angle)`.
#[must_use]
pub fn about_x(angle_rad: f64) -> Mat3 {
    let (s, c) = angle_rad.sin_cos();
    Mat3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

/// `Ry(angle)`.
#[must_use]
pub fn about_y(angle_rad: f64) -> Mat3 {
    let (s, c) = angle_rad.sin_cos();
    Mat3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
}

/// `Rz(angle)`.
#[must_use]
pub fn about_z(angle_rad: f64) -> Mat3 {
    let (s, c) = angle_rad.sin_cos();
    Mat3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

/// `R = Rz(yaw) Ry(pitch) Rx(roll)` (URDF's convention).
#[must_use]
pub fn from_roll_pitch_yaw(roll_rad: f64, pitch_rad: f64, yaw_rad: f64) -> Mat3 {
    about_z(yaw_rad) * about_y(pitch_rad) * about_x(roll_rad)
}

/// `[roll, pitch, yaw]` of `R = Rz(yaw) Ry(pitch) Rx(roll)`, pitch in `[-pi/2, pi/2]`.
#[must_use]
pub fn roll_pitch_yaw(r: &Mat3) -> Vec3 {
    let pitch = (-r[(2, 0)]).atan2(r[(2, 1)].hypot(r[(2, 2)]));
    Vec3::new(r[(2, 1)].atan2(r[(2, 2)]), pitch, r[(1, 0)].atan2(r[(0, 0)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a handful of operations on numbers of order one.
    const ROUNDING: f64 = 4e-15;

    fn samples() -> Vec<Vec3> {
        let directions = [
            Vec3::x(),
            -Vec3::y(),
            Vec3::z(),
            Vec3::new(1.0, -2.0, 0.5).normalize(),
            Vec3::new(-0.3, 0.1, 0.9).normalize(),
        ];
        let angles = [0.0, 1e-12, 1e-5, 9.9e-3, 1.01e-2, 0.3, 1.5, 3.0, 3.1, std::f64::consts::PI - 1e-9];
        directions.iter().flat_map(|d| angles.iter().map(move |a| d * *a)).collect()
    }

    #[test]
    fn logarithm_inverts_exponential_up_to_half_a_turn() {
        for phi in samples() {
            assert!((log(&exp(&phi)) - phi).norm() < 2e-14, "{phi}");
        }
    }

    #[test]
    fn exponential_is_a_rotation() {
        for phi in samples() {
            let r = exp(&phi);
            assert!((r.transpose() * r - Mat3::identity()).norm() < ROUNDING);
            assert!((r.determinant() - 1.0).abs() < ROUNDING);
        }
    }

    #[test]
    fn left_jacobian_is_the_derivative_of_the_exponential() {
        let step = 1e-6;
        for phi in samples() {
            let rate = Vec3::new(0.4, -0.7, 0.2);
            let spin =
                vee(&((exp(&(phi + step * rate)) - exp(&(phi - step * rate))) / (2.0 * step) * exp(&phi).transpose()));
            assert!((left_jacobian(&phi) * rate - spin).norm() < 1e-9, "{phi}");
            assert!((left_jacobian_inverse(&phi) * left_jacobian(&phi) - Mat3::identity()).norm() < 1e-12, "{phi}");
        }
    }

    #[test]
    fn quaternion_and_euler_angles_return_the_rotation() {
        for phi in samples() {
            let r = exp(&phi);
            let (w, v) = quaternion(&r);
            assert!((from_quaternion(w, &v) - r).norm() < ROUNDING);
            assert!((from_quaternion(-3.0 * w, &(-3.0 * v)) - r).norm() < ROUNDING, "of any length and sign");
            let e = roll_pitch_yaw(&r);
            assert!((from_roll_pitch_yaw(e.x, e.y, e.z) - r).norm() < ROUNDING);
        }
    }

    #[test]
    fn euler_angles_return_a_base_that_looks_straight_up_or_down() {
        // Where pitch is nearly a quarter turn its sine no longer tells how nearly.
        for from_vertical in [0.0, 1e-12, 1e-9, 1e-6, 1e-3] {
            for pitch in [std::f64::consts::FRAC_PI_2 - from_vertical, from_vertical - std::f64::consts::FRAC_PI_2] {
                let r = from_roll_pitch_yaw(0.4, pitch, -1.1);
                let e = roll_pitch_yaw(&r);
                assert!((from_roll_pitch_yaw(e.x, e.y, e.z) - r).norm() < ROUNDING, "{pitch}");
            }
        }
    }

    #[test]
    fn a_drifted_rotation_is_mended() {
        let r = exp(&Vec3::new(0.4, -1.2, 0.3));
        let mended = orthonormalised(&(r + Mat3::from_element(1e-4)));
        assert!((mended.transpose() * mended - Mat3::identity()).norm() < ROUNDING);
        assert!((mended - r).norm() < 1e-3);
    }
}
