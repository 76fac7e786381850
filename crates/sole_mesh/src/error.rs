//! Why a mesh is no sole.

use std::ops::RangeInclusive;
use thiserror::Error;

/// Longest edge of a sole's bounding box that is believed (m): from a toy's foot to a giant's. What lies within, given in millimetres or
/// centimetres, lies outside.
pub const EXTENT_M: RangeInclusive<f64> = 0.02..=1.0;
/// Most tetrahedra of a mesh: four times the finest that the docs of `sole` measure. A block of 99,360 onto 42 patches takes 5 s and 0.5 GB.
pub const ELEMENTS_MAX: usize = 100_000;

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
    /// Larger or smaller than any sole. Remedy: metres instead of millimetres or centimetres.
    #[error("the sole is {extent_m} m long, between {} and {} expected: was it given in another unit than metres?", EXTENT_M.start(), EXTENT_M.end())]
    Units {
        /// Longest edge of its bounding box, read as metres.
        extent_m: f64,
    },
    /// Finer than a computer's memory is meant for. Remedy: fewer cells; the estimator's answers differ by hundredths of a millimetre.
    #[error("{elements} tetrahedra, at most {most} expected: fewer cells, or a coarser mesh")]
    TooFine {
        /// Tetrahedra that there would be.
        elements: usize,
        /// Most that are computed.
        most: usize,
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
    /// Different nodes at one place: what they belong to is not joined there. Remedy: merge them (in Gmsh `Coherence Mesh;` or
    /// `RemoveDuplicateNodes`), or open the slit.
    #[error(
        "nodes {first} and {second} lie at the same place, as do {pairs} pairs in all: the mesh is slit there; merge coincident nodes (in Gmsh \
         Coherence Mesh), or open the slit"
    )]
    Coincident {
        /// The one.
        first: usize,
        /// The other, later in the mesh.
        second: usize,
        /// Pairs of nodes at one place, this one included.
        pairs: usize,
    },
    /// Two elements lie on the same side of a common face. Remedy: delete the copy, or remesh.
    #[error(
        "elements {first} and {second} lie on the same side of one face: they overlap, or one is a copy of the other"
    )]
    Overlap {
        /// The one.
        first: usize,
        /// The other, later in the mesh.
        second: usize,
    },
    /// The mesh falls into parts that share no face: a part that hangs on a corner or an edge can swing.
    #[error("element {element} (nodes {nodes:?}) is not connected to the largest part of the mesh by faces")]
    Disconnected {
        /// First element of a smaller part.
        element: usize,
        /// Its corners.
        nodes: [usize; 4],
    },
    /// No node is glued to the foot. Remedy: give the physical group `clamped`.
    #[error("no node is clamped to the foot")]
    NothingClamped,
    /// No node may touch the ground. Remedy: give the physical group `contact`.
    #[error("no node may touch the ground: the contact set is empty")]
    NoContactCandidate,
    /// The rigid foot would reach the ground before the foam. Remedy: turn the mesh (z points up, from the ground to the foot), or swap the
    /// groups `clamped` and `contact`.
    #[error(
        "clamped node {node} at z = {clamped_z_m} m lies below every contact candidate, the lowest of which is at {contact_z_m} m: the sole \
         is upside down (z points from the ground up to the foot)"
    )]
    UpsideDown {
        /// The lowest clamped node.
        node: usize,
        /// Its height (m).
        clamped_z_m: f64,
        /// Height of the lowest contact candidate (m).
        contact_z_m: f64,
    },
    /// A node is both clamped and a contact candidate.
    #[error("node {node} is both clamped and a contact candidate")]
    ClampedContact {
        /// The node.
        node: usize,
    },
}

impl MeshError {
    /// The nodes that it names.
    #[must_use]
    pub fn nodes(&self) -> Vec<usize> {
        match self {
            Self::NodeNotFinite { node }
            | Self::UnreferencedNode { node }
            | Self::ClampedContact { node }
            | Self::UpsideDown { node, .. } => vec![*node],
            Self::Coincident { first, second, .. } => vec![*first, *second],
            Self::BadElement { nodes, .. } | Self::Disconnected { nodes, .. } => nodes.to_vec(),
            _ => Vec::new(),
        }
    }

    /// The elements that it names.
    #[must_use]
    pub fn elements(&self) -> Vec<usize> {
        match self {
            Self::BadElement { element, .. } | Self::Disconnected { element, .. } => vec![*element],
            Self::Overlap { first, second } => vec![*first, *second],
            _ => Vec::new(),
        }
    }
}
