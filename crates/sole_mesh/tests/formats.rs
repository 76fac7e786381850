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

#[test]
fn groups_turned_round_in_format_4_are_the_same_groups() {
    let mesh = block();
    let text = version_4(&mesh);
    // The second surface's group, and the first of the two of the first one.
    let turned = text.replace(" 2 1 4 0\n", " 2 -1 4 0\n").replace(" 1 3 0\n", " 1 -3 0\n");
    assert_ne!(turned, text);
    assert_eq!(Mesh::from_msh(&turned, MshSets::Groups).as_ref(), Ok(&mesh));
}

/// The block in format 2.2, its clamped triangles with other tags.
fn with_tags_of_the_first_group(mesh: &Mesh, tags: &str) -> String {
    let mut out = String::new();
    for line in mesh.to_msh().lines() {
        match line.split_once(" 2 2 1 1 ") {
            // A whole element: its number stands before.
            Some((number, nodes)) if !number.contains(' ') => writeln!(out, "{number} 2 {tags} {nodes}"),
            _ => writeln!(out, "{line}"),
        }
        .expect("a text");
    }
    out
}

#[test]
fn a_partitioned_file_says_the_groups_of_its_pieces() {
    let mesh = block();
    let text = version_4(&mesh);
    // The elements lie on pieces, the entities 11, 12 and 13, whose parents are 1 and 2 and the volume.
    let pieces = "$PartitionedEntities\n2\n1\n14 2\n0 0 2 1\n11 2 1 1 1 -1 -1 -1 1 1 1 2 1 4 0\n\
                  12 2 2 2 1 2 -1 -1 -1 1 1 1 1 -3 0\n13 3 1 2 1 2 -1 -1 -1 1 1 1 1 2 2 11 12\n$EndPartitionedEntities\n$Nodes\n";
    let (before, elements) = text.split_once("$Elements\n").expect("elements");
    let elements = [("2 1 2 4", "2 11 2 4"), ("2 2 2 4", "2 12 2 4"), ("3 1 4 12", "3 13 4 12")]
        .iter()
        .fold(elements.to_owned(), |text, (whole, piece)| {
            text.replacen(&format!("\n{whole}\n"), &format!("\n{piece}\n"), 1)
        });
    let ghosts = "$GhostElements\n1\n3 1 1 2\n$EndGhostElements\n";
    let text = format!("{}$Elements\n{elements}{ghosts}", before.replace("$Nodes\n", pieces));
    assert_eq!(Mesh::from_msh(&text, MshSets::Groups).as_ref(), Ok(&mesh));
    // In format 2.2 it is the element that names its pieces, behind the group.
    let old = with_tags_of_the_first_group(&mesh, "5 1 1 2 1 -2");
    assert_ne!(old, mesh.to_msh());
    assert_eq!(Mesh::from_msh(&old, MshSets::Groups).as_ref(), Ok(&mesh));
}

#[test]
fn parametric_nodes_of_format_2_are_read() {
    let mesh = block();
    let text = mesh.to_msh().replace("$Nodes\n", "$ParametricNodes\n").replace("$EndNodes\n", "$EndParametricNodes\n");
    let (mut out, mut within) = (String::new(), false);
    for line in text.lines() {
        within = (within || line == "$ParametricNodes") && line != "$EndParametricNodes";
        let number = line.split(' ').next().and_then(|word| word.parse::<usize>().ok()).filter(|_| within);
        // On a corner, on a curve, on a surface, inside.
        let parameters = ["0 7", "1 7 0.5", "2 7 0.25 0.75", "3 7"];
        match number.filter(|_| line.split(' ').count() == 4) {
            Some(number) => writeln!(out, "{line} {}", parameters[number % 4]).expect("a text"),
            None => writeln!(out, "{line}").expect("a text"),
        }
    }
    assert_eq!(Mesh::from_msh(&out, MshSets::Groups).as_ref(), Ok(&mesh));
}

#[test]
fn elements_of_any_order_give_their_corners_and_others_are_named() {
    let mesh = block();
    let text = mesh.to_msh();
    let n = mesh.nodes.len();
    let tail = text.rfind(" 4 2 3 1 ").expect("a tetrahedron");
    let (head, last) = text.split_at(tail);
    let corners = last.trim_start_matches(" 4 2 3 1 ").lines().next().expect("its corners");
    for (kind, nodes) in [(11, 10), (29, 20), (30, 35), (31, 56)] {
        let between: Vec<usize> = (n + 1..=n + nodes - 4).collect();
        let listed: Vec<String> = between.iter().map(usize::to_string).collect();
        let element = format!(" {kind} 2 3 1 {corners} {}\n$EndElements\n", listed.join(" "));
        let places: String = between.iter().map(|i| format!("{i} 0 0 0.01\n")).collect();
        let counted = format!("$Nodes\n{}\n{places}", n + nodes - 4);
        let curved = (head.to_owned() + &element).replace(&format!("$Nodes\n{n}\n"), &counted);
        assert_eq!(Mesh::from_msh(&curved, MshSets::Groups).as_ref(), Ok(&mesh), "type {kind}");
    }
    let number: u64 = head.rsplit('\n').next().and_then(|word| word.parse().ok()).expect("its number");
    for (kind, name) in [(3, "quadrangle"), (5, "hexahedron"), (6, "prism"), (7, "pyramid"), (4242, "not known")] {
        let other = format!("{head} {kind} 2 3 1 {corners} 1 2\n$EndElements\n");
        let error = Mesh::from_msh(&other, MshSets::Groups).expect_err("no tetrahedron");
        assert!(
            matches!(&error, MshError::OtherElement { element, kind } if *element == number && kind.contains(name))
        );
        assert!(error.to_string().contains(&format!("element {number} is a {name}")) || kind == 4242, "{error}");
    }
}

#[test]
fn names_that_are_nearly_right_are_told_and_never_taken_for_planes() {
    let mesh = block();
    for (clamped, contact) in [("Clamped", "Contact"), ("clamp", "contact"), ("clamped", "contacts"), (" CLAMPED", "x")]
    {
        let text = mesh.to_msh().replace("\"clamped\"", &format!("\"{clamped}\""));
        let text = text.replace("\"contact\"", &format!("\"{contact}\""));
        for sets in [MshSets::Either, MshSets::Groups] {
            let error = Mesh::from_msh(&text, sets).expect_err("a slip of the pen");
            let MshError::NoGroup { nearest: Some(nearest), .. } = &error else { panic!("{error:?}") };
            assert!([clamped, contact].contains(&nearest.as_str()), "{error}");
            assert!(error.to_string().contains(&format!("was `{nearest}` meant?")), "{error}");
        }
        assert!(Mesh::from_msh(&text, MshSets::Planes).is_ok(), "asked for, the planes are taken");
    }
    // Names of something else are no slips.
    let text = mesh.to_msh().replace("\"clamped\"", "\"top\"").replace("\"contact\"", "\"bottom\"");
    assert_eq!(Mesh::from_msh(&text, MshSets::Either).as_ref(), Ok(&mesh));
}

#[test]
fn groups_without_elements_are_told_with_the_reason() {
    let mesh = block();
    // As saved by version 2.2 with everything: all elements in group 0.
    let all = with_tags_of_the_first_group(&mesh, "2 0 1");
    assert_ne!(all, mesh.to_msh());
    let error = Mesh::from_msh(&all, MshSets::Groups).expect_err("an empty group");
    assert_eq!(error, MshError::EmptyGroup { group: "clamped" });
    assert!(error.to_string().contains("Mesh.SaveAll = 0"), "{error}");
    // Without a group of the volume, Gmsh leaves the tetrahedra out.
    let text = mesh.to_msh();
    let surfaces: Vec<&str> = text.lines().filter(|line| !line.contains(" 4 2 3 1 ")).collect();
    let triangles = surfaces.iter().filter(|line| line.contains(" 2 2 ") && line.split(' ').count() == 8).count();
    let count = triangles + mesh.tetrahedra.len();
    let bare = surfaces.join("\n") + "\n";
    let bare = bare.replace(&format!("$Elements\n{count}\n"), &format!("$Elements\n{triangles}\n"));
    let without = bare
        .replace("\n3\n2 1", "\n2\n2 1")
        .lines()
        .filter(|line| !line.starts_with("3 3 "))
        .collect::<Vec<_>>()
        .join("\n");
    for (text, reason) in [
        (bare.clone(), "of volumes are empty"),
        (without + "\n", "none of the volume"),
        (bare.replace("PhysicalNames", "Comments"), "mesh in three dimensions"),
    ] {
        let error = Mesh::from_msh(&text, MshSets::Groups).expect_err("no volume");
        assert!(matches!(error, MshError::NoTetrahedra { .. }), "{error}");
        assert!(error.to_string().contains(reason), "{error}");
    }
}
