//! Clarabel's interior point behind the dense problem type, with data updates.

use super::cholesky::Cholesky;
use super::order::Order;
use super::scaling::Scaling;
use super::{Active, Contradiction, Outcome, Problem, Size, Solver};
use crate::backend::clarabel::{Settings, solve};
use crate::convexity::negative_curvature;
use crate::{Conflict, QuadraticProgram, Row, SparseMatrix, Status};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nalgebra::DMatrix;

/// Limits of [`Interior`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InteriorSettings {
    /// Clarabel's absolute and relative gap and feasibility tolerance. Useful: 1e-6 to 1e-10.
    pub tolerance: f64,
    /// Interior-point steps after which it gives up.
    pub iterations_max: u32,
}

impl Default for InteriorSettings {
    fn default() -> Self {
        Self { tolerance: 1e-8, iterations_max: 200 }
    }
}

/// Clarabel's own infinity: numbers beyond it would spoil its scaling and mean "none" anyway.
const NO_SIDE: f64 = 1e20;

/// Below this part of the largest multiplier a certificate's entry is noise.
const NEGLIGIBLE: f64 = 1e-4;

/// Units further apart than this make Clarabel's answer worth a second look: its own scaling ends at 1e4 and 1e-4.
const SPREAD: f64 = 1e6;
/// An answer is good when its residual in units of its own is below this times the tolerance.
const MEASURE: f64 = 1e3;

/// What of a two-sided row exists. The cones, and so the memory, depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sides {
    None,
    Lower,
    Upper,
    Two,
    /// Both sides at the same value: an equality, for an interior point needs an interior.
    Equal,
}

impl Sides {
    fn of(lower: f64, upper: f64) -> Self {
        match (lower > -NO_SIDE, upper < NO_SIDE) {
            (false, false) => Self::None,
            (true, false) => Self::Lower,
            (false, true) => Self::Upper,
            (true, true) if lower == upper => Self::Equal,
            (true, true) => Self::Two,
        }
    }

    fn has_lower(self) -> bool {
        matches!(self, Self::Lower | Self::Two)
    }

    fn has_upper(self) -> bool {
        matches!(self, Self::Upper | Self::Two)
    }
}

/// Where a row of Clarabel's constraint matrix comes from.
#[derive(Debug, Clone, Copy)]
struct Source {
    /// Equalities, inequalities, bounds, counted through.
    row: usize,
    /// +1: `a x <= u` or an equality; -1: `-a x <= -l`.
    sign: f64,
}

/// Clarabel for programs of one size. The matrices are handed over by value as long as their pattern of zeros stays
/// within what was seen before; else the solver is set up anew, and [`Interior::setups`] counts it.
///
/// Clarabel itself allocates once per solve.
///
/// A program that is not convex is refused ([`Status::NotConvex`]). The answer to one whose units are far apart is
/// judged in units that are alike; if it is not good there, the program is solved again in these units, and if that is
/// no better, it is [`Status::SolvedInaccurately`].
pub struct Interior {
    size: Size,
    settings: InteriorSettings,
    sides: Vec<Sides>,
    hessian_pattern: DMatrix<bool>,
    equality_pattern: DMatrix<bool>,
    inequality_pattern: DMatrix<bool>,
    sources: Vec<Source>,
    hessian_values: Vec<f64>,
    matrix_values: Vec<f64>,
    target: Vec<f64>,
    c: Vec<f64>,
    solver: Option<DefaultSolver<f64>>,
    order: Order,
    cholesky: Cholesky,
    scaling: Scaling,
    setups: usize,
    outcome: Outcome,
}

impl Interior {
    /// For programs of one size.
    #[must_use]
    pub fn new(size: Size, settings: InteriorSettings) -> Self {
        let Size { variables: n, equalities: e, inequalities: m } = size;
        Self {
            size,
            settings,
            sides: vec![Sides::None; m + n],
            hessian_pattern: DMatrix::from_fn(n, n, |i, j| i == j),
            equality_pattern: DMatrix::from_element(e, n, false),
            inequality_pattern: DMatrix::from_element(m, n, false),
            sources: Vec::new(),
            hessian_values: Vec::new(),
            matrix_values: Vec::new(),
            target: Vec::new(),
            c: Vec::new(),
            solver: None,
            order: Order::natural(n),
            cholesky: Cholesky::new(n),
            scaling: Scaling::new(size),
            setups: 0,
            outcome: Outcome::new(size),
        }
    }

    /// How often Clarabel was set up anew because the pattern of zeros or of bounds had changed.
    #[must_use]
    pub fn setups(&self) -> usize {
        self.setups
    }

    fn solve_into_outcome(&mut self, problem: &Problem) -> Status {
        if let Some(curvature) = self.curvature(problem) {
            self.outcome.report.negative_curvature = Some(curvature);
            return Status::NotConvex;
        }
        let status = self.ask_clarabel(problem);
        if status == Status::Infeasible {
            self.describe_contradiction(problem);
        }
        if status == Status::Solved && self.is_unbalanced(problem) {
            return Status::SolvedInaccurately;
        }
        if status == Status::Infeasible || self.scaling.measure(problem) <= SPREAD {
            return status;
        }
        self.look_again(problem, status)
    }

    /// The negative curvature of P, if any. A factorisation that succeeds is a quick "none".
    fn curvature(&mut self, problem: &Problem) -> Option<f64> {
        self.order.arrange(&problem.P, |_| None);
        let stopped = self.cholesky.factorise(&problem.P, &self.order).is_err();
        if stopped { negative_curvature(&problem.P) } else { None }
    }

    /// Whether the gradient misses zero by more than half of the digits asked for, measured by all its terms but P x.
    /// Clarabel measures by x, which grows without end where nothing bounds the program.
    fn is_unbalanced(&self, problem: &Problem) -> bool {
        let report = &self.outcome.report;
        let missed = report.residuals.stationarity / self.settings.tolerance.sqrt();
        missed > problem.c.amax().max(report.y_bound.amax())
            && missed > problem.A.tr_mul(&report.y_eq).amax().max(problem.C.tr_mul(&report.y_in).amax())
    }

    /// Judges the answer in units that are alike; where it is not good, the better of it and of the answer found in
    /// these units stays.
    fn look_again(&mut self, problem: &Problem, status: Status) -> Status {
        let scaling = &self.scaling;
        let good = MEASURE * self.settings.tolerance;
        let first = scaling.residual(problem, &self.outcome.report);
        if status == Status::Solved && first <= good {
            return status;
        }
        let mut again = Self::new(self.size, self.settings);
        again.ask_clarabel(&scaling.scaled(problem));
        let mut report = again.outcome.report;
        scaling.carry(&mut report, true);
        let second = scaling.residual(problem, &report);
        if !(report.status.has_solution() && (second < first || !status.has_solution())) {
            return if status == Status::Solved { Status::SolvedInaccurately } else { status };
        }
        report.iterations += self.outcome.report.iterations;
        report.residuals = problem.residuals(&report.x, &report.y_eq, &report.y_in, &report.y_bound);
        report.objective = problem.objective(&report.x);
        self.outcome.violation = problem.violation(&report.x);
        let status = if second <= good { report.status } else { Status::SolvedInaccurately };
        self.outcome.report = report;
        status
    }

    fn ask_clarabel(&mut self, problem: &Problem) -> Status {
        let Size { variables: n, equalities: e, inequalities: m } = self.size;
        assert_eq!(problem.size(), self.size, "the program must have the size the solver was made for");
        let fits = self.absorb_pattern(problem);
        self.hessian_values.clear();
        for j in 0..n {
            for i in 0..=j {
                if self.hessian_pattern[(i, j)] {
                    self.hessian_values.push(problem.P[(i, j)]);
                }
            }
        }
        if !fits {
            self.order_rows();
        }
        self.matrix_values.clear();
        for j in 0..n {
            for &Source { row, sign } in &self.sources {
                if let Some(value) = self.entry(problem, row, j) {
                    self.matrix_values.push(sign * value);
                }
            }
        }
        self.target.clear();
        for &Source { row, sign } in &self.sources {
            let limit = |k: usize, lower: &[f64], upper: &[f64]| if sign > 0.0 { upper[k] } else { -lower[k] };
            self.target.push(if row < e {
                problem.b[row]
            } else if row < e + m {
                limit(row - e, problem.l.as_slice(), problem.u.as_slice())
            } else {
                limit(row - e - m, problem.lb.as_slice(), problem.ub.as_slice())
            });
        }
        self.c.clear();
        self.c.extend_from_slice(problem.c.as_slice());
        let updated = fits
            && self.solver.as_mut().is_some_and(|solver| {
                solver.update_P(&self.hessian_values).is_ok()
                    && solver.update_A(&self.matrix_values).is_ok()
                    && solver.update_q(&self.c).is_ok()
                    && solver.update_b(&self.target).is_ok()
            });
        if !updated && !self.set_up(problem) {
            return Status::NumericalFailure;
        }
        let Some(solver) = self.solver.as_mut() else { return Status::NumericalFailure };
        solver.solve();
        let solution = &solver.solution;
        let report = &mut self.outcome.report;
        report.iterations = solution.iterations;
        report.x.as_mut_slice().copy_from_slice(&solution.x);
        for (source, z) in self.sources.iter().zip(&solution.z) {
            let y = source.sign * z;
            if source.row < e {
                report.y_eq[source.row] += y;
            } else if source.row < e + m {
                report.y_in[source.row - e] += y;
            } else {
                report.y_bound[source.row - e - m] += y;
            }
        }
        let status = match solution.status {
            SolverStatus::Solved => Status::Solved,
            SolverStatus::AlmostSolved => Status::SolvedInaccurately,
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Status::Infeasible,
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Status::Unbounded,
            SolverStatus::MaxIterations => Status::IterationLimit,
            SolverStatus::MaxTime => Status::TimeLimit,
            _ => Status::NumericalFailure,
        };
        report.residuals = problem.residuals(&report.x, &report.y_eq, &report.y_in, &report.y_bound);
        report.objective = problem.objective(&report.x);
        self.outcome.violation = problem.violation(&report.x);
        report.status = status;
        status
    }

    /// Which rows exclude each other. Clarabel's certificate leans a little on every row; that of the relaxed program,
    /// where the largest violation is least, leans on those that carry it.
    fn describe_contradiction(&mut self, problem: &Problem) {
        let settings = Settings { tolerance: self.settings.tolerance.min(1e-9), ..Settings::default() };
        let Outcome { report, contradiction, .. } = &mut self.outcome;
        // Crossed sides or bad numbers: there is nothing to relax, the first certificate stays.
        if let Ok(relaxed) = solve(&sparse(problem), &settings)
            && relaxed.status == Status::Infeasible
        {
            (report.y_eq, report.y_in, report.y_bound) = (relaxed.y_eq, relaxed.y_in, relaxed.y_bound);
        }
        let side = |Conflict { row, weight }: &Conflict| match row {
            Row::Equality(i) => problem.b[*i],
            Row::Inequality(i) if *weight > 0.0 => problem.u[*i],
            Row::Inequality(i) => problem.l[*i],
            Row::Bound(i) if *weight > 0.0 => problem.ub[*i],
            Row::Bound(i) => problem.lb[*i],
        };
        let mut rows = report.conflict(NEGLIGIBLE);
        // A row whose side does not exist has no multiplier beyond rounding.
        rows.retain(|conflict| side(conflict).is_finite());
        let amount = -rows.iter().map(|conflict| conflict.weight * side(conflict)).sum::<f64>();
        let heaviest = rows.first();
        *contradiction = Contradiction {
            unmet: heaviest.map(|conflict| conflict.row),
            amount: heaviest.map_or(0.0, |conflict| amount / conflict.weight.abs()),
            rows,
        };
    }

    /// Whether all nonzeros and sides lie within what Clarabel was set up for; takes up those that do not.
    fn absorb_pattern(&mut self, problem: &Problem) -> bool {
        let mut fits = self.solver.is_some();
        let mut absorb = |pattern: &mut DMatrix<bool>, matrix: &DMatrix<f64>| {
            for (seen, value) in pattern.iter_mut().zip(matrix.iter()) {
                if *value != 0.0 && !*seen {
                    *seen = true;
                    fits = false;
                }
            }
        };
        absorb(&mut self.hessian_pattern, &problem.P);
        absorb(&mut self.equality_pattern, &problem.A);
        absorb(&mut self.inequality_pattern, &problem.C);
        let rows = problem.l.iter().zip(problem.u.iter());
        let bounds = problem.lb.iter().zip(problem.ub.iter());
        for (sides, (lower, upper)) in self.sides.iter_mut().zip(rows.chain(bounds)) {
            let now = Sides::of(*lower, *upper);
            if *sides != now {
                *sides = now;
                fits = false;
            }
        }
        fits
    }

    fn order_rows(&mut self) {
        let e = self.size.equalities;
        self.sources.clear();
        self.sources.extend((0..e).map(|row| Source { row, sign: 1.0 }));
        let listed = |wanted: fn(Sides) -> bool, sign: f64| {
            self.sides
                .iter()
                .enumerate()
                .filter(move |(_, sides)| wanted(**sides))
                .map(move |(i, _)| Source { row: e + i, sign })
                .collect::<Vec<_>>()
        };
        let equal = listed(|s| s == Sides::Equal, 1.0);
        let upper = listed(Sides::has_upper, 1.0);
        let lower = listed(Sides::has_lower, -1.0);
        self.sources.extend(equal.into_iter().chain(upper).chain(lower));
    }

    fn entry(&self, problem: &Problem, row: usize, column: usize) -> Option<f64> {
        let Size { equalities: e, inequalities: m, .. } = self.size;
        if row < e {
            self.equality_pattern[(row, column)].then(|| problem.A[(row, column)])
        } else if row < e + m {
            self.inequality_pattern[(row - e, column)].then(|| problem.C[(row - e, column)])
        } else {
            (row - e - m == column).then_some(1.0)
        }
    }

    fn set_up(&mut self, problem: &Problem) -> bool {
        let Size { variables: n, equalities: e, inequalities: m } = self.size;
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for j in 0..n {
            rows.extend((0..=j).filter(|&i| self.hessian_pattern[(i, j)]));
            starts.push(rows.len());
        }
        let hessian = CscMatrix::new(n, n, starts, rows, self.hessian_values.clone());
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for j in 0..n {
            for (i, source) in self.sources.iter().enumerate() {
                let row = source.row;
                let present = if row < e {
                    self.equality_pattern[(row, j)]
                } else if row < e + m {
                    self.inequality_pattern[(row - e, j)]
                } else {
                    row - e - m == j
                };
                if present {
                    rows.push(i);
                }
            }
            starts.push(rows.len());
        }
        let matrix = CscMatrix::new(self.sources.len(), n, starts, rows, self.matrix_values.clone());
        let equalities = e + self.sides.iter().filter(|s| **s == Sides::Equal).count();
        let cones =
            [SupportedConeT::ZeroConeT(equalities), SupportedConeT::NonnegativeConeT(self.sources.len() - equalities)];
        let tolerance = self.settings.tolerance;
        let settings = DefaultSettings {
            verbose: false,
            max_iter: self.settings.iterations_max,
            tol_gap_abs: tolerance,
            tol_gap_rel: tolerance,
            tol_feas: tolerance,
            // Data updates are refused when rows or zeros have been removed.
            presolve_enable: false,
            input_sparse_dropzeros: false,
            ..DefaultSettings::default()
        };
        self.setups += 1;
        self.solver = DefaultSolver::new(&hessian, problem.c.as_slice(), &matrix, &self.target, &cones, settings).ok();
        self.solver.is_some()
    }
}

/// The program for the sparse form.
fn sparse(problem: &Problem) -> QuadraticProgram {
    QuadraticProgram {
        P: SparseMatrix::from_dense(&problem.P),
        c: problem.c.clone(),
        A: SparseMatrix::from_dense(&problem.A),
        b: problem.b.clone(),
        C: SparseMatrix::from_dense(&problem.C),
        l: problem.l.clone(),
        u: problem.u.clone(),
        lb: problem.lb.clone(),
        ub: problem.ub.clone(),
    }
}

impl Solver for Interior {
    fn solve(&mut self, problem: &Problem) -> &Outcome {
        self.outcome.clear();
        self.outcome.report.status = self.solve_into_outcome(problem);
        &self.outcome
    }

    fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    fn guess(&mut self, _active: &[Active]) {}

    fn forget(&mut self) {
        self.solver = None;
    }
}
