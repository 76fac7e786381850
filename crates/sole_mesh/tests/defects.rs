//! Meshes that are no soles, each refused with the element, the node or the size.

use sole_mesh::{ELEMENTS_MAX, Mesh, MeshError};
use spatial::Vec3;

fn good() -> Mesh {
    Mesh::kuhn_box([0.2, 0.1, 0.03], [2, 1, 1]).expect("a box")
}

/// The mesh with one more element, positively oriented, of nodes of the mesh and new ones.
fn with_element(mesh: &Mesh, old: &[usize], new: &[Vec3]) -> Mesh {
    let mut mesh = mesh.clone();
    let first = mesh.nodes.len();
    mesh.nodes.extend(new);
    let corners: Vec<usize> = old.iter().copied().chain(first..mesh.nodes.len()).collect();
    mesh.tetrahedra.push(corners.try_into().expect("four corners"));
    let last = mesh.tetrahedra.len() - 1;
    if mesh.volume(last) < 0.0 {
        mesh.tetrahedra[last].swap(0, 1);
    }
    mesh
}

#[test]
fn parts_that_hang_on_nothing_a_corner_or_an_edge_are_named() {
    let mesh = good();
    let extra = mesh.tetrahedra.len();
    // Beside the rear end of the box, whose corners below are the nodes 0 and 3.
    let places = [[-0.2, 0.0, 0.0], [-0.2, 0.02, 0.01], [-0.2, 0.0, 0.02], [-0.22, -0.02, 0.01]];
    let places = places.map(Vec3::from);
    for shared in 0..3 {
        let hanging = with_element(&mesh, &[0, 3][..shared], &places[shared..]);
        let error = hanging.checked().expect_err("it can swing");
        assert!(matches!(error, MeshError::Disconnected { element, .. } if element == extra), "{shared}: {error}");
    }
    // The smaller part is named, wherever it stands.
    let mut first = with_element(&mesh, &[0], &places[1..]);
    first.tetrahedra.rotate_right(1);
    assert!(matches!(first.checked(), Err(MeshError::Disconnected { element: 0, .. })));
    // On a face it holds.
    let [a, b, c] = mesh.surface()[0];
    let [p, q, r] = [a, b, c].map(|i| mesh.nodes[i]);
    let outside = (p + q + r) / 3.0 + 0.01 * (q - p).cross(&(r - p)).normalize();
    let wart = with_element(&mesh, &[a, b, c], &[outside]);
    assert_eq!(wart.clone().checked().map(|mesh| mesh.tetrahedra.len()), Ok(extra + 1), "{wart:?}");
}

#[test]
fn elements_upon_each_other_are_named() {
    let mesh = good();
    let mut twice = mesh.clone();
    let [a, b, c, d] = mesh.tetrahedra[5];
    twice.tetrahedra.push([b, c, a, d]);
    assert_eq!(twice.checked(), Err(MeshError::Overlap { first: 5, second: 12 }));
    // Another one on the same side of one face.
    let inside = 0.25 * (mesh.nodes[a] + mesh.nodes[b] + mesh.nodes[c] + mesh.nodes[d]);
    let within = with_element(&mesh, &[a, b, c], &[inside]);
    assert_eq!(within.checked(), Err(MeshError::Overlap { first: 5, second: 12 }));
}

#[test]
fn a_sole_upside_down_is_said() {
    let mesh = good();
    let mut exchanged = mesh.clone();
    std::mem::swap(&mut exchanged.clamped, &mut exchanged.contact);
    let error = exchanged.checked().expect_err("the foot is on the ground");
    let MeshError::UpsideDown { node, clamped_z_m, contact_z_m } = error else { panic!("{error}") };
    assert_eq!((mesh.nodes[node].z, clamped_z_m, contact_z_m), (0.0, 0.0, 0.03));
    let mut turned = mesh;
    turned.nodes.iter_mut().for_each(|p| (p.y, p.z) = (-p.y, -p.z));
    let error = turned.checked().expect_err("upside down");
    assert!(matches!(error, MeshError::UpsideDown { clamped_z_m: -0.03, contact_z_m: 0.0, .. }), "{error}");
}

#[test]
fn other_units_than_metres_are_suspected() {
    let units = |size_m, cells| match Mesh::kuhn_box(size_m, cells) {
        Err(MeshError::Units { extent_m }) => extent_m,
        other => panic!("{size_m:?}: {other:?}"),
    };
    assert_eq!(units([230.0, 130.0, 21.0], [12, 7, 3]), 230.0);
    assert_eq!(units([23.0, 13.0, 2.1], [12, 7, 3]), 23.0);
    assert_eq!(units([0.23, 0.13, 21.0], [12, 7, 3]), 21.0, "one of three");
    assert_eq!(units([0.23e-3, 0.13e-3, 0.021e-3], [12, 7, 3]), 0.23e-3);
    let mut mesh = good();
    mesh.nodes.iter_mut().for_each(|p| *p *= 100.0);
    assert!(matches!(mesh.checked(), Err(MeshError::Units { .. })));
}

#[test]
fn blocks_beyond_any_memory_are_refused_before_it_is_asked_for() {
    let size_m = [0.23, 0.13, 0.021];
    for cells in [[4000; 3], [usize::MAX; 3], [1, 1, ELEMENTS_MAX]] {
        assert!(matches!(Mesh::kuhn_box(size_m, cells), Err(MeshError::TooFine { .. })), "{cells:?}");
    }
    assert_eq!(Mesh::check_box(size_m, [1, 1, ELEMENTS_MAX / 6]), Ok(()));
    assert!(matches!(Mesh::check_box(size_m, [1, 1, 0]), Err(MeshError::EmptyBox { .. })));
}

#[test]
fn the_order_in_which_sets_are_given_does_not_matter_and_what_is_in_both_is_named() {
    let mesh = good();
    let mut shuffled = mesh.clone();
    for set in [&mut shuffled.clamped, &mut shuffled.contact] {
        set.reverse();
        set.push(set[1]);
    }
    assert_eq!(shuffled.checked().as_ref(), Ok(&mesh));
    let mut both = mesh.clone();
    both.contact.push(both.clamped[2]);
    assert_eq!(both.checked(), Err(MeshError::ClampedContact { node: mesh.clamped[2] }));
    let mut without = mesh.clone();
    without.clamped.clear();
    assert_eq!(without.checked(), Err(MeshError::NothingClamped));
    let mut floating = mesh.clone();
    floating.contact.clear();
    assert_eq!(floating.checked(), Err(MeshError::NoContactCandidate));
    for lost in [f64::NAN, f64::INFINITY] {
        let mut broken = mesh.clone();
        broken.nodes[4].y = lost;
        assert_eq!(broken.checked(), Err(MeshError::NodeNotFinite { node: 4 }));
    }
    let mut beyond = mesh.clone();
    beyond.tetrahedra[3][2] = mesh.nodes.len();
    assert_eq!(beyond.checked(), Err(MeshError::UnknownNode { element: 3, node: mesh.nodes.len() }));
}

#[test]
fn inverted_elements_and_those_without_volume_are_named() {
    // One node in the middle of 27.
    let block = Mesh::kuhn_box([0.2, 0.1, 0.03], [2, 2, 2]).expect("a box");
    let middle = 13;
    for flat in (0..block.tetrahedra.len()).filter(|t| block.tetrahedra[*t].contains(&middle)) {
        let [a, b, c] = {
            let mut others = block.tetrahedra[flat].iter().filter(|i| **i != middle).map(|i| block.nodes[*i]);
            [(); 3].map(|()| others.next().expect("three others"))
        };
        let foot = (a + b + c) / 3.0;
        // In the plane of its other corners, up to rounding; beyond it; short of it by a millionth of the former distance.
        for (fraction, volume_m3) in [(0.0, 0.0), (-1e-3, -1e-3 * block.volume(flat)), (1e-6, 0.0)] {
            let mut mesh = block.clone();
            mesh.nodes[middle] = foot + fraction * (mesh.nodes[middle] - foot);
            match mesh.checked() {
                Ok(_) => assert_eq!(fraction, 1e-6, "element {flat}"),
                Err(MeshError::BadElement { volume_m3: found, .. }) if fraction != 1e-6 => {
                    assert!((found - volume_m3).abs() < 1e-15, "element {flat}: {found} instead of {volume_m3}");
                }
                Err(other) => panic!("element {flat}, {fraction}: {other}"),
            }
        }
    }
}

#[test]
fn a_slit_of_nodes_at_one_place_is_told() {
    // The block cut in two along y = 0, but for its rear end: the nodes of the cut are there twice.
    let mesh = Mesh::kuhn_box([0.2, 0.1, 0.03], [4, 2, 1]).expect("a box");
    let mut slit = mesh.clone();
    let cut: Vec<usize> =
        (0..mesh.nodes.len()).filter(|i| mesh.nodes[*i].y.abs() < 1e-9 && mesh.nodes[*i].x > 0.0).collect();
    for old in &cut {
        let new = slit.nodes.len();
        slit.nodes.push(slit.nodes[*old]);
        for t in 0..slit.tetrahedra.len() {
            let left =
                slit.tetrahedra[t].iter().map(|i| mesh.nodes[(*i).min(mesh.nodes.len() - 1)].y).sum::<f64>() > 0.0;
            slit.tetrahedra[t].iter_mut().filter(|i| left && **i == *old).for_each(|i| *i = new);
        }
        for set in [&mut slit.clamped, &mut slit.contact] {
            if set.contains(old) {
                set.push(new);
            }
        }
    }
    let told = MeshError::Coincident { first: cut[0], second: mesh.nodes.len(), pairs: cut.len() };
    assert_eq!(slit.clone().checked(), Err(told.clone()));
    assert!(told.to_string().contains("slit"), "{told}");
    // Opened by a hundredth of a millimetre it is a sole that somebody has cut.
    slit.nodes[mesh.nodes.len()..].iter_mut().for_each(|p| p.y += 1e-5);
    assert!(slit.checked().is_ok());
}
