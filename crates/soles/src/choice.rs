//! What a process may replace in `sole.toml`.

use robot::SoleLevel;
use serde::Deserialize;
use std::path::PathBuf;

/// Section `[sole]` of a process's configuration; what is not given comes from the robot's `sole.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SoleChoice {
    /// How much of the sole is modelled.
    pub level: Option<SoleLevel>,
    /// Boxes of the mesh along each edge, each cut into six tetrahedra.
    pub cells: Option<[u32; 3]>,
    /// Cells of the grid of the levels `patches` and `winkler`, forward and sideways: one contact point at each of its corners.
    pub patch_cells: [u32; 2],
    /// Multiplies Young's modulus.
    pub young_modulus_factor: f64,
    /// Coulomb friction, the same everywhere.
    pub friction: Option<f64>,
}

impl Default for SoleChoice {
    fn default() -> Self {
        Self { level: None, cells: None, patch_cells: [8, 7], young_modulus_factor: 1.0, friction: None }
    }
}

/// Why there are no soles.
#[derive(Debug, thiserror::Error)]
pub enum SolesError {
    /// Mesh, material or friction cannot be.
    #[error("{}: {source}", .file.display())]
    Sole {
        /// The description.
        file: PathBuf,
        /// What is wrong.
        source: sole::SoleError,
    },
    /// One coefficient per patch is not used by the processes.
    #[error("{}: friction must be one number", .file.display())]
    FrictionList {
        /// The description.
        file: PathBuf,
    },
    /// A mesh that is not built here.
    #[error("{}: mesh.box_m and mesh.cells are needed", .file.display())]
    Mesh {
        /// The description.
        file: PathBuf,
    },
}
