//! All memory of the recursions.

use crate::model::{FrameIndex, Model};
use crate::rigid::{RigidInertia, Symmetric, unrotate};
use spatial::{Mat3, Transform, Twist, Vec3, Wrench};

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

/// What Newton and Euler's recursion keeps per body, in the body's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Newton {
    /// Pose of the body in its parent.
    pub placement: Transform,
    pub w: Vec3,
    pub wd: Vec3,
    /// Acceleration of the frame's origin, gravity subtracted.
    pub acceleration: Vec3,
    pub force: Vec3,
    /// About the frame's origin.
    pub moment: Vec3,
}

impl Newton {
    pub fn new() -> Self {
        let zero = Vec3::zeros();
        Self { placement: Transform::identity(), w: zero, wd: zero, acceleration: zero, force: zero, moment: zero }
    }
}

/// `[force; moment] = [mass, coupling; coupling', rotational] [acceleration; angular acceleration]` at the body's origin.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ArticulatedInertia {
    pub mass: Symmetric,
    pub coupling: Mat3,
    pub rotational: Symmetric,
}

/// What the articulated-body recursion keeps per body, in the body's frame.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Articulated {
    /// Pose of the body in its parent.
    pub placement: Transform,
    /// Velocity of the frame's origin and angular velocity.
    pub v: Vec3,
    pub w: Vec3,
    pub inertia: ArticulatedInertia,
    /// Wrench on the articulated body when it does not accelerate.
    pub force: Vec3,
    pub moment: Vec3,
    /// Acceleration caused by the joint's rate alone.
    pub c_linear: Vec3,
    pub c_angular: Vec3,
    /// Column of the articulated inertia for the joint.
    pub u_force: Vec3,
    pub u_moment: Vec3,
    /// Apparent inertia at the joint.
    pub d: f64,
    /// Joint force left over.
    pub rest: f64,
    pub acceleration: Vec3,
    pub wd: Vec3,
}

/// What the recursions on a model's tree write, one entry per body.
#[derive(Debug, Clone)]
pub(crate) struct Memory {
    /// `p_WO`.
    pub origin: Vec3,
    /// `(sin q, cos q)` of every joint of the tree.
    pub sines: Vec<(f64, f64)>,
    pub motion: Vec<BodyMotion>,
    /// The same in base axes, positions only.
    pub motion_in_base: Vec<BodyMotion>,
    pub newton: Vec<Newton>,
    pub force: Vec<Wrench>,
    pub inertia: Vec<RigidInertia>,
    /// Composite inertia times joint axis.
    pub axis_force: Vec<Wrench>,
    pub articulated: Vec<Articulated>,
}

impl Memory {
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
        }
    }

    /// `X_WF` of a frame in the configuration of the last kinematics.
    pub fn placement(&self, model: &Model, frame: FrameIndex) -> Transform {
        let frame = &model.frames()[frame.0];
        let placed = self.motion[frame.body].placement * frame.placement;
        Transform::new(placed.rotation, self.origin + placed.translation)
    }

    /// Velocity of a frame's origin and its angular velocity, world axes, at the velocity of the last kinematics.
    pub fn velocity(&self, model: &Model, frame: FrameIndex) -> Twist {
        self.motion[model.frames()[frame.0].body].v.at(&self.frame_position(model, frame))
    }

    /// A wrench about a frame's origin in world axes, as force and moment about the origin of the body that carries the
    /// frame, in the body's axes; after forward kinematics.
    pub fn in_body(&self, model: &Model, frame: FrameIndex, wrench: &Wrench) -> (usize, Vec3, Vec3) {
        let body = model.frames()[frame.0].body;
        let X_OB = &self.motion[body].placement;
        let about_body = wrench.about(&(X_OB.translation - self.frame_position(model, frame)));
        (body, unrotate(&X_OB.rotation, &about_body.force), unrotate(&X_OB.rotation, &about_body.moment))
    }

    /// Position of a frame's origin from O, world axes.
    pub fn frame_position(&self, model: &Model, frame: FrameIndex) -> Vec3 {
        let frame = &model.frames()[frame.0];
        self.motion[frame.body].placement.point(&frame.placement.translation)
    }
}
