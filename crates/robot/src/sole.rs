//! `sole.toml`: the soft sole under each foot.

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The soft sole of the **left** foot; the right one is its mirror image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SoleDescription {
    /// Coulomb friction against the ground.
    pub friction: Friction,
    /// Nodes that may touch the ground.
    #[serde(default)]
    pub contact: ContactSet,
    /// Finite elements.
    pub mesh: MeshDescription,
    /// Linear elastic foam.
    pub material: MaterialDescription,
    /// Where the foot holds the sole.
    pub foot: FootMounting,
    /// How it is computed.
    #[serde(default)]
    pub solver: SolverDescription,
}

impl SoleDescription {
    /// The mesh that this description, read from `sole_file`, names: paths are relative to the file in which they stand.
    #[must_use]
    pub fn mesh_file(&self, sole_file: &Path) -> Option<PathBuf> {
        self.mesh.file.as_ref().map(|name| sole_file.parent().unwrap_or(Path::new(".")).join(name))
    }
}

/// Largest friction coefficient that is believed: dry rubber has about 1, sticky gels a few. The contact solver is tested up to here, and a
/// number beyond it is no friction but another quantity.
pub const FRICTION_MAX: f64 = 10.0;

/// Coulomb friction coefficient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number, or a list of numbers, one per contact point")]
pub enum Friction {
    /// The same everywhere.
    Uniform(f64),
    /// One per contact point of the left sole, in the order in which the level has them: the levels `patches` and `winkler` row by row from
    /// the right rear corner, x running fastest, without those beyond a round sole; `fem` and `quadratic-fem` in the mesh's order of its contact nodes. The right sole has
    /// the mirrored ones. The level `lumped` has no such points, `rigid` no such friction.
    PerPatch(Vec<f64>),
}

impl Friction {
    /// The smallest coefficient there is.
    #[must_use]
    pub fn smallest(&self) -> f64 {
        match self {
            Self::Uniform(mu) => *mu,
            Self::PerPatch(list) => list.iter().copied().fold(f64::INFINITY, f64::min),
        }
    }
}

/// Nodes that may touch the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContactSet {
    /// Those of the bottom face.
    #[default]
    Bottom,
    /// Those of the whole free surface.
    All,
}

/// A block of structured tetrahedra, or a mesh file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshDescription {
    /// Edges of the block (m): forward, sideways, thickness.
    pub box_m: Option<[f64; 3]>,
    /// Boxes along each edge, each cut into six Kuhn tetrahedra.
    pub cells: Option<[u32; 3]>,
    /// Instead: a Gmsh file (ASCII, format 4.1 or 2.2, metres) with the origin at the centre of the undeformed bottom face; relative to
    /// this file. Physical surface groups `clamped` and `contact` say which nodes are glued to the foot and which may touch the ground;
    /// without them they are those of the top and the bottom plane.
    pub file: Option<String>,
}

/// Linear elastic foam.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialDescription {
    /// Young's modulus (Pa).
    pub young_modulus_pa: f64,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
}

/// Where the foot holds the sole.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FootMounting {
    /// Ankle in the sole frame (m): from the centre of the undeformed bottom face, axes of the foot.
    pub ankle_in_sole_m: [f64; 3],
}

impl FootMounting {
    /// Ankle in the sole frame of the left (0) or right (1) foot (m).
    #[must_use]
    pub fn ankle_in_sole_m(&self, foot: usize) -> [f64; 3] {
        let [x, y, z] = self.ankle_in_sole_m;
        [[x, y, z], [x, -y, z]][foot]
    }
}

/// How much of the sole is modelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SoleLevel {
    /// Not at all.
    Rigid,
    /// One spring with six degrees of freedom.
    Lumped,
    /// Independent springs.
    Winkler,
    /// Finite elements condensed on the contact nodes.
    #[default]
    Fem,
    /// The same with quadratic tetrahedra, which do not lock.
    QuadraticFem,
    /// A fine mesh condensed on coarse contact patches.
    Patches,
    /// Quadratic tetrahedra condensed on coarse contact patches.
    QuadraticPatches,
}

/// How it is computed where nothing else is said.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolverDescription {
    /// How much of the sole is modelled.
    pub level: SoleLevel,
}
