//! Data that no solver can use.

use crate::active_set;
use nalgebra::DMatrix;
use qp::dense::{Problem, ProblemError, Size, Solver};
use qp::{Row, Status};

fn plain() -> Problem {
    let mut problem = Problem::new(Size { variables: 3, equalities: 1, inequalities: 2 });
    problem.A.fill(1.0);
    problem.C = DMatrix::from_row_slice(2, 3, &[1.0, 0.0, 2.0, 0.0, 1.0, -1.0]);
    problem
}

fn status(problem: &Problem) -> Status {
    active_set(problem).solve(problem).report.status
}

#[test]
fn what_is_not_a_number_is_a_numerical_failure_wherever_it_stands() {
    assert_eq!(status(&plain()), Status::Solved);
    let spoil: [fn(&mut Problem); 9] = [
        |p| p.P[(1, 1)] = f64::NAN,
        |p| p.c[0] = f64::NAN,
        |p| p.A[(0, 2)] = f64::NAN,
        |p| p.b[0] = f64::NAN,
        |p| p.C[(1, 0)] = f64::NAN,
        |p| p.l[0] = f64::NAN,
        |p| p.u[1] = f64::NAN,
        |p| p.lb[2] = f64::NAN,
        |p| p.ub[0] = f64::NAN,
    ];
    for (k, spoil) in spoil.iter().enumerate() {
        let mut problem = plain();
        spoil(&mut problem);
        assert_eq!(status(&problem), Status::NumericalFailure, "field {k}");
        assert!(problem.check().is_err(), "field {k}");
    }
}

#[test]
fn an_indefinite_hessian_is_not_convex() {
    let mut problem = plain();
    problem.P[(2, 2)] = -1.0;
    assert_eq!(status(&problem), Status::NotConvex);
}

#[test]
fn crossed_sides_are_infeasible_and_named() {
    let mut problem = plain();
    (problem.l[1], problem.u[1]) = (2.0, 1.5);
    let mut solver = active_set(&problem);
    let outcome = solver.solve(&problem);
    assert_eq!(outcome.report.status, Status::Infeasible);
    assert_eq!(outcome.contradiction.unmet, Some(Row::Inequality(1)));
    assert_eq!(outcome.contradiction.amount, 0.5);
    let mut problem = plain();
    (problem.lb[0], problem.ub[0]) = (1.0, 0.0);
    let mut solver = active_set(&problem);
    assert_eq!(solver.solve(&problem).contradiction.unmet, Some(Row::Bound(0)));
}

#[test]
fn a_row_of_zeros_demands_nothing_or_the_impossible() {
    let mut problem = plain();
    problem.C.row_mut(0).fill(0.0);
    (problem.l[0], problem.u[0]) = (-1.0, 1.0);
    assert_eq!(status(&problem), Status::Solved);
    problem.l[0] = 0.5;
    let mut solver = active_set(&problem);
    let outcome = solver.solve(&problem);
    assert_eq!(outcome.report.status, Status::Infeasible);
    assert_eq!(outcome.contradiction.rows.len(), 1);
    assert_eq!(outcome.contradiction.amount, 0.5);
    let mut problem = plain();
    problem.A.fill(0.0);
    assert_eq!(status(&problem), Status::Solved);
    problem.b[0] = 1e-6;
    assert_eq!(status(&problem), Status::Infeasible);
}

#[test]
fn wrong_shapes_are_named_with_what_was_expected() {
    let mut problem = plain();
    problem.C = DMatrix::zeros(2, 4);
    let error = problem.check().expect_err("too wide");
    assert_eq!(error, ProblemError::Shape { field: "C", rows: 2, columns: 3, found_rows: 2, found_columns: 4 });
    assert_eq!(error.to_string(), "`C` is 2 x 4, expected 2 x 3");
    let mut problem = plain();
    problem.l[1] = f64::INFINITY;
    let error = problem.check().expect_err("no number can be that large");
    assert_eq!(error, ProblemError::Entry { field: "l", row: 1, column: 0, value: f64::INFINITY });
}

#[test]
#[should_panic(expected = "the size the solver was made for")]
fn a_program_of_another_size_is_a_bug_of_the_caller() {
    let problem = plain();
    let other = Problem::new(Size { variables: 4, equalities: 0, inequalities: 0 });
    active_set(&problem).solve(&other);
}
