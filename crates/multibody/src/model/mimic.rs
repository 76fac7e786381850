//! Which joints move freely, which follow others (`<mimic>`), and which are held.

use super::joint::{Follower, Joint};
use crate::error::{Item, ModelError, nearest};
use crate::urdf::{self, Kind, Tree};
use std::collections::HashMap;

/// No coupling is steeper than this (rad/rad, m/rad, rad/m): larger numbers are wrong units.
const MULTIPLIER_MAX: f64 = 1e6;

/// What decides where a joint of the tree is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Drive {
    /// A coordinate of its own.
    Free,
    /// `multiplier * q[leader] + offset`, where the leader, a joint of the tree, is free.
    Follows { leader: usize, multiplier: f64, offset: f64 },
    /// Nothing: it stays at this position.
    Held(f64),
}

/// A joint that another one carries along, as the file says it; see [`carried_joints`].
#[derive(Debug, Clone, PartialEq)]
pub struct CarriedJoint {
    /// Name in the URDF.
    pub name: String,
    /// Name of the joint that carries it, one without `<mimic>`; `None` where that is fixed or the multiplier is zero.
    pub leader: Option<String>,
    /// Its motion over the leader's.
    pub multiplier: f64,
    /// Its position (rad, m) when the leader is at zero.
    pub offset: f64,
}

/// All joints of a URDF with `<mimic>` that can move, chains resolved, in the file's order. For who shows a robot: a
/// [`Model`](crate::Model) has only those of them whose leaders the scene moves.
///
/// # Errors
/// [`ModelError`] names the link or joint that is wrong.
pub fn carried_joints(urdf: &str) -> Result<Vec<CarriedJoint>, ModelError> {
    let tree = urdf::tree(urdf)?;
    let drives = drives(&tree, &[])?;
    let carried =
        tree.joints.iter().zip(drives).filter(|(joint, _)| joint.mimic.is_some() && joint.kind != Kind::Fixed);
    let found = carried.map(|(joint, drive)| {
        let (leader, multiplier, offset) = match drive {
            Drive::Follows { leader, multiplier, offset } => {
                (Some(tree.joints[leader].name.clone()), multiplier, offset)
            }
            Drive::Held(position) => (None, 0.0, position),
            Drive::Free => unreachable!("a joint with <mimic> follows another one or is held"),
        };
        CarriedJoint { name: joint.name.clone(), leader, multiplier, offset }
    });
    Ok(found.collect())
}

/// What drives every joint of the tree. A joint is held if it is locked, or if it follows one that is locked or fixed (a
/// fixed joint is at zero), or with the multiplier zero.
pub(crate) fn drives(tree: &Tree, locked: &[(String, f64)]) -> Result<Vec<Drive>, ModelError> {
    let index: HashMap<&str, usize> =
        tree.joints.iter().enumerate().map(|(k, joint)| (joint.name.as_str(), k)).collect();
    let similar = |name: &str| nearest(name, index.keys().copied());
    let mut held = vec![None; tree.joints.len()];
    for (name, position) in locked {
        let joint = *index
            .get(name.as_str())
            .ok_or_else(|| ModelError::UnknownJoint { name: name.clone(), nearest: similar(name) })?;
        if !position.is_finite() {
            return Err(ModelError::NotFinite { item: Item::Joint(name.clone()), field: "locked position" });
        }
        held[joint] = Some(*position);
    }
    let leader_of = |joint: usize| {
        let Some(mimic) = &tree.joints[joint].mimic else { return Ok(None) };
        let found = index.get(mimic.master.as_str()).copied().ok_or_else(|| ModelError::UnknownLeader {
            joint: tree.joints[joint].name.clone(),
            leader: mimic.master.clone(),
            nearest: similar(&mimic.master),
        });
        found.map(|leader| Some((leader, mimic)))
    };
    let stays = |joint: usize| if tree.joints[joint].kind == Kind::Fixed { Some(0.0) } else { held[joint] };
    let drive = |joint: usize| {
        let (mut leader, mut multiplier, mut offset) = (joint, 1.0, 0.0);
        // A chain that visits more joints than there are is a circle.
        for _ in 0..=tree.joints.len() {
            let end = if let Some(position) = stays(leader) {
                Drive::Held(multiplier * position + offset)
            } else if let Some((next, mimic)) = leader_of(leader)? {
                (multiplier, offset) = (multiplier * mimic.multiplier, multiplier * mimic.offset + offset);
                leader = next;
                continue;
            } else if leader == joint {
                Drive::Free
            } else if multiplier == 0.0 {
                Drive::Held(offset)
            } else {
                Drive::Follows { leader, multiplier, offset }
            };
            return plausible(&tree.joints[joint].name, end);
        }
        Err(ModelError::MimicCycle { joint: tree.joints[joint].name.clone() })
    };
    let drives = (0..tree.joints.len()).map(drive).collect::<Result<Vec<_>, _>>()?;
    // Only a lock can hold a follower while its leader moves.
    for joint in (0..tree.joints.len()).filter(|&joint| held[joint].is_some() && tree.joints[joint].kind != Kind::Fixed)
    {
        let Some((leader, mimic)) = leader_of(joint)? else { continue };
        if mimic.multiplier != 0.0 && !matches!(drives[leader], Drive::Held(_)) {
            let (joint, leader) = (tree.joints[joint].name.clone(), mimic.master.clone());
            return Err(ModelError::LockedFollower { joint, leader });
        }
    }
    Ok(drives)
}

/// Products along a chain may overflow, whatever its members are.
fn plausible(joint: &str, drive: Drive) -> Result<Drive, ModelError> {
    let item = || Item::Joint(joint.to_owned());
    let (multiplier, offset) = match drive {
        Drive::Free => return Ok(drive),
        Drive::Follows { multiplier, offset, .. } => (multiplier, offset),
        Drive::Held(position) => (0.0, position),
    };
    if !multiplier.is_finite() || !offset.is_finite() {
        return Err(ModelError::NotFinite { item: item(), field: "position that follows from <mimic>" });
    }
    if multiplier.abs() > MULTIPLIER_MAX {
        let value = multiplier.abs();
        return Err(ModelError::Absurd { item: item(), field: "mimic multiplier", value, limit: MULTIPLIER_MAX });
    }
    Ok(drive)
}

/// Narrows what a joint may do to what its follower allows. Efforts are left alone: a follower has no motor, and what it
/// transmits does not follow from the leader's effort alone.
pub(crate) fn narrow(leader: &mut Joint, follower: &Follower) -> Result<(), ModelError> {
    let Follower { limits, multiplier, offset, .. } = follower;
    let (a, b) = ((limits.lower - offset) / multiplier, (limits.upper - offset) / multiplier);
    let found = &mut leader.limits;
    let (lower, upper) = (found.lower.max(a.min(b)), found.upper.min(a.max(b)));
    if lower > upper {
        return Err(ModelError::MimicLimits {
            joint: follower.name.clone(),
            leader: leader.name.clone(),
            needed: [a.min(b), a.max(b)],
            allowed: [found.lower, found.upper],
        });
    }
    (found.lower, found.upper) = (lower, upper);
    found.velocity = found.velocity.min(limits.velocity / multiplier.abs());
    found.given |= limits.given;
    Ok(())
}
