//! Tetrahedral meshes of the sole: nodes, elements, the clamped and the contact set.

use crate::error::{ELEMENTS_MAX, EXTENT_M, MeshError};
use spatial::{Mat3, Vec3};
use std::collections::HashMap;

/// A tetrahedral mesh of the undeformed sole in the sole frame, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Node positions (m).
    pub nodes: Vec<Vec3>,
    /// Corner nodes of each tetrahedron, positively oriented.
    pub tetrahedra: Vec<[usize; 4]>,
    /// Nodes glued to the rigid foot, ascending.
    pub clamped: Vec<usize>,
    /// Contact candidates, ascending.
    pub contact: Vec<usize>,
}

/// Which nodes may touch the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ContactSet {
    /// The nodes of the bottom face.
    #[default]
    Bottom,
    /// Every surface node that is not clamped.
    All,
}

/// Tetrahedra per hexahedral cell of a block.
const PER_CELL: usize = 6;
/// Nodes within this fraction of the mesh's size of a plane are on it: mesh files carry rounded coordinates.
const PLANE_TOLERANCE: f64 = 1e-6;

impl Mesh {
    /// Can there be a block of this size and so many cells?
    ///
    /// # Errors
    /// [`MeshError::EmptyBox`] when an edge or a cell count is not positive, [`MeshError::Units`], [`MeshError::TooFine`].
    pub fn check_box(size_m: [f64; 3], cells: [usize; 3]) -> Result<(), MeshError> {
        if size_m.iter().any(|s| !(s.is_finite() && *s > 0.0)) || cells.contains(&0) {
            return Err(MeshError::EmptyBox { size_m, cells });
        }
        check_extent(size_m.into_iter().fold(0.0, f64::max))?;
        check_count(cells.into_iter().fold(PER_CELL, usize::saturating_mul))
    }

    /// Box `size_m` centred in x and y with its bottom face at z = 0, cut into `cells` hexahedra of six Kuhn tetrahedra
    /// around the diagonal (0,0,0)-(1,1,1). Node `i + (nx+1) (j + (ny+1) k)`; the top face is clamped.
    ///
    /// # Errors
    /// As [`Mesh::check_box`].
    pub fn kuhn_box(size_m: [f64; 3], cells: [usize; 3]) -> Result<Self, MeshError> {
        Self::check_box(size_m, cells)?;
        let [nx, ny, nz] = cells;
        let node = |i: usize, j: usize, k: usize| i + (nx + 1) * (j + (ny + 1) * k);
        let mut nodes = Vec::with_capacity((nx + 1) * (ny + 1) * (nz + 1));
        for k in 0..=nz {
            for j in 0..=ny {
                for i in 0..=nx {
                    nodes.push(Vec3::new(
                        size_m[0] * (i as f64 / nx as f64 - 0.5),
                        size_m[1] * (j as f64 / ny as f64 - 0.5),
                        size_m[2] * (k as f64 / nz as f64),
                    ));
                }
            }
        }
        const PATHS: [[usize; 3]; PER_CELL] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]];
        let mut tetrahedra = Vec::with_capacity(PER_CELL * nx * ny * nz);
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    for (number, path) in PATHS.iter().enumerate() {
                        let mut corner = [i, j, k];
                        let mut element = [node(i, j, k); 4];
                        for (step, axis) in path.iter().enumerate() {
                            corner[*axis] += 1;
                            element[step + 1] = node(corner[0], corner[1], corner[2]);
                        }
                        if number >= 3 {
                            element.swap(1, 2); // odd permutations of the axes are left-handed
                        }
                        tetrahedra.push(element);
                    }
                }
            }
        }
        let layer = (nx + 1) * (ny + 1);
        let clamped = (nz * layer..(nz + 1) * layer).collect();
        let contact = (0..layer).collect();
        Self { nodes, tetrahedra, clamped, contact }.checked()
    }

    /// Every mesh passes here: not too many elements, finite nodes, the size of a sole, positive volumes, no node without an element, no
    /// two nodes at one place, no element upon another, one part connected through faces, clamped and contact sets that are there, do not meet, and are the right way up.
    ///
    /// # Errors
    /// The first defect found, with the element or node named.
    pub fn checked(mut self) -> Result<Self, MeshError> {
        self.clamped.sort_unstable();
        self.clamped.dedup();
        self.contact.sort_unstable();
        self.contact.dedup();
        check_count(self.tetrahedra.len())?;
        if let Some(node) = self.nodes.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(MeshError::NodeNotFinite { node });
        }
        check_extent(self.extent())?;
        self.check_elements()?;
        self.check_places()?;
        self.check_faces()?;
        self.check_sets()?;
        Ok(self)
    }

    /// Their corners are there, they are no flat ones, and they use every node.
    fn check_elements(&self) -> Result<(), MeshError> {
        let n = self.nodes.len();
        let mut used = vec![false; n];
        for (element, corners) in self.tetrahedra.iter().enumerate() {
            if let Some(node) = corners.iter().copied().find(|c| *c >= n) {
                return Err(MeshError::UnknownNode { element, node });
            }
            corners.iter().for_each(|c| used[*c] = true);
        }
        let extent = self.extent();
        for (element, nodes) in self.tetrahedra.iter().enumerate() {
            let volume_m3 = self.volume(element);
            let edge = self.longest_edge(element);
            // A volume below rounding of the coordinates has no sign.
            if volume_m3 <= 8.0 * f64::EPSILON * edge * edge * extent {
                return Err(MeshError::BadElement { element, nodes: *nodes, volume_m3 });
            }
        }
        match used.iter().position(|u| !u) {
            Some(node) => Err(MeshError::UnreferencedNode { node }),
            None => Ok(()),
        }
    }

    /// No two nodes at one place, other than the ends of an element's shortest edge.
    fn check_places(&self) -> Result<(), MeshError> {
        let tolerance = PLANE_TOLERANCE * self.extent();
        let mut order: Vec<usize> = (0..self.nodes.len()).collect();
        order.sort_by(|a, b| self.nodes[*a].x.total_cmp(&self.nodes[*b].x));
        let mut found: Vec<[usize; 2]> = Vec::new();
        for (i, a) in order.iter().enumerate() {
            let p = self.nodes[*a];
            let near = order[i + 1..].iter().take_while(|b| self.nodes[**b].x - p.x <= tolerance);
            found.extend(near.filter(|b| (self.nodes[**b] - p).norm() <= tolerance).map(|b| [*a.min(b), *a.max(b)]));
        }
        if !found.is_empty() {
            found.retain(|[a, b]| !self.tetrahedra.iter().any(|t| t.contains(a) && t.contains(b)));
        }
        match found.iter().min() {
            Some([first, second]) => Err(MeshError::Coincident { first: *first, second: *second, pairs: found.len() }),
            None => Ok(()),
        }
    }

    /// Each side of a face belongs to one element at most, and faces connect all elements: nodes and edges are hinges.
    fn check_faces(&self) -> Result<(), MeshError> {
        let mut owner = HashMap::with_capacity(4 * self.tetrahedra.len());
        let mut parent: Vec<usize> = (0..self.tetrahedra.len()).collect();
        for (second, t) in self.tetrahedra.iter().enumerate() {
            for face in faces(t) {
                if let Some(first) = owner.insert(turned(face), second) {
                    return Err(MeshError::Overlap { first, second });
                }
                // The neighbour sees the face from its other side.
                let [a, b, c] = face;
                if let Some(neighbour) = owner.get(&turned([a, c, b])) {
                    let (one, other) = (root(&mut parent, *neighbour), root(&mut parent, second));
                    parent[one] = other;
                }
            }
        }
        let part: Vec<usize> = (0..parent.len()).map(|element| root(&mut parent, element)).collect();
        let mut size = vec![0_usize; part.len()];
        part.iter().for_each(|root| size[*root] += 1);
        let largest = size.iter().copied().max().unwrap_or(0);
        let main = part.iter().copied().find(|root| size[*root] == largest);
        match part.iter().position(|root| Some(*root) != main) {
            Some(element) => Err(MeshError::Disconnected { element, nodes: self.tetrahedra[element] }),
            None => Ok(()),
        }
    }

    /// The clamped and the contact nodes are there, no node is both, and the ground is below the foot.
    fn check_sets(&self) -> Result<(), MeshError> {
        let lowest = |set: &[usize]| set.iter().copied().min_by(|a, b| self.nodes[*a].z.total_cmp(&self.nodes[*b].z));
        let node = lowest(&self.clamped).ok_or(MeshError::NothingClamped)?;
        let contact = lowest(&self.contact).ok_or(MeshError::NoContactCandidate)?;
        if let Some(node) = self.contact.iter().copied().find(|c| self.clamped.binary_search(c).is_ok()) {
            return Err(MeshError::ClampedContact { node });
        }
        let (clamped_z_m, contact_z_m) = (self.nodes[node].z, self.nodes[contact].z);
        if clamped_z_m < contact_z_m {
            return Err(MeshError::UpsideDown { node, clamped_z_m, contact_z_m });
        }
        Ok(())
    }

    /// Signed volume (m^3) of a tetrahedron.
    #[must_use]
    pub fn volume(&self, element: usize) -> f64 {
        let [a, b, c, d] = self.tetrahedra[element].map(|i| self.nodes[i]);
        Mat3::from_columns(&[b - a, c - a, d - a]).determinant() / 6.0
    }

    /// Longest edge (m) of a tetrahedron.
    #[must_use]
    pub fn longest_edge(&self, element: usize) -> f64 {
        let p = self.tetrahedra[element].map(|i| self.nodes[i]);
        let mut longest = 0.0_f64;
        for i in 0..4 {
            for j in 0..i {
                longest = longest.max((p[i] - p[j]).norm());
            }
        }
        longest
    }

    /// Shape quality of a tetrahedron: three times inscribed over circumscribed radius, 1 for the regular one, 0 for a flat one.
    #[must_use]
    pub fn quality(&self, element: usize) -> f64 {
        let [a, b, c, d] = self.tetrahedra[element].map(|i| self.nodes[i]);
        let area = |p: Vec3, q: Vec3, r: Vec3| 0.5 * (q - p).cross(&(r - p)).norm();
        let surface = area(a, b, c) + area(a, b, d) + area(a, c, d) + area(b, c, d);
        let volume = self.volume(element);
        let (u, v, w) = (b - a, c - a, d - a);
        let numerator =
            u.norm_squared() * v.cross(&w) + v.norm_squared() * w.cross(&u) + w.norm_squared() * u.cross(&v);
        let circumscribed = numerator.norm() / (12.0 * volume.abs());
        3.0 * (3.0 * volume / surface) / circumscribed
    }

    /// Longest edge of the bounding box (m).
    #[must_use]
    pub fn extent(&self) -> f64 {
        let (low, high) = self.bounds();
        (high - low).max()
    }

    /// Corners of the bounding box (m).
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.nodes.iter().fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)), |(low, high), p| {
            (low.inf(p), high.sup(p))
        })
    }

    /// Triangles that belong to one tetrahedron only, oriented outwards.
    #[must_use]
    pub fn surface(&self) -> Vec<[usize; 3]> {
        let mut sides = std::collections::BTreeMap::new();
        for t in &self.tetrahedra {
            for face in faces(t) {
                let mut key = face;
                key.sort_unstable();
                sides.entry(key).and_modify(|(_, count)| *count += 1).or_insert((face, 1));
            }
        }
        sides.into_values().filter(|(_, count)| *count == 1).map(|(face, _)| face).collect()
    }

    /// Replaces the contact set by all nodes of the bottom face or of the whole unclamped surface.
    ///
    /// # Errors
    /// As [`Mesh::checked`].
    pub fn with_contact(mut self, set: ContactSet) -> Result<Self, MeshError> {
        let (low, _) = self.bounds();
        let tolerance = PLANE_TOLERANCE * self.extent();
        self.contact = match set {
            ContactSet::Bottom => (0..self.nodes.len()).filter(|i| self.nodes[*i].z <= low.z + tolerance).collect(),
            ContactSet::All => self.surface().into_iter().flatten().collect(),
        };
        let clamped = std::mem::take(&mut self.clamped);
        self.contact.retain(|i| clamped.binary_search(i).is_err());
        self.clamped = clamped;
        self.checked()
    }
}

fn check_extent(extent_m: f64) -> Result<(), MeshError> {
    if EXTENT_M.contains(&extent_m) { Ok(()) } else { Err(MeshError::Units { extent_m }) }
}

fn check_count(elements: usize) -> Result<(), MeshError> {
    if elements <= ELEMENTS_MAX { Ok(()) } else { Err(MeshError::TooFine { elements, most: ELEMENTS_MAX }) }
}

/// Faces of a positively oriented tetrahedron, seen from outside.
fn faces(t: &[usize; 4]) -> [[usize; 3]; 4] {
    [[t[1], t[2], t[3]], [t[0], t[3], t[2]], [t[0], t[1], t[3]], [t[0], t[2], t[1]]]
}

/// The same side of the same face, its smallest node first.
fn turned(face: [usize; 3]) -> [usize; 3] {
    let [a, b, c] = face;
    if a < b && a < c {
        face
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

fn root(parent: &mut [usize], mut node: usize) -> usize {
    while parent[node] != node {
        parent[node] = parent[parent[node]];
        node = parent[node];
    }
    node
}
