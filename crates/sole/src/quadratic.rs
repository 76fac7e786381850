//! Ten-node tetrahedra: the option that does not lock.
//!
//! Every edge gets a midpoint node; shape functions `N_a = l_a (2 l_a - 1)` at corners and `N_ab = 4 l_a l_b` on edges, stiffness
//! by the four-point rule of degree 2, which is exact for straight edges. A uniform pressure puts *no* force on the corner nodes of
//! quadratic faces, so nodal contact conditions would be meaningless; the contact points are therefore the corners with the
//! *linear* hat functions of the surface as force distributions: point `a` stands for the weights `INT hat_a N_i / INT hat_a`
//! over the nodes `i`, displacement and position are the same weighted means.

use crate::{ElasticBody, Material, Mesh, SoleError, gradients};
use spatial::{Mat3, Vec3};
use std::collections::BTreeMap;

/// Edges of a tetrahedron as pairs of corners.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// The mesh with midpoints and its factorised stiffness.
pub(crate) struct QuadraticBody {
    pub(crate) body: ElasticBody,
    midpoints: BTreeMap<(usize, usize), usize>,
    pub(crate) nodes: Vec<Vec3>,
}

fn key(a: usize, b: usize) -> (usize, usize) {
    (a.min(b), a.max(b))
}

impl QuadraticBody {
    pub(crate) fn new(mesh: &Mesh, material: &Material) -> Result<Self, SoleError> {
        material.check()?;
        let mut nodes = mesh.nodes.clone();
        let mut midpoints = BTreeMap::new();
        for t in &mesh.tetrahedra {
            for [a, b] in EDGES {
                midpoints.entry(key(t[a], t[b])).or_insert_with(|| {
                    nodes.push(0.5 * (mesh.nodes[t[a]] + mesh.nodes[t[b]]));
                    nodes.len() - 1
                });
            }
        }
        let is_clamped = |i: usize| mesh.clamped.binary_search(&i).is_ok();
        let mut clamped = mesh.clamped.clone();
        // A midpoint is glued when its edge lies on the glued surface.
        for [a, b, c] in mesh.surface() {
            if is_clamped(a) && is_clamped(b) && is_clamped(c) {
                clamped.extend([midpoints[&key(a, b)], midpoints[&key(b, c)], midpoints[&key(a, c)]]);
            }
        }
        clamped.sort_unstable();
        clamped.dedup();
        let blocks = mesh.tetrahedra.iter().flat_map(|t| {
            let numbers: Vec<usize> =
                t.iter().copied().chain(EDGES.iter().map(|[a, b]| midpoints[&key(t[*a], t[*b])])).collect();
            let k = element_blocks(&t.map(|i| mesh.nodes[i]), material);
            (0..100).map(move |ab| (numbers[ab / 10], numbers[ab % 10], k[ab])).collect::<Vec<_>>()
        });
        let body = ElasticBody::from_blocks(nodes.len(), &clamped, blocks)?;
        Ok(Self { body, midpoints, nodes })
    }

    /// Weights of the contact points; see the module.
    pub(crate) fn weights(&self, mesh: &Mesh) -> Vec<Vec<(usize, f64)>> {
        let place: BTreeMap<usize, usize> = mesh.contact.iter().enumerate().map(|(i, node)| (*node, i)).collect();
        let mut weights: Vec<BTreeMap<usize, f64>> = vec![BTreeMap::new(); mesh.contact.len()];
        for face in mesh.surface() {
            if !face.iter().all(|node| place.contains_key(node)) {
                continue;
            }
            let p = face.map(|i| mesh.nodes[i]);
            let area = 0.5 * (p[1] - p[0]).cross(&(p[2] - p[0])).norm();
            for i in 0..3 {
                let (a, b, c) = (face[i], face[(i + 1) % 3], face[(i + 2) % 3]);
                let own = &mut weights[place[&a]];
                // INT l_a^i l_b^j l_c^k = 2 area i! j! k!/(i+j+k+2)!
                for (node, weight) in [
                    (a, area / 30.0),
                    (b, -area / 60.0),
                    (c, -area / 60.0),
                    (self.midpoints[&key(a, b)], 2.0 * area / 15.0),
                    (self.midpoints[&key(a, c)], 2.0 * area / 15.0),
                    (self.midpoints[&key(b, c)], area / 15.0),
                ] {
                    *own.entry(node).or_insert(0.0) += weight;
                }
            }
        }
        weights
            .into_iter()
            .map(|own| {
                let total: f64 = own.values().sum();
                own.into_iter().filter(|(_, w)| *w != 0.0).map(|(node, w)| (node, w / total)).collect()
            })
            .collect()
    }
}

/// 10 x 10 blocks of 3 x 3, row by row: corners 0-3, then [`EDGES`].
fn element_blocks(corners: &[Vec3; 4], material: &Material) -> Vec<Mat3> {
    let (g, volume) = gradients(corners);
    // Degree-2 rule: four points, one coordinate a, the others b.
    let a = (5.0 + 3.0 * 5.0_f64.sqrt()) / 20.0;
    let b = (5.0 - 5.0_f64.sqrt()) / 20.0;
    let mut blocks = vec![Mat3::zeros(); 100];
    for point in 0..4 {
        let l: [f64; 4] = std::array::from_fn(|i| if i == point { a } else { b });
        let mut gradient = [Vec3::zeros(); 10];
        for i in 0..4 {
            gradient[i] = (4.0 * l[i] - 1.0) * g[i];
        }
        for (i, [p, q]) in EDGES.iter().enumerate() {
            gradient[4 + i] = 4.0 * (l[*p] * g[*q] + l[*q] * g[*p]);
        }
        for (ij, block) in blocks.iter_mut().enumerate() {
            *block += material.block(&gradient[ij / 10], &gradient[ij % 10], 0.25 * volume);
        }
    }
    blocks
}
