//! From URDF text to a checked tree of links and joints.

mod clean;
mod read;
mod tree;

pub use tree::Limits;
pub(crate) use tree::{Kind, Tree, TreeJoint};

use crate::error::ModelError;

/// Reads the text; every number in the result is finite and plausible, and the links form one tree.
pub(crate) fn tree(text: &str) -> Result<Tree, ModelError> {
    let document = clean::clean(text)?;
    let robot = read::read(&document)?;
    tree::Tree::build(robot, &document)
}
