//! One moving body, as the recursions need it.

use super::joint::JointMotion;
use crate::rigid::Symmetric;
use spatial::{Inertia, Transform, Vec3};

/// One moving body with everything that is rigidly attached to it. `bodies[0]` is the base; each other one is moved by a
/// joint or a follower of its own, `bodies[i + 1]` by joint `i` where nothing follows. Parents come before children, and the
/// bodies below any body come after it without a gap.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Body {
    pub parent: usize,
    pub motion: JointMotion,
    /// The body's frame at joint position zero, in the parent's body frame; z is the joint's axis.
    pub placement: Transform,
    /// In the body's frame.
    pub inertia: Inertia,
    /// Mass times centre of mass (kg m).
    pub first_moment: Vec3,
    /// Rotational inertia about the frame's origin (kg m^2).
    pub about_origin: Symmetric,
    /// Added to the diagonal entry of its joint in the tree's M (kg m^2, kg).
    pub rotor_inertia: f64,
}

impl Body {
    pub fn massless(parent: usize, motion: JointMotion, placement: Transform) -> Self {
        Self {
            parent,
            motion,
            placement,
            inertia: Inertia::zero(),
            first_moment: Vec3::zeros(),
            about_origin: Symmetric::default(),
            rotor_inertia: 0.0,
        }
    }
}
