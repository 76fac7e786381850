//! `soleus-inspect friction`: one contact problem with dry friction.

use crate::door::{self, Outcome};
use ::friction::{ContactProblem, Report, Settings, Status, Workspace};
use anyhow::Context;
use serde::{Deserialize, Serialize};
use std::time::Instant;

const HELP: &str = r#"INPUT, one JSON document on stdin (--example prints a complete one):
  {"W": [[...]],          3n x 3n, symmetric positive semi-definite; rows t1, t2, n of each contact in turn
   "q": [...],            3n: relative displacement (or velocity) without forces
   "mu": [...],           n friction coefficients >= 0
   "tolerance": 1e-8,     largest |r| / |F| and |r/rho| / |q|, r = F - P(F - rho (delta + mu |delta_t| n)), rho = 3/trace(W_aa), P onto
                         the cone; default 1e-8
   "solver": "auto"}      "gauss-seidel", "newton", "proximal" or "auto" (all in turn); default "auto"

OUTPUT: "F", "delta" = W F + q (3n each), "residual" (the larger of "residual_force" and "residual_gap", as above), "residual_n" (absolute),
  "penetration_m" (largest -delta_n), "worst_contact", "states" ("open", "stick", "slip"), "iterations", "time_us",
  "status": "solved", "iteration-limit" (none found), "singular", or "impossible" (there is none), then with
  "obstruction": {"contacts": [{"contact": i, "weight": y_i}], "least_penetration_m"}: W y = 0 and q.y < 0, y on the normals.
  Exit code 0 only when solved."#;

/// What to solve.
#[derive(clap::Args)]
#[command(after_long_help = HELP)]
pub struct Arguments {
    /// Print a complete input to start from, and stop.
    #[arg(long)]
    example: bool,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)] // names of the literature
struct Input {
    W: Vec<Vec<f64>>,
    q: Vec<f64>,
    mu: Vec<f64>,
    tolerance: Option<f64>,
    solver: Option<Solver>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Solver {
    GaussSeidel,
    Newton,
    Proximal,
    Auto,
}

#[derive(Serialize)]
#[allow(non_snake_case)] // names of the literature
struct Output {
    F: Vec<f64>,
    delta: Vec<f64>,
    residual: f64,
    residual_force: f64,
    residual_gap: f64,
    residual_n: f64,
    penetration_m: f64,
    worst_contact: usize,
    states: Vec<&'static str>,
    status: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    obstruction: Option<Obstruction>,
    iterations: usize,
    time_us: f64,
}

#[derive(Serialize)]
struct Obstruction {
    contacts: Vec<ObstructingContact>,
    least_penetration_m: f64,
}

#[derive(Serialize)]
struct ObstructingContact {
    contact: usize,
    weight: f64,
}

/// Reads a problem, writes its solution.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if arguments.example {
        door::write(&example())?;
        return Ok(Outcome::Solved);
    }
    let input: Input = door::read()?;
    let n = input.mu.len();
    let w = door::matrix("W", &input.W)?;
    let q = door::vector("q", &input.q, 3 * n).with_context(|| format!("mu has {n} entries"))?;
    let problem = ContactProblem::new(w, q, input.mu)?;
    let settings =
        Settings { tolerance: input.tolerance.unwrap_or(Settings::default().tolerance), ..Settings::default() };
    anyhow::ensure!(settings.tolerance > 0.0, "tolerance: a positive number expected, {} found", settings.tolerance);
    let mut workspace = Workspace::new(n);
    workspace.reserve_newton();
    let start = Instant::now();
    let report: Report = match input.solver.unwrap_or(Solver::Auto) {
        Solver::GaussSeidel => ::friction::gauss_seidel(&problem, &mut workspace, &settings),
        Solver::Newton => ::friction::newton(&problem, &mut workspace, &settings),
        Solver::Proximal => ::friction::proximal(&problem, &mut workspace, &settings),
        Solver::Auto => ::friction::solve(&problem, &mut workspace, &settings),
    };
    let time_us = start.elapsed().as_secs_f64() * 1e6;
    let (status, outcome) = match report.status {
        Status::Solved => ("solved", Outcome::Solved),
        Status::IterationLimit => ("iteration-limit", Outcome::NotSolved),
        Status::Impossible => ("impossible", Outcome::NotSolved),
        Status::Singular => ("singular", Outcome::NotSolved),
    };
    door::write(&Output {
        F: door::list(&report.force),
        delta: door::list(&report.delta),
        residual: report.residual.relative,
        residual_force: report.residual.force,
        residual_gap: report.residual.gap,
        residual_n: report.residual.absolute_n,
        penetration_m: report.residual.penetration_m,
        worst_contact: report.residual.worst_contact,
        states: workspace.states().iter().map(|state| state.word()).collect(),
        status,
        obstruction: report.obstruction.as_ref().map(|found| Obstruction {
            contacts: found
                .contacts
                .iter()
                .map(|(contact, weight)| ObstructingContact { contact: *contact, weight: *weight })
                .collect(),
            least_penetration_m: found.least_penetration_m,
        }),
        iterations: report.iterations,
        time_us,
    })?;
    Ok(outcome)
}

/// Two coupled contacts: one slides, one sticks.
fn example() -> Input {
    let mut w = vec![vec![0.0; 6]; 6];
    for i in 0..6 {
        w[i][i] = 2e-4;
        w[i][(i + 3) % 6] = 5e-5;
    }
    Input {
        W: w,
        q: vec![3e-3, 0.0, -2e-3, 1e-4, 0.0, -1e-3],
        mu: vec![0.5, 0.8],
        tolerance: Some(1e-10),
        solver: Some(Solver::Auto),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_is_a_problem_with_a_solution() {
        let input = example();
        let w = door::matrix("W", &input.W).expect("a matrix");
        let q = door::vector("q", &input.q, 6).expect("a vector");
        let problem = ContactProblem::new(w, q, input.mu).expect("a sound problem");
        let report = ::friction::solve(&problem, &mut Workspace::new(2), &Settings::default());
        assert_eq!(report.status, Status::Solved);
    }
}
