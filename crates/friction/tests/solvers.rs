//! The solvers on problems of rigid bodies and random ones: agreement, every status, every refusal.

use friction::{
    ContactProblem, ContactState, ProblemError, Report, Settings, Status, Workspace, gauss_seidel, newton, proximal,
    solve,
};
use nalgebra::{DMatrix, DVector, Vector3};

/// Numbers in -1..1, the same ones every time.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / f64::from(1_u32 << 31) * 2.0 - 1.0
    }
}

/// Elastic: positive definite, neighbours coupled; some points far off, some pressed, some dragged.
fn elastic(n: usize, mu: f64, seed: u64) -> ContactProblem {
    let mut next = random(seed);
    let a = DMatrix::from_fn(3 * n, 3 * n, |_, _| next());
    let scale = 1e-5 / (3 * n) as f64;
    let w = (&a * a.transpose()) * scale + DMatrix::identity(3 * n, 3 * n) * (0.3 * 1e-5);
    let q = DVector::from_fn(3 * n, |i, _| if i % 3 == 2 { 1e-3 * (next() - 0.3) } else { 5e-4 * next() });
    ContactProblem::new(w, q, vec![mu; n]).expect("a sound problem")
}

/// A slab of 4 kg that moves only along x and z and tilts about y, on four points per side: velocities after 1 ms under
/// gravity and a push. No force moves a point along y: every 3 x 3 block has rank 2, and `W` rank 3 of 24.
fn planar(push_n: f64, mu: f64) -> ContactProblem {
    let (mass, inertia, step_s) = (4.0, 0.03, 1e-3);
    let inverse = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0 / mass, 1.0 / mass, 1.0 / inertia]));
    let mut j = DMatrix::zeros(24, 3);
    for i in 0..8 {
        let (x, z) = (0.1 * (i % 4) as f64 - 0.15, -0.05);
        // v_x = vx + w z, v_z = vz - w x
        j[(3 * i, 0)] = 1.0;
        j[(3 * i, 2)] = z;
        j[(3 * i + 2, 1)] = 1.0;
        j[(3 * i + 2, 2)] = -x;
    }
    let load = DVector::from_vec(vec![push_n, -9.81 * mass, 0.0]) * step_s;
    let q = &j * (&inverse * load);
    // Impulses over the step are forces: W in m/s per N.
    let w = &j * inverse * j.transpose() * step_s;
    ContactProblem::new(w, q, vec![mu; 8]).expect("semi-definite is enough")
}

fn tight() -> Settings {
    Settings { tolerance: 1e-12, ..Settings::default() }
}

fn laws_hold(problem: &ContactProblem, report: &Report, relative: f64) {
    let delta = problem.displacement(&report.force);
    let (load, way) = (report.force.amax().max(f64::MIN_POSITIVE), problem.free().amax());
    for (a, mu) in problem.mu().iter().enumerate() {
        let f: Vector3<f64> = report.force.fixed_rows::<3>(3 * a).into();
        let d: Vector3<f64> = delta.fixed_rows::<3>(3 * a).into();
        assert!(f.z >= -relative * load && d.z >= -relative * way, "Signorini at {a}: {f} {d}");
        assert!(f.z * d.z <= relative * load * way, "Signorini at {a}: {f} {d}");
        assert!(f.xy().norm() <= mu * f.z + relative * load, "the cone at {a}: {f}");
        let against = f.xy() * d.xy().norm() + *mu * f.z * d.xy();
        assert!(against.norm() <= relative * load * way, "Coulomb at {a}: {f} {d}");
    }
}

#[test]
fn three_solvers_find_the_same_forces_of_random_elastic_problems() {
    for (n, mu, seed) in [(1, 0.5, 1), (3, 0.0, 2), (10, 0.3, 3), (10, 0.8, 4), (40, 0.6, 5), (40, 1.2, 6)] {
        let problem = elastic(n, mu, seed);
        let swept = gauss_seidel(&problem, &mut Workspace::new(n), &tight());
        let mut workspace = Workspace::new(n);
        gauss_seidel(&problem, &mut workspace, &Settings { sweeps_max: 10, ..tight() });
        let polished = newton(&problem, &mut workspace, &tight());
        let shifted = proximal(&problem, &mut Workspace::new(n), &tight());
        for (name, report) in [("Gauss-Seidel", &swept), ("Newton", &polished), ("proximal", &shifted)] {
            assert_eq!(report.status, Status::Solved, "{name}, {n} contacts: {:e}", report.residual.relative);
            laws_hold(&problem, report, 1e-9);
            let apart = (&report.force - &swept.force).norm();
            assert!(apart <= 1e-9 * swept.force.norm(), "{name}, {n} contacts: {apart} N");
        }
        assert!(n == 1 || swept.force.iter().any(|f| *f == 0.0), "some contact is open");
    }
}

#[test]
fn a_start_near_the_answer_takes_fewer_sweeps() {
    let problem = elastic(40, 0.6, 5);
    let mut workspace = Workspace::new(40);
    let cold = gauss_seidel(&problem, &mut workspace, &Settings::default());
    let q = problem.free() * 1.01;
    let next = ContactProblem::new(problem.delassus().clone(), q, problem.mu().to_vec()).expect("as sound as before");
    let warm = gauss_seidel(&next, &mut workspace, &Settings::default());
    let again = gauss_seidel(&next, &mut Workspace::new(40), &Settings::default());
    assert_eq!([cold.status, warm.status, again.status], [Status::Solved; 3]);
    assert!(warm.iterations < again.iterations, "{} sweeps, cold {}", warm.iterations, again.iterations);
}

#[test]
fn contacts_that_no_force_can_move_in_some_direction_are_solved() {
    let weight_n = 4.0 * 9.81;
    // Pushed by half of what friction holds: all stick. By twice as much: all slide.
    for (part, slides) in [(0.5, false), (2.0, true)] {
        let mu = 0.6;
        let problem = planar(part * mu * weight_n, mu);
        let swept = gauss_seidel(&problem, &mut Workspace::new(8), &tight());
        assert_eq!((swept.status, swept.iterations), (Status::Singular, 0));
        let report = solve(&problem, &mut Workspace::new(8), &Settings { tolerance: 1e-10, ..tight() });
        assert_eq!(report.status, Status::Solved, "{:e}", report.residual.relative);
        laws_hold(&problem, &report, 1e-8);
        let total = (0..8).map(|a| Vector3::from(report.force.fixed_rows::<3>(3 * a))).sum::<Vector3<f64>>();
        let friction = if slides { -mu * weight_n } else { -part * mu * weight_n };
        assert!((total - Vector3::new(friction, 0.0, weight_n)).norm() < 1e-6 * weight_n, "{total}");
        let speed = problem.displacement(&report.force)[0];
        let expected = if slides { (part - 1.0) * mu * 9.81 * 1e-3 } else { 0.0 };
        assert!((speed - expected).abs() < 1e-8, "{speed} m/s, expected {expected}");
    }
}

#[test]
fn who_runs_out_of_iterations_says_so_and_gives_the_best_forces() {
    let problem = elastic(40, 1.2, 6);
    let zero = problem.residual(&DVector::zeros(120)).relative;
    let one = Settings { sweeps_max: 1, newton_iterations_max: 1, proximal_iterations_max: 1, tolerance: 1e-12 };
    for (name, solver) in [
        ("Gauss-Seidel", gauss_seidel as fn(&ContactProblem, &mut Workspace, &Settings) -> Report),
        ("Newton", newton),
        ("proximal", proximal),
        ("all", solve),
    ] {
        let report = solver(&problem, &mut Workspace::new(40), &one);
        assert_eq!(report.status, Status::IterationLimit, "{name}");
        assert!(report.residual.relative <= zero && report.residual.relative > 1e-12, "{name}: {:?}", report.residual);
        assert_eq!(report.residual, problem.residual(&report.force), "{name}: judged by what is returned");
    }
}

#[test]
fn newton_says_when_its_matrix_is_singular() {
    // One body on two contacts at the same place: which one carries what is open.
    let mut w = DMatrix::zeros(6, 6);
    for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        w.fixed_view_mut::<3, 3>(3 * a, 3 * b).fill_with_identity();
    }
    let q = DVector::from_vec(vec![0.0, 0.0, -1.0, 0.0, 0.0, -1.0]);
    let problem = ContactProblem::new(w, q, vec![0.5; 2]).expect("semi-definite is enough");
    let report = newton(&problem, &mut Workspace::new(2), &tight());
    assert_eq!(report.status, Status::Singular);
    let report = solve(&problem, &mut Workspace::new(2), &tight());
    assert_eq!(report.status, Status::Solved);
    assert!((report.force[2] + report.force[5] - 1.0).abs() < 1e-11);
}

#[test]
fn what_is_not_a_contact_problem_is_refused_by_place() {
    let w = |blocks: [[f64; 3]; 2]| DMatrix::from_diagonal(&DVector::from_vec(blocks.concat()));
    let sound = || w([[1.0; 3]; 2]);
    let q = || DVector::from_vec(vec![0.0, 0.0, -1.0, 0.0, 0.0, -1.0]);
    let refused = |w, q, mu: [f64; 2]| ContactProblem::new(w, q, mu.to_vec()).expect_err("not a contact problem");
    let zero = refused(w([[1.0; 3], [0.0; 3]]), q(), [0.5; 2]);
    assert_eq!(zero, ProblemError::ImmovableContact { contact: 1 });
    let negative = refused(w([[1.0; 3], [1.0, -0.1, 1.0]]), q(), [0.5; 2]);
    assert_eq!(negative, ProblemError::NegativeBlock { contact: 1, eigenvalue: -0.1 });
    let mut lopsided = sound();
    lopsided[(0, 4)] = 0.5;
    assert!(matches!(refused(lopsided, q(), [0.5; 2]), ProblemError::NotSymmetric { row: 0, column: 4, .. }));
    let mut broken = sound();
    broken[(5, 5)] = f64::NAN;
    assert_eq!(refused(broken, q(), [0.5; 2]), ProblemError::NotFinite { what: "W", row: 5 });
    assert_eq!(refused(sound(), q() * f64::INFINITY, [0.5; 2]), ProblemError::NotFinite { what: "q", row: 0 });
    assert_eq!(refused(sound(), q(), [0.5, f64::NAN]), ProblemError::NotFinite { what: "mu", row: 1 });
    let mu = refused(sound(), q(), [0.5, -0.1]);
    assert_eq!(mu, ProblemError::NegativeFriction { contact: 1, mu: -0.1 });
    assert!(matches!(refused(sound(), DVector::zeros(5), [0.5; 2]), ProblemError::Size { free: 5, .. }));
}

#[test]
fn the_residual_is_the_one_of_the_docs_in_newtons() {
    // Two contacts of 2e-4 m/N, rho = 5000 N/m; each 1 mm and 0.6 mm deep.
    let w = DMatrix::identity(6, 6) * 2e-4;
    let q = DVector::from_vec(vec![0.0, 0.0, -1e-3, 0.0, 0.0, -0.6e-3]);
    let problem = ContactProblem::new(w, q, vec![0.5; 2]).expect("sound");
    let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
    // Without force: 5 N and 3 N are missing.
    let none = problem.residual(&DVector::zeros(6));
    assert!(close(none.absolute_n, 34.0_f64.sqrt()) && close(none.relative, 1.0), "{none:?}");
    assert_eq!(none.worst_contact, 0);
    // 4 N of 5, 1 N of 3; relative to the force that there is.
    let some = problem.residual(&DVector::from_vec(vec![0.0, 0.0, 4.0, 0.0, 0.0, 1.0]));
    assert!(close(some.absolute_n, 5.0_f64.sqrt()) && close(some.relative, (5.0_f64 / 17.0).sqrt()), "{some:?}");
    assert_eq!(some.worst_contact, 1);
    let first = problem.residual(&DVector::from_vec(vec![0.0, 0.0, 3.0, 0.0, 0.0, 2.0]));
    assert_eq!(first.worst_contact, 0);
    // Sideways: 1 N of friction on a contact that has not moved sideways is too much by what the law says, z = F - rho
    // delta.
    let side = problem.residual(&DVector::from_vec(vec![1.0, 0.0, 5.0, 0.0, 0.0, 3.0]));
    let (slip, rho, mu) = (2e-4, 5000.0, 0.5);
    let shifted = Vector3::new(1.0 - rho * slip, 0.0, 5.0 - rho * mu * slip);
    assert!(close(side.absolute_n, (Vector3::new(1.0, 0.0, 5.0) - shifted).norm()), "{side:?}");
}

#[test]
fn an_asymmetry_of_rounding_is_averaged_and_more_is_refused() {
    let with = |mirror: f64| {
        let mut w = DMatrix::identity(3, 3) * 2e-4;
        (w[(0, 2)], w[(2, 0)]) = (1.0e-6, mirror);
        ContactProblem::new(w, DVector::from_vec(vec![0.0, 0.0, -1e-3]), vec![0.5])
    };
    let rounding = 1e-6 * (1.0 + 1e-9);
    let problem = with(rounding).expect("symmetric to rounding");
    assert_eq!([(0, 2), (2, 0)].map(|at| problem.delassus()[at]), [0.5 * (1e-6 + rounding); 2]);
    assert!(matches!(with(1.001e-6), Err(ProblemError::NotSymmetric { row: 0, column: 2, .. })));
}

#[test]
fn an_indefinite_operator_is_refused_and_a_deficient_one_is_not() {
    for seed in 1..40 {
        let mut next = random(seed);
        let (n, rank) = (12, 3 + seed as usize % 30);
        let factor = DMatrix::from_fn(3 * n, rank, |_, _| next());
        // Units of every size, as of metres beside radians.
        let units = DVector::from_fn(3 * n, |_, _| 10_f64.powf(2.0 * next()));
        let scaled = |m: DMatrix<f64>| DMatrix::from_fn(3 * n, 3 * n, |i, j| m[(i, j)] * units[i] * units[j]);
        let (q, mu) = (DVector::from_element(3 * n, -1.0), vec![0.5; n]);
        let semidefinite = &factor * factor.transpose();
        let sound = ContactProblem::new(scaled(semidefinite.clone()), q.clone(), mu.clone());
        assert!(sound.is_ok(), "seed {seed}: {sound:?}");
        let direction = DVector::from_fn(3 * n, |_, _| next()).normalize();
        let lost = direction.dot(&(&semidefinite * &direction)) + 0.01;
        let indefinite = scaled(semidefinite - lost * &direction * direction.transpose());
        let refused = ContactProblem::new(indefinite, q, mu).expect_err("indefinite");
        let is_named = match refused {
            ProblemError::Indefinite { eigenvalue } | ProblemError::NegativeBlock { eigenvalue, .. } => {
                eigenvalue < 0.0
            }
            _ => false,
        };
        assert!(is_named, "seed {seed}: {refused}");
    }
}

#[test]
fn forces_without_end_do_not_hide_a_penetration() {
    // No force lifts the contact by its missing metre.
    let w = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 1.0, 0.0]));
    let problem = ContactProblem::new(w, DVector::from_vec(vec![0.0, 0.0, -1.0]), vec![0.5]).expect("semi-definite");
    let residual = problem.residual(&DVector::from_vec(vec![0.0, 0.0, 1e9]));
    assert!(residual.force < 1e-8 && residual.gap >= 1.0 && residual.relative == residual.gap, "{residual:?}");
    assert_eq!(residual.penetration_m, 1.0);
    let report = solve(&problem, &mut Workspace::new(1), &Settings::default());
    assert_eq!(report.status, Status::Impossible);
    let obstruction = report.obstruction.expect("named");
    assert_eq!((obstruction.contacts, obstruction.least_penetration_m), (vec![(0, 1.0)], 1.0));
}

/// A ball between two fixed walls that leave `gap_m` less than its diameter, beside it a contact that is none of their
/// business.
fn pinched(gap_m: f64) -> ContactProblem {
    let mut j = DMatrix::zeros(9, 6);
    for (a, side) in [(0, 1.0), (1, -1.0)] {
        (j[(3 * a, 1)], j[(3 * a + 1, 2)], j[(3 * a + 2, 0)]) = (1.0, 1.0, side);
    }
    (0..3).for_each(|i| j[(6 + i, 3 + i)] = 1.0);
    let q = DVector::from_vec(vec![1e-4, 0.0, 3e-3 + gap_m, 1e-4, 0.0, -3e-3, 0.0, 0.0, -1e-3]);
    ContactProblem::new(&j * j.transpose() * 1e-3, q, vec![0.4; 3]).expect("semi-definite")
}

#[test]
fn a_pinched_body_has_no_solution_and_a_fitting_one_has() {
    let report = solve(&pinched(-2e-3), &mut Workspace::new(3), &Settings::default());
    assert_eq!(report.status, Status::Impossible);
    let obstruction = report.obstruction.expect("named");
    let mut contacts: Vec<_> = obstruction.contacts.iter().map(|(contact, _)| *contact).collect();
    contacts.sort_unstable();
    assert_eq!(contacts, [0, 1]);
    assert!((obstruction.least_penetration_m - 1e-3).abs() < 1e-12, "{obstruction:?}");
    let problem = pinched(1e-4);
    let report = solve(&problem, &mut Workspace::new(3), &Settings::default());
    assert_eq!((report.status, &report.obstruction), (Status::Solved, &None));
    laws_hold(&problem, &report, 1e-7);
}

#[test]
fn a_reset_workspace_is_a_new_one() {
    let problem = elastic(10, 0.8, 4);
    let mut used = Workspace::new(10);
    solve(&elastic(10, 0.3, 3), &mut used, &tight());
    used.reset();
    assert_eq!(gauss_seidel(&problem, &mut used, &tight()), gauss_seidel(&problem, &mut Workspace::new(10), &tight()));
}

#[test]
fn more_iterations_never_give_a_worse_answer() {
    for (n, mu, seed) in [(10, 0.8, 4), (40, 1.2, 6), (40, 5.0, 7), (40, 5.0, 8)] {
        let problem = elastic(n, mu, seed);
        for solver in [newton as fn(&ContactProblem, &mut Workspace, &Settings) -> Report, proximal] {
            let mut before = f64::INFINITY;
            for limit in 0..12 {
                let settings = Settings { newton_iterations_max: limit, proximal_iterations_max: limit, ..tight() };
                let found = solver(&problem, &mut Workspace::new(n), &settings).residual.relative;
                assert!(found <= before, "{n} contacts, mu {mu}, {limit} iterations: {found:e} after {before:e}");
                before = found;
            }
        }
    }
}

#[test]
fn one_newton_step_takes_the_force_from_contacts_that_have_opened() {
    // Without friction the equations of given states are linear: from the right states one step is enough.
    let problem = elastic(40, 0.0, 2);
    let mut workspace = Workspace::new(40);
    let answer = gauss_seidel(&problem, &mut workspace, &tight());
    assert_eq!(answer.status, Status::Solved);
    let mut open = 0;
    for a in 0..40 {
        let (rho, i) = (3.0 / problem.delassus().fixed_view::<3, 3>(3 * a, 3 * a).trace(), 3 * a + 2);
        if answer.force[i] == 0.0 {
            // Much less than would press it to the ground, or let a neighbour open or close.
            workspace.force[i] = 1e-4 * rho * answer.delta[i];
            open += 1;
        }
    }
    assert!(open > 3, "{open}");
    let one = newton(&problem, &mut workspace, &Settings { newton_iterations_max: 1, ..tight() });
    assert_eq!((one.status, one.iterations), (Status::Solved, 1), "{:e}", one.residual.relative);
    assert!((&one.force - &answer.force).norm() < 1e-9 * answer.force.norm());
}

#[test]
fn near_the_answer_newton_doubles_its_digits() {
    for (n, mu, seed) in [(10, 0.3, 3), (40, 0.6, 5), (40, 1.2, 6)] {
        let problem = elastic(n, mu, seed);
        let mut workspace = Workspace::new(n);
        let answer = solve(&problem, &mut workspace, &tight());
        let slides = workspace.states().iter().filter(|state| **state == ContactState::Slip).count();
        assert!(answer.status == Status::Solved && slides > n / 10, "{slides} slide, or this says little");
        let start = answer.force.map(|f| f * (1.0 + 1e-4 * (1e4 * f).sin()));
        let relative = |iterations: usize| {
            workspace.force.copy_from_slice(start.as_slice());
            let settings = Settings { newton_iterations_max: iterations, ..tight() };
            newton(&problem, &mut workspace, &settings).residual.relative
        };
        let [before, once, twice] = [0, 1, 2].map(relative);
        assert!(before > 1e-6, "{before:e}");
        assert!(
            once < 10.0 * before * before && twice < (10.0 * once * once).max(1e-14),
            "{before:e} {once:e} {twice:e}"
        );
    }
}

#[test]
fn states_after_a_failed_solve_are_those_of_the_forces_that_are_given() {
    for (seed, iterations) in (1..10).flat_map(|seed| [(seed, 1), (seed, 2), (seed, 3)]) {
        let problem = elastic(20, 1.2, seed);
        let few = Settings { proximal_iterations_max: iterations, tolerance: 1e-15, ..tight() };
        let mut workspace = Workspace::new(20);
        let report = proximal(&problem, &mut workspace, &few);
        assert_eq!(report.status, Status::IterationLimit);
        // The best is never the last, which is not judged any more.
        for (a, state) in workspace.states().iter().enumerate() {
            let force: Vector3<f64> = report.force.fixed_rows::<3>(3 * a).into();
            assert_eq!(*state == ContactState::Open, force == Vector3::zeros(), "seed {seed}, contact {a}");
            let room = problem.mu()[a] * force.z - force.xy().norm();
            match state {
                ContactState::Open => {}
                ContactState::Stick => assert!(room > 0.0, "seed {seed}, contact {a}: {room}"),
                ContactState::Slip => assert!(room.abs() < 1e-12 * force.norm(), "seed {seed}, contact {a}: {room}"),
            }
        }
    }
}
