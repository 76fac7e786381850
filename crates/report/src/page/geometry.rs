//! The little geometry that drawing needs; rotations are row-major.

/// Zero-moment point on the ground of a wrench about a point above it.
pub(super) fn foot_zmp_m(wrench: &[f64; 6], about: &[f64; 3]) -> [f64; 2] {
    let [fx, fy, fz, mx, my, _] = *wrench;
    let [x, y, z] = *about;
    // The moment about the point below, on the ground.
    [x + (-my - fx * z) / fz, y + (mx - fy * z) / fz]
}

/// Roll and pitch of a nearly horizontal frame in its own heading (mrad).
pub(super) fn tilt_mrad(r: &[f64; 9]) -> [f64; 2] {
    let (sin, cos) = r[3].atan2(r[0]).sin_cos();
    let (x, y) = (cos * r[2] + sin * r[5], -sin * r[2] + cos * r[5]);
    [1e3 * (-y).atan2(r[8]), 1e3 * x.atan2(r[8])]
}

/// Quaternion x, y, z, w, from its largest component, so that nothing is divided by little.
pub(super) fn quaternion(r: &[f64; 9]) -> [f64; 4] {
    let trace = r[0] + r[4] + r[8];
    let candidates = [r[0], r[4], r[8], trace];
    let largest = (0..4).max_by(|a, b| candidates[*a].total_cmp(&candidates[*b])).unwrap_or(3);
    let q = match largest {
        0 => [1.0 + r[0] - r[4] - r[8], r[1] + r[3], r[2] + r[6], r[7] - r[5]],
        1 => [r[1] + r[3], 1.0 - r[0] + r[4] - r[8], r[5] + r[7], r[2] - r[6]],
        2 => [r[2] + r[6], r[5] + r[7], 1.0 - r[0] - r[4] + r[8], r[3] - r[1]],
        _ => [r[7] - r[5], r[2] - r[6], r[3] - r[1], 1.0 + trace],
    };
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| x / norm)
}

/// A vector from a rotated frame in the world.
pub(super) fn rotated(r: &[f64; 9], v: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|row| (0..3).map(|column| r[3 * row + column] * v[column]).sum())
}

/// Quaternion x, y, z, w of roll, pitch and yaw as a URDF has them.
pub(super) fn of_rpy([roll, pitch, yaw]: [f64; 3]) -> [f64; 4] {
    let ((sr, cr), (sp, cp), (sy, cy)) = ((0.5 * roll).sin_cos(), (0.5 * pitch).sin_cos(), (0.5 * yaw).sin_cos());
    [sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_beside_the_sole_has_its_zmp_where_it_acts() {
        // 200 N upwards, 30 mm in front and 10 mm left of the point it is taken about, which is 21 mm above the ground.
        let wrench = [0.0, 0.0, 200.0, 2.0, -6.0, 0.0];
        let [x, y] = foot_zmp_m(&wrench, &[1.0, 2.0, 0.021]);
        assert!((x - 1.03).abs() < 1e-12 && (y - 2.01).abs() < 1e-12, "{x} {y}");
        // A force forwards leans the line of force: below the point it is farther back.
        let [x, _] = foot_zmp_m(&[20.0, 0.0, 200.0, 0.0, 0.0, 0.0], &[0.0, 0.0, 0.02]);
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
    fn quaternions_are_right_whatever_component_is_largest() {
        let quarter = 0.5_f64.sqrt();
        for (rotation, expected) in [
            ([1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0], [1.0, 0.0, 0.0, 0.0]),
            ([-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0], [0.0, 1.0, 0.0, 0.0]),
            ([0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0], [0.0, 0.0, quarter, quarter]),
        ] {
            let found = quaternion(&rotation);
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{found:?}");
        }
        let yaw = of_rpy([0.0, 0.0, std::f64::consts::FRAC_PI_2]);
        assert!((yaw[2] - quarter).abs() < 1e-15 && (yaw[3] - quarter).abs() < 1e-15, "{yaw:?}");
    }
}
