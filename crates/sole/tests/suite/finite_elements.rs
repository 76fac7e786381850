//! Identities, a manufactured solution with its order, condensation against a dense Schur complement.

use nalgebra::{DMatrix, DVector};
use sole::{
    ContactSet, ElasticBody, Level, Material, Mesh, MeshSource, SoleModel, SoleSettings, element_stiffness, gradients,
};
use spatial::{Mat3, Vec3};

pub(crate) const FOAM: Material = Material { young_modulus_pa: 0.32e6, poisson_ratio: 0.31 };

/// Dense stiffness of all nodes, clamped or not.
fn dense_stiffness(mesh: &Mesh, material: &Material) -> DMatrix<f64> {
    let mut k = DMatrix::zeros(3 * mesh.nodes.len(), 3 * mesh.nodes.len());
    for t in &mesh.tetrahedra {
        let element = element_stiffness(&t.map(|i| mesh.nodes[i]), material);
        for a in 0..4 {
            for b in 0..4 {
                let mut block = k.fixed_view_mut::<3, 3>(3 * t[a], 3 * t[b]);
                block += element.fixed_view::<3, 3>(3 * a, 3 * b);
            }
        }
    }
    k
}

fn field(mesh: &Mesh, u: impl Fn(&Vec3) -> Vec3) -> DVector<f64> {
    DVector::from_iterator(3 * mesh.nodes.len(), mesh.nodes.iter().flat_map(|p| <[f64; 3]>::from(u(p))))
}

#[test]
fn rigid_motions_produce_no_force_and_stiffness_is_symmetric_and_definite() {
    let mesh = Mesh::kuhn_box([0.23, 0.13, 0.021], [4, 3, 2]).expect("a box");
    let k = dense_stiffness(&mesh, &FOAM);
    let scale = k.amax();
    assert!((&k - k.transpose()).amax() < 1e-14 * scale);
    for axis in 0..3 {
        let e = Vec3::ith(axis, 1.0);
        assert!((&k * field(&mesh, |_| e)).amax() < 1e-12 * scale, "translation {axis}");
        assert!((&k * field(&mesh, |p| e.cross(p))).amax() < 1e-13 * scale, "rotation {axis}");
    }
    let eigenvalues = k.symmetric_eigenvalues();
    let mut sorted: Vec<f64> = eigenvalues.iter().copied().collect();
    sorted.sort_by(f64::total_cmp);
    assert!(sorted[5].abs() < 1e-9 * sorted[6], "six rigid motions");
    assert!(sorted[6] > 0.0, "everything else costs energy");
}

#[test]
fn a_linear_displacement_gives_constant_stress_and_no_interior_force() {
    let mesh = Mesh::kuhn_box([0.2, 0.1, 0.05], [4, 3, 3]).expect("a box");
    let gradient = Mat3::new(1e-3, 2e-3, -1e-3, 0.5e-3, -2e-3, 3e-3, 1e-3, 0.0, 4e-3);
    let u = field(&mesh, |p| gradient * p);
    let k = dense_stiffness(&mesh, &FOAM);
    let force = &k * &u;
    let (low, high) = mesh.bounds();
    let largest = force.amax();
    for (i, p) in mesh.nodes.iter().enumerate() {
        let inside = (0..3).all(|axis| p[axis] > low[axis] + 1e-9 && p[axis] < high[axis] - 1e-9);
        if inside {
            assert!(force.rows(3 * i, 3).amax() < 1e-12 * largest, "node {i}");
        }
    }
    let strain = 0.5 * (gradient + gradient.transpose());
    let density = 0.5 * FOAM.lame_lambda() * strain.trace().powi(2) + FOAM.lame_mu() * (strain * strain).trace();
    let energy = 0.5 * u.dot(&force);
    assert!((energy / (density * 0.2 * 0.1 * 0.05) - 1.0).abs() < 1e-12);
}

#[test]
fn a_manufactured_solution_is_approached_with_second_order_and_its_gradient_with_first() {
    // u = c b(x) with the bubble b = product of s (1 - s): zero on the boundary, which is clamped.
    let c = Vec3::new(1.0, -0.5, 0.7);
    let bubble = |s: f64| [s * (1.0 - s), 1.0 - 2.0 * s, -2.0];
    let exact = |p: &Vec3| c * (bubble(p.x)[0] * bubble(p.y)[0] * bubble(p.z)[0]);
    let exact_gradient = |p: &Vec3| {
        let [x, y, z] = [bubble(p.x), bubble(p.y), bubble(p.z)];
        c * Vec3::new(x[1] * y[0] * z[0], x[0] * y[1] * z[0], x[0] * y[0] * z[1]).transpose()
    };
    let body_force = |p: &Vec3| {
        let [x, y, z] = [bubble(p.x), bubble(p.y), bubble(p.z)];
        let hessian = Mat3::new(
            x[2] * y[0] * z[0],
            x[1] * y[1] * z[0],
            x[1] * y[0] * z[1],
            x[1] * y[1] * z[0],
            x[0] * y[2] * z[0],
            x[0] * y[1] * z[1],
            x[1] * y[0] * z[1],
            x[0] * y[1] * z[1],
            x[0] * y[0] * z[2],
        );
        let (lambda, mu) = (FOAM.lame_lambda(), FOAM.lame_mu());
        -((lambda + mu) * hessian * c + mu * hessian.trace() * c)
    };
    let error = |cells: usize| {
        let mut mesh = Mesh::kuhn_box([1.0; 3], [cells; 3]).expect("a box");
        for p in &mut mesh.nodes {
            *p += Vec3::new(0.5, 0.5, 0.0);
        }
        mesh.clamped =
            (0..mesh.nodes.len()).filter(|i| mesh.nodes[*i].iter().any(|x| *x < 1e-9 || *x > 1.0 - 1e-9)).collect();
        let body = ElasticBody::new(&mesh, &FOAM).expect("a body");
        let mut force = vec![Vec3::zeros(); mesh.nodes.len()];
        // Four points of degree 2.
        let (a, b) = ((5.0 + 3.0 * 5.0_f64.sqrt()) / 20.0, (5.0 - 5.0_f64.sqrt()) / 20.0);
        for t in &mesh.tetrahedra {
            let corners = t.map(|i| mesh.nodes[i]);
            let (_, volume) = gradients(&corners);
            for q in 0..4 {
                let weight = |i: usize| if i == q { a } else { b };
                let p: Vec3 = (0..4).map(|i| weight(i) * corners[i]).sum();
                for i in 0..4 {
                    force[t[i]] += 0.25 * volume * weight(i) * body_force(&p);
                }
            }
        }
        let u = body.displacement(&force);
        // The norms of the theory: L2 of the displacement and of its gradient, over the elements by the same points. (Errors at the
        // nodes alone fall faster than the displacement's in between and would say less.)
        let mut squares = [0.0; 2];
        for t in &mesh.tetrahedra {
            let corners = t.map(|i| mesh.nodes[i]);
            let (shape, volume) = gradients(&corners);
            let gradient: Mat3 = (0..4).map(|i| u[t[i]] * shape[i].transpose()).sum();
            for q in 0..4 {
                let weight = |i: usize| if i == q { a } else { b };
                let p: Vec3 = (0..4).map(|i| weight(i) * corners[i]).sum();
                let at: Vec3 = (0..4).map(|i| weight(i) * u[t[i]]).sum();
                squares[0] += 0.25 * volume * (at - exact(&p)).norm_squared();
                squares[1] += 0.25 * volume * (gradient - exact_gradient(&p)).norm_squared();
            }
        }
        squares.map(f64::sqrt)
    };
    let errors = [error(4), error(8), error(16)];
    let order = |norm: usize, finer: usize| (errors[finer - 1][norm] / errors[finer][norm]).log2();
    // h^2 and h, and the nearer the finer the mesh.
    for (norm, theory) in [(0, 2.0), (1, 1.0)] {
        let [coarse, fine] = [order(norm, 1), order(norm, 2)];
        assert!((fine - theory).abs() < 0.08, "norm {norm}: order {fine}, errors {errors:?}");
        assert!((fine - theory).abs() < (coarse - theory).abs(), "norm {norm}: orders {coarse}, {fine}");
    }
}

/// Inverse of the Schur complement of the dense stiffness on the contact nodes.
pub(crate) fn dense_compliance(mesh: &Mesh, material: &Material) -> DMatrix<f64> {
    let k = dense_stiffness(mesh, material);
    let dofs = |nodes: &[usize]| nodes.iter().flat_map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect::<Vec<_>>();
    let contact = dofs(&mesh.contact);
    let interior: Vec<usize> =
        (0..mesh.nodes.len()).filter(|i| !mesh.contact.contains(i) && !mesh.clamped.contains(i)).collect();
    let interior = dofs(&interior);
    let pick = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| k[(rows[i], columns[j])])
    };
    let inner = pick(&interior, &interior).lu().solve(&pick(&interior, &contact)).expect("regular");
    let schur = pick(&contact, &contact) - pick(&contact, &interior) * inner;
    schur.try_inverse().expect("regular")
}

#[test]
fn the_condensed_compliance_is_the_inverse_of_the_dense_schur_complement() {
    let mesh = Mesh::kuhn_box([0.23, 0.13, 0.021], [4, 3, 2]).expect("a box");
    let dense = dense_compliance(&mesh, &FOAM);
    let nodal: Vec<Vec<(usize, f64)>> = mesh.contact.iter().map(|i| vec![(*i, 1.0)]).collect();
    let ours = ElasticBody::new(&mesh, &FOAM).expect("a body").compliance(&nodal);
    assert!((&ours - &dense).amax() < 1e-10 * dense.amax(), "{}", (&ours - &dense).amax() / dense.amax());
    assert!(ours.symmetric_eigenvalues().min() > 0.0);
}

#[test]
fn quadratic_elements_do_not_lock() {
    let stiffness = |level: Level, cells: [usize; 3], nu: f64| {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.03], cells };
        let material = Material { poisson_ratio: nu, ..FOAM };
        let model =
            SoleModel::build(&SoleSettings { mesh, material, level, ..SoleSettings::default() }).expect("a sole");
        let k = model.bonded_stiffness();
        [k[(2, 2)], k[(3, 3)], k[(4, 4)]]
    };
    let coarse = stiffness(Level::Fem, [10, 5, 3], 0.49);
    let fine = stiffness(Level::Fem, [16, 9, 4], 0.49);
    let quadratic = stiffness(Level::QuadraticFem, [10, 5, 3], 0.49);
    // Linear elements are too stiff from above; the quadratic coarse mesh is softer than the finer linear one.
    for axis in 0..3 {
        assert!(coarse[axis] > fine[axis] && fine[axis] > quadratic[axis], "{coarse:?} {fine:?} {quadratic:?}");
    }
    assert!(coarse[1] / quadratic[1] > 1.3, "at nu = 0.49 the roll stiffness of linear elements is far off");
    let (linear, quadratic) =
        (stiffness(Level::Fem, [10, 5, 3], 0.31), stiffness(Level::QuadraticFem, [10, 5, 3], 0.31));
    assert!(linear[0] / quadratic[0] < 1.06, "at nu = 0.31 the vertical stiffness is fine: {linear:?} {quadratic:?}");
}

#[test]
fn every_node_and_midpoint_of_the_glued_face_is_held_and_no_other() {
    let [nx, ny, nz] = [4, 3, 2];
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [nx, ny, nz] };
    // With the midpoints a cell of six tetrahedra has its 27 nodes: a grid of half the step.
    for (level, per_cell) in [(Level::Fem, 1), (Level::QuadraticFem, 2)] {
        let settings = SoleSettings { mesh: mesh.clone(), level, ..SoleSettings::default() };
        let statistics = SoleModel::build(&settings).expect("a sole").statistics();
        let layer = (per_cell * nx + 1) * (per_cell * ny + 1);
        assert_eq!(statistics.nodes, layer * (per_cell * nz + 1), "{level:?}");
        assert_eq!(statistics.degrees_of_freedom, 3 * layer * per_cell * nz, "{level:?}");
    }
}

#[test]
fn springs_have_the_stiffness_they_stand_for() {
    let build = |level: Level| SoleModel::build(&SoleSettings { level, ..SoleSettings::default() }).expect("a sole");
    let fem = build(Level::Fem).bonded_stiffness();
    let lumped = build(Level::Lumped).bonded_stiffness();
    for axis in 2..5 {
        assert!((lumped[(axis, axis)] / fem[(axis, axis)] - 1.0).abs() < 1e-9, "axis {axis}");
    }
    // One shear stiffness in all directions: the mean of forward and sideways.
    let shear = 0.5 * (fem[(0, 0)] + fem[(1, 1)]);
    assert!((fem[(0, 0)] / fem[(1, 1)] - 1.0).abs() > 1e-6, "or this says nothing");
    for axis in 0..2 {
        assert!((lumped[(axis, axis)] / shear - 1.0).abs() < 1e-9, "axis {axis}");
    }
    let winkler = build(Level::Winkler { cells: [9, 5] });
    assert_eq!(winkler.contact_points().len(), 60);
    assert!((winkler.bonded_stiffness()[(2, 2)] / fem[(2, 2)] - 1.0).abs() < 1e-9);
    let rigid = build(Level::Rigid);
    assert_eq!(rigid.contact_points().len(), 4);
    assert!(rigid.bonded_stiffness()[(2, 2)] > 0.99e9);
}

#[test]
fn all_free_surface_nodes_as_candidates_include_the_bottom_ones() {
    let all = SoleModel::build(&SoleSettings { contact: ContactSet::All, ..SoleSettings::default() }).expect("a sole");
    let bottom = SoleModel::build(&SoleSettings::default()).expect("a sole");
    assert_eq!(bottom.contact_points().len(), 104);
    // 104 below, and 38 around on each of the two layers between bottom and top.
    assert_eq!(all.contact_points().len(), 104 + 2 * 38);
}

#[test]
fn unsound_meshes_materials_and_frictions_are_named() {
    use sole::{MeshError, SoleError};
    let good = Mesh::kuhn_box([0.2, 0.1, 0.03], [2, 1, 1]).expect("a box");
    let broken = |change: &dyn Fn(&mut Mesh)| {
        let mut mesh = good.clone();
        change(&mut mesh);
        mesh.checked().expect_err("unsound")
    };
    assert!(matches!(broken(&|m| m.tetrahedra[3].swap(0, 1)), MeshError::BadElement { element: 3, .. }));
    assert!(matches!(broken(&|m| m.nodes[2].x = f64::NAN), MeshError::NodeNotFinite { node: 2 }));
    assert!(matches!(broken(&|m| m.nodes.push(Vec3::zeros())), MeshError::UnreferencedNode { node: 12 }));
    assert!(matches!(broken(&|m| m.tetrahedra[0][1] = 99), MeshError::UnknownNode { element: 0, node: 99 }));
    assert!(matches!(broken(&|m| m.clamped.clear()), MeshError::NothingClamped));
    assert!(matches!(broken(&|m| m.contact.clear()), MeshError::NoContactCandidate));
    assert!(matches!(broken(&|m| m.contact.push(m.clamped[0])), MeshError::ClampedContact { .. }));
    assert!(matches!(Mesh::kuhn_box([0.0, 1.0, 1.0], [1, 1, 1]), Err(MeshError::EmptyBox { .. })));
    let settings = SoleSettings::default();
    let incompressible = Material { poisson_ratio: 0.5, ..FOAM };
    let error = SoleModel::build(&SoleSettings { material: incompressible, ..settings.clone() });
    assert!(matches!(error, Err(SoleError::Material { .. })));
    let error = SoleModel::build(&SoleSettings { friction: -0.1, ..settings.clone() });
    assert!(matches!(error, Err(SoleError::Friction { point: 0, .. })));
    let error = SoleModel::build(&SoleSettings { level: Level::Patches { cells: [40, 20] }, ..settings.clone() });
    assert!(matches!(error, Err(SoleError::EmptyPatch { .. })));
    // A dense compliance of more points than fit is not begun.
    let fine = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [60, 40, 1] };
    let many =
        |mesh: &MeshSource, level| SoleModel::build(&SoleSettings { mesh: mesh.clone(), level, ..settings.clone() });
    for (mesh, level, found) in [
        (&fine, Level::Fem, 61 * 41),
        (&fine, Level::Winkler { cells: [2, 1] }, 61 * 41),
        (&settings.mesh, Level::Patches { cells: [4000, 4000] }, 4001 * 4001),
        (&settings.mesh, Level::Winkler { cells: [usize::MAX; 2] }, usize::MAX),
    ] {
        let expected = Some(SoleError::TooManyPoints { points: found, most: sole::CONTACT_POINTS_MAX });
        assert_eq!(many(mesh, level).err(), expected, "{level:?}");
    }
    assert!(many(&fine, Level::Patches { cells: [2, 1] }).is_ok(), "few patches of many nodes");
    let deep = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [20, 20, 11] };
    let error = many(&deep, Level::QuadraticFem).err();
    assert!(matches!(error, Some(SoleError::Mesh(MeshError::TooFine { elements: 26_400, .. }))), "{error:?}");
    // Patches on a block's edge are within it, however its corners round.
    let error = SoleModel::build(&SoleSettings { level: Level::Patches { cells: [40, 1] }, ..SoleSettings::default() });
    assert!(matches!(error, Err(SoleError::EmptyPatch { .. })));
}

/// An ellipse of 0.23 x 0.13 m: squares about the origin become circles, then the circles ellipses.
fn ellipse() -> Mesh {
    let mut mesh = Mesh::kuhn_box([1.0, 1.0, 0.021], [16, 16, 2]).expect("a block");
    for p in &mut mesh.nodes {
        (p.x, p.y) = (2.0 * p.x, 2.0 * p.y);
        let square = p.x.abs().max(p.y.abs());
        let norm = p.xy().norm().max(f64::MIN_POSITIVE);
        (p.x, p.y) = (0.115 * p.x * square / norm, 0.065 * p.y * square / norm);
    }
    mesh.checked().expect("sound")
}

#[test]
fn a_round_sole_has_no_patches_where_it_does_not_reach_and_is_as_stiff_as_without_patches() {
    let mesh = sole::MeshSource::Mesh(ellipse());
    let at = |level| SoleModel::build(&SoleSettings { mesh: mesh.clone(), level, ..SoleSettings::default() });
    let grid = at(Level::Patches { cells: [8, 7] }).expect("a sole");
    let points = grid.contact_points();
    assert_eq!(
        points.len(),
        72 - 4,
        "the corners of the grid are off the sole, their neighbours hold nodes on its edge"
    );
    assert!(points.iter().all(|p| (p.x / 0.115).hypot(p.y / 0.065) <= 1.0 + 1e-12), "on the sole");
    assert_eq!(grid.mirrored().contact_points().len(), points.len());
    // All points bonded to the ground: what a patch does not hold would be missing here.
    let vertical = |model: &SoleModel| {
        let n = model.contact_points().len();
        let row = |i: usize| (0..n).map(move |j| model.stiffness()[(3 * i + 2, 3 * j + 2)]);
        (0..n).flat_map(row).sum::<f64>()
    };
    let every_node = at(Level::Fem).expect("a sole");
    let (coarse, fine) = (vertical(&grid), vertical(&every_node));
    assert!(coarse < fine && coarse > 0.99 * fine, "{coarse} of {fine}");
    let springs = at(Level::Winkler { cells: [8, 7] }).expect("a sole");
    assert_eq!(springs.contact_points().len(), points.len());
}

#[test]
fn contact_points_of_quadratic_elements_stand_in_the_middle_of_their_hats() {
    let mesh = ellipse();
    let settings =
        SoleSettings { mesh: MeshSource::Mesh(mesh.clone()), level: Level::QuadraticFem, ..SoleSettings::default() };
    let model = SoleModel::build(&settings).expect("a sole");
    // INT hat_a x / INT hat_a triangle by triangle: (2 a + b + c) area/12 over area/3.
    let mut sums = vec![(Vec3::zeros(), 0.0); mesh.nodes.len()];
    for face in mesh.surface().into_iter().filter(|face| face.iter().all(|i| mesh.contact.binary_search(i).is_ok())) {
        let [a, b, c] = face.map(|i| mesh.nodes[i]);
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        for i in face {
            sums[i].0 += area / 12.0 * (a + b + c + mesh.nodes[i]);
            sums[i].1 += area / 3.0;
        }
    }
    for (node, point) in mesh.contact.iter().zip(model.contact_points()) {
        let (sum, area) = sums[*node];
        assert!((sum / area - point).norm() < 1e-15, "node {node}: {} {point}", sum / area);
    }
}

#[test]
fn springs_share_the_stiffness_by_the_area_they_stand_for() {
    let settings = SoleSettings {
        mesh: MeshSource::Box { size_m: [0.24, 0.12, 0.021], cells: [24, 12, 1] },
        level: Level::Winkler { cells: [4, 2] },
        ..SoleSettings::default()
    };
    let model = SoleModel::build(&settings).expect("a sole");
    let stiffness = |i: usize| 1.0 / model.compliance()[(3 * i + 2, 3 * i + 2)];
    let total: f64 = (0..15).map(stiffness).sum();
    // Points row by row: corners stand for an eighth of the whole over four, edges for twice, the middle for four times as much.
    for (point, quarters) in
        [(0, 1.0), (4, 1.0), (10, 1.0), (14, 1.0), (2, 2.0), (5, 2.0), (9, 2.0), (6, 4.0), (7, 4.0)]
    {
        let share = stiffness(point) / total * 32.0;
        // Kuhn's triangles give a block's corners unequal areas, a tenth of a patch's here.
        assert!((share / quarters - 1.0).abs() < 0.1, "point {point}: {share} of {quarters}");
    }
}

/// Of scikit-fem with 14 x 8 x 3 quadratic hexahedra, all contact points stuck: sinkage (mm) under 420 N, roll and pitch (degrees) with the ZMP
/// 20 mm to the left and 30 mm ahead. All levels: `examples/press.rs`.
#[test]
fn patches_of_quadratic_elements_sink_and_tilt_as_scikit_fem_says() {
    const REFERENCE: [f64; 3] = [0.7015, 0.5996, 0.2820];
    let errors = |cells, level| {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells };
        let model = std::sync::Arc::new(
            SoleModel::build(&SoleSettings { mesh, level, ..SoleSettings::default() }).expect("a sound sole"),
        );
        let pressed = |x_m: f64, y_m: f64| {
            let mut estimator =
                sole::StanceEstimator::new(std::sync::Arc::clone(&model), sole::EstimatorSettings::default());
            estimator.touch_down(sole::Foothold::default());
            let zmp = nalgebra::Vector2::new(x_m, y_m);
            let report = estimator.step(&sole::StanceReference::constant(Vec3::new(0.0, 0.0, 420.0), zmp));
            assert!(report.status.is_solved(), "{:?}", report.status);
            report.sole_pose
        };
        let angles = |pose: spatial::Transform| spatial::so3::roll_pitch_yaw(&pose.rotation).map(f64::to_degrees);
        let found = [
            -1e3 * pressed(0.0, 0.0).translation.z,
            angles(pressed(0.0, 0.020)).x.abs(),
            angles(pressed(0.030, 0.0)).y.abs(),
        ];
        [0, 1, 2].map(|i| found[i] / REFERENCE[i] - 1.0)
    };
    for (cells, patches) in [([12, 7, 3], [8, 7]), ([12, 7, 3], [6, 5]), ([8, 7, 2], [8, 7])] {
        let quadratic = errors(cells, Level::QuadraticPatches { cells: patches });
        assert!(quadratic.iter().all(|error| error.abs() < 0.015), "{cells:?} {patches:?}: {quadratic:?}");
    }
    // Linear elements on the same mesh roll too little by a tenth.
    assert!(errors([12, 7, 3], Level::Patches { cells: [8, 7] })[1] < -0.06);
}
