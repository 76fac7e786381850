//! Links and joints as one checked tree.

use super::clean::Document;
use crate::error::{Item, ModelError, nearest};
use spatial::{Inertia, InertiaError, Mat3, Transform, Vec3, so3};
use std::collections::HashMap;

/// No robot part is longer than this (m): larger numbers are millimetres.
const LENGTH_MAX_M: f64 = 1e3;
/// No robot part is heavier than this (kg).
const MASS_MAX_KG: f64 = 1e6;
/// No robot part has a larger moment of inertia (kg m^2).
const MOMENT_MAX_KG_M2: f64 = 1e9;
/// Joint axes shorter than this have no direction (the file gives unit vectors to a few digits).
const AXIS_MIN: f64 = 1e-6;

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Fixed,
    Revolute,
    Continuous,
    Prismatic,
}

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

/// `q = multiplier * q[master] + offset`.
pub(crate) struct Mimic {
    pub master: String,
    pub multiplier: f64,
    pub offset: f64,
}

pub(crate) struct TreeJoint {
    pub name: String,
    pub kind: Kind,
    pub parent: usize,
    pub child: usize,
    /// Joint frame in the parent link.
    pub placement: Transform,
    /// Unit vector in the joint frame.
    pub axis: Vec3,
    pub limits: Limits,
    pub mimic: Option<Mimic>,
}

pub(crate) struct TreeLink {
    pub name: String,
    /// In the link's frame.
    pub inertia: Inertia,
    /// Joints below, in the file's order.
    pub children: Vec<usize>,
}

pub(crate) struct Tree {
    pub name: String,
    pub links: Vec<TreeLink>,
    pub joints: Vec<TreeJoint>,
    pub root: usize,
    /// Links that no real body can be.
    pub impossible: Vec<(String, InertiaError)>,
}

impl Tree {
    pub(super) fn build(robot: urdf_rs::Robot, document: &Document) -> Result<Self, ModelError> {
        let mut links = Vec::with_capacity(robot.links.len());
        let (mut index, mut impossible) = (HashMap::new(), Vec::new());
        for link in &robot.links {
            if index.insert(link.name.clone(), links.len()).is_some() {
                return Err(ModelError::Duplicate(Item::Link(link.name.clone())));
            }
            let (X_LC, inertia) = inertia(link)?;
            if let Err(cause) = inertia.check() {
                impossible.push((link.name.clone(), cause));
            }
            links.push(TreeLink { name: link.name.clone(), inertia: inertia.seen_from(&X_LC), children: Vec::new() });
        }
        let mut joints: Vec<TreeJoint> = Vec::with_capacity(robot.joints.len());
        let mut above: Vec<Option<usize>> = vec![None; links.len()];
        let has_limit: HashMap<&str, bool> = document
            .elements
            .iter()
            .filter_map(|element| match &element.item {
                Item::Joint(name) => Some((name.as_str(), element.has_limit)),
                _ => None,
            })
            .collect();
        let mut names = std::collections::HashSet::new();
        for joint in &robot.joints {
            if !names.insert(joint.name.as_str()) {
                return Err(ModelError::Duplicate(Item::Joint(joint.name.clone())));
            }
            let find = |link: &String| {
                index.get(link).copied().ok_or_else(|| ModelError::UnknownLink {
                    joint: joint.name.clone(),
                    link: link.clone(),
                    nearest: nearest(link, index.keys().map(String::as_str)),
                })
            };
            let (parent, child) = (find(&joint.parent.link)?, find(&joint.child.link)?);
            if let Some(other) = above[child] {
                return Err(ModelError::TwoParents {
                    link: joint.child.link.clone(),
                    first: joints[other].name.clone(),
                    second: joint.name.clone(),
                });
            }
            above[child] = Some(joints.len());
            links[parent].children.push(joints.len());
            let limited = has_limit.get(joint.name.as_str()).copied().unwrap_or(false);
            joints.push(read_joint(joint, parent, child, limited)?);
        }
        let root = root(&links, &joints, &above)?;
        Ok(Self { name: robot.name, links, joints, root, impossible })
    }
}

/// The one link from which all others are reached.
fn root(links: &[TreeLink], joints: &[TreeJoint], above: &[Option<usize>]) -> Result<usize, ModelError> {
    if links.is_empty() {
        return Err(ModelError::NoLink);
    }
    // Every link has at most one parent, so a link from which no root is reached going up lies on or below a cycle.
    for start in 0..links.len() {
        let mut link = start;
        for _ in 0..=links.len() {
            match above[link] {
                Some(joint) => link = joints[joint].parent,
                None => break,
            }
        }
        if let Some(joint) = above[link] {
            // After as many steps as there are links, the walk is on the cycle itself.
            return Err(ModelError::Cycle { link: links[link].name.clone(), joint: joints[joint].name.clone() });
        }
    }
    let roots: Vec<usize> = (0..links.len()).filter(|&link| above[link].is_none()).collect();
    match roots[..] {
        [root] => Ok(root),
        _ => Err(ModelError::SeveralRoots { roots: roots.iter().map(|&link| links[link].name.clone()).collect() }),
    }
}

fn read_joint(joint: &urdf_rs::Joint, parent: usize, child: usize, limited: bool) -> Result<TreeJoint, ModelError> {
    let unsupported = |kind| Err(ModelError::UnsupportedJoint { joint: joint.name.clone(), kind });
    let kind = match joint.joint_type {
        urdf_rs::JointType::Fixed => Kind::Fixed,
        urdf_rs::JointType::Revolute => Kind::Revolute,
        urdf_rs::JointType::Continuous => Kind::Continuous,
        urdf_rs::JointType::Prismatic => Kind::Prismatic,
        urdf_rs::JointType::Floating => return unsupported("floating"),
        urdf_rs::JointType::Planar => return unsupported("planar"),
        urdf_rs::JointType::Spherical => return unsupported("spherical"),
    };
    let item = || Item::Joint(joint.name.clone());
    let placement = pose(&joint.origin, item)?;
    let mut axis = Vec3::from(joint.axis.xyz.0);
    if kind != Kind::Fixed {
        let length = axis.norm();
        // Also refuses NaN.
        if !(AXIS_MIN..f64::INFINITY).contains(&length) {
            return Err(ModelError::Axis { joint: joint.name.clone(), length });
        }
        axis /= length;
    }
    let mimic = match &joint.mimic {
        Some(mimic) => {
            let (multiplier, offset) = (mimic.multiplier.unwrap_or(1.0), mimic.offset.unwrap_or(0.0));
            if !multiplier.is_finite() || !offset.is_finite() {
                return Err(ModelError::NotFinite { item: item(), field: "mimic" });
            }
            Some(Mimic { master: mimic.joint.clone(), multiplier, offset })
        }
        None => None,
    };
    let limits = limits(joint, kind, limited)?;
    Ok(TreeJoint { name: joint.name.clone(), kind, parent, child, placement, axis, limits, mimic })
}

fn limits(joint: &urdf_rs::Joint, kind: Kind, limited: bool) -> Result<Limits, ModelError> {
    let unlimited = Limits {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        velocity: f64::INFINITY,
        effort: f64::INFINITY,
        given: false,
    };
    if !limited || kind == Kind::Fixed {
        return Ok(unlimited);
    }
    let found = &joint.limit;
    let mut limits =
        Limits { lower: found.lower, upper: found.upper, velocity: found.velocity, effort: found.effort, given: true };
    if [limits.lower, limits.upper, limits.velocity, limits.effort].iter().any(|x| x.is_nan()) {
        return Err(ModelError::NotFinite { item: Item::Joint(joint.name.clone()), field: "limit" });
    }
    let impossible = |quantity, lower, upper| {
        Err(ModelError::ImpossibleLimits { joint: joint.name.clone(), quantity, lower, upper })
    };
    if kind == Kind::Continuous {
        (limits.lower, limits.upper) = (unlimited.lower, unlimited.upper);
    }
    if limits.lower > limits.upper {
        return impossible("position", limits.lower, limits.upper);
    }
    if limits.velocity < 0.0 {
        return impossible("velocity", -limits.velocity, limits.velocity);
    }
    if limits.effort < 0.0 {
        return impossible("effort", -limits.effort, limits.effort);
    }
    Ok(limits)
}

/// Pose of the inertial frame in the link, and the inertia in it.
fn inertia(link: &urdf_rs::Link) -> Result<(Transform, Inertia), ModelError> {
    let item = || Item::Link(link.name.clone());
    let found = &link.inertial;
    let X_LC = pose(&found.origin, item)?;
    let (mass_kg, i) = (found.mass.value, &found.inertia);
    let about_com = Mat3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    if !mass_kg.is_finite() {
        return Err(ModelError::NotFinite { item: item(), field: "mass" });
    }
    if about_com.iter().any(|x| !x.is_finite()) {
        return Err(ModelError::NotFinite { item: item(), field: "inertia" });
    }
    plausible(item, "mass", mass_kg, MASS_MAX_KG)?;
    plausible(item, "inertia", about_com.amax(), MOMENT_MAX_KG_M2)?;
    let inertia = Inertia { mass_kg, com: Vec3::zeros(), about_com };
    match inertia.check() {
        Err(cause @ InertiaError::NegativeMass(_)) => Err(ModelError::Inertia { link: link.name.clone(), cause }),
        _ => Ok((X_LC, inertia)),
    }
}

fn pose(origin: &urdf_rs::Pose, item: impl Fn() -> Item) -> Result<Transform, ModelError> {
    let (p, [roll, pitch, yaw]) = (Vec3::from(origin.xyz.0), origin.rpy.0);
    if p.iter().any(|x| !x.is_finite()) {
        return Err(ModelError::NotFinite { item: item(), field: "origin xyz" });
    }
    if ![roll, pitch, yaw].iter().all(|x| x.is_finite()) {
        return Err(ModelError::NotFinite { item: item(), field: "origin rpy" });
    }
    plausible(&item, "origin xyz", p.amax(), LENGTH_MAX_M)?;
    Ok(Transform::new(so3::from_roll_pitch_yaw(roll, pitch, yaw), p))
}

fn plausible(item: impl Fn() -> Item, field: &'static str, value: f64, limit: f64) -> Result<(), ModelError> {
    if value > limit { Err(ModelError::Absurd { item: item(), field, value, limit }) } else { Ok(()) }
}
