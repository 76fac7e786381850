//! Steps on the configuration manifold.

use super::{Base, Configuration, Model};
use nalgebra::DVector;
use spatial::{Transform, Vec3, so3};

impl Model {
    /// `out = q (+) dv`: the base moves by the SE(3) exponential of the body twist in the first six entries, the joints
    /// by the others. The base's rotation is mended to rounding level, so that it stays one over any number of steps.
    pub fn integrate(&self, q: &Configuration, dv: &DVector<f64>, out: &mut Configuration) {
        assert_eq!(dv.len(), self.nv(), "length of the increment");
        let base_dofs = self.base_dofs();
        for j in 0..self.joint_count() {
            out.joints[j] = q.joints[j] + dv[base_dofs + j];
        }
        out.base = match self.base() {
            Base::Fixed => q.base,
            Base::Floating => {
                let (step, phi) = (Vec3::new(dv[0], dv[1], dv[2]), Vec3::new(dv[3], dv[4], dv[5]));
                let moved = q.base * Transform::new(so3::exp(&phi), so3::left_jacobian(&phi) * step);
                Transform::new(so3::orthonormalised(&moved.rotation), moved.translation)
            }
        };
    }

    /// `out` such that `from (+) out = to`, the shortest one: the inverse of [`Model::integrate`] for base rotations
    /// below half a turn.
    pub fn difference(&self, from: &Configuration, to: &Configuration, out: &mut DVector<f64>) {
        assert_eq!(out.len(), self.nv(), "length of the difference");
        let base_dofs = self.base_dofs();
        for j in 0..self.joint_count() {
            out[base_dofs + j] = to.joints[j] - from.joints[j];
        }
        if self.base() == Base::Floating {
            let step = from.base.inverse() * to.base;
            let phi = so3::log(&step.rotation);
            out.fixed_rows_mut::<3>(0).copy_from(&(so3::left_jacobian_inverse(&phi) * step.translation));
            out.fixed_rows_mut::<3>(3).copy_from(&phi);
        }
    }
}
