//! Gmsh meshes, ASCII formats 2.2 and 4.1.
//!
//! Own reader: the one crate for this (mshio 0.4.2, 2020) reads 4.1 only, drops the names of physical groups, which is all that
//! matters here, and is no longer kept. Here: which nodes are clamped and which may touch. The sections are read in `msh_file`.

use crate::msh_file;
use crate::{Mesh, MeshError};
use spatial::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use thiserror::Error;

/// How clamped and contact nodes are told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MshSets {
    /// Physical surface groups named `clamped` and `contact`.
    #[default]
    Groups,
    /// The top and the bottom plane of the mesh.
    Planes,
    /// Groups where the file names them, planes otherwise.
    Either,
}

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

/// Nodes within this fraction of the extent of a plane lie on it.
const PLANE_TOLERANCE: f64 = 1e-6;
/// Names at least so similar (Jaro-Winkler, small letters) are taken for slips of the pen.
const NEAR_MISS: f64 = 0.85;

impl Mesh {
    /// Reads a Gmsh file (format 2.2 or 4.1, ASCII), coordinates in metres in the sole frame.
    ///
    /// # Errors
    /// [`MshError`] names the section, group, node or element.
    pub fn from_msh(text: &str, sets: MshSets) -> Result<Self, MshError> {
        let file = msh_file::read(text)?;
        if file.tetrahedra.is_empty() {
            let of = |wanted: u64| file.names.iter().filter(move |((dimension, _), _)| *dimension == wanted);
            let volumes = of(3).map(|(_, name)| name.clone()).collect();
            return Err(MshError::NoTetrahedra { surfaces: of(2).next().is_some(), volumes });
        }
        let tags: Vec<u64> = file.nodes.keys().copied().collect();
        let index: BTreeMap<u64, usize> = tags.iter().enumerate().map(|(i, tag)| (*tag, i)).collect();
        let nodes: Vec<Vec3> = file.nodes.values().copied().collect();
        let place = |element: u64, node: u64| index.get(&node).copied().ok_or(MshError::UnknownNode { element, node });
        let mut tetrahedra = Vec::with_capacity(file.tetrahedra.len());
        for (element, corners) in &file.tetrahedra {
            let mut t = [0; 4];
            for (slot, node) in t.iter_mut().zip(corners) {
                *slot = place(*element, *node)?;
            }
            tetrahedra.push(t);
        }
        let bare = Mesh { nodes, tetrahedra, clamped: Vec::new(), contact: Vec::new() };
        let extent_m = bare.extent();
        let surfaces =
            || file.names.iter().filter(|((dimension, _), _)| *dimension == 2).map(|(_, name)| name.as_str());
        // A name that is nearly right is a mistake, not a wish for the planes.
        let named =
            |group: &str| file.names.values().any(|name| name == group) || near_miss(group, surfaces()).is_some();
        let by_group = match sets {
            MshSets::Groups => true,
            MshSets::Planes => false,
            MshSets::Either => named("clamped") || named("contact"),
        };
        let (low, high) = bare.bounds();
        let group = |wanted: &'static str, height: f64| -> Result<Vec<usize>, MshError> {
            if !by_group {
                let on = |p: &Vec3| (p.z - height).abs() <= PLANE_TOLERANCE * extent_m;
                return Ok((0..bare.nodes.len()).filter(|i| on(&bare.nodes[*i])).collect());
            }
            let tag = file.names.iter().find(|((dimension, _), name)| *dimension == 2 && *name == wanted);
            let ((_, tag), _) = tag.ok_or_else(|| MshError::NoGroup {
                group: wanted,
                found: file.names.values().cloned().collect(),
                nearest: near_miss(wanted, surfaces()),
            })?;
            let mut set = BTreeSet::new();
            for (element, physical, corners) in &file.triangles {
                if physical.contains(tag) {
                    for node in corners {
                        set.insert(place(*element, *node)?);
                    }
                }
            }
            if set.is_empty() {
                return Err(MshError::EmptyGroup { group: wanted });
            }
            Ok(set.into_iter().collect())
        };
        let clamped = group("clamped", high.z)?;
        // Edges between both groups belong to the clamped one: a glued node cannot slide.
        let contact: Vec<usize> = group("contact", low.z)?.into_iter().filter(|i| !clamped.contains(i)).collect();
        let numbers: Vec<u64> = file.tetrahedra.iter().map(|(number, _)| *number).collect();
        Mesh { clamped, contact, ..bare }.checked().map_err(|defect| MshError::Unsound {
            nodes: defect.nodes().into_iter().map(|node| tags[node]).collect(),
            elements: defect.elements().into_iter().map(|element| numbers[element]).collect(),
            defect,
        })
    }
}

/// The name that was meant, if one of these is nearly it.
fn near_miss<'a>(wanted: &str, names: impl Iterator<Item = &'a str>) -> Option<String> {
    let similarity = |name: &str| strsim::jaro_winkler(wanted, &name.trim().to_lowercase());
    let near = names.filter(|name| *name != wanted).map(|name| (similarity(name), name));
    let near = near.filter(|(similarity, _)| *similarity >= NEAR_MISS);
    near.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name.to_owned())
}
