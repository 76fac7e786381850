//! Tetrahedral meshes of the sole: nodes, elements, the clamped and the contact set.

use crate::MeshError;
use spatial::{Mat3, Vec3};

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

/// Nodes within this fraction of the mesh's size of a plane are on it: mesh files carry rounded coordinates.
const PLANE_TOLERANCE: f64 = 1e-6;

impl Mesh {
    /// Box `size_m` centred in x and y with its bottom face at z = 0, cut into `cells` hexahedra of six Kuhn tetrahedra
    /// around the diagonal (0,0,0)-(1,1,1). Node `i + (nx+1) (j + (ny+1) k)`; the top face is clamped.
    ///
    /// # Errors
    /// [`MeshError::EmptyBox`] when an edge or a cell count is not positive.
    pub fn kuhn_box(size_m: [f64; 3], cells: [usize; 3]) -> Result<Self, MeshError> {
        if size_m.iter().any(|s| !(s.is_finite() && *s > 0.0)) || cells.contains(&0) {
            return Err(MeshError::EmptyBox { size_m, cells });
        }
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
        const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]];
        let mut tetrahedra = Vec::with_capacity(6 * nx * ny * nz);
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

    /// Every mesh passes here: finite nodes, positive volumes, no node without an element, one connected part, clamped and
    /// contact sets that are there and do not meet.
    ///
    /// # Errors
    /// The first defect found, with the element or node named.
    pub fn checked(mut self) -> Result<Self, MeshError> {
        self.clamped.sort_unstable();
        self.clamped.dedup();
        self.contact.sort_unstable();
        self.contact.dedup();
        if let Some(node) = self.nodes.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(MeshError::NodeNotFinite { node });
        }
        let n = self.nodes.len();
        for (element, corners) in self.tetrahedra.iter().enumerate() {
            if let Some(node) = corners.iter().copied().find(|c| *c >= n) {
                return Err(MeshError::UnknownNode { element, node });
            }
        }
        for element in 0..self.tetrahedra.len() {
            let volume_m3 = self.volume(element);
            let edge = self.longest_edge(element);
            // A volume below rounding of the coordinates has no sign.
            if volume_m3 <= 8.0 * f64::EPSILON * edge * edge * self.extent() {
                return Err(MeshError::BadElement { element, nodes: self.tetrahedra[element], volume_m3 });
            }
        }
        let mut parent: Vec<usize> = (0..n).collect();
        let mut used = vec![false; n];
        for corners in &self.tetrahedra {
            for c in corners {
                used[*c] = true;
                let (a, b) = (root(&mut parent, corners[0]), root(&mut parent, *c));
                parent[a] = b;
            }
        }
        if let Some(node) = used.iter().position(|u| !u) {
            return Err(MeshError::UnreferencedNode { node });
        }
        let first = self.tetrahedra.first().map_or(0, |t| root(&mut parent, t[0]));
        if let Some(node) = (0..n).find(|i| root(&mut parent, *i) != first) {
            return Err(MeshError::Disconnected { node });
        }
        if self.clamped.is_empty() {
            return Err(MeshError::NothingClamped);
        }
        if self.contact.is_empty() {
            return Err(MeshError::NoContactCandidate);
        }
        if let Some(node) = self.contact.iter().copied().find(|c| self.clamped.binary_search(c).is_ok()) {
            return Err(MeshError::ClampedContact { node });
        }
        Ok(self)
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
        let mut faces = std::collections::BTreeMap::new();
        for t in &self.tetrahedra {
            for face in [[t[1], t[2], t[3]], [t[0], t[3], t[2]], [t[0], t[1], t[3]], [t[0], t[2], t[1]]] {
                let mut key = face;
                key.sort_unstable();
                faces.entry(key).and_modify(|(_, count)| *count += 1).or_insert((face, 1));
            }
        }
        faces.into_values().filter(|(_, count)| *count == 1).map(|(face, _)| face).collect()
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

fn root(parent: &mut [usize], mut node: usize) -> usize {
    while parent[node] != node {
        parent[node] = parent[parent[node]];
        node = parent[node];
    }
    node
}
