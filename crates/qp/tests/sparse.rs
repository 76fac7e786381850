//! The sparse form and its interior-point backend.
#![allow(non_snake_case)] // P, A, C as in the crate's documentation

use nalgebra::{DMatrix, DVector};
use qp::backend::clarabel::{Settings, solve};
use qp::sparse::ProblemError;
use qp::{QuadraticProgram, Report, Row, SparseMatrix, Status, Triplets};

const INF: f64 = f64::INFINITY;

/// Repeatable numbers in (-1, 1): SplitMix64, seed printed by the failing assertion.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        2.0 * ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
    }

    fn matrix(&mut self, rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| self.next())
    }

    fn vector(&mut self, n: usize) -> DVector<f64> {
        DVector::from_fn(n, |_, _| self.next())
    }
}

fn program(P: &DMatrix<f64>, c: &[f64]) -> QuadraticProgram {
    QuadraticProgram::unconstrained(SparseMatrix::from_dense(P), DVector::from_column_slice(c))
}

fn solved(problem: &QuadraticProgram) -> Report {
    let report = solve(problem, &Settings::default()).expect("well formed");
    assert_eq!(report.status, Status::Solved);
    assert!(report.residuals.max() < 1e-8, "{:?}", report.residuals);
    report
}

#[test]
fn triplets_add_up_in_any_order() {
    let mut random = Random(1);
    let mut dense = DMatrix::zeros(7, 5);
    let mut triplets = Triplets::default();
    for _ in 0..200 {
        let (i, j) = (((random.next() + 1.0) * 3.5) as usize, ((random.next() + 1.0) * 2.5) as usize);
        let value = random.next();
        dense[(i, j)] += value;
        triplets.add(i, j, value);
    }
    let sparse = triplets.into_matrix(7, 5);
    assert!((sparse.to_dense() - &dense).amax() < 1e-15);
    let (x, y) = (random.vector(5), random.vector(7));
    assert!((sparse.product(&x) - &dense * &x).amax() < 1e-14);
    assert!((sparse.transposed_product(&y) - dense.transpose() * &y).amax() < 1e-14);
    assert!(sparse.entries() <= 35);
}

#[test]
fn multipliers_of_a_closed_form_solution_have_the_stated_signs() {
    // min (x-3)^2/2 + (y+2)^2/2, x + y = 1.5, x <= 2 as a row, y >= -0.4 as a bound: x = 1.9, y = -0.4.
    let mut problem = program(&DMatrix::identity(2, 2), &[-3.0, 2.0]);
    problem.A = SparseMatrix::from_dense(&DMatrix::from_row_slice(1, 2, &[1.0, 1.0]));
    problem.b = DVector::from_element(1, 1.5);
    problem.C = SparseMatrix::from_dense(&DMatrix::from_row_slice(1, 2, &[1.0, 0.0]));
    problem.l = DVector::from_element(1, -INF);
    problem.u = DVector::from_element(1, 2.0);
    problem.lb[1] = -0.4;
    let report = solved(&problem);
    assert!((report.x[0] - 1.9).abs() < 1e-8 && (report.x[1] + 0.4).abs() < 1e-8);
    // Stationarity: x - 3 + y_eq = 0 and y + 2 + y_eq + y_bound = 0.
    assert!((report.y_eq[0] - 1.1).abs() < 1e-7);
    assert!(report.y_in[0].abs() < 1e-7);
    assert!((report.y_bound[1] + 2.7).abs() < 1e-7, "a lower side has a negative multiplier");
    assert!((report.objective - problem.objective(&report.x)).abs() < 1e-15);
}

/// A feasible program of random size with one equality, and a point that fulfils it.
fn random_feasible(seed: u64) -> (QuadraticProgram, DVector<f64>) {
    let mut random = Random(seed);
    let n = 3 + (seed % 9) as usize;
    // Rank-deficient Hessians too.
    let R = random.matrix(n - (seed % 3) as usize, n);
    let mut problem = program(&(R.transpose() * &R), random.vector(n).as_slice());
    let inside = random.vector(n);
    let A = random.matrix(1, n);
    problem.b = &A * &inside;
    problem.A = SparseMatrix::from_dense(&A);
    let C = random.matrix(2 * n, n);
    let value = &C * &inside;
    problem.l = DVector::from_fn(2 * n, |i, _| if i % 4 == 0 { -INF } else { value[i] - random.next().abs() });
    // Some rows are equalities in disguise.
    problem.u = DVector::from_fn(2 * n, |i, _| if i == 3 { problem.l[3] } else { value[i] + 0.1 });
    if problem.l[3].is_finite() {
        problem.l[3] = value[3];
        problem.u[3] = value[3];
    }
    problem.C = SparseMatrix::from_dense(&C);
    problem.lb = inside.map(|x| x - 2.0);
    problem.ub = inside.map(|x| x + 2.0);
    (problem, inside)
}

#[test]
fn random_programs_are_solved_to_their_optimality_conditions() {
    for seed in 0..40 {
        let (problem, inside) = random_feasible(seed);
        let report = solve(&problem, &Settings::default()).expect("well formed");
        assert_eq!(report.status, Status::Solved, "seed {seed}");
        assert!(report.residuals.max() < 1e-8, "seed {seed}: {:?}", report.residuals);
        // No feasible direction of descent towards the known feasible point.
        assert!(problem.objective(&report.x) <= problem.objective(&inside) + 1e-9, "seed {seed}");
    }
}

/// Clarabel accepts a point at its reduced tolerances where it gets no farther: that is told apart, and the residuals say what it is worth.
#[test]
fn a_point_that_misses_the_tolerance_is_not_called_solved() {
    let of = |seed: u64, tolerance: f64, iterations_max: u32| {
        let settings = Settings { tolerance, iterations_max, ..Settings::default() };
        let (problem, _) = random_feasible(seed);
        let report = solve(&problem, &settings).expect("well formed");
        let from_data = problem.residuals(&report.x, &report.y_eq, &report.y_in, &report.y_bound);
        assert_eq!(report.residuals, from_data, "seed {seed}: the reported residuals are those of the problem");
        report
    };
    for seed in 0..40 {
        // More digits than there are: it ends within rounding, but not at the tolerance.
        let report = of(seed, 1e-17, 200);
        assert_eq!(report.status, Status::SolvedInaccurately, "seed {seed}: {:?}", report.residuals);
        assert!(report.residuals.max() < 1e-10, "seed {seed}: {:?}", report.residuals);
    }
    // Too few iterations: near is not there, whichever way it is said.
    let (mut near, mut far) = (0, 0);
    for (seed, iterations_max) in (0..40).flat_map(|seed| (4..10).map(move |k| (seed, k))) {
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

#[test]
fn beginning_with_few_rows_ends_at_the_same_optimum() {
    for seed in 100..130 {
        let mut random = Random(seed);
        let (n, m) = (6, 60);
        let R = random.matrix(n, n);
        let mut problem = program(&(R.transpose() * &R), (10.0 * random.vector(n)).as_slice());
        let C = random.matrix(m, n);
        problem.C = SparseMatrix::from_dense(&C);
        problem.l = DVector::from_fn(m, |_, _| -0.2 - random.next().abs());
        problem.u = DVector::from_fn(m, |_, _| 0.2 + random.next().abs());
        let whole = solved(&problem);
        for first in [vec![false; m], vec![true; m], (0..m).map(|i| i % 3 == 0).collect()] {
            let report = qp::solve_generating(&problem, &first, &Settings::default()).expect("well formed");
            assert_eq!(report.status, Status::Solved, "seed {seed}");
            assert!(report.residuals.max() < 1e-8, "seed {seed}: {:?}", report.residuals);
            assert!((&report.x - &whole.x).amax() < 1e-7, "seed {seed}");
        }
        // Infeasible only in rows that are not among the first.
        problem.C =
            SparseMatrix::from_dense(&DMatrix::from_fn(m, n, |i, j| if i < 2 { f64::from(j == 0) } else { C[(i, j)] }));
        (problem.l[0], problem.u[1]) = (1.5, -1.5);
        (problem.u[0], problem.l[1]) = (INF, -INF);
        let report = qp::solve_generating(&problem, &vec![false; m], &Settings::default()).expect("well formed");
        assert_eq!(report.status, Status::Infeasible, "seed {seed}");
        assert!(report.conflict(0.1).iter().any(|c| c.row == Row::Inequality(0)));
    }
}

#[test]
fn rows_that_are_broken_by_little_are_not_left_out() {
    // min (x - 3)^2 / 2, x <= 1 by its bound and x <= 1 - 1e-5 by a row that does not take part at first.
    let mut problem = program(&DMatrix::identity(1, 1), &[-3.0]);
    problem.ub[0] = 1.0;
    problem.C = SparseMatrix::from_dense(&DMatrix::identity(1, 1));
    problem.l = DVector::from_element(1, -INF);
    problem.u = DVector::from_element(1, 1.0 - 1e-5);
    let report = qp::solve_generating(&problem, &[false], &Settings::default()).expect("well formed");
    assert!((report.x[0] - problem.u[0]).abs() < 1e-9, "{}", report.x[0]);
    // Iterations are those of all rounds: one without the row, one with it.
    let alone = solve(&problem, &Settings::default()).expect("well formed");
    assert!(report.iterations > alone.iterations, "{} after {}", report.iterations, alone.iterations);
    // Contradictory from the start: the round that found out counts, too.
    problem.l[0] = 3.0;
    problem.u[0] = INF;
    problem.ub[0] = 2.0;
    let [part, whole] = [[true], [false]]
        .map(|first| qp::solve_generating(&problem, &first, &Settings::default()).expect("well formed"));
    let alone = solve(&problem, &Settings::default()).expect("well formed");
    assert_eq!((part.status, whole.status), (Status::Infeasible, Status::Infeasible));
    assert!(part.iterations > alone.iterations && whole.iterations > alone.iterations);
}

/// Each residual is relative to the terms that should cancel: units of cost, rows and unknowns do not matter once they are large.
#[test]
fn residuals_are_relative_to_what_should_cancel() {
    let zero = DVector::zeros(0);
    let residuals = |scale: f64, x: f64, y: f64| {
        let mut problem = program(&DMatrix::from_element(1, 1, scale), &[-scale]);
        problem.ub[0] = 0.5;
        problem.residuals(&DVector::from_element(1, x), &zero, &zero, &DVector::from_element(1, y))
    };
    for scale in [1e3, 1e9] {
        let off = residuals(scale, 0.5, 0.501 * scale);
        assert!((off.stationarity - 1e-3).abs() < 1e-6, "{off:?}");
        let off = residuals(scale, 0.499, 0.5 * scale);
        assert!((off.complementarity - 1e-3).abs() < 1e-6, "{off:?}");
    }
    // Equalities and lower sides count like upper ones.
    let mut problem = program(&DMatrix::identity(1, 1), &[0.0]);
    problem.A = SparseMatrix::from_dense(&DMatrix::identity(1, 1));
    problem.b = DVector::from_element(1, 0.5);
    let at = |problem: &QuadraticProgram, x: f64| {
        let y_eq = DVector::zeros(problem.b.len());
        problem.residuals(&DVector::from_element(1, x), &y_eq, &zero, &DVector::zeros(1)).feasibility
    };
    assert!((at(&problem, 0.3) - 0.2).abs() < 1e-15);
    let mut problem = program(&DMatrix::identity(1, 1), &[0.0]);
    problem.lb[0] = 0.5;
    assert!((at(&problem, 0.3) - 0.2).abs() < 1e-15);
}

#[test]
fn residuals_see_every_kind_of_error() {
    let mut problem = program(&DMatrix::identity(2, 2), &[-1.0, 0.0]);
    problem.ub[0] = 0.5;
    let zero = DVector::zeros(0);
    let good = (DVector::from_vec(vec![0.5, 0.0]), DVector::from_vec(vec![0.5, 0.0]));
    assert!(problem.residuals(&good.0, &zero, &zero, &good.1).max() < 1e-15);
    let wrong = |x: [f64; 2], y: [f64; 2]| {
        problem.residuals(&DVector::from_row_slice(&x), &zero, &zero, &DVector::from_row_slice(&y))
    };
    assert!(wrong([0.6, 0.0], [0.4, 0.0]).feasibility > 0.09);
    assert!(wrong([0.5, 0.0], [0.4, 0.0]).stationarity > 0.09);
    for broken in [f64::NAN, f64::INFINITY] {
        assert_eq!(wrong([broken, 0.0], [0.5, 0.0]).max(), f64::INFINITY);
        assert_eq!(wrong([0.5, 0.0], [0.5, broken]).feasibility, f64::INFINITY);
    }
    assert!(wrong([0.4, 0.0], [0.6, 0.0]).complementarity > 0.05);
    assert!(wrong([0.5, -0.5], [0.5, 0.5]).complementarity > 0.4, "a multiplier towards a side that does not exist");
    assert!(wrong([1.5, 0.0], [-0.5, 0.0]).complementarity > 0.3, "a multiplier of the wrong sign");
}

#[test]
fn an_infeasible_program_names_the_rows_that_contradict_each_other_and_nothing_else() {
    // Rows 1 and 3 and the bound of x1 cannot hold together: x0 + x1 >= 3, x0 <= 1, x1 <= 1. The others are harmless.
    let mut problem = program(&DMatrix::identity(3, 3), &[0.0; 3]);
    let C = DMatrix::from_row_slice(4, 3, &[1.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0]);
    problem.C = SparseMatrix::from_dense(&C);
    problem.l = DVector::from_vec(vec![-5.0, 3.0, -5.0, -INF]);
    problem.u = DVector::from_vec(vec![5.0, INF, 5.0, 1.0]);
    problem.ub[1] = 1.0;
    let report = solve(&problem, &Settings::default()).expect("well formed");
    assert_eq!(report.status, Status::Infeasible);
    let conflict = report.conflict(1e-3);
    let mut rows: Vec<_> = conflict.iter().map(|c| c.row).collect();
    rows.sort();
    assert_eq!(rows, [Row::Inequality(1), Row::Inequality(3), Row::Bound(1)]);
    for c in &conflict {
        assert_eq!(c.weight > 0.0, c.row != Row::Inequality(1), "{c:?}: positive at upper sides");
    }
    // Three rows share a contradiction of 1: some row is off by at least 1/3.
    assert!((problem.least_violation(&report) - 1.0 / 3.0).abs() < 1e-8);
    // The certificate itself.
    let balance = problem.C.transposed_product(&report.y_in) + &report.y_bound;
    assert!(balance.amax() < 1e-8 * report.y_in.amax());
    assert!(solved(&program(&DMatrix::identity(1, 1), &[1.0])).conflict(0.0).is_empty());
}

#[test]
fn the_least_violation_counts_equalities_and_the_heaviest_row_comes_first() {
    // x0 + x1 = 3 with x0 <= 1 and x1 <= 1: one is missing, at best a half in each.
    let mut problem = program(&DMatrix::identity(2, 2), &[0.0; 2]);
    problem.A = SparseMatrix::from_dense(&DMatrix::from_row_slice(1, 2, &[1.0, 1.0]));
    problem.b = DVector::from_element(1, 3.0);
    problem.ub = DVector::from_element(2, 1.0);
    let report = solve(&problem, &Settings::default()).expect("well formed");
    assert!((problem.least_violation(&report) - 0.5).abs() < 1e-8);
    // x >= 2 by a row, 3 x <= 3 by another: the certificate is 3 of the first and 1 of the second.
    let mut problem = program(&DMatrix::identity(1, 1), &[0.0]);
    problem.C = SparseMatrix::from_dense(&DMatrix::from_row_slice(2, 1, &[3.0, 1.0]));
    problem.l = DVector::from_vec(vec![-INF, 2.0]);
    problem.u = DVector::from_vec(vec![3.0, INF]);
    let conflict = solve(&problem, &Settings::default()).expect("well formed").conflict(1e-3);
    assert_eq!(conflict.iter().map(|c| c.row).collect::<Vec<_>>(), [Row::Inequality(1), Row::Inequality(0)]);
    assert!((conflict[0].weight + 1.0).abs() < 1e-8 && (conflict[1].weight - 1.0 / 3.0).abs() < 1e-8, "{conflict:?}");
}

#[test]
fn contradicting_equalities_are_named_too() {
    let mut problem = program(&DMatrix::identity(2, 2), &[0.0; 2]);
    problem.A = SparseMatrix::from_dense(&DMatrix::from_row_slice(3, 2, &[1.0, 1.0, 2.0, 2.0, 1.0, -1.0]));
    problem.b = DVector::from_vec(vec![1.0, 3.0, 0.0]);
    let report = solve(&problem, &Settings::default()).expect("well formed");
    assert_eq!(report.status, Status::Infeasible);
    let mut rows: Vec<_> = report.conflict(1e-3).iter().map(|c| c.row).collect();
    rows.sort();
    assert_eq!(rows, [Row::Equality(0), Row::Equality(1)]);
}

#[test]
fn every_other_ending_is_told_apart() {
    let unbounded = program(&DMatrix::zeros(2, 2), &[1.0, 0.0]);
    let report = solve(&unbounded, &Settings::default()).expect("well formed");
    assert_eq!(report.status, Status::Unbounded);
    let mut hard = program(&DMatrix::identity(2, 2), &[-3.0, -5.0]);
    hard.ub = DVector::from_element(2, 1.0);
    let report = solve(&hard, &Settings { iterations_max: 1, ..Settings::default() }).expect("well formed");
    assert_eq!(report.status, Status::IterationLimit);
    assert!(!report.status.has_solution() && report.conflict(0.1).is_empty());
}

#[test]
fn arrays_that_do_not_fit_are_refused_by_name() {
    let good = program(&DMatrix::identity(2, 2), &[0.0; 2]);
    let mut shape = good.clone();
    shape.lb = DVector::zeros(3);
    assert_eq!(shape.check(), Err(ProblemError::Shape { array: "length of lb", found: 3, expected: 2 }));
    let mut number = good.clone();
    number.c[1] = f64::NAN;
    assert!(matches!(number.check(), Err(ProblemError::NotFinite { array: "c", index: 1, .. })));
    let mut infinite = good.clone();
    infinite.c[0] = INF;
    assert!(matches!(infinite.check(), Err(ProblemError::NotFinite { array: "c", index: 0, .. })));
    type Sides = fn(&mut QuadraticProgram) -> &mut DVector<f64>;
    let sides: [(&str, Sides); 4] =
        [("l", |p| &mut p.l), ("u", |p| &mut p.u), ("lb", |p| &mut p.lb), ("ub", |p| &mut p.ub)];
    for (name, side) in sides {
        let mut problem = good.clone();
        problem.C = SparseMatrix::from_dense(&DMatrix::identity(2, 2));
        (problem.l, problem.u) = (DVector::repeat(2, -INF), DVector::repeat(2, INF));
        assert_eq!(problem.check(), Ok(()));
        side(&mut problem)[1] = f64::NAN;
        assert!(
            matches!(problem.check(), Err(ProblemError::NotFinite { array, index: 1, .. }) if array == name),
            "{name}"
        );
        // No number is at least infinite, none at most minus infinite.
        side(&mut problem)[1] = if name.starts_with('l') { INF } else { -INF };
        assert!(matches!(problem.check(), Err(ProblemError::Crossed { index: 1, .. })), "{name}");
    }
    let mut crossed = good.clone();
    (crossed.lb[1], crossed.ub[1]) = (1.0, -1.0);
    let error = solve(&crossed, &Settings::default()).expect_err("crossed");
    assert_eq!(error.to_string(), "lb[1] = 1 lies above ub[1] = -1");
    assert_eq!(good.check(), Ok(()));
}
