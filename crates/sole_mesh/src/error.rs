use thiserror::Error;

/// Why a mesh is no sole. Elements and nodes are counted from 0 in the order of the mesh.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MeshError {
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
}
