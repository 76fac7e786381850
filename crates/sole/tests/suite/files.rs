//! Meshes from Gmsh, condensed soles as bytes.

use sole::{CacheError, ContactSet, Level, Mesh, MeshError, MeshSource, MshError, MshSets, SoleModel, SoleSettings};

const GMSH: &str = include_str!("../data/sole_1494.msh");

#[test]
fn the_gmsh_sole_has_its_1494_elements_and_154_contact_nodes() {
    let mesh = Mesh::from_msh(GMSH, MshSets::Groups).expect("a sound mesh");
    assert_eq!((mesh.tetrahedra.len(), mesh.nodes.len(), mesh.contact.len()), (1494, 460, 154));
    let worst = (0..1494).map(|t| mesh.quality(t)).fold(f64::INFINITY, f64::min);
    assert!(worst > 0.3 && worst < 0.4, "the reference reports 0.35: {worst}");
    assert_eq!(Mesh::from_msh(GMSH, MshSets::Planes).expect("planes").contact, mesh.contact);
    let settings = SoleSettings { mesh: MeshSource::Mesh(mesh), ..SoleSettings::default() };
    let model = SoleModel::build(&settings).expect("a sole");
    // Facts: condition 81; flat stiffness 422 kN/m loaded, a little more bonded.
    assert!((model.compliance_condition() / 81.0 - 1.0).abs() < 0.02, "{}", model.compliance_condition());
    assert!((model.bonded_stiffness()[(2, 2)] / 422e3 - 1.0).abs() < 0.02);
}

#[test]
fn version_2_files_give_the_same_mesh() {
    let mesh = Mesh::kuhn_box([0.23, 0.13, 0.021], [3, 2, 1]).expect("a box");
    assert_eq!(Mesh::from_msh(&mesh.to_msh(), MshSets::Groups).expect("a mesh"), mesh);
}

#[test]
fn unsound_files_are_refused_with_the_place() {
    let mesh = Mesh::kuhn_box([0.23, 0.13, 0.021], [3, 2, 1]).expect("a box");
    let good = mesh.to_msh();
    let error = |text: &str| Mesh::from_msh(text, MshSets::Groups).expect_err("unsound");
    let mut millimetres = mesh.clone();
    millimetres.nodes.iter_mut().for_each(|p| *p *= 1000.0);
    let units = error(&millimetres.to_msh());
    let MshError::Unsound { defect: MeshError::Units { extent_m }, .. } = units else { panic!("{units}") };
    assert!((extent_m - 230.0).abs() < 1e-9);
    assert!(!units.to_string().contains("in the file"), "no node is to blame: {units}");
    assert!(matches!(error(&good.replace("2.2 0 8", "2.2 1 8")), MshError::Unsupported { .. }));
    assert!(matches!(error(&good.replace("2.2 0 8", "4.0 0 8")), MshError::Unsupported { .. }));
    assert!(matches!(error(&good.replace("\"clamped\"", "\"glued\"")), MshError::NoGroup { group: "clamped", .. }));
    assert!(matches!(error(&good.replace("$EndElements", "")), MshError::Malformed { section: "Elements", .. }));
    assert!(matches!(error(&good.replace("$EndMeshFormat", "")), MshError::Malformed { section: "MeshFormat", .. }));
    // Another kind of file, and Gmsh's first format.
    for text in ["hello", "solid foot\n", "$NOD\n1\n1 0 0 0\n$ENDNOD\n"] {
        assert_eq!(error(text), MshError::NotGmsh);
    }
    let first_tetrahedron = good.lines().position(|line| line.contains(" 4 2 3 1 ")).expect("one");
    let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
    let words: Vec<String> = lines[first_tetrahedron].split(' ').map(str::to_owned).collect();
    lines[first_tetrahedron] = format!("{} 4 2 3 1 {} {} {} {}", words[0], words[6], words[5], words[7], words[8]);
    let number: u64 = words[0].parse().expect("a number");
    let inverted = error(&(lines.join("\n") + "\n"));
    let MshError::Unsound { defect: MeshError::BadElement { element: 0, .. }, elements, .. } = &inverted else {
        panic!("{inverted:?}")
    };
    assert_eq!(*elements, [number]);
    let nodes: Vec<&str> = [6, 5, 7, 8].map(|i| words[i].as_str()).into();
    let place = format!("(in the file: element {number}; nodes {})", nodes.join(", "));
    assert!(inverted.to_string().ends_with(&place), "{inverted}");
    lines[first_tetrahedron] = format!("{number} 4 2 3 1 1 2 3 999");
    assert_eq!(error(&(lines.join("\n") + "\n")), MshError::UnknownNode { element: number, node: 999 });
    let with_stray = good.replace("$Nodes\n24\n", "$Nodes\n25\n77 0 0 0\n");
    let stray = error(&with_stray);
    assert!(
        matches!(&stray, MshError::Unsound { defect: MeshError::UnreferencedNode { .. }, nodes, .. } if *nodes == [77]),
        "{stray:?}"
    );
    assert_eq!(stray.to_string(), "node 24 belongs to no element (in the file: node 77)");
}

#[test]
fn a_cached_sole_is_the_sole_and_a_wrong_one_is_refused() {
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [4, 3, 2] };
    let settings = SoleSettings { mesh, ..SoleSettings::default() };
    let (model, bytes) = SoleModel::cached(&settings, None).expect("a sole");
    let bytes = bytes.expect("nothing was cached");
    let (again, none) = SoleModel::cached(&settings, Some(&bytes)).expect("a sole");
    assert!(none.is_none(), "the bytes were good");
    assert_eq!(again.compliance(), model.compliance());
    assert_eq!(again.contact_points(), model.contact_points());
    assert_eq!(again.friction(), model.friction());
    assert_eq!(again.ankle_in_sole_m(), model.ankle_in_sole_m());
    assert_eq!(again.statistics(), model.statistics());
    let mut other = settings.clone();
    other.material.young_modulus_pa *= 1.0 + 1e-15;
    assert_ne!(other.key(), settings.key());
    // Each number and choice is a part of the key.
    let block = |size_m, cells| MeshSource::Box { size_m, cells };
    let changes: [&dyn Fn(&mut SoleSettings); 15] = [
        &|s| s.material.poisson_ratio = 0.3,
        &|s| s.friction = 0.6,
        &|s| s.ankle_in_sole_m.x = 0.0,
        &|s| s.ankle_in_sole_m.y = 0.0,
        &|s| s.ankle_in_sole_m.z = 0.1,
        &|s| s.contact = ContactSet::All,
        &|s| s.level = Level::Rigid,
        &|s| s.level = Level::Lumped,
        &|s| s.level = Level::QuadraticFem,
        &|s| s.level = Level::Winkler { cells: [2, 1] },
        &|s| s.level = Level::Patches { cells: [2, 1] },
        &|s| s.level = Level::Patches { cells: [1, 2] },
        &|s| s.mesh = block([0.13, 0.23, 0.021], [4, 3, 2]),
        &|s| s.mesh = block([0.23, 0.13, 0.021], [4, 2, 3]),
        &|s| s.mesh = MeshSource::Mesh(Mesh::kuhn_box([0.23, 0.13, 0.021], [4, 3, 2]).expect("a box")),
    ];
    let mut keys = std::collections::BTreeSet::from([settings.key(), other.key()]);
    for (k, change) in changes.iter().enumerate() {
        let mut changed = settings.clone();
        change(&mut changed);
        assert!(keys.insert(changed.key()), "change {k}");
    }
    assert!(matches!(SoleModel::from_bytes(&bytes, other.key()), Err(CacheError::Key { .. })));
    let mut altered = bytes.clone();
    altered[200] ^= 1;
    assert!(matches!(SoleModel::from_bytes(&altered, settings.key()), Err(CacheError::Damaged { .. })));
    assert!(matches!(
        SoleModel::from_bytes(&bytes[..bytes.len() - 9], settings.key()),
        Err(CacheError::Damaged { .. })
    ));
    assert!(matches!(SoleModel::from_bytes(b"hello", settings.key()), Err(CacheError::Foreign)));
    let mut newer = bytes.clone();
    newer[8] = 99;
    assert!(matches!(SoleModel::from_bytes(&newer, settings.key()), Err(CacheError::Version { found: 99, .. })));
}
