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
    /// Boxes of the mesh along each edge, each cut into six tetrahedra. For a block only: a mesh file is taken as it is.
    pub cells: Option<[u32; 3]>,
    /// Cells of the grid of the levels `patches` and `winkler`, forward and sideways: one contact point at each of its corners
    /// that lies on the sole.
    pub patch_cells: [u32; 2],
    /// Multiplies Young's modulus.
    pub young_modulus_factor: f64,
    /// Coulomb friction, the same everywhere, also where `sole.toml` has a list.
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
    #[error("{}: no such sole can be built", .file.display())]
    Sole {
        /// The description.
        file: PathBuf,
        /// What is wrong.
        source: sole::SoleError,
    },
    /// The levels `rigid` and `lumped` have no contact points of the mesh. Remedy: another level, or one coefficient.
    #[error(
        "{}: friction is a list, one value per contact point: the levels rigid and lumped have none; choose sole.level patches, winkler, \
         fem or quadratic-fem, or give one number", .file.display()
    )]
    FrictionList {
        /// The description.
        file: PathBuf,
    },
    /// A list of coefficients for another sole. Planner, estimator and plant may have different contact points: the same `sole.level` and
    /// `sole.patch_cells` in all three configurations give them the same.
    #[error(
        "{}: friction has {found} values, but at this process's sole.level = \"{level}\" the sole has {expected} contact points: give as many, \
         with the same sole.level and sole.patch_cells in the configurations of planner, estimator and simulator; or one number",
        .file.display()
    )]
    FrictionCount {
        /// The description.
        file: PathBuf,
        /// Level of the process that counted.
        level: &'static str,
        /// Number of values.
        found: usize,
        /// Number of contact points.
        expected: usize,
    },
    /// Cells for a mesh that is not cut into cells.
    #[error("{key} is for a block, but the sole is the mesh {}, which is taken as it is: remove {key}", .file.display())]
    CellsOfFile {
        /// The mesh.
        file: PathBuf,
        /// Key in the process's configuration.
        key: &'static str,
    },
}
