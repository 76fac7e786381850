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
    /// A contact patch within the sole holds no node of the fine mesh. Remedy: fewer patches, a finer mesh, or [`crate::Level::Fem`].
    #[error("patch {column}, {row} holds no mesh node: fewer patches, a finer mesh, or the level fem")]
    EmptyPatch {
        /// Its place along x.
        column: usize,
        /// Its place along y.
        row: usize,
    },
}
