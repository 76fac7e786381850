//! How well the elements of a mesh are shaped, in a few numbers.

use crate::Mesh;
use spatial::Vec3;

/// An element, its [`Mesh::quality`] and where to find it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementQuality {
    /// Element, counted from 0 in the order of the mesh.
    pub element: usize,
    /// 1 for the regular tetrahedron, 0 for a flat one.
    pub quality: f64,
    /// Mean of its corners (m).
    pub centre_m: Vec3,
}

/// Distribution of the elements' quality at its lower end, where it matters.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshQuality {
    /// How many elements lie below each of [`MeshQuality::LIMITS`].
    pub below: [usize; 3],
    /// The worst elements, worst first, [`MeshQuality::WORST`] at most.
    pub worst: Vec<ElementQuality>,
}

impl MeshQuality {
    /// Slivers (0.01), elements that cost accuracy around them (0.1), and what a mesher left unoptimised (0.3): the boxes of the tests have
    /// 0.5 and more, Gmsh's `sole_1494.msh` 0.35 and more.
    pub const LIMITS: [f64; 3] = [0.01, 0.1, 0.3];
    /// Length of the list of the worst.
    pub const WORST: usize = 5;
}

impl Mesh {
    /// Counts below limits and the worst few elements.
    #[must_use]
    pub fn quality_report(&self) -> MeshQuality {
        let mut all: Vec<ElementQuality> = (0..self.tetrahedra.len())
            .map(|element| ElementQuality {
                element,
                quality: self.quality(element),
                centre_m: self.tetrahedra[element].iter().map(|i| self.nodes[*i]).sum::<Vec3>() / 4.0,
            })
            .collect();
        all.sort_by(|a, b| a.quality.total_cmp(&b.quality));
        let below = MeshQuality::LIMITS.map(|limit| all.partition_point(|e| e.quality < limit));
        all.truncate(MeshQuality::WORST);
        MeshQuality { below, worst: all }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flattened_elements_are_counted_named_and_placed() {
        let mut mesh = Mesh::kuhn_box([0.2, 0.1, 0.03], [2, 2, 2]).expect("a box");
        let before = mesh.quality_report();
        assert_eq!(before.below, [0, 0, 0]);
        assert_eq!(before.worst.len(), MeshQuality::WORST);
        // The node in the middle moves almost into the opposite face of one of its elements: some around it go flat.
        let middle = 13;
        let flat = mesh.tetrahedra.iter().position(|t| t.contains(&middle)).expect("an element");
        let others: Vec<Vec3> =
            mesh.tetrahedra[flat].iter().filter(|i| **i != middle).map(|i| mesh.nodes[*i]).collect();
        let foot = (others[0] + others[1] + others[2]) / 3.0;
        mesh.nodes[middle] = foot + 1e-6 * (mesh.nodes[middle] - foot);
        let after = mesh.quality_report();
        let slivers = (0..mesh.tetrahedra.len()).filter(|t| mesh.quality(*t) < 0.01).count();
        assert_eq!((after.below[0], slivers), (3, 3), "{after:?}");
        for element in &after.worst[..3] {
            let corners = &mesh.tetrahedra[element.element];
            assert!(corners.contains(&middle));
            assert_eq!(element.quality, mesh.quality(element.element));
            let reach = corners.iter().map(|i| (mesh.nodes[*i] - element.centre_m).norm()).fold(0.0, f64::max);
            assert!(reach < mesh.longest_edge(element.element));
        }
        assert!(after.worst[..2].iter().any(|e| e.element == flat));
        assert!(after.worst.windows(2).all(|pair| pair[0].quality <= pair[1].quality));
    }
}
