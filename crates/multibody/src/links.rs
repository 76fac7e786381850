//! The links of a URDF and where their joints hold them: what a picture of the robot needs.

use crate::error::ModelError;
use crate::urdf::{self, Kind};
use spatial::{Transform, Vec3};

/// How a joint moves what it holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Not at all.
    Fixed,
    /// It turns about its axis (rad).
    Turns,
    /// It slides along its axis (m).
    Slides,
}

/// A link that a joint holds. At the position `q` of the joint its frame is at `X_PJ` followed by the turn about, or
/// the way along, `axis`.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldLink {
    /// Its name.
    pub name: String,
    /// The link that holds it.
    pub parent: String,
    /// The joint between them.
    pub joint: String,
    /// The joint's frame in the parent link.
    pub X_PJ: Transform,
    /// Unit vector in the joint's frame.
    pub axis: Vec3,
    /// How it moves.
    pub motion: Motion,
}

/// All links of a URDF but its root, in the file's order of their joints; and the root's name. Unlike a
/// [`Model`](crate::Model) it has every link, also those that are fixed to others and those without mass.
///
/// # Errors
/// [`ModelError`] names the link or joint that is wrong.
pub fn held_links(urdf: &str) -> Result<(String, Vec<HeldLink>), ModelError> {
    let tree = urdf::tree(urdf)?;
    let links = tree.joints.iter().map(|joint| HeldLink {
        name: tree.links[joint.child].name.clone(),
        parent: tree.links[joint.parent].name.clone(),
        joint: joint.name.clone(),
        X_PJ: joint.placement,
        axis: joint.axis,
        motion: match joint.kind {
            Kind::Fixed => Motion::Fixed,
            Kind::Revolute | Kind::Continuous => Motion::Turns,
            Kind::Prismatic => Motion::Slides,
        },
    });
    Ok((tree.links[tree.root].name.clone(), links.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_link_but_the_root_is_held_by_one_joint() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/hrp4/hrp4.urdf");
        let (root, links) = held_links(&std::fs::read_to_string(path).expect("it ships")).expect("it ships");
        assert_eq!(root, "body");
        let count = |motion| links.iter().filter(|link| link.motion == motion).count();
        assert_eq!((count(Motion::Turns), count(Motion::Slides)), (34, 0));
        let known = |name: &str| name == root || links.iter().any(|link| link.name == name);
        assert!(links.iter().all(|link| known(&link.parent) && (link.axis.norm() - 1.0).abs() < 1e-12));
    }
}
