//! Why a mesh file is refused.

use crate::error::MeshError;
use thiserror::Error;

/// Why a mesh file is refused. Nodes and elements are named by their numbers (tags) in the file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MshError {
    /// Another kind of file, or a Gmsh file of version 1. Remedy: save the mesh as version 4.1 ASCII.
    #[error("not a Gmsh mesh of version 2.2 or 4.1: it has no section $MeshFormat")]
    NotGmsh,
    /// A section is cut short or holds something else than numbers.
    #[error("{section}: {expected} expected")]
    Malformed {
        /// The section.
        section: &'static str,
        /// What should have been there.
        expected: &'static str,
    },
    /// Binary file or another version. Remedy: save as version 4.1 or 2.2 ASCII.
    #[error(
        "MSH version {version}, {}: versions 2.2 and 4.1 in ASCII are read; in Gmsh set Mesh.MshFileVersion = 4.1 and Mesh.Binary = 0",
        if .file_type == "0" { "ASCII" } else { "binary" }
    )]
    Unsupported {
        /// Version in the file.
        version: String,
        /// 0 is ASCII.
        file_type: String,
    },
    /// A physical group is not there. Remedy: the name exactly so, in small letters, on surfaces.
    #[error(
        "no physical surface group `{group}` (found: {found:?}){}",
        .nearest.as_ref().map_or_else(String::new, |name| format!("; was `{name}` meant? rename it to `{group}`"))
    )]
    NoGroup {
        /// The group looked for.
        group: &'static str,
        /// The groups of the file.
        found: Vec<String>,
        /// A surface group whose name is nearly this one.
        nearest: Option<String>,
    },
    /// A physical group has its name and no triangle. Remedy: assign the surface to it. Format 2.2 loses the groups of all elements when
    /// everything is saved.
    #[error(
        "the physical surface group `{group}` has no triangle: assign its surfaces to it, and with version 2.2 set Mesh.SaveAll = 0, for \
         there saving everything drops the groups"
    )]
    EmptyGroup {
        /// The group.
        group: &'static str,
    },
    /// No tetrahedron in the file.
    #[error("no tetrahedron in the file: {}", why_no_tetrahedra(*.surfaces, .volumes))]
    NoTetrahedra {
        /// There are physical groups of surfaces.
        surfaces: bool,
        /// Names of the physical groups of volumes.
        volumes: Vec<String>,
    },
    /// An element of another kind, in three dimensions or on a surface. Remedy: tetrahedra; in Gmsh without recombination and without layers of
    /// an extrusion that recombine.
    #[error(
        "element {element} is a {kind}: triangles and tetrahedra are read (of higher order too, by their corners); mesh without recombination"
    )]
    OtherElement {
        /// Its number.
        element: u64,
        /// What it is, and Gmsh's number of its type.
        kind: String,
    },
    /// An element names a node that the file does not have.
    #[error("element {element} refers to node {node}, which does not exist")]
    UnknownNode {
        /// Number of the element.
        element: u64,
        /// Number of the node.
        node: u64,
    },
    /// Two nodes have one number. Remedy: number the nodes anew, as Gmsh does when it saves a file.
    #[error("there are two nodes {node}")]
    NodeTwice {
        /// Their number.
        node: u64,
    },
    /// The mesh itself is unsound.
    #[error("{defect}{}", in_the_file(.elements, .nodes))]
    Unsound {
        /// What is wrong, counted from 0.
        defect: MeshError,
        /// Numbers in the file of the nodes that it names.
        nodes: Vec<u64>,
        /// Numbers in the file of the elements that it names.
        elements: Vec<u64>,
    },
}

/// The defect counts from 0: what its elements and nodes are called in the file.
fn in_the_file(elements: &[u64], nodes: &[u64]) -> String {
    let named = [("element", elements), ("node", nodes)].into_iter().filter(|(_, numbers)| !numbers.is_empty());
    let named: Vec<String> = named
        .map(|(what, numbers)| {
            let plural = if numbers.len() == 1 { "" } else { "s" };
            let numbers: Vec<String> = numbers.iter().map(u64::to_string).collect();
            format!("{what}{plural} {}", numbers.join(", "))
        })
        .collect();
    if named.is_empty() { String::new() } else { format!(" (in the file: {})", named.join("; ")) }
}

/// Gmsh saves the elements of physical groups only as soon as there is one.
fn why_no_tetrahedra(surfaces: bool, volumes: &[String]) -> String {
    if !volumes.is_empty() {
        format!("the physical groups {volumes:?} of volumes are empty; mesh in three dimensions (gmsh -3)")
    } else if surfaces {
        "it has physical groups of surfaces but none of the volume, so Gmsh did not save it; add one, as in Physical Volume(\"sole\") = {1}"
            .to_owned()
    } else {
        "mesh in three dimensions (gmsh -3)".to_owned()
    }
}
