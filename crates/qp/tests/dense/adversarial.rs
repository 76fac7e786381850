//! Programs made to break an active-set method.

use crate::random::Random;
use crate::{active_set, random_feasible};
use nalgebra::{DMatrix, DVector};
use qp::dense::{Active, ActiveSet, ActiveSetSettings, Outcome, Problem, Side, Size, Solver};
use qp::{Row, Status};

fn solved(problem: &Problem, label: &str) -> Outcome {
    let mut solver = active_set(problem);
    let outcome = solver.solve(problem).clone();
    assert_eq!(
        outcome.report.status,
        Status::Solved,
        "{label}: {:?} {:e}",
        outcome.report.residuals,
        outcome.violation
    );
    outcome
}

#[test]
fn a_vertex_where_many_rows_meet_is_found_without_cycling() {
    for n in [2, 5, 12] {
        for seed in 0..50 {
            let mut random = Random(seed);
            let rows = 8 * n;
            let mut problem = Problem::new(Size { variables: n, equalities: 0, inequalities: rows });
            // All rows pass through one point; the minimum without them lies behind all of them.
            let apex = DVector::from_fn(n, |_, _| random.signed());
            problem.C = DMatrix::from_fn(rows, n, |_, j| if j == 0 { 1.0 } else { 0.9 * random.signed() / n as f64 });
            problem.l = &problem.C * &apex;
            problem.c = -&apex;
            problem.c[0] += 10.0;
            let outcome = solved(&problem, &format!("n {n} seed {seed}"));
            assert!((&outcome.report.x - &apex).amax() < 1e-9, "n {n} seed {seed}");
            assert!(outcome.report.iterations < 20 * n as u32, "n {n} seed {seed}: {}", outcome.report.iterations);
        }
    }
}

#[test]
fn copies_of_rows_scaled_and_turned_change_nothing() {
    for seed in 0..300 {
        let mut random = Random(seed);
        let problem = random_feasible(&mut random);
        let plain = solved(&problem, &format!("seed {seed}"));
        let Size { variables: n, equalities: e, inequalities: m } = problem.size();
        let mut doubled = Problem::new(Size { variables: n, equalities: 2 * e, inequalities: 2 * m + n });
        (doubled.P, doubled.c) = (problem.P.clone(), problem.c.clone());
        (doubled.lb, doubled.ub) = (problem.lb.clone(), problem.ub.clone());
        for i in 0..e {
            let factor = 10.0 * random.signed();
            doubled.A.set_row(i, &problem.A.row(i));
            doubled.A.set_row(e + i, &(factor * problem.A.row(i)));
            (doubled.b[i], doubled.b[e + i]) = (problem.b[i], factor * problem.b[i]);
        }
        for i in 0..m {
            let factor: f64 = 1e3 * random.signed();
            doubled.C.set_row(i, &problem.C.row(i));
            doubled.C.set_row(m + i, &(factor * problem.C.row(i)));
            (doubled.l[i], doubled.u[i]) = (problem.l[i], problem.u[i]);
            let sides = [factor * problem.l[i], factor * problem.u[i]];
            (doubled.l[m + i], doubled.u[m + i]) =
                if factor > 0.0 { (sides[0], sides[1]) } else { (sides[1], sides[0]) };
        }
        for i in 0..n {
            doubled.C[(2 * m + i, i)] = 1.0; // bounds once more, as rows
            (doubled.l[2 * m + i], doubled.u[2 * m + i]) = (problem.lb[i], problem.ub[i]);
        }
        let outcome = solved(&doubled, &format!("seed {seed} doubled"));
        let scale = plain.report.x.amax().max(1.0);
        let difference = (&outcome.report.x - &plain.report.x).amax();
        assert!(difference < 1e-6 * scale, "seed {seed}: {difference:e}");
        assert!(
            (outcome.report.objective - plain.report.objective).abs() < 1e-9 * plain.report.objective.abs().max(1.0)
        );
    }
}

#[test]
fn nearly_dependent_equalities_are_met() {
    for exponent in 2..15 {
        let angle = 10_f64.powi(-exponent);
        let mut problem = Problem::new(Size { variables: 4, equalities: 3, inequalities: 0 });
        problem.P = DMatrix::from_fn(4, 4, |i, j| if i == j { 1.0 + i as f64 } else { 0.2 });
        problem.c = DVector::from_vec(vec![1.0, 2.0, -1.0, 0.5]);
        problem.A = DMatrix::from_row_slice(3, 4, &[1.0, 2.0, 0.0, 1.0, 1.0, 2.0, angle, 1.0, 0.0, 1.0, 1.0, -1.0]);
        let inside = DVector::from_vec(vec![0.3, -0.2, 0.7, 0.1]);
        problem.b = &problem.A * inside;
        let outcome = solved(&problem, &format!("angle {angle:e}"));
        assert!(outcome.violation < 1e-10, "angle {angle:e}: {:e}", outcome.violation);
        // As long as the rows are distinguishable from rounding, the third unknown is determined by their difference.
        if exponent <= 8 {
            let found = outcome.report.x[2];
            assert!((found - 0.7).abs() < 1e-15 / angle * 10.0 + 1e-12, "angle {angle:e}: {found}");
        }
    }
}

#[test]
fn contradicting_equalities_are_named_down_to_a_billionth() {
    for gap in [1.0, 1e-3, 1e-6, 1e-9] {
        let mut problem = Problem::new(Size { variables: 3, equalities: 3, inequalities: 0 });
        problem.A = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 2.0, 4.0, 2.0]);
        problem.b = DVector::from_vec(vec![1.0, 2.0, 6.0 + gap]); // row 2 = 2 row 0 + 2 row 1
        let mut solver = active_set(&problem);
        let outcome = solver.solve(&problem);
        assert_eq!(outcome.report.status, Status::Infeasible, "gap {gap:e}");
        let contradiction = &outcome.contradiction;
        let mut rows: Vec<_> = contradiction.rows.iter().map(|c| c.row).collect();
        rows.sort();
        assert_eq!(rows, [0, 1, 2].map(Row::Equality), "gap {gap:e}");
        assert!(contradiction.unmet.is_some());
        let expected = if contradiction.unmet == Some(Row::Equality(2)) { gap } else { 0.5 * gap };
        assert!(
            (contradiction.amount - expected).abs() < 1e-14 + 1e-12 * gap,
            "gap {gap:e}: {:e}",
            contradiction.amount
        );
    }
}

#[test]
fn infeasible_by_a_billionth_and_by_one_are_told_from_feasible() {
    for gap in [1.0, 1e-3, 1e-6, 1e-9, -1e-9, -1.0] {
        // A chain: x0 <= 0, x1 <= x0, .., x4 <= x3, and x4 >= gap.
        let n = 5;
        let mut problem = Problem::new(Size { variables: n, equalities: 0, inequalities: n - 1 });
        problem.c = DVector::from_fn(n, |i, _| 0.3 * i as f64 - 1.0);
        for i in 0..n - 1 {
            (problem.C[(i, i)], problem.C[(i, i + 1)]) = (-1.0, 1.0);
            problem.u[i] = 0.0;
        }
        problem.ub[0] = 0.0;
        problem.lb[n - 1] = gap;
        let mut solver = active_set(&problem);
        let outcome = solver.solve(&problem);
        if gap < 0.0 {
            assert_eq!(outcome.report.status, Status::Solved, "gap {gap:e}");
            continue;
        }
        assert_eq!(outcome.report.status, Status::Infeasible, "gap {gap:e}");
        let contradiction = &outcome.contradiction;
        assert!((contradiction.amount - gap).abs() < 1e-12 * gap.max(1e-3), "gap {gap:e}: {:e}", contradiction.amount);
        assert_eq!(contradiction.rows.len(), n + 1, "all six rows of the chain and no other: {contradiction:?}");
        // Widening the first named row by what is missing, and a little, makes the program feasible.
        let first = contradiction.rows[0];
        let more = gap * 1.001 + 1e-10;
        match first.row {
            Row::Inequality(i) => problem.u[i] += more,
            Row::Bound(i) if first.weight > 0.0 => problem.ub[i] += more,
            Row::Bound(i) => problem.lb[i] -= more,
            Row::Equality(_) => panic!("there is none"),
        }
        assert_eq!(solver.solve(&problem).report.status, Status::Solved, "gap {gap:e} after widening");
    }
}

#[test]
fn a_hessian_of_condition_1e12_is_solved_to_rounding() {
    for seed in 0..200 {
        let mut random = Random(seed);
        let mut problem = random_feasible(&mut random);
        let n = problem.c.len();
        // Random directions with eigenvalues from 1e-6 to 1e6.
        let basis = DMatrix::from_fn(n, n, |_, _| random.signed()).qr().q();
        let spread = |i: usize| 10_f64.powf(-6.0 + 12.0 * i as f64 / (n - 1).max(1) as f64);
        problem.P = &basis * DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| spread(i))) * basis.transpose();
        problem.P = 0.5 * (&problem.P + problem.P.transpose());
        for i in 0..n {
            // Unknowns in a box: the weak directions would run off to 1e6 otherwise.
            problem.lb[i] = problem.lb[i].max(-50.0).min(problem.ub[i]);
            problem.ub[i] = problem.ub[i].min(50.0);
        }
        let outcome = solved(&problem, &format!("seed {seed}"));
        assert!(outcome.violation < 1e-9, "seed {seed}: {:e}", outcome.violation);
        let report = &outcome.report;
        let residuals = problem.residuals(&report.x, &report.y_eq, &report.y_in, &report.y_bound);
        let lost = DVector::from_element(report.x.len(), f64::NAN);
        assert_eq!(problem.residuals(&lost, &report.y_eq, &report.y_in, &report.y_bound).feasibility, f64::INFINITY);
        // P x cancels: its rounding is that of its largest terms.
        let rounding = 16.0 * f64::EPSILON * problem.P.amax() * report.x.norm();
        assert!(residuals.stationarity < 1e-13 + rounding, "seed {seed}: {residuals:?}");
        assert!(residuals.feasibility.max(residuals.complementarity) < 1e-11, "seed {seed}: {residuals:?}");
    }
}

#[test]
fn directions_held_by_damping_alone_go_where_their_bounds_are() {
    let n = 6;
    let mut problem = Problem::new(Size { variables: n, equalities: 1, inequalities: 0 });
    problem.P = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 1.0, 1e-9, 1e-9, 1e-9, 1e-9]));
    problem.c = DVector::from_vec(vec![0.0, 1.0, -1.0, 1.0, -1.0, -1.0]);
    problem.A = DMatrix::from_row_slice(1, n, &[1.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
    problem.b[0] = 7.0;
    for i in 2..n {
        (problem.lb[i], problem.ub[i]) = (-100.0, 100.0);
    }
    let outcome = solved(&problem, "damped");
    let x = &outcome.report.x;
    assert!((x[2] - 100.0).abs() < 1e-9 && (x[3] + 100.0).abs() < 1e-9, "{x}");
    assert!((x[0] + x[4] + x[5] - 7.0).abs() < 1e-10);
    // x4 and x5 are alike: damping decides for the middle.
    assert!((x[4] - x[5]).abs() < 1e-3, "{x}");
}

#[test]
fn any_guess_leads_to_the_same_solution() {
    for seed in 0..400 {
        let mut random = Random(seed);
        let problem = random_feasible(&mut random);
        let cold = solved(&problem, &format!("seed {seed}"));
        let Size { variables: n, inequalities: m, .. } = problem.size();
        let mut solver = active_set(&problem);
        for trial in 0..6 {
            let guess: Vec<Active> = (0..random.below(2 * n + 2))
                .map(|_| {
                    let row = if random.chance(0.5) {
                        Row::Inequality(random.below(m + 2)) // some do not exist
                    } else {
                        Row::Bound(random.below(n + 1))
                    };
                    Active { row, side: if random.chance(0.5) { Side::Lower } else { Side::Upper } }
                })
                .collect();
            solver.guess(&guess);
            let warm = solver.solve(&problem);
            assert_eq!(warm.report.status, Status::Solved, "seed {seed} trial {trial}");
            let scale = cold.report.objective.abs().max(1.0);
            assert!((warm.report.objective - cold.report.objective).abs() < 1e-9 * scale, "seed {seed} trial {trial}");
            assert!(warm.violation < 1e-9, "seed {seed} trial {trial}");
        }
        // The solution's own set is the best guess: nothing is left to do.
        solver.guess(&cold.active);
        let again = solver.solve(&problem);
        assert_eq!(again.report.status, Status::Solved);
        assert!(again.report.iterations <= cold.report.iterations, "seed {seed}");
    }
}

#[test]
fn a_solution_is_a_good_guess_for_its_neighbour_and_a_solver_can_be_used_for_anything() {
    let mut random = Random(7);
    let mut warm_changes = 0;
    let mut cold_changes = 0;
    for _ in 0..200 {
        let problem = random_feasible(&mut random);
        let mut solver = active_set(&problem);
        solver.solve(&problem);
        let mut neighbour = problem.clone();
        neighbour.c.iter_mut().for_each(|c| *c += 1e-3 * random.signed());
        warm_changes += solver.solve(&neighbour).report.iterations;
        let mut cold = active_set(&neighbour);
        cold_changes += cold.solve(&neighbour).report.iterations;
        let objectives = [cold.outcome().report.objective, solver.outcome().report.objective];
        assert!((objectives[0] - objectives[1]).abs() < 1e-10 * objectives[0].abs().max(1.0));
    }
    assert!(10 * warm_changes < cold_changes, "{warm_changes} against {cold_changes}");
}

#[test]
fn a_vertex_that_determines_everything_is_reached_and_left() {
    // As many active bounds as unknowns, then one more row that pushes one of them out.
    let n = 8;
    let mut problem = Problem::new(Size { variables: n, equalities: 0, inequalities: 1 });
    problem.c.fill(5.0);
    problem.lb.fill(0.0);
    let outcome = solved(&problem, "vertex");
    assert_eq!(outcome.active.len(), n);
    problem.C.fill(1.0);
    problem.l[0] = 1.0;
    let outcome = solved(&problem, "vertex with a row");
    assert!((outcome.report.x.sum() - 1.0).abs() < 1e-12);
    assert!((&outcome.report.x - DVector::from_element(n, 1.0 / n as f64)).amax() < 1e-12);
}

#[test]
fn the_iteration_limit_stops_the_solver_with_residuals_that_say_so() {
    let mut problem = Problem::new(Size { variables: 10, equalities: 0, inequalities: 0 });
    problem.c.fill(5.0);
    problem.lb.fill(0.0);
    let mut solver =
        ActiveSet::new(problem.size(), ActiveSetSettings { iterations_max: 4, ..ActiveSetSettings::default() });
    let outcome = solver.solve(&problem);
    assert_eq!(outcome.report.status, Status::IterationLimit);
    assert_eq!(outcome.report.iterations, 4);
    assert!((outcome.violation - 5.0).abs() < 1e-12);
    // The next solve goes on from there.
    solver.solve(&problem);
    assert_eq!(solver.solve(&problem).report.status, Status::Solved);
}

#[test]
fn the_iteration_limit_counts_rows_that_leave_while_one_is_taken_up() {
    let n = 10;
    let mut problem = Problem::new(Size { variables: n, equalities: 0, inequalities: 1 });
    problem.c = DVector::from_fn(n, |i, _| 1.0 + i as f64);
    problem.lb.fill(0.0);
    problem.C.fill(1.0);
    let settings = ActiveSetSettings { iterations_max: 4, ..ActiveSetSettings::default() };
    let mut solver = ActiveSet::new(problem.size(), settings);
    let all: Vec<Active> = (0..n).map(|i| Active { row: Row::Bound(i), side: Side::Lower }).collect();
    solver.guess(&all);
    assert_eq!(solver.solve(&problem).report.iterations, 0, "the guess is the solution");
    // Each bound leaves at another length of the one step in which the row is taken up.
    problem.l[0] = 1000.0;
    let outcome = solver.solve(&problem);
    assert_eq!((outcome.report.status, outcome.report.iterations), (Status::IterationLimit, 4));
    let mut patient = active_set(&problem);
    patient.guess(&all);
    let outcome = patient.solve(&problem);
    assert_eq!((outcome.report.status, outcome.active.len()), (Status::Solved, 1));
}

#[test]
fn a_solver_that_forgets_starts_cold() {
    let n = 6;
    let mut problem = Problem::new(Size { variables: n, equalities: 0, inequalities: 0 });
    problem.c.fill(5.0);
    problem.lb.fill(0.0);
    let mut solver = active_set(&problem);
    assert_eq!(solver.solve(&problem).report.iterations, n as u32);
    assert_eq!(solver.solve(&problem).report.iterations, 0, "warm");
    solver.forget();
    assert_eq!(solver.solve(&problem).report.iterations, n as u32, "cold");
}
