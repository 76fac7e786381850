//! Families of hard programs, each checked a second way.

use crate::random::Random;
use crate::{active_set, backends, oracle};
use nalgebra::{DMatrix, DVector};
use qp::Status;
use qp::dense::{ActiveSetSettings, Auto, Backend, InteriorSettings, Problem, Size, Solver};

fn auto(problem: &Problem) -> Auto {
    Auto::new(
        problem.size(),
        ActiveSetSettings::default(),
        InteriorSettings { tolerance: 1e-9, ..InteriorSettings::default() },
    )
}

fn all(problem: &Problem) -> Vec<(&'static str, Box<dyn Solver>)> {
    let mut all = backends(problem);
    all.push(("auto", Box::new(auto(problem))));
    all
}

/// P of a rank, rows about a feasible point, all unknowns within a box.
fn boxed(n: usize, rank: usize, equalities: usize, rows: usize, random: &mut Random) -> Problem {
    let mut problem = Problem::new(Size { variables: n, equalities, inequalities: rows });
    let factor = DMatrix::from_fn(n, rank, |_, _| random.signed());
    problem.P = &factor * factor.transpose() / n as f64;
    problem.c = DVector::from_fn(n, |_, _| 2.0 * random.signed());
    let inside = DVector::from_fn(n, |_, _| random.signed());
    problem.A = DMatrix::from_fn(equalities, n, |_, _| random.signed());
    problem.b = &problem.A * &inside;
    problem.C = DMatrix::from_fn(rows, n, |_, _| random.signed());
    let values = &problem.C * &inside;
    problem.l = values.map(|v| v - 0.5 * random.unit());
    problem.u = values.map(|v| v + 0.5 * random.unit());
    problem.lb = inside.map(|x| x - random.unit());
    problem.ub = inside.map(|x| x + random.unit());
    problem
}

/// The same program in other units: x = `units` z.
fn in_units(problem: &Problem, units: &DVector<f64>) -> Problem {
    let columns = |m: &DMatrix<f64>| DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] * units[j]);
    Problem {
        P: DMatrix::from_fn(units.len(), units.len(), |i, j| problem.P[(i, j)] * units[i] * units[j]),
        c: problem.c.component_mul(units),
        A: columns(&problem.A),
        C: columns(&problem.C),
        lb: problem.lb.component_div(units),
        ub: problem.ub.component_div(units),
        ..problem.clone()
    }
}

#[test]
fn semidefinite_programs_are_solved_as_by_the_interior_point() {
    for seed in 0..150 {
        let mut random = Random(seed);
        let n = 2 + random.below(24);
        let rank = random.below(n); // zero: a linear program
        let (equalities, rows) = (random.below(n / 3 + 1), random.below(2 * n));
        let problem = boxed(n, rank, equalities, rows, &mut random);
        let expected = oracle(&problem).solve(&problem).report.clone();
        assert!(expected.status.has_solution(), "seed {seed}");
        for (name, mut solver) in all(&problem) {
            let outcome = solver.solve(&problem);
            let report = &outcome.report;
            // At 1e-10 the interior point may end short of its own tolerance.
            let is_solved = report.status == Status::Solved || (name == "Clarabel" && report.status.has_solution());
            assert!(is_solved, "{name}, seed {seed}, rank {rank} of {n}: {:?} {:?}", report.status, report.residuals);
            assert!(outcome.violation < 1e-7, "{name}, seed {seed}: {:e}", outcome.violation);
            let apart = (report.objective - expected.objective).abs();
            assert!(apart < 1e-7 * expected.objective.abs().max(1.0), "{name}, seed {seed}: {apart:e}");
        }
    }
}

#[test]
fn an_unbounded_program_gives_the_direction() {
    for seed in 0..60 {
        let mut random = Random(seed);
        let n = 3 + random.below(12);
        let mut problem = boxed(n, n - 2, 1, n, &mut random);
        // A direction without curvature that no row stops.
        let factor = DMatrix::from_fn(n, n - 2, |_, _| random.signed());
        let mut free = DVector::from_fn(n, |_, _| random.signed()).normalize();
        let along = |v: DVector<f64>, d: &DVector<f64>| &v - d * d.dot(&v);
        let flat = DMatrix::from_columns(&factor.column_iter().map(|f| along(f.into(), &free)).collect::<Vec<_>>());
        problem.P = &flat * flat.transpose();
        for matrix in [&mut problem.A, &mut problem.C] {
            let rows: Vec<_> = matrix.row_iter().map(|r| along(r.transpose(), &free).transpose()).collect();
            *matrix = DMatrix::from_rows(&rows);
        }
        free *= -problem.c.dot(&free).signum();
        for i in 0..n {
            if free[i] > 0.0 { problem.ub[i] = f64::INFINITY } else { problem.lb[i] = f64::NEG_INFINITY }
        }
        problem.b = &problem.A * DVector::from_element(n, 0.1);
        problem.l.fill(f64::NEG_INFINITY);
        problem.u = (&problem.C * DVector::from_element(n, 0.1)).map(|v| v + 1.0);
        for (name, mut solver) in all(&problem) {
            let report = &solver.solve(&problem).report;
            // Clarabel walks away along the direction and measures its residuals by where it has come to.
            if name == "Clarabel" && report.status == Status::SolvedInaccurately {
                continue;
            }
            assert_eq!(report.status, Status::Unbounded, "{name}, seed {seed}: {:?}", report.residuals);
            let d = &report.x / report.x.amax();
            let curved = (&problem.P * &d).amax();
            // Clarabel's certificate is good to its tolerance, and to less where it is called almost one.
            let flat = if name == "Clarabel" { 1e-3 } else { 1e-9 };
            assert!(problem.c.dot(&d) < 0.0 && curved < flat, "{name}, seed {seed}: {curved:e}");
        }
    }
}

#[test]
fn no_saddle_is_called_a_solution() {
    for seed in 0..150 {
        let mut random = Random(seed);
        let n = 2 + random.below(15);
        let mut problem = boxed(n, n, random.below(2), n, &mut random);
        let direction = DVector::from_fn(n, |_, _| random.signed()).normalize();
        let depth = 10_f64.powf(-4.0 * random.unit());
        let curvature = direction.dot(&(&problem.P * &direction)) + depth;
        problem.P -= curvature * &direction * direction.transpose();
        let units = DVector::from_fn(n, |_, _| 10_f64.powf(3.0 * random.signed()));
        for problem in [in_units(&problem, &units), problem] {
            for (name, mut solver) in all(&problem) {
                let report = &solver.solve(&problem).report;
                assert_eq!(report.status, Status::NotConvex, "{name}, seed {seed}");
                assert!(report.negative_curvature.is_some_and(|x| x < 0.0), "{name}, seed {seed}");
            }
        }
    }
}

/// Other units, the same answer: up to twelve decimal orders between two unknowns.
#[test]
fn units_do_not_change_the_answer() {
    for seed in 0..80 {
        let mut random = Random(seed);
        let n = 3 + random.below(15);
        let problem = boxed(n, n + 2, random.below(3), n, &mut random);
        let plain = active_set(&problem).solve(&problem).report.clone();
        assert_eq!(plain.status, Status::Solved, "seed {seed}");
        for orders in [2.0, 4.0, 6.0] {
            let units = DVector::from_fn(n, |_, _| 10_f64.powf(orders * random.signed()));
            let scaled = in_units(&problem, &units);
            for (name, mut solver) in all(&scaled) {
                let report = &solver.solve(&scaled).report;
                assert!(report.status.has_solution(), "{name}, seed {seed}, {orders} orders: {:?}", report.status);
                let apart = (report.x.component_mul(&units) - &plain.x).amax();
                let is_exact = apart < 1e-5 * plain.x.amax();
                assert!(is_exact || report.status != Status::Solved, "{name}, seed {seed}, {orders} orders: {apart:e}");
                assert!(is_exact || name == "Clarabel", "{name}, seed {seed}, {orders} orders: {apart:e}");
            }
        }
    }
}

#[test]
fn many_rows_take_many_changes_and_then_the_backup_solver() {
    let mut random = Random(5);
    let problem = boxed(60, 60, 12, 240, &mut random);
    let exact = active_set(&problem).solve(&problem).report.clone();
    assert_eq!(exact.status, Status::Solved);
    let expected = oracle(&problem).solve(&problem).report.objective;
    assert!((exact.objective - expected).abs() < 1e-7 * expected.abs(), "{} {expected}", exact.objective);
    let few = ActiveSetSettings { iterations_max: 20, ..ActiveSetSettings::default() };
    let mut solver = Auto::new(problem.size(), few, InteriorSettings::default());
    let outcome = solver.solve(&problem);
    assert_eq!(outcome.report.status, Status::Solved);
    assert!((outcome.report.objective - expected).abs() < 1e-6 * expected.abs());
    // Started from the rows that hold there, the active set needs few changes to be exact.
    assert_eq!(solver.backend(), Backend::ActiveSet);
}

#[test]
fn the_amount_of_an_infeasibility_is_the_true_one() {
    for seed in 0..60 {
        let mut random = Random(seed);
        let n = 2 + random.below(8);
        let mut problem = boxed(n, n, random.below(2), n + 4, &mut random);
        // Some rows ask for more than the others leave.
        for i in 0..2 {
            (problem.l[i], problem.u[i]) = (problem.u[i] + 30.0, problem.u[i] + 31.0);
        }
        let widened = |by: f64| {
            let mut wide = problem.clone();
            for (lower, upper) in [(&mut wide.l, &mut wide.u), (&mut wide.lb, &mut wide.ub)] {
                lower.add_scalar_mut(-by);
                upper.add_scalar_mut(by);
            }
            wide
        };
        let [own, clarabel] = backends(&problem).map_contradictions(&problem);
        let least = clarabel.least_violation();
        assert!(own.least_violation() <= least * (1.0 + 1e-6), "seed {seed}: {} {least}", own.least_violation());
        for (by, expected) in [(least * 1.0001, Status::Solved), (least * 0.999, Status::Infeasible)] {
            let wide = widened(by);
            assert_eq!(active_set(&wide).solve(&wide).report.status, expected, "seed {seed}: {by}");
        }
    }
}

trait Contradictions {
    fn map_contradictions(self, problem: &Problem) -> [qp::dense::Contradiction; 2];
}

impl Contradictions for Vec<(&'static str, Box<dyn Solver>)> {
    fn map_contradictions(self, problem: &Problem) -> [qp::dense::Contradiction; 2] {
        let found: Vec<_> = self
            .into_iter()
            .map(|(name, mut solver)| {
                let outcome = solver.solve(problem).clone();
                assert_eq!(outcome.report.status, Status::Infeasible, "{name}");
                outcome.contradiction
            })
            .collect();
        found.try_into().expect("two backends")
    }
}
