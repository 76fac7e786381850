//! Why there is no sole.

use sole_mesh::MeshError;
use thiserror::Error;

/// Why a sole cannot be built.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SoleError {
    /// The mesh is unsound, or there is nothing to stand on.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Young's modulus must be positive, Poisson's ratio in (-1, 0.5).
    #[error("material with E = {young_modulus_pa} Pa, nu = {poisson_ratio}: E must be positive and nu in (-1, 0.5)")]
    Material {
        /// Young's modulus given (Pa).
        young_modulus_pa: f64,
        /// Poisson's ratio given.
        poisson_ratio: f64,
    },
    /// A friction coefficient must be finite and not negative.
    #[error("friction coefficient {friction} of contact point {point}: must be finite and not negative")]
    Friction {
        /// The contact point.
        point: usize,
        /// The value given.
        friction: f64,
    },
    /// Per-point values do not match the contact points.
    #[error("{found} values given for {expected} contact points")]
    Count {
        /// Number of contact points.
        expected: usize,
        /// Number of values.
        found: usize,
    },
    /// The stiffness or compliance is not positive definite: the mesh or the given compliance is degenerate.
    #[error("{matrix} is not positive definite (size {size})")]
    NotPositiveDefinite {
        /// Which matrix.
        matrix: &'static str,
        /// Its size.
        size: usize,
    },
    /// More contact points than a dense compliance is meant for. Remedy: a coarser mesh, fewer patches, or [`crate::Level::Patches`].
    #[error("{points} contact points, at most {most} expected: a coarser mesh, or the level patches")]
    TooManyPoints {
        /// Points that there would be.
        points: usize,
        /// [`crate::CONTACT_POINTS_MAX`].
        most: usize,
    },
    /// The elastic body of the mesh does not hold its contact nodes where they are said to be, so there is no picture of it. Remedy: the
    /// level [`crate::Level::Fem`], whose contact points are nodes of the mesh, and the material that the sole was built of.
    #[error(
        "contact node {node} of the mesh would be {difference_m:.1e} m from where the sole has it: only the level fem has a deformed mesh"
    )]
    OtherBody {
        /// The worst contact node.
        node: usize,
        /// How far it is off (m).
        difference_m: f64,
    },
    /// A contact patch within the sole holds no node of the fine mesh. Remedy: fewer patches, a finer mesh, or [`crate::Level::Fem`].
    #[error("patch {column}, {row} holds no mesh node: fewer patches, a finer mesh, or the level fem")]
    EmptyPatch {
        /// Its place along x.
        column: usize,
        /// Its place along y.
        row: usize,
    },
}
