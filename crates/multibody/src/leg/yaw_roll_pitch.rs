//! Closed-form inverse kinematics of a six-joint leg whose hip axes meet in one point and whose ankle axes meet in another.
//!
//! Joint order from base to foot: hip yaw (z), hip roll (x), hip pitch (y), knee pitch (y), ankle pitch (y), ankle roll (x);
//! with all joints at zero every link frame is parallel to the base. Then, with `R_BF, p_BF` the wanted foot pose,
//!
//! ```text
//! R_BF = Rz(q1) Rx(q2) Ry(q3) Ry(q4) Ry(q5) Rx(q6)
//! p_BF = p_BH + Rz(q1) Rx(q2) Ry(q3) ( p_HK + Ry(q4) p_KF ),   p_HK = (0, d, -a),  p_KF = (0, 0, -b)
//! ```
//!
//! Seen from the foot, the hip is at `r = R_BFᵀ (p_BH - p_BF) = Rx(-q6) w` with `w_y = -d`, which gives q6; the plane of
//! thigh and shank then has one unknown angle at the knee (law of cosines) and one at the ankle; the hip takes the rest.
//! The two branches left (knee forward or backward, leg up or down) are fixed: the knee bends forward (`q4 >= 0`), the hip is
//! above the foot. References: Pieper (1968); Kajita et al., *Introduction to Humanoid Robotics* (2014), section 2.5.

use super::{LegAngles, LegError};
use crate::algorithms::forward_kinematics;
use crate::model::{FrameIndex, JointIndex, Model};
use crate::workspace::Workspace;
use nalgebra::DMatrix;
use spatial::{Transform, Vec3};

/// Models are written with at most this rounding of lengths and directions (m, 1).
const ROUNDED_MODEL: f64 = 1e-6;

/// Fixed lengths of one leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegGeometry {
    /// `p_BH`: where the hip axes meet, in the base frame (m).
    pub hip_in_base: Vec3,
    /// `d`: lateral offset of the knee from the hip, left positive (m).
    pub knee_offset_m: f64,
    /// `a`: height of the hip above the knee at zero angles (m).
    pub thigh_m: f64,
    /// `b`: height of the knee above the ankle at zero angles (m).
    pub shank_m: f64,
}

impl LegGeometry {
    /// Reads the lengths off a model: where each axis lies follows from the Jacobian of the ankle at zero angles.
    ///
    /// # Errors
    /// The leg is not of the known shape.
    pub fn of_model(model: &Model, joints: &[JointIndex; 6], ankle: FrameIndex) -> Result<Self, LegError> {
        let mut ws = Workspace::new(model);
        let mut q = model.neutral();
        q.joints.fill(0.0);
        let mut placed = forward_kinematics(model, &mut ws, &q);
        let X_BA = placed.pose(model.base_frame()).inverse() * placed.pose(ankle);
        let angle_rad = spatial::so3::log(&X_BA.rotation).norm();
        if angle_rad > ROUNDED_MODEL {
            return Err(LegError::Foot { frame: model.frames()[ankle.0].name.clone(), angle_rad });
        }
        let mut J = DMatrix::zeros(6, model.nv());
        placed.jacobian(ankle, &mut J);
        let name = |i: usize| model.joints()[joints[i].0].name.clone();
        // Column of a joint: its axis w, and w x r with r from the axis to the ankle.
        let axes = [Vec3::z(), Vec3::x(), Vec3::y(), Vec3::y(), Vec3::y(), Vec3::x()];
        let mut arms = [Vec3::zeros(); 6];
        for (i, expected) in axes.into_iter().enumerate() {
            let column = J.column(model.column(joints[i]));
            let found: Vec3 = column.fixed_rows::<3>(3).into();
            if (found - expected).norm() > ROUNDED_MODEL {
                return Err(LegError::Axis { joint: name(i), expected: expected.into(), found: found.into() });
            }
            let moved: Vec3 = column.fixed_rows::<3>(0).into();
            arms[i] = moved.cross(&expected); // the part of r across the axis
        }
        let [yaw, roll, pitch, knee, ankle_pitch, ankle_roll] = arms;
        let hip = Vec3::new(pitch.x, roll.y, pitch.z);
        for (i, relation, distance_m) in [
            (0, "the yaw axis through the hip's centre", (yaw - Vec3::new(hip.x, hip.y, 0.0)).norm()),
            (1, "the height at which the hip's roll and pitch axes meet", (roll.z - pitch.z).abs()),
            (3, "the knee straight above the ankle", knee.x.abs()),
            (2, "the hip straight above the ankle", hip.x.abs()),
            (4, "the ankle's pitch axis through the ankle", ankle_pitch.norm()),
            (5, "the ankle's roll axis through the ankle", ankle_roll.norm()),
        ] {
            if distance_m > ROUNDED_MODEL {
                return Err(LegError::Offset { joint: name(i), relation, distance_m });
            }
        }
        let shank_m = -knee.z;
        Ok(Self { hip_in_base: X_BA.translation - hip, knee_offset_m: hip.y, thigh_m: -hip.z - shank_m, shank_m })
    }

    /// The six angles that bring the foot (axes parallel to the base at zero angles, origin where the ankle axes meet) to
    /// the pose `X_BF`. A pose out of reach is answered with the nearest leg length along the same line from ankle to hip.
    #[must_use]
    pub fn inverse(&self, X_BF: &Transform) -> LegAngles {
        let (a, b, d) = (self.thigh_m, self.shank_m, self.knee_offset_m);
        let r = X_BF.rotation.tr_mul(&(self.hip_in_base - X_BF.translation));
        // Ankle roll: turn (y, z) of r so that y becomes -d.
        let in_plane = r.y.hypot(r.z);
        let w_z = (in_plane * in_plane - d * d).max(0.0).sqrt();
        let q6 = r.y.atan2(r.z) - (-d).atan2(w_z);
        let w_x = r.x;

        // Knee: half-angle form of the law of cosines, which keeps its digits when the leg is nearly straight.
        let reach = w_x.hypot(w_z);
        let within = reach.clamp((a - b).abs(), a + b);
        let sine_squared = (a + b - within) * (a + b + within);
        let cosine_squared = (within - (a - b)) * (within + (a - b));
        let q4 = 2.0 * sine_squared.max(0.0).sqrt().atan2(cosine_squared.max(0.0).sqrt());

        // Ankle pitch: angle of the hip seen from the shank, less the same seen from the foot.
        let (s4, c4) = q4.sin_cos();
        let q5 = (-a * s4).atan2(b + a * c4) - w_x.atan2(w_z);

        // Hip: what is left of the rotation, R_BF Rx(-q6) Ry(-q4 - q5) = Rz(q1) Rx(q2) Ry(q3).
        let m = X_BF.rotation * spatial::so3::about_x(-q6) * spatial::so3::about_y(-q4 - q5);
        let q1 = (-m[(0, 1)]).atan2(m[(1, 1)]);
        let q2 = m[(2, 1)].atan2(m[(2, 0)].hypot(m[(2, 2)]));
        let q3 = (-m[(2, 0)]).atan2(m[(2, 2)]);
        LegAngles { joints_rad: [q1, q2, q3, q4, q5, q6], out_of_reach_m: reach - within }
    }

    /// Distance from hip to ankle with the knee at an angle (rad) (m).
    #[must_use]
    pub fn length_m(&self, knee_rad: f64) -> f64 {
        let knee_to_hip = Vec3::new(0.0, self.knee_offset_m, -self.thigh_m);
        (knee_to_hip + spatial::so3::about_y(knee_rad) * Vec3::new(0.0, 0.0, -self.shank_m)).norm()
    }

    /// Foot pose in the base frame at the given angles (rad).
    #[must_use]
    pub fn forward(&self, joints_rad: &[f64; 6]) -> Transform {
        use spatial::so3::{about_x, about_y, about_z};
        let [q1, q2, q3, q4, q5, q6] = *joints_rad;
        let R_BH = about_z(q1) * about_x(q2) * about_y(q3);
        let R_BK = R_BH * about_y(q4);
        let knee = self.hip_in_base + R_BH * Vec3::new(0.0, self.knee_offset_m, -self.thigh_m);
        Transform::new(R_BK * about_y(q5) * about_x(q6), knee + R_BK * Vec3::new(0.0, 0.0, -self.shank_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of about thirty operations on lengths below 1 m.
    const ROUNDING_M: f64 = 1e-12;

    fn left() -> LegGeometry {
        LegGeometry {
            hip_in_base: Vec3::new(0.0, 0.0875, 0.0),
            knee_offset_m: -0.01905,
            thigh_m: 0.358,
            shank_m: 0.34115,
        }
    }

    fn pose_error(a: &Transform, b: &Transform) -> f64 {
        (a.rotation - b.rotation).norm() + (a.translation - b.translation).norm()
    }

    #[test]
    fn inverse_returns_the_angles_over_the_whole_range_of_the_joints() {
        let limits = [(-45.0, 45.0), (-25.0, 25.0), (-77.0, 24.0), (0.7, 124.7), (-56.7, 15.3), (-34.0, 34.0)];
        for sample in 1..=10_000_u32 {
            // Weyl's sequence: multiples of irrational numbers fill the box of the limits evenly.
            let share = |joint: usize| (f64::from(sample) * [2.0_f64, 3.0, 5.0, 7.0, 11.0, 13.0][joint].sqrt()).fract();
            let angles = std::array::from_fn(|joint| {
                let (low, high): (f64, f64) = limits[joint];
                (low + (high - low) * share(joint)).to_radians()
            });
            let found = left().inverse(&left().forward(&angles));
            assert!(found.out_of_reach_m.abs() < ROUNDING_M);
            // An angle near the straight knee is the square root of a length's rounding: 1e-15 m / (0.7 deg x 0.17 m).
            for (got, wanted) in found.joints_rad.iter().zip(angles) {
                assert!((got - wanted).abs() < 1e-11, "{found:?} against {angles:?}");
            }
            assert!(pose_error(&left().forward(&found.joints_rad), &left().forward(&angles)) < ROUNDING_M);
        }
    }

    #[test]
    fn foot_pose_is_met_up_to_the_straight_knee() {
        for knee in [1e-2, 1e-4, 1e-6, 1e-8, 0.0] {
            let wanted = left().forward(&[0.1, -0.05, -0.3, knee, 0.2, 0.04]);
            let found = left().inverse(&wanted);
            assert!(pose_error(&left().forward(&found.joints_rad), &wanted) < ROUNDING_M, "knee {knee}: {found:?}");
        }
    }

    #[test]
    fn a_pose_out_of_reach_is_said_and_the_leg_is_stretched_towards_it() {
        let far = Transform::from_translation(Vec3::new(0.0, 0.06845, -0.8));
        let found = left().inverse(&far);
        assert!((found.out_of_reach_m - (0.8 - 0.69915)).abs() < 1e-3);
        assert_eq!(found.joints_rad[3], 0.0);
        let close = Transform::from_translation(Vec3::new(0.0, 0.06845, -0.01));
        assert!(left().inverse(&close).out_of_reach_m < 0.0);
    }

    #[test]
    fn the_right_leg_mirrors_the_left() {
        let right = LegGeometry { hip_in_base: Vec3::new(0.0, -0.0875, 0.0), knee_offset_m: 0.01905, ..left() };
        let pose = left().forward(&[0.2, 0.1, -0.5, 0.9, -0.4, 0.05]);
        let mirror = spatial::Mat3::from_diagonal(&Vec3::new(1.0, -1.0, 1.0));
        let mirrored = Transform::new(mirror * pose.rotation * mirror, mirror * pose.translation);
        let (l, r) = (left().inverse(&pose).joints_rad, right.inverse(&mirrored).joints_rad);
        let signs = [-1.0, -1.0, 1.0, 1.0, 1.0, -1.0];
        for i in 0..6 {
            assert!((l[i] * signs[i] - r[i]).abs() < ROUNDING_M);
        }
    }
}
