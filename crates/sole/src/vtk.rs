//! The deformed sole as a VTK file, for ParaView and its relatives.

use crate::{ElasticBody, Material, Mesh, SoleError, SoleModel};
use nalgebra::DVector;
use spatial::{Transform, Vec3};
use std::fmt::Write;

/// Farthest that a contact node of the picture may be from where the sole has it (m): thousands of times what rounding in the condensation
/// makes of the largest displacement, and nothing that an eye could see.
const DIFFERENCE_MAX_M: f64 = 1e-9;

/// Legacy VTK text: tetrahedra at their deformed world positions, with `displacement_m` (of the sole relative to its rigid pose) and
/// `force_n` (of the ground) at the nodes, both in world axes.
///
/// `node_positions` (m) and `node_forces` (N) are those of a report about a sole of the level [`Level::Fem`](crate::Level::Fem), in the world
/// and in the order of its contact points, `X_WS` its pose and `material` what it was built of. The contact nodes are drawn where the report
/// has them; the interior follows from the elastic body, factorised here: for pictures, not for ticks.
///
/// # Errors
/// [`SoleError::Count`] when there is not one position and force per contact node of a mesh; [`SoleError::OtherBody`] when the mesh's elastic body does
/// not have its contact nodes there: points of other levels are no nodes, or have another compliance. Otherwise as [`ElasticBody::new`].
#[allow(non_snake_case)]
pub fn deformed_sole_vtk(
    model: &SoleModel,
    material: &Material,
    X_WS: &Transform,
    node_positions: &[Vec3],
    node_forces: &[Vec3],
) -> Result<String, SoleError> {
    let expected = model.contact_points().len();
    let mesh = model.mesh().ok_or(SoleError::Count { expected: 0, found: expected })?;
    for found in [mesh.contact.len(), node_positions.len(), node_forces.len()] {
        if found != expected {
            return Err(SoleError::Count { expected, found });
        }
    }
    let displacement = displacements(model, mesh, material, X_WS, node_positions)?;
    let mut in_world = vec![Vec3::zeros(); mesh.nodes.len()];
    for (node, force) in mesh.contact.iter().zip(node_forces) {
        in_world[*node] = *force;
    }
    let mut text = String::from("# vtk DataFile Version 4.2\nSoft sole\nASCII\nDATASET UNSTRUCTURED_GRID\n");
    let (nodes, elements) = (mesh.nodes.len(), mesh.tetrahedra.len());
    writeln!(text, "POINTS {nodes} double").expect(TO_TEXT);
    put_vectors(&mut text, mesh.nodes.iter().zip(&displacement).map(|(p, u)| X_WS.point(&(p + u))));
    writeln!(text, "CELLS {elements} {}", 5 * elements).expect(TO_TEXT);
    for [a, b, c, d] in &mesh.tetrahedra {
        writeln!(text, "4 {a} {b} {c} {d}").expect(TO_TEXT);
    }
    write!(text, "CELL_TYPES {elements}\n{}", TETRAHEDRON.repeat(elements)).expect(TO_TEXT);
    writeln!(text, "POINT_DATA {nodes}\nVECTORS displacement_m double").expect(TO_TEXT);
    put_vectors(&mut text, displacement.iter().map(|u| X_WS.rotation * u));
    text.push_str("VECTORS force_n double\n");
    put_vectors(&mut text, in_world.into_iter());
    Ok(text)
}

/// VTK's number of a linear tetrahedron, as a line.
const TETRAHEDRON: &str = "10\n";
const TO_TEXT: &str = "writing to a string does not fail";

/// One vector per line, in so many digits that reading gives the same numbers.
fn put_vectors(text: &mut String, vectors: impl Iterator<Item = Vec3>) {
    for v in vectors {
        writeln!(text, "{:e} {:e} {:e}", v.x, v.y, v.z).expect(TO_TEXT);
    }
}

/// Displacement of every node in the sole frame, such that the contact nodes are where they are said to be. The elastic forces behind it follow from
/// the displacements and not from the reported forces, a part of which may be viscous.
#[allow(non_snake_case)]
fn displacements(
    model: &SoleModel,
    mesh: &Mesh,
    material: &Material,
    X_WS: &Transform,
    node_positions: &[Vec3],
) -> Result<Vec<Vec3>, SoleError> {
    let X_SW = X_WS.inverse();
    let points = model.contact_points().iter().zip(node_positions);
    let known = DVector::from_iterator(
        3 * node_positions.len(),
        points.flat_map(|(p, at)| <[f64; 3]>::from(X_SW.point(at) - p)),
    );
    let elastic = model.stiffness() * known;
    let mut force = vec![Vec3::zeros(); mesh.nodes.len()];
    for (i, node) in mesh.contact.iter().enumerate() {
        force[*node] = elastic.fixed_rows::<3>(3 * i).into();
    }
    let displacement = ElasticBody::new(mesh, material)?.displacement(&force);
    let off =
        |(node, at): (&usize, &Vec3)| (*node, (X_WS.point(&(mesh.nodes[*node] + displacement[*node])) - at).norm());
    let worst = mesh.contact.iter().zip(node_positions).map(off).max_by(|a, b| a.1.total_cmp(&b.1));
    match worst {
        Some((node, difference_m)) if difference_m.is_nan() || difference_m > DIFFERENCE_MAX_M => {
            Err(SoleError::OtherBody { node, difference_m })
        }
        _ => Ok(displacement),
    }
}
