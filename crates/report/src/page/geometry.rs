//! The little geometry that drawing needs; rotations are row-major.

use messages::from_row_major;
use spatial::{Vec3, Wrench, so3};

/// Zero-moment point on the ground of a wrench about a point above it; `None` where hardly anything presses.
pub(super) fn foot_zmp_m(wrench: &[f64; 6], about: &[f64; 3]) -> Option<[f64; 2]> {
    Wrench::from_vector(&(*wrench).into()).zmp(&(*about).into(), 0.0).map(Into::into)
}

/// Roll and pitch of a nearly horizontal frame in its own heading (mrad).
pub(super) fn tilt_mrad(r: &[f64; 9]) -> [f64; 2] {
    let (sin, cos) = r[3].atan2(r[0]).sin_cos();
    let (x, y) = (cos * r[2] + sin * r[5], -sin * r[2] + cos * r[5]);
    [1e3 * (-y).atan2(r[8]), 1e3 * x.atan2(r[8])]
}

/// Quaternion x, y, z, w of a rotation.
pub(super) fn quaternion(r: &[f64; 9]) -> [f64; 4] {
    let (w, v) = so3::quaternion(&from_row_major(r));
    [v.x, v.y, v.z, w]
}

/// A vector from a rotated frame in the world.
pub(super) fn rotated(r: &[f64; 9], v: [f64; 3]) -> [f64; 3] {
    (from_row_major(r) * Vec3::from(v)).into()
}

/// Quaternion x, y, z, w of roll, pitch and yaw as a URDF has them.
pub(super) fn of_rpy([roll, pitch, yaw]: [f64; 3]) -> [f64; 4] {
    let (w, v) = so3::quaternion(&so3::from_roll_pitch_yaw(roll, pitch, yaw));
    [v.x, v.y, v.z, w]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_beside_the_sole_has_its_zmp_where_it_acts() {
        // 200 N upwards, 30 mm in front and 10 mm left of the point it is taken about, which is 21 mm above the ground.
        let wrench = [0.0, 0.0, 200.0, 2.0, -6.0, 0.0];
        let [x, y] = foot_zmp_m(&wrench, &[1.0, 2.0, 0.021]).expect("it presses");
        assert!((x - 1.03).abs() < 1e-12 && (y - 2.01).abs() < 1e-12, "{x} {y}");
        // A force forwards leans the line of force: below the point it is farther back.
        let [x, _] = foot_zmp_m(&[20.0, 0.0, 200.0, 0.0, 0.0, 0.0], &[0.0, 0.0, 0.02]).expect("it presses");
        assert!((x + 0.002).abs() < 1e-12, "{x}");
    }

    #[test]
    fn tilts_are_in_the_feet_own_heading() {
        let (sin, cos) = 0.01_f64.sin_cos();
        // Rolled about its own length, and the same heading left.
        let rolled = [1.0, 0.0, 0.0, 0.0, cos, -sin, 0.0, sin, cos];
        let heading_left = [0.0, -cos, sin, 1.0, 0.0, 0.0, 0.0, sin, cos];
        for rotation in [rolled, heading_left] {
            let [roll, pitch] = tilt_mrad(&rotation);
            assert!((roll - 10.0).abs() < 1e-9 && pitch.abs() < 1e-9, "{roll} {pitch}");
        }
    }

    #[test]
    fn turns_are_the_same_as_matrix_angles_and_quaternion() {
        let quarter = 0.5_f64.sqrt();
        let turn = [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        for found in [quaternion(&turn), of_rpy([0.0, 0.0, std::f64::consts::FRAC_PI_2])] {
            assert!(found.iter().zip([0.0, 0.0, quarter, quarter]).all(|(a, b)| (a - b).abs() < 1e-15), "{found:?}");
        }
        assert_eq!(rotated(&turn, [1.0, 0.0, 2.0]), [0.0, 1.0, 2.0]);
    }
}
