//! The constant description of a robot, built once.

mod body;
mod build;
mod configuration;
mod coupling;
mod integrate;
mod joint;
mod mimic;
mod options;

pub(crate) use body::Body;
pub use configuration::Configuration;
pub(crate) use coupling::Coupling;
pub use joint::{Follower, FollowerIndex, Joint, JointIndex, JointMotion};
pub use mimic::{CarriedJoint, carried_joints};
pub use options::{Base, InertiaCheck, ModelOptions};

use crate::error::{ModelError, nearest};
use nalgebra::DVector;
use spatial::{InertiaError, Transform, Vec3};

/// Position of a frame in [`Model::frames`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FrameIndex(pub usize);

/// A named frame, rigidly attached to a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Name of the URDF link, or the one given to [`Model::add_frame`].
    pub name: String,
    pub(crate) body: usize,
    /// Pose in the body's frame.
    pub(crate) placement: Transform,
}

/// A robot: bodies, joints, frames. Constant for all algorithms.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    name: String,
    base: Base,
    gravity: Vec3,
    total_mass_kg: f64,
    joints: Vec<Joint>,
    followers: Vec<Follower>,
    pub(crate) bodies: Vec<Body>,
    /// `None` where nothing follows: the robot's coordinates are those of its tree.
    pub(crate) coupling: Option<Coupling>,
    frames: Vec<Frame>,
    impossible_links: Vec<(String, InertiaError)>,
}

impl Model {
    /// The robot's name in the URDF.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the root link is attached to.
    #[must_use]
    pub fn base(&self) -> Base {
        self.base
    }

    /// Acceleration of free fall (m/s^2), world axes.
    #[must_use]
    pub fn gravity(&self) -> Vec3 {
        self.gravity
    }

    /// Length of `v`: base and joints.
    #[must_use]
    pub fn nv(&self) -> usize {
        self.base_dofs() + self.joints.len()
    }

    /// Columns of the base in `v`: 6 if floating, 0 if fixed.
    #[must_use]
    pub fn base_dofs(&self) -> usize {
        match self.base {
            Base::Floating => 6,
            Base::Fixed => 0,
        }
    }

    /// Length of `v` if nothing followed: the base's columns and one per moving body.
    pub(crate) fn tree_dofs(&self) -> usize {
        self.base_dofs() + self.bodies.len() - 1
    }

    /// The joint whose coordinate moves a body against its parent.
    pub(crate) fn coordinate(&self, body: usize) -> usize {
        self.coupling.as_ref().map_or(body - 1, |coupling| coupling.law(body).column - coupling.base_dofs)
    }

    /// Number of movable, unlocked joints with a coordinate (the base is none).
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// Movable, unlocked joints with a coordinate, in the order of `v`.
    #[must_use]
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Looks up a joint by its URDF name.
    ///
    /// # Errors
    /// [`ModelError::Follows`] for a follower, otherwise [`ModelError::UnknownJoint`]; locked joints are unknown too.
    pub fn joint(&self, name: &str) -> Result<JointIndex, ModelError> {
        self.joints.iter().position(|joint| joint.name == name).map(JointIndex).ok_or_else(|| {
            if let Some(follower) = self.followers.iter().find(|follower| follower.name == name) {
                let leader = self.joints[follower.joint.0].name.clone();
                return ModelError::Follows { joint: name.to_owned(), leader };
            }
            let nearest = nearest(name, self.joints.iter().map(|joint| joint.name.as_str()));
            ModelError::UnknownJoint { name: name.to_owned(), nearest }
        })
    }

    /// Joints that others carry along (`<mimic>`), in the order in which the tree is walked.
    #[must_use]
    pub fn followers(&self) -> &[Follower] {
        &self.followers
    }

    /// Column of a joint in `v`.
    #[must_use]
    pub fn column(&self, joint: JointIndex) -> usize {
        self.base_dofs() + joint.0
    }

    /// All frames: every URDF link, also merged ones, and added frames.
    #[must_use]
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Looks up a frame by the name of its URDF link.
    ///
    /// # Errors
    /// [`ModelError::UnknownFrame`].
    pub fn frame(&self, name: &str) -> Result<FrameIndex, ModelError> {
        self.frames.iter().position(|frame| frame.name == name).map(FrameIndex).ok_or_else(|| {
            let nearest = nearest(name, self.frames.iter().map(|frame| frame.name.as_str()));
            ModelError::UnknownFrame { name: name.to_owned(), nearest }
        })
    }

    /// Frame of the root link, which is the base frame B.
    #[must_use]
    pub fn base_frame(&self) -> FrameIndex {
        FrameIndex(0)
    }

    /// The joint that moves the body to which a frame is attached, itself or by a follower; `None` if it is the base.
    #[must_use]
    pub fn joint_above(&self, frame: FrameIndex) -> Option<JointIndex> {
        match self.frames[frame.0].body {
            0 => None,
            body => Some(JointIndex(self.coordinate(body))),
        }
    }

    /// Does this joint move the frame, itself or by a follower?
    #[must_use]
    pub fn moves(&self, joint: JointIndex, frame: FrameIndex) -> bool {
        let mut body = self.frames[frame.0].body;
        while body > 0 {
            if self.coordinate(body) == joint.0 {
                return true;
            }
            body = self.bodies[body].parent;
        }
        false
    }

    /// Adds a frame at the constant pose `X_PF` in an existing one. Workspaces need not be made anew.
    pub fn add_frame(&mut self, name: &str, parent: FrameIndex, X_PF: Transform) -> FrameIndex {
        let Frame { body, placement, .. } = self.frames[parent.0];
        self.frames.push(Frame { name: name.to_owned(), body, placement: placement * X_PF });
        FrameIndex(self.frames.len() - 1)
    }

    /// Inertia of a joint's rotor seen through its gear (kg m^2, kg for a prismatic joint). It enters M's diagonal in
    /// all algorithms; the rotor's gyroscopic effects are neglected.
    pub fn set_rotor_inertia(&mut self, joint: JointIndex, kg_m2: f64) {
        let Joint { name, body, .. } = &self.joints[joint.0];
        assert!(kg_m2.is_finite() && kg_m2 >= 0.0, "rotor inertia of `{name}`: {kg_m2}");
        self.bodies[*body].rotor_inertia = kg_m2;
    }

    /// The same for a rotor that turns with a follower, as seen at the follower; its leader feels it `multiplier^2` times.
    pub fn set_follower_rotor_inertia(&mut self, follower: FollowerIndex, kg_m2: f64) {
        let Follower { name, body, .. } = &self.followers[follower.0];
        assert!(kg_m2.is_finite() && kg_m2 >= 0.0, "rotor inertia of `{name}`: {kg_m2}");
        self.bodies[*body].rotor_inertia = kg_m2;
    }

    /// Links that no real body can be, accepted with [`InertiaCheck::Tolerant`].
    #[must_use]
    pub fn impossible_links(&self) -> &[(String, InertiaError)] {
        &self.impossible_links
    }

    /// Mass of all links (kg); with a fixed base, of those that can move.
    #[must_use]
    pub fn total_mass_kg(&self) -> f64 {
        self.total_mass_kg
    }

    /// The first joint that moves nothing, nor do its followers: all below them is massless, or lies on their axes, and they
    /// have no rotors. M is then singular, so [`aba`](crate::aba) and a Cholesky factorisation have no answer. Remedy: lock
    /// it, or give it a rotor.
    #[must_use]
    pub fn massless_joint(&self) -> Option<JointIndex> {
        let n = self.bodies.len();
        let (mut below, mut is_leaf) = (vec![false; n], vec![true; n]);
        for i in (1..n).rev() {
            let body = &self.bodies[i];
            below[i] |= body.inertia.mass_kg > 0.0 || body.inertia.about_com.amax() > 0.0;
            below[body.parent] |= below[i];
            is_leaf[body.parent] = false;
        }
        let moves_nothing = |i: usize| {
            let Body { inertia, motion, rotor_inertia, .. } = &self.bodies[i];
            let alone = match motion {
                JointMotion::Revolute => inertia.about_origin()[(2, 2)],
                JointMotion::Prismatic => inertia.mass_kg,
            };
            *rotor_inertia == 0.0 && (!below[i] || (is_leaf[i] && alone == 0.0))
        };
        let mut idle = vec![true; self.joints.len()];
        (1..n).for_each(|i| idle[self.coordinate(i)] &= moves_nothing(i));
        idle.iter().position(|idle| *idle).map(JointIndex)
    }

    /// `1 / total mass` (1/kg); a fixed base that carries no mass at all has its centre of mass at O.
    pub(crate) fn per_mass(&self) -> f64 {
        if self.total_mass_kg > 0.0 { 1.0 / self.total_mass_kg } else { 0.0 }
    }

    /// Base at the world's origin, all joints at zero.
    #[must_use]
    pub fn neutral(&self) -> Configuration {
        Configuration { base: Transform::identity(), joints: DVector::zeros(self.joints.len()) }
    }
}
