//! The picture of a sole shows it where the tick has it, or there is none.

use nalgebra::{Matrix3, Vector2};
use sole::{
    EstimatorSettings, Foothold, Level, Material, MeshSource, Plane, PoseDrivenContact, PoseDrivenSettings, SoleError,
    SoleModel, SoleSettings, StanceEstimator, StanceReference, StanceReport, deformed_sole_vtk,
};
use spatial::{Transform, Vec3, so3};

/// Rounding of a condensation and of text to 17 digits (m), far below any displacement.
const SAME_PLACE_M: f64 = 1e-9;

fn settings(level: Level) -> SoleSettings {
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [6, 4, 2] };
    SoleSettings { mesh, level, ..SoleSettings::default() }
}

fn sole(level: Level) -> SoleModel {
    SoleModel::build(&settings(level)).expect("a sole")
}

/// Heel-to-toe and sideways, the rear of the sole off the ground, on a turned foothold.
fn stance(model: &SoleModel) -> StanceReport {
    let mut estimator = StanceEstimator::new(model.clone(), EstimatorSettings::default());
    estimator.touch_down(Foothold { x_m: 0.3, y_m: -0.1, yaw_rad: 0.4 });
    let zmp = (so3::about_z(0.4) * Vec3::new(0.07, 0.01, 0.0)).xy() + Vector2::new(0.3, -0.1);
    estimator.step(&StanceReference::constant(Vec3::new(0.0, 0.0, 50.0), Vector2::new(0.3, -0.1)));
    estimator.step(&StanceReference::constant(Vec3::new(30.0, -20.0, 383.0), zmp)).clone()
}

/// As many numbers as asked for, behind the line of a picture that begins so.
fn numbers(text: &str, head: &str, count: usize) -> Vec<f64> {
    let mut lines = text.lines().skip_while(|line| !line.starts_with(head));
    assert!(lines.next().is_some(), "no {head}");
    let words = lines.flat_map(str::split_ascii_whitespace).take(count);
    words.map(|word| word.parse().expect("a number")).collect()
}

/// One vector per node.
fn vectors(text: &str, head: &str) -> Vec<Vec3> {
    let points = text.lines().find(|line| line.starts_with("POINTS")).expect("points");
    let count: usize = points.split(' ').nth(1).expect("a count").parse().expect("a number");
    numbers(text, head, 3 * count).chunks_exact(3).map(Vec3::from_column_slice).collect()
}

/// The points of a picture.
fn points(text: &str) -> Vec<Vec3> {
    vectors(text, "POINTS")
}

fn assert_shows(model: &SoleModel, text: &str, node_positions: &[Vec3]) {
    let points = points(text);
    let mesh = model.mesh().expect("a mesh");
    assert_eq!(points.len(), mesh.nodes.len());
    for (node, position) in mesh.contact.iter().zip(node_positions) {
        assert!((points[*node] - position).norm() < SAME_PLACE_M, "node {node}: {} for {position}", points[*node]);
    }
}

#[test]
fn contact_nodes_are_drawn_where_the_tick_has_them_and_the_clamped_ones_where_the_foot_is() {
    let material = settings(Level::Fem).material;
    for model in [sole(Level::Fem), sole(Level::Fem).mirrored()] {
        let report = stance(&model);
        assert!(report.status.is_solved() && report.open > 5 && report.sticking > 5, "{:?}", report.status);
        let (x, positions) = (&report.sole_pose, &report.node_positions);
        let text = deformed_sole_vtk(&model, &material, x, positions, &report.node_forces).expect("a picture");
        for piece in ["UNSTRUCTURED_GRID", "POINTS 105", "CELLS 288 1440", "displacement_m", "force_n"] {
            assert!(text.contains(piece), "{piece} in\n{}", &text[..400]);
        }
        assert_shows(&model, &text, positions);
        let mesh = model.mesh().expect("a mesh");
        for node in &mesh.clamped {
            assert!((points(&text)[*node] - x.point(&mesh.nodes[*node])).norm() < SAME_PLACE_M, "node {node}");
        }
        // Arrows: how far each node is from where an undeformed sole would have it, and what the ground does to it.
        let (moved, pushed) = (vectors(&text, "VECTORS displacement_m"), vectors(&text, "VECTORS force_n"));
        let drawn = points(&text);
        for (node, at) in drawn.iter().enumerate() {
            let away = at - x.point(&mesh.nodes[node]);
            assert!((moved[node] - away).norm() < SAME_PLACE_M, "node {node}: {} for {away}", moved[node]);
            let force = mesh.contact.iter().position(|i| *i == node).map_or(Vec3::zeros(), |i| report.node_forces[i]);
            assert!((pushed[node] - force).norm() < 1e-9, "node {node}: {} for {force}", pushed[node]);
        }
        // Viewers turn elements with negative volumes inside out.
        for cell in numbers(&text, "CELLS", 5 * 288).chunks_exact(5) {
            let [a, b, c, d] = [1, 2, 3, 4].map(|k| drawn[cell[k] as usize]);
            assert!(cell[0] == 4.0 && (b - a).cross(&(c - a)).dot(&(d - a)) > 0.0, "{cell:?}");
        }
        let short = deformed_sole_vtk(&model, &material, x, positions, &report.node_forces[1..]);
        assert_eq!(short.err(), Some(SoleError::Count { expected: 35, found: 34 }));
    }
}

#[test]
fn a_viscous_sole_is_drawn_where_it_is_and_not_where_its_forces_would_hold_an_elastic_one() {
    let model = sole(Level::Fem);
    let viscous = PoseDrivenSettings { viscosity_time_s: 0.02, ..PoseDrivenSettings::default() };
    let mut contact = PoseDrivenContact::new(model.clone(), viscous);
    for tick in 0..3 {
        let depth = 2e-4 * f64::from(tick);
        let x = Transform::new(so3::from_roll_pitch_yaw(0.01, 0.02, 0.3), Vec3::new(0.1, 0.2, -depth));
        let report = contact.evaluate(&x, &Plane, 0.005).clone();
        contact.commit();
        let material = settings(Level::Fem).material;
        let text = deformed_sole_vtk(&model, &material, &x, &report.node_positions, &report.node_forces);
        assert_shows(&model, &text.expect("a picture"), &report.node_positions);
    }
}

#[test]
fn other_levels_and_other_foams_have_no_picture() {
    let foam = settings(Level::Fem).material;
    let picture = |model: &SoleModel, material: Material| {
        let report = stance(model);
        deformed_sole_vtk(model, &material, &report.sole_pose, &report.node_positions, &report.node_forces)
    };
    // As many contact points as the mesh has contact nodes, Winkler's even at the same places.
    for level in [Level::QuadraticFem, Level::Winkler { cells: [6, 4] }] {
        let model = sole(level);
        let error = picture(&model, foam).err();
        let Some(SoleError::OtherBody { difference_m, .. }) = error else { panic!("{level:?}: {error:?}") };
        assert!(difference_m > 1e-5, "{level:?}: {difference_m} m");
    }
    for level in [Level::Rigid, Level::Lumped, Level::Patches { cells: [3, 2] }] {
        assert!(matches!(picture(&sole(level), foam), Err(SoleError::Count { .. })), "{level:?}");
    }
    for change in [|foam: &mut Material| foam.young_modulus_pa *= 0.9, |foam: &mut Material| foam.poisson_ratio = 0.2] {
        let mut other = foam;
        change(&mut other);
        assert!(matches!(picture(&sole(Level::Fem), other), Err(SoleError::OtherBody { .. })), "{other:?}");
    }
    let points = vec![Vec3::new(0.1, 0.0, 0.0), Vec3::new(-0.1, 0.0, 0.0)];
    let model = SoleModel::from_parts(points, nalgebra::DMatrix::identity(6, 6) * 1e-5, vec![0.6; 2], Vec3::z());
    let none = [Vec3::zeros(); 2];
    let x = Transform::new(Matrix3::identity(), Vec3::zeros());
    let error = deformed_sole_vtk(&model.expect("a sole"), &foam, &x, &none, &none);
    assert_eq!(error.err(), Some(SoleError::Count { expected: 0, found: 2 }), "no mesh");
}
