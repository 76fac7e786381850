//! Meshes for Gmsh.

use crate::Mesh;
use std::fmt::Write;

impl Mesh {
    /// The mesh as a Gmsh file (format 2.2, ASCII, metres) with the groups `clamped`, `contact` and `sole`; every coordinate is written
    /// with all its digits. [`Mesh::from_msh`] reads the same mesh, to the bit, if the contact points are the corners of whole triangles of
    /// the surface, as those of a block are.
    #[must_use]
    pub fn to_msh(&self) -> String {
        let mut text = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n");
        text += "$PhysicalNames\n3\n2 1 \"clamped\"\n2 2 \"contact\"\n3 3 \"sole\"\n$EndPhysicalNames\n";
        let mut line =
            |arguments: std::fmt::Arguments| writeln!(text, "{arguments}").expect("a text can be written to");
        line(format_args!("$Nodes\n{}", self.nodes.len()));
        for (i, p) in self.nodes.iter().enumerate() {
            line(format_args!("{} {:e} {:e} {:e}", i + 1, p.x, p.y, p.z));
        }
        let mut elements = Vec::new();
        for [a, b, c] in self.surface() {
            for (group, set) in [(1, &self.clamped), (2, &self.contact)] {
                if [a, b, c].iter().all(|node| set.binary_search(node).is_ok()) {
                    elements.push(format!("2 2 {group} 1 {} {} {}", a + 1, b + 1, c + 1));
                }
            }
        }
        elements.extend(
            (self.tetrahedra.iter()).map(|[a, b, c, d]| format!("4 2 3 1 {} {} {} {}", a + 1, b + 1, c + 1, d + 1)),
        );
        line(format_args!("$EndNodes\n$Elements\n{}", elements.len()));
        for (i, element) in elements.iter().enumerate() {
            line(format_args!("{} {element}", i + 1));
        }
        line(format_args!("$EndElements"));
        text
    }
}
