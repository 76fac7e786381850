//! From a checked tree of links and joints to bodies: what is fixed or locked is merged.

use super::body::Body;
use super::coupling::{Coupling, Law};
use super::joint::{Follower, Joint, JointIndex, JointMotion};
use super::mimic::{self, Drive};
use super::options::{Base, InertiaCheck, ModelOptions};
use super::{Frame, Model};
use crate::error::ModelError;
use crate::rigid::Symmetric;
use crate::urdf::{self, Kind, Tree, TreeJoint};
use spatial::{Inertia, InertiaError, Mat3, Transform, Vec3, so3};
use std::collections::HashMap;

/// More movable joints than this make dense matrices of gigabytes.
const JOINTS_MAX: usize = 2000;

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
