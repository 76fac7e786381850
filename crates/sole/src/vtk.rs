//! The deformed sole as a VTK file, for ParaView and its relatives.

use crate::{ElasticBody, Material, Mesh, SoleError};
use spatial::{Transform, Vec3};
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataSet, UnstructuredGridPiece, Version, VertexNumbers,
};

/// Legacy VTK text: tetrahedra at their deformed world positions, with `displacement_m` (of the sole relative to its rigid pose) and
/// `force_n` (of the ground) at the nodes, both in world axes.
///
/// `node_forces` are world forces on the mesh's contact nodes, in the order of [`Mesh::contact`] (levels with other contact points
/// have no nodal forces to show). The interior follows from the elastic body, so it is factorised here: for pictures, not for ticks.
///
/// # Errors
/// [`SoleError::Count`] when there is not one force per contact node; otherwise as [`ElasticBody::new`].
#[allow(non_snake_case)]
pub fn deformed_sole_vtk(
    mesh: &Mesh,
    material: &Material,
    X_WS: &Transform,
    node_forces: &[Vec3],
) -> Result<String, SoleError> {
    if node_forces.len() != mesh.contact.len() {
        return Err(SoleError::Count { expected: mesh.contact.len(), found: node_forces.len() });
    }
    let body = ElasticBody::new(mesh, material)?;
    let mut in_sole = vec![Vec3::zeros(); mesh.nodes.len()];
    let mut in_world = in_sole.clone();
    for (node, force) in mesh.contact.iter().zip(node_forces) {
        in_sole[*node] = X_WS.rotation.tr_mul(force);
        in_world[*node] = *force;
    }
    let displacement = body.displacement(&in_sole);
    let flat =
        |vectors: &mut dyn Iterator<Item = Vec3>| -> Vec<f64> { vectors.flat_map(|v| [v.x, v.y, v.z]).collect() };
    let points = flat(&mut mesh.nodes.iter().zip(&displacement).map(|(p, u)| X_WS.point(&(p + u))));
    let vertices = mesh.tetrahedra.iter().flat_map(|t| [4, t[0], t[1], t[2], t[3]]);
    // Node numbers of a mesh that fits in memory fit in the format's 32 bits.
    let vertices = vertices.map(|i| u32::try_from(i).expect("fewer than 2^32 nodes")).collect();
    let moved = flat(&mut displacement.iter().map(|u| X_WS.rotation * u));
    let vtk = vtkio::Vtk {
        version: Version::new_legacy(4, 2),
        byte_order: ByteOrder::BigEndian,
        title: "Soft sole".to_owned(),
        file_path: None,
        data: DataSet::inline(UnstructuredGridPiece {
            points: points.into(),
            cells: Cells {
                cell_verts: VertexNumbers::Legacy {
                    num_cells: u32::try_from(mesh.tetrahedra.len()).expect("fewer than 2^32 elements"),
                    vertices,
                },
                types: vec![CellType::Tetra; mesh.tetrahedra.len()],
            },
            data: Attributes {
                point: vec![
                    Attribute::vectors("displacement_m").with_data(moved),
                    Attribute::vectors("force_n").with_data(flat(&mut in_world.into_iter())),
                ],
                cell: Vec::new(),
            },
        }),
    };
    let mut text = String::new();
    vtk.write_legacy_ascii(&mut text).expect("writing to a string does not fail");
    Ok(text)
}
