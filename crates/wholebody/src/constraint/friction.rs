//! Contact forces of a foot as nonnegative intensities along the edges of friction cones.

use nalgebra::DMatrix;
use spatial::{Transform, Vec3, Wrench};

/// Points of a foot that may carry load.
pub const POINTS: usize = 4;

/// The cones of one foot: `wrench = G f`, `f >= 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionCones {
    /// Corners of the undeformed sole in the ankle frame (m).
    corners: [Vec3; POINTS],
    /// Edges of the linearised cone, normal part 1, in world axes.
    generators: Vec<Vec3>,
    /// 6 x intensities: wrench about the ankle's origin, world axes, force first.
    pub map: DMatrix<f64>,
}

impl FrictionCones {
    /// Cones at the corners of a sole. The edges lie on Coulomb's cone, so the linearised cone lies inside.
    #[must_use]
    pub fn new(
        length_m: f64,
        width_m: f64,
        ankle_in_sole_m: &Vec3,
        friction: f64,
        generators_per_point: usize,
    ) -> Self {
        let corner = |x: f64, y: f64| Vec3::new(0.5 * x * length_m, 0.5 * y * width_m, 0.0) - ankle_in_sole_m;
        let step = std::f64::consts::TAU / generators_per_point as f64;
        let generators: Vec<Vec3> = (0..generators_per_point)
            .map(|k| {
                // Half a step away from the axes: symmetric left to right and front to back.
                let (s, c) = (step * (k as f64 + 0.5)).sin_cos();
                Vec3::new(friction * c, friction * s, 1.0)
            })
            .collect();
        Self {
            corners: [corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0), corner(-1.0, 1.0)],
            map: DMatrix::zeros(6, POINTS * generators.len()),
            generators,
        }
    }

    /// Number of intensities.
    #[must_use]
    pub fn len(&self) -> usize {
        POINTS * self.generators.len()
    }

    /// A foot always has points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Places the points: the corners moved by the ankle's pose, projected on the ground z = 0, whose normal is the cones'
    /// axis. The tangential axes turn with the foot's yaw, so that the result does not depend on the walk's direction.
    pub fn place(&mut self, ankle: &Transform) {
        let yaw = ankle.rotation[(1, 0)].atan2(ankle.rotation[(0, 0)]);
        let (s, c) = yaw.sin_cos();
        let per_point = self.generators.len();
        for (i, corner) in self.corners.iter().enumerate() {
            let mut lever = ankle.rotation * corner;
            lever.z = -ankle.translation.z;
            for (k, g) in self.generators.iter().enumerate() {
                let force = Vec3::new(c * g.x - s * g.y, s * g.x + c * g.y, g.z);
                let moment = lever.cross(&force);
                let mut column = self.map.column_mut(i * per_point + k);
                column.fixed_rows_mut::<3>(0).copy_from(&force);
                column.fixed_rows_mut::<3>(3).copy_from(&moment);
            }
        }
    }

    /// Wrench about the ankle's origin of given intensities.
    #[must_use]
    pub fn wrench(&self, intensities: &[f64]) -> Wrench {
        let mut sum = spatial::Vec6::zeros();
        for (column, f) in self.map.as_slice().chunks_exact(6).zip(intensities) {
            for (sum, g) in sum.iter_mut().zip(column) {
                *sum += f * g;
            }
        }
        Wrench::from_vector(&sum)
    }

    /// Force at each corner of given intensities, world axes.
    #[must_use]
    pub fn corner_forces(&self, intensities: &[f64]) -> [Vec3; POINTS] {
        let mut forces = [Vec3::zeros(); POINTS];
        let per_point = self.generators.len();
        for ((k, column), f) in self.map.as_slice().chunks_exact(6).enumerate().zip(intensities) {
            forces[k / per_point] += *f * Vec3::new(column[0], column[1], column[2]);
        }
        forces
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spatial::so3;

    const ANKLE_IN_SOLE: Vec3 = Vec3::new(-0.015, -0.011, 0.103);

    #[test]
    fn every_generator_lies_on_coulombs_cone_and_acts_on_the_ground_under_a_corner() {
        for per_point in [4, 8, 16] {
            let mut cones = FrictionCones::new(0.23, 0.13, &ANKLE_IN_SOLE, 0.65, per_point);
            let ankle = Transform::new(so3::from_roll_pitch_yaw(0.03, -0.02, 1.1), Vec3::new(3.0, -2.0, 0.102));
            cones.place(&ankle);
            for (j, column) in cones.map.column_iter().enumerate() {
                let force = Vec3::new(column[0], column[1], column[2]);
                assert!((force.xy().norm() - 0.65 * force.z).abs() < 1e-15 && force.z == 1.0);
                // The force's line meets the ground at lever x force = moment, at depth z below the ankle.
                let corner = ankle.rotation * cones.corners[j / per_point];
                let lever = Vec3::new(corner.x, corner.y, -0.102);
                let moment = Vec3::new(column[3], column[4], column[5]);
                assert!((lever.cross(&force) - moment).norm() < 1e-15);
            }
        }
    }

    #[test]
    fn more_generators_contain_more_of_the_cone() {
        let inner = |per_point: usize| {
            let half_step = std::f64::consts::PI / per_point as f64;
            half_step.cos()
        };
        for per_point in [4, 8, 16] {
            let cones = FrictionCones::new(0.23, 0.13, &ANKLE_IN_SOLE, 0.5, per_point);
            // The chord between neighbouring edges is what the linearised cone offers along an axis.
            let chord = 0.5 * (cones.generators[0] + cones.generators[per_point - 1]);
            assert!((chord.xy().norm() / 0.5 - inner(per_point)).abs() < 1e-15);
        }
    }
}
