//! All memory of the algorithms.

use crate::aba::Articulated;
use crate::coupling::TreeMemory;
use crate::rigid::{RigidInertia, unrotate};
use crate::rnea::Newton;
use crate::{FrameIndex, Model};
use nalgebra::DVector;
use spatial::{Transform, Twist, Vec3, Wrench};

/// Motion of one body, world axes, about the origin O of the base.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyMotion {
    /// Rotation and position of the body's frame, measured from O.
    pub placement: Transform,
    /// Twist of the body per unit of joint rate.
    pub s: Twist,
    /// Twist.
    pub v: Twist,
    /// Spatial acceleration (of the algorithm that wrote it last; most include the fictitious `-gravity`).
    pub a: Twist,
}

/// All memory of the algorithms, made once per model.
///
/// [`Workspace::placement`] and [`Workspace::velocity`] answer for the last forward kinematics (which
/// [`whole_body_terms`](crate::whole_body_terms) includes); the other algorithms do not disturb it.
#[derive(Debug, Clone)]
pub struct Workspace {
    /// `p_WO`.
    pub(crate) origin: Vec3,
    /// `(sin q, cos q)` of every joint of the tree.
    pub(crate) sines: Vec<(f64, f64)>,
    pub(crate) motion: Vec<BodyMotion>,
    /// The same in base axes, positions only.
    pub(crate) motion_in_base: Vec<BodyMotion>,
    pub(crate) newton: Vec<Newton>,
    pub(crate) force: Vec<Wrench>,
    pub(crate) inertia: Vec<RigidInertia>,
    /// Composite inertia times joint axis.
    pub(crate) axis_force: Vec<Wrench>,
    pub(crate) articulated: Vec<Articulated>,
    /// Generalised forces of the refinement, and the accelerations before it.
    pub(crate) forces: DVector<f64>,
    pub(crate) unrefined: DVector<f64>,
    /// Only where joints follow others.
    pub(crate) tree: Option<Box<TreeMemory>>,
}

impl Workspace {
    /// Memory for a model's algorithms; frames may be added to the model afterwards.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let n = model.bodies.len();
        let rest =
            BodyMotion { placement: Transform::identity(), s: Twist::zero(), v: Twist::zero(), a: Twist::zero() };
        Self {
            origin: Vec3::zeros(),
            sines: vec![(0.0, 1.0); n - 1],
            motion: vec![rest; n],
            motion_in_base: vec![rest; n],
            newton: vec![Newton::new(); n],
            force: vec![Wrench::zero(); n],
            inertia: vec![RigidInertia::default(); n],
            axis_force: vec![Wrench::zero(); n],
            articulated: vec![Articulated::default(); n],
            forces: DVector::zeros(model.nv()),
            unrefined: DVector::zeros(model.nv()),
            tree: model.coupling.as_ref().map(|_| Box::new(TreeMemory::new(model))),
        }
    }

    /// `X_WF` of a frame in the configuration of the last kinematics.
    #[must_use]
    pub fn placement(&self, model: &Model, frame: FrameIndex) -> Transform {
        let frame = &model.frames()[frame.0];
        let placed = self.motion[frame.body].placement * frame.placement;
        Transform::new(placed.rotation, self.origin + placed.translation)
    }

    /// Velocity of a frame's origin and its angular velocity, world axes, at the velocity of the last kinematics.
    #[must_use]
    pub fn velocity(&self, model: &Model, frame: FrameIndex) -> Twist {
        self.motion[model.frames()[frame.0].body].v.at(&self.frame_position(model, frame))
    }

    /// A wrench about a frame's origin in world axes, as force and moment about the origin of the body that carries the
    /// frame, in the body's axes; after forward kinematics.
    pub(crate) fn in_body(&self, model: &Model, frame: FrameIndex, wrench: &Wrench) -> (usize, Vec3, Vec3) {
        let body = model.frames()[frame.0].body;
        let X_OB = &self.motion[body].placement;
        let about_body = wrench.about(&(X_OB.translation - self.frame_position(model, frame)));
        (body, unrotate(&X_OB.rotation, &about_body.force), unrotate(&X_OB.rotation, &about_body.moment))
    }

    /// Position of a frame's origin from O, world axes.
    pub(crate) fn frame_position(&self, model: &Model, frame: FrameIndex) -> Vec3 {
        let frame = &model.frames()[frame.0];
        self.motion[frame.body].placement.point(&frame.placement.translation)
    }
}
