//! Tetrahedral meshes of the undeformed sole, in metres and in the sole frame: origin at the centre of the undeformed bottom face, x
//! forward, z up.
//!
//! - [`Mesh::kuhn_box`]: a block. [`Mesh::from_msh`], [`Mesh::to_msh`]: a Gmsh file. [`Mesh::checked`]: every mesh passes here.
//! - [`Mesh::outline`]: what planner and controller need of a sole, a rectangle that it can carry.
//!
//! This is a crate of its own, apart from the finite elements in `sole`, because every process that reads a robot's folder meets the
//! mesh there, the 200 Hz controller too, which must not carry finite elements.

mod error;
mod mesh;
mod mesh_quality;
mod msh;
mod msh_error;
mod msh_file;
mod outline;
mod write_msh;

pub use error::{ELEMENTS_MAX, EXTENT_M, MeshError};
pub use mesh::{ContactSet, Mesh};
pub use mesh_quality::{ElementQuality, MeshQuality};
pub use msh::MshSets;
pub use msh_error::MshError;
pub use outline::Outline;
