//! `soleus-inspect qp`: the dense solvers of the whole-body controller for any program.

use crate::door::{self, Outcome};
use ::qp::dense::{
    ActiveSet, ActiveSetSettings, Auto, Backend as Answering, Interior, InteriorSettings, Outcome as Solution, Problem,
    Side, Size, Solver,
};
use ::qp::{Row, Status};
use anyhow::Context;
use clap::ValueEnum;
use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use std::time::Instant;

const HELP: &str = r#"INPUT, one JSON document on stdin (--example prints a complete one): a program, or a list of programs that are
solved in order, each starting from what held at the solution before it (as long as the sizes stay):
  minimise 1/2 x'Px + c'x   subject to   A x = b,   l <= C x <= u,   lb <= x <= ub
  {"P": [[..]], "c": [..], "A": [[..]], "b": [..], "C": [[..]], "l": [..], "u": [..], "lb": [..], "ub": [..]}
  P (n x n) and c (n) are required; of P the symmetric part counts. null in l, u, lb, ub = no bound; a missing field = no
  such rows or no bounds.

OUTPUT, one JSON document on stdout: an object per program (a list for a list):
  "status"       "solved", "solved_inaccurately", "infeasible", "unbounded", "not_convex", "iteration_limit", "time_limit",
                 "numerical_failure"
  "x"            the point; of an unbounded program the direction in which the objective falls for ever
  "negative_curvature"  of a program that is not convex: the least eigenvalue of P, or a lower v'Pv / v'v of some v
  "y_eq", "y_in", "y_bound"     multipliers: P x + c + A'y_eq + C'y_in + y_bound = 0, positive at upper sides, negative at lower
                 ones; of an infeasible program the certificate A'y_eq + C'y_in + y_bound = 0
  "objective"    1/2 x'Px + c'x
  "residuals"    "stationarity", "feasibility", "complementarity", each relative to the largest term that should cancel (at
                 least 1); "violation": largest violation of any row in its own unit
  "active"       rows that hold: {"row": "C"|"bound", "index": i, "side": "lower"|"upper"} (active set only)
  "contradiction"  of an infeasible program: "rows" [{"row": "A"|"C"|"bound", "index": i, "weight": w}], "unmet" (a row that
                 cannot be met while the others hold), "amount" (by how much, in its unit), "least_violation" (whatever x, with A x = b
                 met, one of these rows is violated by at least this much)
  "iterations"   changes of the active set, or interior-point steps
  "backend", "time_us"   who solved it, and how long the solver took (wall clock)
Exit code 0 only when every program was solved."#;

const EXAMPLE: &str = r#"[
  {"P": [[2, 0.5], [0.5, 1]], "c": [1, -3], "A": [[1, 1]], "b": [1], "C": [[1, -1]], "l": [null], "u": [0.2], "lb": [0, null], "ub": [null, 2]},
  {"P": [[2, 0.5], [0.5, 1]], "c": [1.1, -3], "A": [[1, 1]], "b": [1], "C": [[1, -1]], "l": [null], "u": [0.2], "lb": [0, null], "ub": [null, 2]}
]
"#;

/// Who solves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Backend {
    /// The active set; Clarabel as backup solver where it does not get through.
    Auto,
    /// Own warm-started dual active set: P positive semidefinite.
    ActiveSet,
    /// Clarabel's interior point: P positive semidefinite.
    Clarabel,
}

/// How to solve.
#[derive(clap::Args)]
#[command(after_long_help = HELP)]
pub struct Arguments {
    /// Solver.
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    backend: Backend,
    /// Active set: violation of a row that is accepted (default 1e-11). Clarabel: its tolerances (default 1e-9).
    #[arg(long)]
    tolerance: Option<f64>,
    /// Active set: changes after which it gives up; Clarabel: interior-point steps.
    #[arg(long, default_value_t = 1000)]
    iterations_max: u32,
    /// Print an input to start from.
    #[arg(long)]
    example: bool,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Input {
    List(Vec<Program>),
    One(Box<Program>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)] // the letters of the equation
struct Program {
    P: Vec<Vec<f64>>,
    c: Vec<f64>,
    #[serde(default)]
    A: Vec<Vec<f64>>,
    #[serde(default)]
    b: Vec<f64>,
    #[serde(default)]
    C: Vec<Vec<f64>>,
    l: Option<Vec<Option<f64>>>,
    u: Option<Vec<Option<f64>>>,
    lb: Option<Vec<Option<f64>>>,
    ub: Option<Vec<Option<f64>>>,
}

impl Program {
    fn problem(&self) -> anyhow::Result<Problem> {
        let n = self.c.len();
        let size = Size { variables: n, equalities: self.A.len(), inequalities: self.C.len() };
        let mut problem = Problem::new(size);
        let hessian = door::matrix("P", &self.P)?;
        anyhow::ensure!(hessian.is_square(), "P: {} rows of {} entries", hessian.nrows(), hessian.ncols());
        problem.P = 0.5 * (&hessian + hessian.transpose());
        problem.c = door::vector("c", &self.c, n)?;
        if size.equalities > 0 {
            problem.A = door::matrix("A", &self.A)?;
        }
        problem.b = door::vector("b", &self.b, size.equalities)?;
        if size.inequalities > 0 {
            problem.C = door::matrix("C", &self.C)?;
        }
        let side = |name: &str, values: &Option<Vec<Option<f64>>>, length: usize, none: f64| match values {
            None => Ok(DVector::from_element(length, none)),
            Some(values) => {
                let values: Vec<f64> = values.iter().map(|x| x.unwrap_or(none)).collect();
                door::vector(name, &values, length)
            }
        };
        problem.l = side("l", &self.l, size.inequalities, f64::NEG_INFINITY)?;
        problem.u = side("u", &self.u, size.inequalities, f64::INFINITY)?;
        problem.lb = side("lb", &self.lb, n, f64::NEG_INFINITY)?;
        problem.ub = side("ub", &self.ub, n, f64::INFINITY)?;
        problem.check()?;
        Ok(problem)
    }
}

#[derive(Serialize)]
struct Answer {
    status: &'static str,
    x: Vec<f64>,
    y_eq: Vec<f64>,
    y_in: Vec<f64>,
    y_bound: Vec<f64>,
    objective: Option<f64>,
    residuals: Residuals,
    active: Vec<ActiveRow>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contradiction: Option<Contradiction>,
    #[serde(skip_serializing_if = "Option::is_none")]
    negative_curvature: Option<f64>,
    iterations: u32,
    backend: &'static str,
    time_us: f64,
}

#[derive(Serialize)]
struct Residuals {
    stationarity: Option<f64>,
    feasibility: Option<f64>,
    complementarity: Option<f64>,
    violation: Option<f64>,
}

#[derive(Serialize)]
struct ActiveRow {
    row: &'static str,
    index: usize,
    side: &'static str,
}

#[derive(Serialize)]
struct Contradiction {
    rows: Vec<ConflictRow>,
    unmet: Option<UnmetRow>,
    amount: f64,
    least_violation: f64,
}

#[derive(Serialize)]
struct ConflictRow {
    row: &'static str,
    index: usize,
    weight: f64,
}

#[derive(Serialize)]
struct UnmetRow {
    row: &'static str,
    index: usize,
}

/// Reads programs, writes solutions.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if arguments.example {
        print!("{EXAMPLE}");
        return Ok(Outcome::Solved);
    }
    if let Some(tolerance) = arguments.tolerance {
        anyhow::ensure!(tolerance > 0.0 && tolerance.is_finite(), "--tolerance {tolerance}: must be positive");
    }
    let (programs, is_list) = match door::read()? {
        Input::List(programs) => (programs, true),
        Input::One(program) => (vec![*program], false),
    };
    let mut solvers = Solvers::default();
    let mut answers = Vec::with_capacity(programs.len());
    for (k, program) in programs.iter().enumerate() {
        let problem = program.problem().with_context(|| format!("program {k}"))?;
        answers.push(solvers.solve(&problem, arguments));
    }
    let outcome =
        if answers.iter().all(|answer| answer.status == "solved") { Outcome::Solved } else { Outcome::NotSolved };
    if is_list {
        door::write(&answers)?;
    } else {
        door::write(&answers[0])?;
    }
    Ok(outcome)
}

/// Solvers of the last size, which remember what held.
#[derive(Default)]
struct Solvers {
    size: Option<Size>,
    solver: Option<Chosen>,
}

enum Chosen {
    Auto(Auto),
    ActiveSet(ActiveSet),
    Clarabel(Interior),
}

impl Solvers {
    fn solve(&mut self, problem: &Problem, arguments: &Arguments) -> Answer {
        let size = problem.size();
        if self.size != Some(size) {
            (self.size, self.solver) = (Some(size), None);
        }
        let defaults = ActiveSetSettings::default();
        let settings = ActiveSetSettings {
            feasibility_tolerance: arguments.tolerance.unwrap_or(defaults.feasibility_tolerance),
            iterations_max: arguments.iterations_max as usize,
        };
        let interior = InteriorSettings {
            tolerance: arguments.tolerance.unwrap_or(1e-9),
            iterations_max: arguments.iterations_max,
        };
        let solver = self.solver.get_or_insert_with(|| match arguments.backend {
            Backend::Auto => Chosen::Auto(Auto::new(size, settings, interior)),
            Backend::ActiveSet => Chosen::ActiveSet(ActiveSet::new(size, settings)),
            Backend::Clarabel => Chosen::Clarabel(Interior::new(size, interior)),
        });
        match solver {
            Chosen::ActiveSet(solver) => timed(solver, problem, "active-set"),
            Chosen::Clarabel(solver) => timed(solver, problem, "clarabel"),
            Chosen::Auto(solver) => {
                let answer = timed(solver, problem, "active-set");
                let backend = if solver.backend() == Answering::Interior { "clarabel" } else { answer.backend };
                Answer { backend, ..answer }
            }
        }
    }
}

fn timed(solver: &mut dyn Solver, problem: &Problem, backend: &'static str) -> Answer {
    let start = Instant::now();
    let solution = solver.solve(problem);
    let time_us = start.elapsed().as_secs_f64() * 1e6;
    answer(solution, backend, time_us)
}

fn answer(solution: &Solution, backend: &'static str, time_us: f64) -> Answer {
    let report = &solution.report;
    let finite = |x: f64| x.is_finite().then_some(x); // JSON has no other numbers
    let list = |v: &DVector<f64>| v.iter().copied().collect::<Vec<_>>();
    let contradiction = (!solution.contradiction.rows.is_empty()).then(|| Contradiction {
        rows: solution
            .contradiction
            .rows
            .iter()
            .map(|c| {
                let (row, index) = place(c.row);
                ConflictRow { row, index, weight: c.weight }
            })
            .collect(),
        unmet: solution.contradiction.unmet.map(|row| {
            let (row, index) = place(row);
            UnmetRow { row, index }
        }),
        amount: solution.contradiction.amount,
        least_violation: solution.contradiction.least_violation(),
    });
    Answer {
        status: word(report.status),
        x: list(&report.x),
        y_eq: list(&report.y_eq),
        y_in: list(&report.y_in),
        y_bound: list(&report.y_bound),
        objective: finite(report.objective),
        residuals: Residuals {
            stationarity: finite(report.residuals.stationarity),
            feasibility: finite(report.residuals.feasibility),
            complementarity: finite(report.residuals.complementarity),
            violation: finite(solution.violation),
        },
        active: solution
            .active
            .iter()
            .map(|active| {
                let (row, index) = place(active.row);
                let side = match active.side {
                    Side::Lower => "lower",
                    Side::Upper => "upper",
                    Side::Both => "both",
                };
                ActiveRow { row, index, side }
            })
            .collect(),
        contradiction,
        negative_curvature: report.negative_curvature,
        iterations: report.iterations,
        backend,
        time_us,
    }
}

fn place(row: Row) -> (&'static str, usize) {
    match row {
        Row::Equality(i) => ("A", i),
        Row::Inequality(i) => ("C", i),
        Row::Bound(i) => ("bound", i),
    }
}

fn word(status: Status) -> &'static str {
    match status {
        Status::Solved => "solved",
        Status::SolvedInaccurately => "solved_inaccurately",
        Status::Infeasible => "infeasible",
        Status::Unbounded => "unbounded",
        Status::NotConvex => "not_convex",
        Status::IterationLimit => "iteration_limit",
        Status::TimeLimit => "time_limit",
        Status::NumericalFailure => "numerical_failure",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(backend: Backend) -> Arguments {
        Arguments { backend, tolerance: None, iterations_max: 1000, example: false }
    }

    #[test]
    fn the_example_is_solved_by_both_backends_alike() {
        let Input::List(programs) = door::parse(EXAMPLE).expect("the example parses") else { panic!("a list") };
        for program in &programs {
            let problem = program.problem().expect("well-formed");
            let own = Solvers::default().solve(&problem, &arguments(Backend::Auto));
            let other = Solvers::default().solve(&problem, &arguments(Backend::Clarabel));
            assert_eq!((own.status, own.backend, other.status), ("solved", "active-set", "solved"));
            for (a, b) in own.x.iter().zip(&other.x) {
                assert!((a - b).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn semidefinite_infeasible_and_other_programs_say_what_they_are() {
        let semidefinite: Program =
            door::parse(r#"{"P": [[1, 0], [0, 0]], "c": [0, 1], "lb": [null, -2]}"#).expect("parses");
        let answer = Solvers::default().solve(&semidefinite.problem().expect("fits"), &arguments(Backend::Auto));
        assert_eq!((answer.status, answer.x[1]), ("solved", -2.0));
        let saddle: Program =
            door::parse(r#"{"P": [[1, 0], [0, -1]], "c": [0, 0], "lb": [-1, -1], "ub": [1, 1]}"#).expect("parses");
        for backend in [Backend::Auto, Backend::ActiveSet, Backend::Clarabel] {
            let answer = Solvers::default().solve(&saddle.problem().expect("fits"), &arguments(backend));
            assert_eq!((answer.status, answer.negative_curvature), ("not_convex", Some(-1.0)));
        }
        let impossible: Program =
            door::parse(r#"{"P": [[1]], "c": [0], "C": [[1]], "l": [2], "ub": [1]}"#).expect("parses");
        let answer = Solvers::default().solve(&impossible.problem().expect("fits"), &arguments(Backend::Auto));
        assert_eq!(answer.status, "infeasible");
        let contradiction = answer.contradiction.expect("named");
        assert_eq!((contradiction.rows.len(), contradiction.amount, contradiction.least_violation), (2, 1.0, 0.5));
    }

    #[test]
    fn a_dumped_program_comes_back_to_the_bit() {
        let mut problem = Problem::new(Size { variables: 3, equalities: 1, inequalities: 2 });
        problem.P[(0, 0)] = 1.0 / 3.0;
        problem.c[1] = -1e-300;
        problem.A.fill(0.1);
        problem.C[(1, 2)] = 1e17 / 7.0;
        (problem.u[0], problem.l[1], problem.lb[2]) = (2.0_f64.sqrt(), -0.0, 5.5);
        let program: Program = door::parse(&problem.to_json()).expect("the dump is what this subcommand reads");
        assert_eq!(program.problem().expect("well-formed"), problem);
    }

    #[test]
    fn wrong_input_is_refused_with_the_field() {
        let crooked: Program = door::parse(r#"{"P": [[1, 0], [0, 1]], "c": [0, 1], "lb": [0]}"#).expect("parses");
        assert!(crooked.problem().expect_err("too short").to_string().contains("lb"));
        let unknown = door::parse::<Program>(r#"{"P": [[1]], "c": [0], "Q": []}"#);
        assert!(unknown.is_err());
    }
}
