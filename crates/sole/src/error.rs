use thiserror::Error;

/// Why a sole cannot be built. Elements and nodes are counted from 0 in the order of the mesh.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SoleError {
    /// A box needs positive finite edges and at least one cell along each.
    #[error("box of {size_m:?} m with {cells:?} cells: edges and cell counts must be positive")]
    EmptyBox {
        /// Edges given (m).
        size_m: [f64; 3],
        /// Cell counts given.
        cells: [usize; 3],
    },
    /// A coordinate is NaN or infinite.
    #[error("node {node} has a coordinate that is not finite")]
    NodeNotFinite {
        /// The node.
        node: usize,
    },
    /// An element refers to a node that is not there.
    #[error("element {element} refers to node {node}, which does not exist")]
    UnknownNode {
        /// The element.
        element: usize,
        /// The missing node.
        node: usize,
    },
    /// An element is inverted or flat. Remedy: swap two of its corners, or remesh.
    #[error("element {element} (nodes {nodes:?}) has volume {volume_m3:e} m^3: inverted or flat")]
    BadElement {
        /// The element.
        element: usize,
        /// Its corners.
        nodes: [usize; 4],
        /// Its signed volume (m^3).
        volume_m3: f64,
    },
    /// A node belongs to no element. Remedy: save the mesh with all elements, or delete the node.
    #[error("node {node} belongs to no element")]
    UnreferencedNode {
        /// The node.
        node: usize,
    },
    /// The mesh falls into parts that share no node.
    #[error("node {node} is not connected to the first element: the mesh has more than one part")]
    Disconnected {
        /// A node of another part.
        node: usize,
    },
    /// No node is glued to the foot. Remedy: give the physical group `clamped`.
    #[error("no node is clamped to the foot")]
    NothingClamped,
    /// No node may touch the ground. Remedy: give the physical group `contact`.
    #[error("no node may touch the ground: the contact set is empty")]
    NoContactCandidate,
    /// A node is both clamped and a contact candidate.
    #[error("node {node} is both clamped and a contact candidate")]
    ClampedContact {
        /// The node.
        node: usize,
    },
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
    /// A contact patch holds no node of the fine mesh. Remedy: fewer patches or a finer mesh.
    #[error("patch {column}, {row} holds no mesh node: fewer patches or a finer mesh")]
    EmptyPatch {
        /// Its place along x.
        column: usize,
        /// Its place along y.
        row: usize,
    },
}
