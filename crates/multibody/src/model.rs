//! The constant description of a robot, built once.

use crate::coupling::{Coupling, Law};
use crate::error::nearest;
use crate::mimic::{self, Drive};
use crate::rigid::Symmetric;
use crate::urdf::{self, Kind, Tree, TreeJoint};
use crate::{Configuration, ModelError};
use nalgebra::DVector;
use spatial::{Inertia, InertiaError, Mat3, Transform, Vec3, so3};
use std::collections::HashMap;

/// More movable joints than this make dense matrices of gigabytes.
const JOINTS_MAX: usize = 2000;

/// What the root link is attached to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Base {
    /// Nothing: six degrees of freedom.
    #[default]
    Floating,
    /// The world: the base pose in [`Configuration`] says where, and does not move.
    Fixed,
}

/// What to do with links that no real body can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InertiaCheck {
    /// Refuse the robot, naming the link.
    #[default]
    Strict,
    /// Accept the robot, and list such links in [`Model::impossible_links`], as long as every *body* (a link with all that
    /// is fixed to it) has positive principal moments, so that M stays positive definite. Every fourth public URDF needs
    /// this: placeholders on massless sensor links, misplaced digits.
    Tolerant,
}

/// How a URDF becomes a [`Model`].
#[derive(Debug, Clone, PartialEq)]
pub struct ModelOptions {
    /// What the root link is attached to.
    pub base: Base,
    /// Joints that this scene does not move, with the position (rad, m) at which they are merged into their parents. A joint
    /// that mimics a locked one is locked with it, at `multiplier * position + offset`, unless it is listed itself.
    pub locked_joints: Vec<(String, f64)>,
    /// Acceleration of free fall (m/s^2), world axes.
    pub gravity: Vec3,
    /// What to do with links that no real body can be.
    pub inertia: InertiaCheck,
}

impl Default for ModelOptions {
    fn default() -> Self {
        Self {
            base: Base::Floating,
            locked_joints: Vec::new(),
            gravity: Vec3::new(0.0, 0.0, -9.81),
            inertia: InertiaCheck::default(),
        }
    }
}

/// Position of a joint in [`Model::joints`]; its column in `v` is `model.base_dofs() + index`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JointIndex(pub usize);

/// Position of a joint in [`Model::followers`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FollowerIndex(pub usize);

/// Position of a frame in [`Model::frames`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FrameIndex(pub usize);

/// What a joint may do, as the file says; infinite where the file says nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Lowest position (rad, m).
    pub lower: f64,
    /// Highest position (rad, m).
    pub upper: f64,
    /// Largest speed (rad/s, m/s).
    pub velocity: f64,
    /// Largest torque or force (N m, N).
    pub effort: f64,
    /// The file has limits for this joint.
    pub given: bool,
}

/// What a joint's coordinate measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointMotion {
    /// A rotation about the axis (rad).
    Revolute,
    /// A displacement along the axis (m).
    Prismatic,
}

/// A movable joint with a coordinate of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name in the URDF.
    pub name: String,
    /// What its coordinate measures.
    pub motion: JointMotion,
    /// What it may do; position and speed also such that its followers stay within their limits.
    pub limits: Limits,
    /// The body that it moves, beside those of its followers.
    pub(crate) body: usize,
}

/// A joint that another one carries along (`<mimic>`): it is at `multiplier * q[joint] + offset` and has no coordinate.
#[derive(Debug, Clone, PartialEq)]
pub struct Follower {
    /// Name in the URDF.
    pub name: String,
    /// What its position measures.
    pub motion: JointMotion,
    /// What the file says of it; the leader's position and speed are bounded accordingly.
    pub limits: Limits,
    /// The joint that it follows. Chains of followers are resolved: this one has a coordinate.
    pub joint: JointIndex,
    /// Its motion over the leader's; never zero.
    pub multiplier: f64,
    /// Its position (rad, m) when the leader is at zero.
    pub offset: f64,
    /// The body that it moves.
    pub(crate) body: usize,
}

impl Follower {
    /// Where it is (rad, m).
    #[must_use]
    pub fn position(&self, q: &Configuration) -> f64 {
        self.multiplier * q.joints[self.joint.0] + self.offset
    }
}

/// A named frame, rigidly attached to a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Name of the URDF link, or the one given to [`Model::add_frame`].
    pub name: String,
    pub(crate) body: usize,
    /// Pose in the body's frame.
    pub(crate) placement: Transform,
}

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
    fn massless(parent: usize, motion: JointMotion, placement: Transform) -> Self {
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
    /// Reads a URDF. Joints are ordered depth first, children in the file's order. A joint with `<mimic>` is none of them but
    /// one of [`Model::followers`]; where its leader cannot move, or with the multiplier zero, it is merged as a fixed one is.
    ///
    /// # Errors
    /// [`ModelError`] names the link or joint that is wrong.
    pub fn from_urdf(text: &str, options: &ModelOptions) -> Result<Self, ModelError> {
        let tree = urdf::tree(text)?;
        if let (InertiaCheck::Strict, Some((link, cause))) = (options.inertia, tree.impossible.first()) {
            return Err(ModelError::Inertia { link: link.clone(), cause: *cause });
        }
        let drives = mimic::drives(&tree, &options.locked_joints)?;
        let mut model = Self {
            name: tree.name.clone(),
            base: options.base,
            gravity: options.gravity,
            total_mass_kg: 0.0,
            joints: Vec::new(),
            followers: Vec::new(),
            coupling: None,
            bodies: vec![Body::massless(0, JointMotion::Revolute, Transform::identity())],
            frames: Vec::new(),
            impossible_links: tree.impossible.clone(),
        };
        // Depth first with an explicit stack of joints to cross: a chain of any length is read.
        let (mut pending, mut movers) = (Vec::new(), Vec::new());
        model.add_link(&tree, tree.root, 0, Transform::identity(), &mut pending);
        while let Some((joint, body, X_BJ)) = pending.pop() {
            let child = tree.joints[joint].child;
            let (below, X_BL) = model.attach(&tree.joints[joint], drives[joint], body, X_BJ);
            if below != body {
                movers.push(joint);
            }
            model.add_link(&tree, child, below, X_BL, &mut pending);
        }
        if model.bodies.len() > JOINTS_MAX + 1 {
            return Err(ModelError::TooManyJoints { found: model.bodies.len() - 1, limit: JOINTS_MAX });
        }
        model.add_joints(&tree, &drives, &movers)?;
        model.refuse_indefinite_bodies()?;
        if model.base == Base::Fixed {
            // What is attached to the world is part of the world.
            model.bodies[0].inertia = Inertia::zero();
        }
        for body in &mut model.bodies {
            body.first_moment = body.inertia.mass_kg * body.inertia.com;
            body.about_origin = Symmetric::of(&body.inertia.about_origin());
        }
        model.total_mass_kg = model.bodies.iter().map(|body| body.inertia.mass_kg).sum();
        if model.base == Base::Floating && model.total_mass_kg == 0.0 {
            return Err(ModelError::NoMass);
        }
        Ok(model)
    }

    /// Makes a link part of a body and puts the joints below it on the stack, the first one on top.
    fn add_link(
        &mut self,
        tree: &Tree,
        link: usize,
        body: usize,
        X_BL: Transform,
        pending: &mut Vec<(usize, usize, Transform)>,
    ) {
        let link = &tree.links[link];
        let inertia = &mut self.bodies[body].inertia;
        *inertia = inertia.joined(&link.inertia.seen_from(&X_BL));
        self.frames.push(Frame { name: link.name.clone(), body, placement: X_BL });
        pending.extend(link.children.iter().rev().map(|&joint| (joint, body, X_BL * tree.joints[joint].placement)));
    }

    /// Where the child link of a joint goes: into the same body if it does not move, else into a new one.
    fn attach(&mut self, joint: &TreeJoint, drive: Drive, body: usize, X_BJ: Transform) -> (usize, Transform) {
        let Some(motion) = motion(joint.kind) else { return (body, X_BJ) };
        if let Drive::Held(position) = drive {
            let X_JL = match motion {
                JointMotion::Revolute => Transform::new(so3::exp(&(joint.axis * position)), Vec3::zeros()),
                JointMotion::Prismatic => Transform::from_translation(joint.axis * position),
            };
            return (body, X_BJ * X_JL);
        }
        let R_JA = with_z_along(&joint.axis);
        let placement = Transform::new(X_BJ.rotation * R_JA, X_BJ.translation);
        self.bodies.push(Body::massless(body, motion, placement));
        (self.bodies.len() - 1, Transform::new(R_JA.transpose(), Vec3::zeros()))
    }

    /// Joints and followers, in the order of the bodies that they move.
    fn add_joints(&mut self, tree: &Tree, drives: &[Drive], movers: &[usize]) -> Result<(), ModelError> {
        let mut index = HashMap::new();
        for (k, &mover) in movers.iter().enumerate() {
            let TreeJoint { name, kind, limits, .. } = &tree.joints[mover];
            if matches!(drives[mover], Drive::Free) {
                // A follower needs no limits: its range follows from its leader's.
                if *kind != Kind::Continuous && !limits.given {
                    return Err(ModelError::MissingLimits { joint: name.clone() });
                }
                index.insert(mover, self.joints.len());
                let motion = self.bodies[k + 1].motion;
                self.joints.push(Joint { name: name.clone(), motion, limits: *limits, body: k + 1 });
            }
        }
        let base_dofs = self.base_dofs();
        let mut laws: Vec<Law> = (0..base_dofs).map(Law::of_itself).collect();
        for (k, &mover) in movers.iter().enumerate() {
            let Drive::Follows { leader, multiplier, offset } = drives[mover] else {
                laws.push(Law::of_itself(base_dofs + index[&mover]));
                continue;
            };
            let (body, joint) = (k + 1, index[&leader]);
            let (name, limits, motion) =
                (tree.joints[mover].name.clone(), tree.joints[mover].limits, self.bodies[body].motion);
            let follower = Follower { name, motion, limits, joint: JointIndex(joint), multiplier, offset, body };
            mimic::narrow(&mut self.joints[joint], &follower)?;
            self.followers.push(follower);
            laws.push(Law { column: base_dofs + joint, multiplier, offset });
        }
        if !self.followers.is_empty() {
            self.coupling = Some(Coupling { base_dofs, nv: self.nv(), laws });
        }
        Ok(())
    }

    /// Even a tolerated robot must have a positive definite M.
    fn refuse_indefinite_bodies(&self) -> Result<(), ModelError> {
        for (link, _) in &self.impossible_links {
            let frame = self.frames.iter().find(|frame| frame.name == *link).expect("every link is a frame");
            if let Err(cause @ InertiaError::NegativeMoment(_)) = self.bodies[frame.body].inertia.check() {
                return Err(ModelError::Inertia { link: link.clone(), cause });
            }
        }
        Ok(())
    }

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

/// What a joint of this kind does; `None` if nothing.
fn motion(kind: Kind) -> Option<JointMotion> {
    match kind {
        Kind::Fixed => None,
        Kind::Revolute | Kind::Continuous => Some(JointMotion::Revolute),
        Kind::Prismatic => Some(JointMotion::Prismatic),
    }
}

/// A rotation whose third column is the unit vector `axis`; exact (a permutation with signs) along coordinate axes.
fn with_z_along(axis: &Vec3) -> Mat3 {
    let x = Vec3::ith(axis.iamin(), 1.0).cross(axis).normalize();
    Mat3::from_columns(&[x, axis.cross(&x), *axis])
}
