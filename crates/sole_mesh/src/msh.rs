//! Gmsh meshes, ASCII formats 2.2 and 4.1.
//!
//! Own reader: the one crate for this (mshio 0.4.2, 2020) reads 4.1 only, drops the names of physical groups, which is all that
//! matters here, and is no longer kept. Here: which nodes are clamped and which may touch. The sections are read in `msh_file`.

use crate::mesh::Mesh;
use crate::msh_error::MshError;
use crate::msh_file;
use spatial::Vec3;
use std::collections::{BTreeMap, BTreeSet};

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
