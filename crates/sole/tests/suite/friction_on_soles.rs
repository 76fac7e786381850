//! The contact solvers on the problems that soles make: five shapes, eight poses, friction from 0 to 1.5, cold.

use friction::{ContactProblem, Settings, Status, Workspace, gauss_seidel, newton, proximal, solve};
use nalgebra::{DMatrix, DVector};
use sole::{Material, MeshSource, SoleModel, SoleSettings};
use spatial::{Transform, Vec3, so3};

/// Heights (m) and Poisson's ratios.
pub const SHAPES: [(f64, f64); 5] = [(0.03, 0.31), (0.008, 0.31), (0.06, 0.31), (0.06, 0.47), (0.012, 0.47)];

pub fn shape(height: f64, poisson_ratio: f64) -> SoleModel {
    SoleModel::build(&SoleSettings {
        mesh: MeshSource::Box { size_m: [0.23, 0.13, height], cells: [6, 4, 2] },
        material: Material { young_modulus_pa: 0.32e6, poisson_ratio },
        ..SoleSettings::default()
    })
    .expect("a sole")
}

/// Poses of the sole and how far it has slid since it touched.
pub fn poses() -> [(Transform, Vec3); 8] {
    let pose = |roll: f64, pitch: f64, yaw: f64, z: f64| {
        Transform::new(so3::from_roll_pitch_yaw(roll, pitch, yaw), Vec3::new(0.0, 0.0, z))
    };
    [
        (pose(0.0, 0.0, 0.0, -0.001), Vec3::zeros()),
        (pose(0.01, 0.01, 0.0, -0.004), Vec3::new(2e-4, 0.0, 0.0)),
        (pose(0.0, -0.04, 0.0, 0.003), Vec3::zeros()),
        (pose(0.01, 0.03, 0.02, 0.001), Vec3::new(1e-4, 0.0, 0.0)),
        (pose(0.0, 0.0, 0.03, -0.001), Vec3::zeros()),
        (pose(0.005, 0.01, 0.0, -0.001), Vec3::new(1.2e-3, 3e-4, 0.0)),
        (pose(0.0, 0.005, 0.0, -0.001), Vec3::new(8e-3, -3e-3, 0.0)),
        (pose(0.02, 0.02, 0.0, 0.0033), Vec3::new(1e-4, 0.0, 0.0)),
    ]
}

pub fn problem(model: &SoleModel, pose: &Transform, slip: &Vec3, mu: f64) -> ContactProblem {
    let (points, c) = (model.contact_points(), model.compliance());
    let n = points.len();
    let mut delassus = DMatrix::zeros(3 * n, 3 * n);
    let mut free = DVector::zeros(3 * n);
    for b in 0..n {
        for a in 0..n {
            let block = pose.rotation * c.fixed_view::<3, 3>(3 * a, 3 * b) * pose.rotation.transpose();
            delassus.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(&block);
        }
        let from = Vec3::new(points[b].x, points[b].y, 0.0);
        free.fixed_rows_mut::<3>(3 * b).copy_from(&(pose.point(&points[b]) - from + slip));
    }
    ContactProblem::new(delassus, free, vec![mu; n]).expect("a sound problem")
}

#[test]
fn no_pose_friction_or_shape_defeats_the_solvers_and_they_agree() {
    let settings = Settings { tolerance: 1e-12, ..Settings::default() };
    for (height, poisson_ratio) in SHAPES {
        let model = shape(height, poisson_ratio);
        for mu in [0.0, 0.3, 0.8, 1.5] {
            for (k, (x, slip)) in poses().iter().enumerate() {
                let name = format!("{height} m, nu {poisson_ratio}, mu {mu}, pose {k}");
                let problem = problem(&model, x, slip, mu);
                let n = problem.contact_count();
                let all = solve(&problem, &mut Workspace::new(n), &settings);
                assert_eq!(all.status, Status::Solved, "{name}: {:e}", all.residual.relative);
                let scale = all.force.norm().max(1e-9);
                let swept = gauss_seidel(&problem, &mut Workspace::new(n), &settings);
                assert_eq!(swept.status, Status::Solved, "{name}, Gauss-Seidel: {:e}", swept.residual.relative);
                assert!((&all.force - &swept.force).norm() < 1e-9 * scale, "{name}");
                // Newton from the states that a few sweeps find.
                let mut workspace = Workspace::new(n);
                gauss_seidel(&problem, &mut workspace, &Settings { sweeps_max: 20, ..settings });
                let polished = newton(&problem, &mut workspace, &settings);
                assert_eq!(polished.status, Status::Solved, "{name}, Newton: {:e}", polished.residual.relative);
                assert!((&all.force - &polished.force).norm() < 1e-9 * scale, "{name}, Newton");
            }
        }
    }
}

#[test]
fn the_solver_that_ships_succeeds_far_beyond_any_real_friction() {
    let settings = Settings { tolerance: 1e-12, ..Settings::default() };
    for (height, poisson_ratio) in SHAPES {
        let model = shape(height, poisson_ratio);
        for mu in [2.0, 3.0, 10.0] {
            for (k, (x, slip)) in poses().iter().enumerate() {
                let problem = problem(&model, x, slip, mu);
                let report = solve(&problem, &mut Workspace::new(problem.contact_count()), &settings);
                let name = format!("{height} m, nu {poisson_ratio}, mu {mu}, pose {k}");
                assert_eq!(report.status, Status::Solved, "{name}: {:e}", report.residual.relative);
            }
        }
    }
}

/// Rubber on dry ground, a thick nearly incompressible sole, sliding: so unusual is that not.
#[test]
fn at_high_friction_one_problem_has_two_solutions() {
    let model = shape(0.06, 0.47);
    let (x, slip) = poses()[6];
    let mu = 1.5;
    let problem = problem(&model, &x, &slip, mu);
    let n = problem.contact_count();
    let settings = Settings { tolerance: 1e-12, ..Settings::default() };
    let one = gauss_seidel(&problem, &mut Workspace::new(n), &settings);
    let other = proximal(&problem, &mut Workspace::new(n), &settings);
    for report in [&one, &other] {
        assert_eq!(report.status, Status::Solved, "{:e}", report.residual.relative);
        // The laws themselves, without the solvers' own residual: to 1e-9 of the load and of the way slid.
        let (load, way) = (report.force.norm(), slip.norm());
        let delta = problem.displacement(&report.force);
        for a in 0..n {
            let f: Vec3 = report.force.fixed_rows::<3>(3 * a).into();
            let d: Vec3 = delta.fixed_rows::<3>(3 * a).into();
            assert!(f.z >= -1e-9 * load && d.z >= -1e-9 * way, "Signorini at {a}: {f} {d}");
            assert!(f.z * d.z <= 1e-9 * load * way, "Signorini at {a}: {f} {d}");
            assert!(f.xy().norm() <= mu * f.z + 1e-9 * load, "the cone at {a}: {f}");
            let against = f.xy() * d.xy().norm() + mu * f.z * d.xy();
            assert!(against.norm() <= 1e-8 * load * way, "Coulomb at {a}: {f} {d}");
        }
    }
    let apart = (&one.force - &other.force).norm() / one.force.norm();
    assert!(apart > 0.1, "the two solutions differ by {apart}");
    // Each is a solution on its own: Gauss-Seidel stays where it starts.
    for report in [&one, &other] {
        let mut workspace = Workspace::new(n);
        workspace.force.copy_from_slice(report.force.as_slice());
        let again = gauss_seidel(&problem, &mut workspace, &settings);
        assert!((&again.force - &report.force).norm() < 1e-9 * report.force.norm());
    }
}

/// A box of 4 kg on eight corner contacts, twice as many as it needs: `W = J M^-1 J'` has rank 6 of 24.
#[test]
fn a_rank_deficient_stack_is_solved_by_the_proximal_method() {
    let corners: Vec<Vec3> =
        (0..8).map(|i| Vec3::new(f64::from(i % 4) * 0.1 - 0.15, if i < 4 { -0.1 } else { 0.1 }, -0.05)).collect();
    let mass = 4.0;
    let inertia = [0.02, 0.03, 0.04];
    let mut j = DMatrix::zeros(24, 6);
    for (i, p) in corners.iter().enumerate() {
        j.fixed_view_mut::<3, 3>(3 * i, 0).fill_with_identity();
        j.fixed_view_mut::<3, 3>(3 * i, 3).copy_from(&-so3::skew(p));
    }
    let inverse = DMatrix::from_diagonal(&DVector::from_vec(vec![
        1.0 / mass,
        1.0 / mass,
        1.0 / mass,
        1.0 / inertia[0],
        1.0 / inertia[1],
        1.0 / inertia[2],
    ]));
    let w = &j * inverse * j.transpose();
    // Falling for 10 ms while pushed sideways.
    let velocity = DVector::from_vec(vec![0.03, 0.01, -0.0981, 0.0, 0.1, 0.2]);
    let problem = ContactProblem::new(w, &j * velocity, vec![0.4; 8]).expect("a sound problem");
    let settings = Settings { tolerance: 1e-8, ..Settings::default() };
    let report = proximal(&problem, &mut Workspace::new(8), &settings);
    assert_eq!(report.status, Status::Solved, "{:e}", report.residual.relative);
    let report = solve(&problem, &mut Workspace::new(8), &settings);
    assert_eq!(report.status, Status::Solved, "{:e}", report.residual.relative);
    assert!(report.force.dot(&report.delta) <= 1e-9, "contact and friction take energy");
}
