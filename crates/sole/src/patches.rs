//! Contact patches: a fine mesh condensed onto a coarse grid (method 2.6, beyond the paper).

use crate::{Mesh, MeshError, SoleError};
use nalgebra::Vector2;
use spatial::polygon::{convex_hull, distance_outside};
use spatial::{Mat6, Vec3};
use std::collections::BTreeMap;

/// Farther outside a patch lies beyond the sole (m): rounding puts those of a block's edge no farther.
const ON_THE_EDGE_M: f64 = 1e-9;

/// Patches as weighted nodes.
pub(crate) struct Grid {
    /// (node, weight) of each patch; the weights of a patch sum to one.
    pub(crate) weights: Vec<Vec<(usize, f64)>>,
    /// Share of the contact area.
    shares: Vec<f64>,
}

impl Grid {
    /// Where the patches act, and their share of the area.
    pub(crate) fn points(&self, mesh: &Mesh) -> Vec<(Vec3, f64)> {
        let place = |patch: &Vec<(usize, f64)>| patch.iter().map(|(node, weight)| *weight * mesh.nodes[*node]).sum();
        self.weights.iter().map(place).zip(self.shares.iter().copied()).collect()
    }
}

impl Grid {
    /// The same patches over contact points that are weighted means themselves (`hats`, in the order of the mesh's contact nodes).
    pub(crate) fn over(&self, mesh: &Mesh, hats: &[Vec<(usize, f64)>]) -> Vec<Vec<(usize, f64)>> {
        let patch = |own: &Vec<(usize, f64)>| {
            let mut sum = BTreeMap::new();
            for (node, weight) in own {
                let place = mesh.contact.binary_search(node).expect("patches are made of contact nodes");
                for (part, share) in &hats[place] {
                    *sum.entry(*part).or_insert(0.0) += weight * share;
                }
            }
            sum.into_iter().collect()
        };
        self.weights.iter().map(patch).collect()
    }
}

/// The four corners of the contact nodes' bounding rectangle, a quarter each.
pub(crate) fn corners(mesh: &Mesh) -> Vec<(Vec3, f64)> {
    let nodes = || mesh.contact.iter().map(|i| mesh.nodes[*i]);
    let low = nodes().fold(Vec3::repeat(f64::INFINITY), |a, b| a.inf(&b));
    let high = nodes().fold(Vec3::repeat(f64::NEG_INFINITY), |a, b| a.sup(&b));
    let corner = |x: f64, y: f64| (Vec3::new(x, y, low.z), 0.25);
    vec![corner(low.x, low.y), corner(high.x, low.y), corner(low.x, high.y), corner(high.x, high.y)]
}

/// Four points whose springs have the same vertical, roll and pitch stiffness as a bonded sole, a quarter each.
pub(crate) fn equivalent_corners(bonded: &Mat6) -> Vec<(Vec3, f64)> {
    let vertical = bonded[(2, 2)];
    let (x, y) = ((bonded[(4, 4)] / vertical).sqrt(), (bonded[(3, 3)] / vertical).sqrt());
    [(-x, -y), (x, -y), (-x, y), (x, y)].into_iter().map(|(x, y)| (Vec3::new(x, y, 0.0), 0.25)).collect()
}

/// For each point of a grid of `cells` over the bottom face the mesh nodes it stands for with weights
/// `a_i N_j(x_i) / sum_i a_i N_j(x_i)`: nodal area times bilinear hat, normalised. A patch's position and displacement are the
/// weighted means of its nodes', its force is spread with the same weights, so work is the same on both levels. Where a round sole does not
/// reach, beyond the hull of its contact nodes, there is no node and no patch; the weights of the others still divide the whole area.
pub(crate) fn weights(mesh: &Mesh, cells: [usize; 2]) -> Result<Grid, SoleError> {
    let (low, high) = mesh.contact.iter().fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(low, high), i| {
        let p = mesh.nodes[*i];
        ([low[0].min(p.x), low[1].min(p.y)], [high[0].max(p.x), high[1].max(p.y)])
    });
    if cells.contains(&0) {
        return Err(MeshError::EmptyBox {
            size_m: [high[0] - low[0], high[1] - low[1], 0.0],
            cells: [cells[0], cells[1], 1],
        }
        .into());
    }
    let mut area = vec![0.0; mesh.nodes.len()];
    let mut is_contact = vec![false; mesh.nodes.len()];
    for node in &mesh.contact {
        is_contact[*node] = true;
    }
    for [a, b, c] in mesh.surface() {
        if is_contact[a] && is_contact[b] && is_contact[c] {
            let p = [a, b, c].map(|i| mesh.nodes[i]);
            let third = (p[1] - p[0]).cross(&(p[2] - p[0])).norm() / 6.0;
            for i in [a, b, c] {
                area[i] += third;
            }
        }
    }
    // Value of hat `index` of `count` cells at the coordinate `s` in [0, count].
    let hat = |s: f64, index: usize| (1.0 - (s - index as f64).abs()).max(0.0);
    let mut patches = Vec::with_capacity((cells[0] + 1) * (cells[1] + 1));
    let mut shares = Vec::with_capacity(patches.capacity());
    let whole: f64 = area.iter().sum();
    let hull = convex_hull(mesh.contact.iter().map(|i| mesh.nodes[*i].xy()));
    for j in 0..=cells[1] {
        for i in 0..=cells[0] {
            let mut patch = Vec::new();
            for node in &mesh.contact {
                let p = mesh.nodes[*node];
                let s = cells[0] as f64 * (p.x - low[0]) / (high[0] - low[0]);
                let t = cells[1] as f64 * (p.y - low[1]) / (high[1] - low[1]);
                let weight = area[*node] * hat(s, i) * hat(t, j);
                if weight > 0.0 {
                    patch.push((*node, weight));
                }
            }
            let total: f64 = patch.iter().map(|(_, weight)| weight).sum();
            if patch.is_empty() {
                let along =
                    |axis: usize, k: usize| low[axis] + (high[axis] - low[axis]) * k as f64 / cells[axis] as f64;
                let place = Vector2::new(along(0, i), along(1, j));
                if distance_outside(hull.iter().copied(), hull.iter().copied(), &place) > ON_THE_EDGE_M {
                    continue;
                }
                return Err(SoleError::EmptyPatch { column: i, row: j });
            }
            for (_, weight) in &mut patch {
                *weight /= total;
            }
            shares.push(total / whole);
            patches.push(patch);
        }
    }
    Ok(Grid { weights: patches, shares })
}
