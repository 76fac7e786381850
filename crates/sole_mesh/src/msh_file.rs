//! The sections of a Gmsh file, ASCII formats 2.2 and 4.1: `$PhysicalNames`, `$Entities`, `$PartitionedEntities`, `$Nodes` or
//! `$ParametricNodes`, `$Elements`. Other sections are skipped.
//!
//! A physical group that is turned round against its surface has a negative number in `$Entities`: the same group. A partitioned mesh names the
//! groups of its pieces in a section of their own. Elements of higher order give their corners; what lies between is made anew where it is
//! wanted, so a curved edge becomes a straight one.

use crate::msh_error::MshError;
use spatial::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use std::str::{FromStr, SplitAsciiWhitespace};

/// What is kept of a file.
#[derive(Default)]
pub(crate) struct File {
    /// (dimension, tag) -> name
    pub(crate) names: BTreeMap<(u64, i64), String>,
    /// (dimension, entity) -> physical tags
    entities: BTreeMap<(u64, i64), Vec<i64>>,
    pub(crate) nodes: BTreeMap<u64, Vec3>,
    /// number, physical tags, corners
    pub(crate) triangles: Vec<(u64, Vec<i64>, Vec<u64>)>,
    pub(crate) tetrahedra: Vec<(u64, Vec<u64>)>,
    /// Nodes of elements of higher order that are no corners.
    between: BTreeSet<u64>,
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

pub(crate) fn read(text: &str) -> Result<File, MshError> {
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

/// What the types of elements are that can be read, and how many nodes they have.
fn shape(kind: u64) -> Option<(Shape, usize)> {
    Some(match kind {
        15 => (Shape::Point, 1),
        1 => (Shape::Line, 2),
        8 => (Shape::Line, 3),
        26 => (Shape::Line, 4),
        27 => (Shape::Line, 5),
        28 => (Shape::Line, 6),
        2 => (Shape::Triangle, 3),
        9 => (Shape::Triangle, 6),
        20 => (Shape::Triangle, 9),
        21 => (Shape::Triangle, 10),
        22 => (Shape::Triangle, 12),
        23 => (Shape::Triangle, 15),
        24 => (Shape::Triangle, 15),
        25 => (Shape::Triangle, 21),
        4 => (Shape::Tetrahedron, 4),
        11 => (Shape::Tetrahedron, 10),
        29 => (Shape::Tetrahedron, 20),
        30 => (Shape::Tetrahedron, 35),
        31 => (Shape::Tetrahedron, 56),
        _ => return None,
    })
}

/// What the others are.
fn other(kind: u64) -> &'static str {
    match kind {
        3 | 10 | 16 | 36..=41 => "quadrangle",
        5 | 12 | 17 | 92..=99 => "hexahedron",
        6 | 13 | 18 | 90 | 91 | 106..=111 => "prism",
        7 | 14 | 19 | 118..=125 => "pyramid",
        34 | 35 => "polygon or polyhedron",
        _ => "element that is not known here",
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Shape {
    Point,
    Line,
    Triangle,
    Tetrahedron,
}

impl Shape {
    fn corners(self) -> usize {
        match self {
            Self::Point => 1,
            Self::Line => 2,
            Self::Triangle => 3,
            Self::Tetrahedron => 4,
        }
    }
}

impl File {
    fn node(&mut self, number: u64, point: Vec3) -> Result<(), MshError> {
        match self.nodes.insert(number, point) {
            None => Ok(()),
            Some(_) => Err(MshError::NodeTwice { node: number }),
        }
    }

    fn element(&mut self, shape: Shape, number: u64, physical: Vec<i64>, mut nodes: Vec<u64>) {
        self.between.extend(nodes.drain(shape.corners()..));
        match shape {
            Shape::Triangle => self.triangles.push((number, physical, nodes)),
            Shape::Tetrahedron => self.tetrahedra.push((number, nodes)),
            Shape::Point | Shape::Line => {}
        }
    }

    /// Drops the nodes between the corners of elements of higher order.
    fn drop_nodes_between(&mut self) {
        let corners: BTreeSet<u64> = self.tetrahedra.iter().flat_map(|(_, nodes)| nodes.iter().copied()).collect();
        let between = std::mem::take(&mut self.between);
        self.nodes.retain(|tag, _| corners.contains(tag) || !between.contains(tag));
    }
}

fn known(kind: u64, element: u64) -> Result<(Shape, usize), MshError> {
    shape(kind).ok_or_else(|| MshError::OtherElement { element, kind: format!("{} (type {kind})", other(kind)) })
}

fn read_2(text: &str, file: &mut File) -> Result<(), MshError> {
    let parametric = section(text, "ParametricNodes").is_some();
    let mut input = numbers(text, if parametric { "ParametricNodes" } else { "Nodes" })?;
    for _ in 0..input.next::<usize>("the number of nodes")? {
        let tag = input.next("a node number")?;
        let point = input.point()?;
        if parametric {
            let dimension: u64 = input.next("the dimension of the node's entity")?;
            input.skip(1, "the node's entity")?;
            // One on a curve, two on a surface; corners and the inside have none.
            input.skip(if dimension <= 2 { dimension as usize } else { 0 }, "parametric coordinates")?;
        }
        file.node(tag, point)?;
    }
    let mut input = numbers(text, "Elements")?;
    for _ in 0..input.next::<usize>("the number of elements")? {
        let number = input.next("an element number")?;
        let (shape, count) = known(input.next("an element type")?, number)?;
        let tags: usize = input.next("the number of tags")?;
        let tags = (0..tags).map(|_| input.next("an element tag")).collect::<Result<Vec<i64>, _>>()?;
        let nodes = (0..count).map(|_| input.next("a node number")).collect::<Result<Vec<u64>, _>>()?;
        file.element(shape, number, tags.into_iter().take(1).map(i64::abs).collect(), nodes);
    }
    file.drop_nodes_between();
    Ok(())
}

fn read_4(text: &str, file: &mut File) -> Result<(), MshError> {
    for (name, partitioned) in [("Entities", false), ("PartitionedEntities", true)] {
        if section(text, name).is_some() {
            read_entities(&mut numbers(text, name)?, partitioned, file)?;
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
    for _ in 0..blocks {
        let dimension: u64 = input.next("an entity")?;
        let entity: i64 = input.next("an entity")?;
        let kind = input.next("an element type")?;
        let groups = file.entities.get(&(dimension, entity)).cloned().unwrap_or_default();
        for _ in 0..input.next::<usize>("the number of elements")? {
            let number = input.next("an element number")?;
            let (shape, nodes) = known(kind, number)?;
            let nodes = (0..nodes).map(|_| input.next("a node number")).collect::<Result<Vec<u64>, _>>()?;
            file.element(shape, number, groups.clone(), nodes);
        }
    }
    file.drop_nodes_between();
    Ok(())
}

/// Which physical groups the points, curves, surfaces and volumes belong to, whole ones or the pieces that a mesh was partitioned into.
fn read_entities(input: &mut Numbers, partitioned: bool, file: &mut File) -> Result<(), MshError> {
    if partitioned {
        input.skip(1, "the number of partitions")?;
        let ghosts: usize = input.next("the number of ghost entities")?;
        input.skip(ghosts.saturating_mul(2), "ghost entities")?;
    }
    let counts: [usize; 4] = [
        input.next("the number of points")?,
        input.next("the number of curves")?,
        input.next("the number of surfaces")?,
        input.next("the number of volumes")?,
    ];
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let tag = input.next("an entity")?;
            if partitioned {
                input.skip(2, "its parent")?;
                let partitions: usize = input.next("the number of its partitions")?;
                input.skip(partitions, "its partitions")?;
            }
            input.skip(if dimension == 0 { 3 } else { 6 }, "its bounding box")?;
            let physical: usize = input.next("the number of physical groups")?;
            let group = |input: &mut Numbers| input.next("a group").map(i64::abs);
            let groups = (0..physical).map(|_| group(input)).collect::<Result<Vec<i64>, _>>()?;
            if dimension > 0 {
                let bounding: usize = input.next("the number of bounding entities")?;
                input.skip(bounding, "bounding entities")?;
            }
            file.entities.entry((dimension as u64, tag)).or_default().extend(groups);
        }
    }
    Ok(())
}
