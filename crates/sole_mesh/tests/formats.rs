//! What Gmsh files may look like: sets and groups, formats 2.2 and 4.1, parametric nodes, quadratic elements, line ends.

use sole_mesh::{Mesh, MeshError, MshError, MshSets};
use std::fmt::Write;

fn block() -> Mesh {
    Mesh::kuhn_box([0.2, 0.1, 0.03], [2, 1, 1]).expect("a box")
}

/// The tetrahedra and the triangles of both sets as a file of format 4.1. Nodes lie on a surface and carry two parameters; the volume has
/// a group named `contact`, too, as a body may be called after what it does.
fn version_4(mesh: &Mesh) -> String {
    let box_of = "-1 -1 -1 1 1 1";
    let mut text = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n");
    text += "$PhysicalNames\n4\n2 1 \"clamped\"\n3 2 \"contact\"\n2 3 \"contact\"\n2 4 \"sides\"\n$EndPhysicalNames\n";
    write!(text, "$Entities\n0 0 2 1\n1 {box_of} 2 1 4 0\n2 {box_of} 1 3 0\n1 {box_of} 1 2 2 1 2\n$EndEntities\n")
        .expect("a text");
    let n = mesh.nodes.len();
    write!(text, "$Nodes\n1 {n} 1 {n}\n2 1 1 {n}\n").expect("a text");
    (1..=n).for_each(|i| writeln!(text, "{i}").expect("a text"));
    for p in &mesh.nodes {
        writeln!(text, "{:e} {:e} {:e} 0.25 0.75", p.x, p.y, p.z).expect("a text");
    }
    let faces = |set: &[usize]| -> Vec<[usize; 3]> {
        mesh.surface().into_iter().filter(|face| face.iter().all(|i| set.binary_search(i).is_ok())).collect()
    };
    let mut number = 0;
    let all = mesh.tetrahedra.len() + faces(&mesh.clamped).len() + faces(&mesh.contact).len();
    write!(text, "$EndNodes\n$Elements\n3 {all} 1 {all}\n").expect("a text");
    for (entity, set) in [(1, &mesh.clamped), (2, &mesh.contact)] {
        writeln!(text, "2 {entity} 2 {}", faces(set).len()).expect("a text");
        for [a, b, c] in faces(set) {
            number += 1;
            writeln!(text, "{number} {} {} {}", a + 1, b + 1, c + 1).expect("a text");
        }
    }
    writeln!(text, "3 1 4 {}", mesh.tetrahedra.len()).expect("a text");
    for [a, b, c, d] in &mesh.tetrahedra {
        number += 1;
        writeln!(text, "{number} {} {} {} {}", a + 1, b + 1, c + 1, d + 1).expect("a text");
    }
    text + "$EndElements\n"
}

#[test]
fn both_formats_line_ends_and_ways_to_tell_the_sets_give_the_same_mesh() {
    let mesh = block();
    for text in [mesh.to_msh(), version_4(&mesh)] {
        for text in [text.replace('\n', "\r\n"), text] {
            for sets in [MshSets::Groups, MshSets::Planes, MshSets::Either] {
                assert_eq!(Mesh::from_msh(&text, sets).as_ref(), Ok(&mesh), "{sets:?}\n{text}");
            }
        }
    }
    // Without names only the planes are left, which `Either` takes; one name alone is a file that forgot the other.
    let (names, nameless) = ("$PhysicalNames", version_4(&mesh).replace("PhysicalNames", "Comments"));
    assert!(!nameless.contains(names));
    assert_eq!(Mesh::from_msh(&nameless, MshSets::Either).as_ref(), Ok(&mesh));
    assert!(matches!(Mesh::from_msh(&nameless, MshSets::Groups), Err(MshError::NoGroup { group: "clamped", .. })));
    let half = version_4(&mesh).replace("2 1 \"clamped\"", "2 1 \"glue\"");
    assert!(matches!(Mesh::from_msh(&half, MshSets::Either), Err(MshError::NoGroup { group: "clamped", .. })));
}

#[test]
fn a_node_of_both_groups_is_clamped() {
    let mesh = block();
    // The rear end belongs to the contact group as well: its upper corners cannot slide.
    let (rear_below, rear_above): (Vec<usize>, Vec<usize>) =
        (0..mesh.nodes.len()).filter(|i| mesh.nodes[*i].x < -0.09).partition(|i| mesh.nodes[*i].z < 0.01);
    let [a, b, c] = [rear_below[0] + 1, rear_below[1] + 1, rear_above[0] + 1];
    let text = mesh.to_msh();
    let count: usize =
        text.split("$Elements\n").nth(1).and_then(|t| t.lines().next()).expect("a count").parse().expect("a count");
    let text =
        text.replace(&format!("$Elements\n{count}\n"), &format!("$Elements\n{}\n999 2 2 2 1 {a} {b} {c}\n", count + 1));
    assert_eq!(Mesh::from_msh(&text, MshSets::Groups).as_ref(), Ok(&mesh));
}

#[test]
fn midpoints_of_quadratic_elements_are_dropped_and_nodes_of_nothing_are_not() {
    let mesh = block();
    let text = mesh.to_msh();
    let n = mesh.nodes.len();
    // The last tetrahedron becomes a quadratic one: six nodes more, of its own.
    let tail = text.rfind(" 4 2 3 1 ").expect("a tetrahedron");
    let (head, last) = text.split_at(tail);
    let corners = last.trim_start_matches(" 4 2 3 1 ").lines().next().expect("its corners");
    let midpoints: Vec<usize> = (n + 1..=n + 6).collect();
    let listed: Vec<String> = midpoints.iter().map(usize::to_string).collect();
    let element = format!(" 11 2 3 1 {corners} {}\n$EndElements\n", listed.join(" "));
    let nodes: String = midpoints.iter().map(|i| format!("{i} 0 0 0.01\n")).collect();
    let quadratic =
        (head.to_owned() + &element).replace(&format!("$Nodes\n{n}\n"), &format!("$Nodes\n{}\n{nodes}", n + 6));
    assert_eq!(Mesh::from_msh(&quadratic, MshSets::Groups).as_ref(), Ok(&mesh));
    // Points and lines, linear and quadratic, are of no use here and no harm.
    let count = quadratic.split("$Elements\n").nth(1).and_then(|text| text.lines().next()).expect("a count");
    let more = count.parse::<usize>().expect("a count") + 3;
    let lines = quadratic.replace(
        &format!("$Elements\n{count}\n"),
        &format!("$Elements\n{more}\n901 15 2 0 1 1\n902 1 2 0 1 1 2\n903 8 2 0 1 1 2 3\n"),
    );
    assert_ne!(lines, quadratic);
    assert_eq!(Mesh::from_msh(&lines, MshSets::Groups).as_ref(), Ok(&mesh));
    let stray = text.replace(&format!("$Nodes\n{n}\n"), &format!("$Nodes\n{}\n77 0 0 0.01\n", n + 1));
    let error = Mesh::from_msh(&stray, MshSets::Groups).expect_err("a node of nothing");
    assert!(
        matches!(&error, MshError::Unsound { defect: MeshError::UnreferencedNode { .. }, nodes, .. } if *nodes == [77])
    );
}

#[test]
fn numbers_that_make_no_sense_are_refused_and_never_panic() {
    let mesh = block();
    let twice = mesh.to_msh().replace("$Nodes\n12\n1 ", "$Nodes\n12\n2 ");
    assert_eq!(Mesh::from_msh(&twice, MshSets::Groups), Err(MshError::NodeTwice { node: 2 }));
    let four = version_4(&mesh);
    for (from, to) in [("2 1 1 12\n", "3 1 18446744073709551615 12\n"), ("2 1 1 12\n", "2 1 1 18446744073709551615\n")]
    {
        assert!(four.contains(from));
        let error = Mesh::from_msh(&four.replace(from, to), MshSets::Groups).expect_err("cut short");
        assert!(matches!(error, MshError::Malformed { section: "Nodes", .. }), "{error}");
    }
}
