//! One suite for every backend.

use crate::random::Random;
use crate::{active_set, backends, oracle, random_feasible, unit_row};
use nalgebra::{DMatrix, DVector};
use qp::dense::{Interior, InteriorSettings, Problem, Size, Solver};
use qp::{Row, Status};

/// What an interior point at 1e-10 reaches in well-scaled programs.
const RELATIVE: f64 = 1e-7;

#[test]
fn without_rows_the_minimiser_is_the_newton_point() {
    let mut problem = Problem::new(Size { variables: 3, equalities: 0, inequalities: 0 });
    problem.P = DMatrix::from_row_slice(3, 3, &[4.0, 1.0, 0.0, 1.0, 3.0, -1.0, 0.0, -1.0, 5.0]);
    problem.c = DVector::from_vec(vec![1.0, -2.0, 0.5]);
    let expected = -problem.P.clone().try_inverse().expect("regular") * &problem.c;
    for (name, mut solver) in backends(&problem) {
        let outcome = solver.solve(&problem);
        assert_eq!(outcome.report.status, Status::Solved, "{name}");
        assert!((&outcome.report.x - &expected).amax() < RELATIVE, "{name}");
    }
}

#[test]
fn projection_on_a_box_clips_and_its_multipliers_are_the_cut_off_parts() {
    let mut problem = Problem::new(Size { variables: 4, equalities: 0, inequalities: 0 });
    problem.c = DVector::from_vec(vec![-3.0, 2.0, -0.25, 0.0]);
    problem.lb.fill(-1.0);
    problem.ub.fill(1.0);
    for (name, mut solver) in backends(&problem) {
        let report = &solver.solve(&problem).report;
        let (x, y) = ([1.0, -1.0, 0.25, 0.0], [2.0, -1.0, 0.0, 0.0]);
        for i in 0..4 {
            assert!((report.x[i] - x[i]).abs() < RELATIVE, "{name}");
            assert!(
                (report.y_bound[i] - y[i]).abs() < RELATIVE,
                "{name}: positive at the upper side, negative at the lower"
            );
        }
    }
}

#[test]
fn an_equality_constrained_program_solves_its_linear_system() {
    let mut problem = Problem::new(Size { variables: 4, equalities: 2, inequalities: 0 });
    problem.P = DMatrix::from_fn(4, 4, |i, j| if i == j { 2.0 + i as f64 } else { 0.3 });
    problem.c = DVector::from_vec(vec![1.0, -1.0, 2.0, 0.0]);
    problem.A = DMatrix::from_row_slice(2, 4, &[1.0, 1.0, 0.0, 2.0, 0.0, 1.0, -1.0, 0.5]);
    problem.b = DVector::from_vec(vec![1.0, -0.5]);
    let mut system = DMatrix::zeros(6, 6);
    system.view_mut((0, 0), (4, 4)).copy_from(&problem.P);
    system.view_mut((4, 0), (2, 4)).copy_from(&problem.A);
    system.view_mut((0, 4), (4, 2)).copy_from(&problem.A.transpose());
    let rhs = DVector::from_iterator(6, (-&problem.c).iter().chain(problem.b.iter()).copied());
    let expected = system.lu().solve(&rhs).expect("regular");
    for (name, mut solver) in backends(&problem) {
        let report = &solver.solve(&problem).report;
        assert!((&report.x - expected.rows(0, 4)).amax() < RELATIVE, "{name}");
        assert!((&report.y_eq - expected.rows(4, 2)).amax() < RELATIVE, "{name}");
    }
}

#[test]
fn rows_with_equal_sides_are_equalities_and_fixed_unknowns_stay() {
    let mut problem = Problem::new(Size { variables: 3, equalities: 0, inequalities: 1 });
    problem.c.fill(-1.0);
    problem.C = DMatrix::from_row_slice(1, 3, &[1.0, 1.0, 1.0]);
    (problem.l[0], problem.u[0]) = (1.5, 1.5);
    (problem.lb[2], problem.ub[2]) = (2.0, 2.0);
    for (name, mut solver) in backends(&problem) {
        let report = &solver.solve(&problem).report;
        let expected = DVector::from_vec(vec![-0.25, -0.25, 2.0]);
        assert!((&report.x - expected).amax() < RELATIVE, "{name}: {}", report.x);
    }
}

#[test]
fn infeasible_programs_are_found_infeasible_and_the_multipliers_prove_it() {
    let mut problem = Problem::new(Size { variables: 4, equalities: 1, inequalities: 2 });
    problem.A = unit_row(4, 0, 1.0);
    problem.b[0] = 1.0;
    problem.C = DMatrix::from_row_slice(2, 4, &[1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 0.0]);
    (problem.l[0], problem.u[1]) = (4.0, 1.0);
    problem.lb[2] = 0.0;
    (problem.c[3], problem.lb[3]) = (5.0, 0.0); // pressed against its bound, but no part of the conflict
    // x0 = 1, x0 + x1 >= 4, x1 + 2 x2 <= 1, x2 >= 0: x1 >= 3 and x1 <= 1.
    for (name, mut solver) in backends(&problem) {
        let report = solver.solve(&problem).report.clone();
        assert_eq!(report.status, Status::Infeasible, "{name}");
        let vanishing = problem.A.tr_mul(&report.y_eq) + problem.C.tr_mul(&report.y_in) + &report.y_bound;
        let size = report.y_eq.amax().max(report.y_in.amax());
        assert!(vanishing.amax() < 1e-6 * size, "{name}: {vanishing}");
        let mut support = problem.b.dot(&report.y_eq);
        for i in 0..2 {
            let y = report.y_in[i];
            support += if y.abs() < 1e-9 * size { 0.0 } else { y * if y > 0.0 { problem.u[i] } else { problem.l[i] } };
        }
        assert!(support < -1e-6 * size, "{name}: {support}");
    }
}

#[test]
fn a_contradiction_vanishes_when_one_of_its_rows_is_widened_as_it_says() {
    let mut problem = Problem::new(Size { variables: 3, equalities: 1, inequalities: 2 });
    problem.A = unit_row(3, 0, 1.0);
    problem.b[0] = 1.0;
    problem.C = DMatrix::from_row_slice(2, 3, &[1.0, 1.0, 0.0, 0.0, 1.0, 2.0]);
    (problem.l[0], problem.u[1]) = (4.0, 1.0);
    problem.lb[2] = 0.0;
    for (name, mut solver) in backends(&problem) {
        let contradiction = solver.solve(&problem).contradiction.clone();
        assert_eq!(contradiction.rows.len(), 4, "{name}: {contradiction:?}");
        let unmet =
            contradiction.rows.iter().find(|c| Some(c.row) == contradiction.unmet).map_or(1.0, |c| c.weight.abs());
        for conflict in &contradiction.rows {
            let exact = contradiction.amount * unmet / conflict.weight.abs();
            for (part, expected) in [(1.001, Status::Solved), (0.99, Status::Infeasible)] {
                let mut widened = problem.clone();
                let amount = (part * exact).copysign(conflict.weight);
                match conflict.row {
                    Row::Equality(i) => widened.b[i] += amount,
                    Row::Inequality(i) if amount > 0.0 => widened.u[i] += amount,
                    Row::Inequality(i) => widened.l[i] += amount,
                    Row::Bound(i) if amount > 0.0 => widened.ub[i] += amount,
                    Row::Bound(i) => widened.lb[i] += amount,
                }
                assert_eq!(solver.solve(&widened).report.status, expected, "{name}: {part} of {exact} at {conflict:?}");
            }
        }
    }
}

#[test]
fn thousands_of_random_programs_agree_and_are_optimal() {
    let (mut held, mut changes) = (0, 0);
    for seed in 0..3000_u64 {
        let problem = random_feasible(&mut Random(seed));
        let mut solver = active_set(&problem);
        let outcome = solver.solve(&problem);
        let report = &outcome.report;
        assert_eq!(report.status, Status::Solved, "seed {seed}");
        // Weak directions run far out: rounding grows with x.
        let accepted = 1e-11 * (1.0 + report.x.amax());
        assert!(outcome.violation < accepted, "seed {seed}: {:e}", outcome.violation);
        let from_data = problem.residuals(&report.x, &report.y_eq, &report.y_in, &report.y_bound);
        assert!(from_data.max() < accepted, "seed {seed}: {from_data:?}");
        assert!(
            (from_data.max() - report.residuals.max()).abs() < 1e-9,
            "seed {seed}: reported residuals are the residuals"
        );
        let other = oracle(&problem).solve(&problem).report.clone();
        if other.status == Status::Solved {
            let scale = other.objective.abs().max(1.0);
            assert!((report.objective - other.objective).abs() < 1e-6 * scale, "seed {seed}");
        }
        held += outcome.active.len();
        changes += report.iterations;
    }
    // The programs are worth solving: thousands of rows hold, and most have to be found.
    assert!(held > 6000 && changes > 9000, "{held} {changes}");
}

/// Clarabel accepts a point at its reduced tolerances where it gets no farther: that is told apart, and the residuals say what it is worth.
#[test]
fn a_point_that_misses_clarabels_tolerance_is_not_called_solved() {
    let of = |seed: u64, tolerance: f64, iterations_max: u32| {
        let problem = random_feasible(&mut Random(seed));
        let mut solver = Interior::new(problem.size(), InteriorSettings { tolerance, iterations_max });
        solver.solve(&problem).report.clone()
    };
    let (mut near, mut far) = (0, 0);
    for (seed, iterations_max) in (0..100).flat_map(|seed| (3..10).map(move |k| (seed, k))) {
        let report = of(seed, 1e-10, iterations_max);
        match report.status {
            Status::Solved => assert!(report.residuals.max() < 1e-8, "seed {seed}: {:?}", report.residuals),
            Status::SolvedInaccurately => near += usize::from(report.residuals.max() > 1e-8),
            Status::IterationLimit => far += 1,
            other => panic!("seed {seed}, {iterations_max} iterations: {other:?}"),
        }
    }
    assert!(near > 10 && far > 10, "{near} {far}");
}
