//! Dense programs: what every backend must do, and what only the active set promises.
#![allow(non_snake_case)] // the letters of the equations

#[path = "../support/random.rs"]
mod random;
#[path = "../support/recorded.rs"]
mod recorded;

mod adversarial;
mod conformance;
mod families;
mod recordings;
mod refusals;

use nalgebra::{DMatrix, DVector};
use qp::dense::{ActiveSet, ActiveSetSettings, Interior, InteriorSettings, Problem, Size, Solver};
use random::Random;

/// The active set with its default settings.
fn active_set(problem: &Problem) -> ActiveSet {
    ActiveSet::new(problem.size(), ActiveSetSettings::default())
}

/// Clarabel as an oracle.
fn oracle(problem: &Problem) -> Interior {
    Interior::new(problem.size(), InteriorSettings { tolerance: 1e-10, ..InteriorSettings::default() })
}

/// One of each backend.
fn backends(problem: &Problem) -> Vec<(&'static str, Box<dyn Solver>)> {
    vec![("active set", Box::new(active_set(problem))), ("Clarabel", Box::new(oracle(problem)))]
}

/// Standard basis row.
fn unit_row(n: usize, i: usize, value: f64) -> DMatrix<f64> {
    let mut row = DMatrix::zeros(1, n);
    row[i] = value;
    row
}

/// A strictly convex program with a known feasible point, of random size and of random structure.
fn random_feasible(random: &mut Random) -> Problem {
    let n = 1 + random.below(24);
    let size = Size { variables: n, equalities: random.below(n.div_ceil(2)), inequalities: random.below(2 * n + 1) };
    let mut problem = Problem::new(size);
    let rank = 1 + random.below(n);
    let factor = DMatrix::from_fn(n, rank, |_, _| random.signed());
    let damping = 10_f64.powf(-6.0 * random.unit());
    problem.P = &factor * factor.transpose() + damping * DMatrix::identity(n, n);
    problem.c = DVector::from_fn(n, |_, _| 3.0 * random.signed());
    let inside = DVector::from_fn(n, |_, _| 2.0 * random.signed());
    let sparsity = random.unit();
    let mut matrix = |rows: usize| {
        let mut m = DMatrix::zeros(rows, n);
        for x in m.iter_mut() {
            if random.chance(1.0 - 0.8 * sparsity) {
                *x = random.signed();
            }
        }
        m
    };
    problem.A = matrix(size.equalities);
    problem.C = matrix(size.inequalities);
    problem.b = &problem.A * &inside;
    let values = &problem.C * &inside;
    let mut sides = |value: f64| match random.below(5) {
        0 => (f64::NEG_INFINITY, value + random.unit()),
        1 => (value - random.unit(), f64::INFINITY),
        2 => (value - 0.3 * random.unit(), value + 0.3 * random.unit()),
        3 => (value, value + random.unit()),
        _ => (f64::NEG_INFINITY, f64::INFINITY),
    };
    for i in 0..size.inequalities {
        (problem.l[i], problem.u[i]) = sides(values[i]);
    }
    for i in 0..n {
        (problem.lb[i], problem.ub[i]) = sides(inside[i]);
    }
    problem
}
