//! Gmsh meshes, ASCII formats 2.2 and 4.1.
//!
//! Own reader: the one crate for this (mshio 0.4.2, 2020) reads 4.1 only, drops the names of physical groups, which is all that
//! matters here, and is no longer kept. What is read: `$PhysicalNames`, `$Entities`, `$Nodes`, `$Elements` (triangles and
//! tetrahedra, of quadratic ones the corners); other sections are skipped.

use crate::{Mesh, MeshError};
use spatial::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use std::str::{FromStr, SplitAsciiWhitespace};
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
    /// A physical group is not there.
    #[error("no physical surface group `{group}` (found: {found:?})")]
    NoGroup {
        /// The group looked for.
        group: &'static str,
        /// The groups of the file.
        found: Vec<String>,
    },
    /// No tetrahedron in the file. Remedy: save all elements, or put the volume into a physical group.
    #[error(
        "no tetrahedron in the file: put the volume into a physical group, or save all elements (in Gmsh Mesh.SaveAll = 1)"
    )]
    NoTetrahedra,
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

/// Nodes within this fraction of the extent of a plane lie on it.
const PLANE_TOLERANCE: f64 = 1e-6;

#[derive(Default)]
struct File {
    /// (dimension, tag) -> name
    names: BTreeMap<(u64, i64), String>,
    /// (dimension, entity) -> physical tags
    entities: BTreeMap<(u64, i64), Vec<i64>>,
    nodes: BTreeMap<u64, Vec3>,
    /// number, physical tags, corners
    triangles: Vec<(u64, Vec<i64>, Vec<u64>)>,
    tetrahedra: Vec<(u64, Vec<u64>)>,
}

impl Mesh {
    /// Reads a Gmsh file (format 2.2 or 4.1, ASCII), coordinates in metres in the sole frame.
    ///
    /// # Errors
    /// [`MshError`] names the section, group, node or element.
    pub fn from_msh(text: &str, sets: MshSets) -> Result<Self, MshError> {
        let file = read(text)?;
        if file.tetrahedra.is_empty() {
            return Err(MshError::NoTetrahedra);
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
        let named = |group: &str| file.names.iter().any(|((_, _), name)| name == group);
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
            let found = file.names.values().cloned().collect();
            let tag = file.names.iter().find(|((dimension, _), name)| *dimension == 2 && *name == wanted);
            let ((_, tag), _) = tag.ok_or(MshError::NoGroup { group: wanted, found })?;
            let mut set = BTreeSet::new();
            for (element, physical, corners) in &file.triangles {
                if physical.contains(tag) {
                    for node in corners {
                        set.insert(place(*element, *node)?);
                    }
                }
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

/// The numbers of one section, in order.
struct Numbers<'a> {
    section: &'static str,
    words: SplitAsciiWhitespace<'a>,
}

impl Numbers<'_> {
    fn next<T: FromStr>(&mut self, expected: &'static str) -> Result<T, MshError> {
        let malformed = MshError::Malformed { section: self.section, expected };
        self.words.next().and_then(|word| word.parse().ok()).ok_or(malformed)
    }

    fn point(&mut self) -> Result<Vec3, MshError> {
        const WHAT: &str = "three coordinates";
        Ok(Vec3::new(self.next(WHAT)?, self.next(WHAT)?, self.next(WHAT)?))
    }

    fn skip(&mut self, count: usize, expected: &'static str) -> Result<(), MshError> {
        (0..count).try_for_each(|_| self.next::<f64>(expected).map(|_| ()))
    }
}

fn section<'a>(text: &'a str, name: &'static str) -> Option<&'a str> {
    let (open, close) = (format!("${name}\n"), format!("$End{name}"));
    let start = text.find(&open)? + open.len();
    Some(&text[start..start + text[start..].find(&close)?])
}

fn numbers<'a>(text: &'a str, name: &'static str) -> Result<Numbers<'a>, MshError> {
    let body = section(text, name);
    let body = body.ok_or(MshError::Malformed { section: name, expected: "the section with its end" })?;
    Ok(Numbers { section: name, words: body.split_ascii_whitespace() })
}

fn read(text: &str) -> Result<File, MshError> {
    let text = text.replace("\r\n", "\n");
    if !text.contains("$MeshFormat\n") {
        return Err(MshError::NotGmsh);
    }
    let mut header = numbers(&text, "MeshFormat")?;
    let version: String = header.next("a version")?;
    let file_type: String = header.next("a file type")?;
    let mut file = File { names: names(&text)?, ..File::default() };
    match (version.as_str(), file_type.as_str()) {
        ("2.2" | "2", "0") => read_2(&text, &mut file)?,
        ("4.1", "0") => read_4(&text, &mut file)?,
        _ => return Err(MshError::Unsupported { version, file_type }),
    }
    Ok(file)
}

fn names(text: &str) -> Result<BTreeMap<(u64, i64), String>, MshError> {
    let Some(body) = section(text, "PhysicalNames") else { return Ok(BTreeMap::new()) };
    let malformed = || MshError::Malformed { section: "PhysicalNames", expected: "dimension, tag and quoted name" };
    body.lines()
        .skip(1)
        .filter(|line| !line.trim().is_empty())
        .map(|line| {
            let mut parts = line.trim().splitn(3, ' ');
            let dimension = parts.next().and_then(|x| x.parse().ok()).ok_or_else(malformed)?;
            let tag = parts.next().and_then(|x| x.parse().ok()).ok_or_else(malformed)?;
            let name = parts.next().ok_or_else(malformed)?.trim().trim_matches('"');
            Ok(((dimension, tag), name.to_owned()))
        })
        .collect()
}

/// Corners and all nodes of the element types that are understood; nodes of the others.
fn element_shape(kind: u64) -> Option<(Shape, usize)> {
    Some(match kind {
        1 => (Shape::Other, 2),
        2 => (Shape::Triangle, 3),
        4 => (Shape::Tetrahedron, 4),
        8 => (Shape::Other, 3),
        9 => (Shape::Triangle, 6),
        11 => (Shape::Tetrahedron, 10),
        15 => (Shape::Other, 1),
        _ => return None,
    })
}

#[derive(Clone, Copy, PartialEq)]
enum Shape {
    Triangle,
    Tetrahedron,
    Other,
}

impl File {
    fn node(&mut self, number: u64, point: Vec3) -> Result<(), MshError> {
        match self.nodes.insert(number, point) {
            None => Ok(()),
            Some(_) => Err(MshError::NodeTwice { node: number }),
        }
    }

    fn element(&mut self, shape: Shape, number: u64, physical: Vec<i64>, mut nodes: Vec<u64>) {
        match shape {
            Shape::Triangle => {
                nodes.truncate(3);
                self.triangles.push((number, physical, nodes));
            }
            Shape::Tetrahedron => {
                nodes.truncate(4);
                self.tetrahedra.push((number, nodes));
            }
            Shape::Other => {}
        }
    }

    /// Midpoints of quadratic elements are made anew where they are wanted: those of the file are dropped.
    fn drop_midpoints(&mut self, seen: &BTreeSet<u64>) {
        let corners: BTreeSet<u64> = self.tetrahedra.iter().flat_map(|(_, nodes)| nodes.iter().copied()).collect();
        self.nodes.retain(|tag, _| corners.contains(tag) || !seen.contains(tag));
    }
}

const ELEMENT: &str = "an element of a known type (line, triangle, tetrahedron, point, linear or quadratic)";

fn read_2(text: &str, file: &mut File) -> Result<(), MshError> {
    let mut input = numbers(text, "Nodes")?;
    for _ in 0..input.next::<usize>("the number of nodes")? {
        let tag = input.next("a node number")?;
        let point = input.point()?;
        file.node(tag, point)?;
    }
    let mut input = numbers(text, "Elements")?;
    let mut midpoints = BTreeSet::new();
    for _ in 0..input.next::<usize>("the number of elements")? {
        let number = input.next("an element number")?;
        let (shape, count) = element_shape(input.next("an element type")?)
            .ok_or(MshError::Malformed { section: "Elements", expected: ELEMENT })?;
        let tags: usize = input.next("the number of tags")?;
        let tags = (0..tags).map(|_| input.next("an element tag")).collect::<Result<Vec<i64>, _>>()?;
        let nodes = (0..count).map(|_| input.next("a node number")).collect::<Result<Vec<u64>, _>>()?;
        midpoints.extend(nodes.iter().skip(4).copied());
        file.element(shape, number, tags.into_iter().take(1).collect(), nodes);
    }
    file.drop_midpoints(&midpoints);
    Ok(())
}

fn read_4(text: &str, file: &mut File) -> Result<(), MshError> {
    if section(text, "Entities").is_some() {
        let mut input = numbers(text, "Entities")?;
        let counts: [usize; 4] = [
            input.next("the number of points")?,
            input.next("the number of curves")?,
            input.next("the number of surfaces")?,
            input.next("the number of volumes")?,
        ];
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let tag = input.next("an entity")?;
                input.skip(if dimension == 0 { 3 } else { 6 }, "its bounding box")?;
                let physical: usize = input.next("the number of physical groups")?;
                let groups = (0..physical).map(|_| input.next("a group")).collect::<Result<Vec<i64>, _>>()?;
                if dimension > 0 {
                    let bounding: usize = input.next("the number of bounding entities")?;
                    input.skip(bounding, "bounding entities")?;
                }
                file.entities.insert((dimension as u64, tag), groups);
            }
        }
    }
    let mut input = numbers(text, "Nodes")?;
    let blocks: usize = input.next("the number of blocks")?;
    input.skip(3, "node counts")?;
    for _ in 0..blocks {
        let dimension: usize = input.next("an entity")?;
        input.skip(1, "an entity")?;
        let parametric: usize = input.next("a parametric flag")?;
        let count: usize = input.next("the number of nodes")?;
        let tags = (0..count).map(|_| input.next("a node number")).collect::<Result<Vec<u64>, _>>()?;
        for tag in tags {
            let point = input.point()?;
            input.skip(parametric.saturating_mul(dimension), "parametric coordinates")?;
            file.node(tag, point)?;
        }
    }
    let mut input = numbers(text, "Elements")?;
    let blocks: usize = input.next("the number of blocks")?;
    input.skip(3, "element counts")?;
    let mut midpoints = BTreeSet::new();
    for _ in 0..blocks {
        let dimension: u64 = input.next("an entity")?;
        let entity: i64 = input.next("an entity")?;
        let (shape, nodes) = element_shape(input.next("an element type")?)
            .ok_or(MshError::Malformed { section: "Elements", expected: ELEMENT })?;
        let groups = file.entities.get(&(dimension, entity)).cloned().unwrap_or_default();
        for _ in 0..input.next::<usize>("the number of elements")? {
            let number = input.next("an element number")?;
            let nodes = (0..nodes).map(|_| input.next("a node number")).collect::<Result<Vec<u64>, _>>()?;
            midpoints.extend(nodes.iter().skip(4).copied());
            file.element(shape, number, groups.clone(), nodes);
        }
    }
    file.drop_midpoints(&midpoints);
    Ok(())
}
