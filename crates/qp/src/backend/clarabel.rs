//! Clarabel, an interior-point method (Goulart and Chen, 2024): `min 1/2 x'Px + q'x, A x + s = b, s in K`.
//!
//! Each finite side becomes one row of the nonnegative cone, `C x + s = u` and `-C x + s = -l`; rows whose sides
//! coincide join the equalities (zero cone), because a pair of opposite inequalities without interior breaks interior
//! points.

use crate::convexity::negative_curvature_sparse;
use crate::relaxation::{Relaxation, relax};
use crate::sparse::ProblemError;
use crate::{QuadraticProgram, Report, Row, SparseMatrix, Status};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, SolverStatus,
    SupportedConeT::{NonnegativeConeT, ZeroConeT},
};

/// Tolerances and limits.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Relative and absolute tolerance on residuals and duality gap, in Clarabel's equilibrated problem. Useful: 1e-6
    /// to 1e-11; an interior point gains about one digit per iteration near the end, so tight tolerances are cheap.
    pub tolerance: f64,
    /// Limit of interior-point iterations; 10 to 30 are usual.
    pub iterations_max: u32,
    /// Whether Clarabel scales rows and columns to similar size first. Leave it out where unknowns and rows have been
    /// scaled with their meaning in mind: its scaling, which looks at the largest entry of each, then takes digits
    /// away.
    pub equilibrate: bool,
    /// Added to the diagonal of every system of equations, so that its factors exist; iterative refinement takes it
    /// away again. Where the objective is flatter than this along some direction refinement no longer converges, and
    /// steps in that direction lose their digits; the smaller it is, the more digits the factors lose. Useful: 1e-11 to
    /// 1e-8.
    pub regularisation: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: 1e-10, iterations_max: 200, equilibrate: true, regularisation: 1e-8 }
    }
}

/// Where a row of Clarabel's constraint matrix comes from: `sign` = +1 for an upper side or an equality, -1 for a lower
/// side.
struct Origin {
    row: Row,
    sign: f64,
}

/// Solves the problem from scratch, if it is convex. If it is infeasible, a second solve finds the rows that contradict
/// each other.
///
/// # Errors
/// If the problem's arrays do not fit together ([`QuadraticProgram::check`]).
///
/// # Panics
/// If Clarabel refuses data that passed the check: a defect of this conversion.
pub fn solve(problem: &QuadraticProgram, settings: &Settings) -> Result<Report, ProblemError> {
    problem.check()?;
    if let Some(report) = not_convex(problem) {
        return Ok(report);
    }
    let mut report = solve_once(problem, settings);
    if report.status == Status::Infeasible {
        let Relaxation { problem: relaxed, origins } = relax(problem);
        let relaxed = solve_once(&relaxed, settings);
        // Not solved: the equalities alone contradict each other; the first certificate stays.
        if relaxed.status.has_solution() {
            report.y_eq = relaxed.y_eq;
            report.y_in.fill(0.0);
            report.y_bound.fill(0.0);
            for (origin, y) in origins.iter().zip(&relaxed.y_in) {
                match origin {
                    Row::Inequality(i) => report.y_in[*i] += y,
                    Row::Bound(i) => report.y_bound[*i] += y,
                    Row::Equality(_) => unreachable!("equalities are not relaxed"),
                }
            }
        }
    }
    Ok(report)
}

/// The report of a program that is not convex.
pub(crate) fn not_convex(problem: &QuadraticProgram) -> Option<Report> {
    let curvature = negative_curvature_sparse(&problem.P)?;
    let mut report = Report::with_sizes(problem.variables(), problem.b.len(), problem.l.len());
    report.status = Status::NotConvex;
    report.negative_curvature = Some(curvature);
    Some(report)
}

pub(crate) fn solve_once(problem: &QuadraticProgram, settings: &Settings) -> Report {
    let n = problem.variables();
    let (constraints, rhs, origins, equalities) = stack(problem);
    let cones = [ZeroConeT(equalities), NonnegativeConeT(origins.len() - equalities)];
    let clarabel_settings = DefaultSettings {
        verbose: false,
        max_iter: settings.iterations_max,
        tol_gap_abs: settings.tolerance,
        tol_gap_rel: settings.tolerance,
        tol_feas: settings.tolerance,
        equilibrate_enable: settings.equilibrate,
        static_regularization_constant: settings.regularisation,
        direct_solve_method: "qdldl".to_string(),
        presolve_enable: false, // the rows below are all finite; presolve would only copy them
        ..DefaultSettings::default()
    };
    let P = to_csc(&problem.P, |i, j| i <= j);
    let mut solver = DefaultSolver::new(&P, problem.c.as_slice(), &constraints, &rhs, &cones, clarabel_settings)
        .expect("shapes were checked above");
    solver.solve();

    let mut report = Report::with_sizes(n, problem.b.len(), problem.l.len());
    report.status = status(solver.solution.status);
    report.iterations = solver.solution.iterations;
    report.x.copy_from_slice(&solver.solution.x);
    for (origin, z) in origins.iter().zip(&solver.solution.z) {
        match origin.row {
            Row::Equality(i) => report.y_eq[i] += origin.sign * z,
            Row::Inequality(i) => report.y_in[i] += origin.sign * z,
            Row::Bound(i) => report.y_bound[i] += origin.sign * z,
        }
    }
    report.objective = problem.objective(&report.x);
    report.residuals = problem.residuals(&report.x, &report.y_eq, &report.y_in, &report.y_bound);
    report
}

/// `[A; C and bounds with coinciding sides; finite sides]`, its right-hand side, the origin of each row, and how many
/// rows are equalities.
fn stack(problem: &QuadraticProgram) -> (CscMatrix<f64>, Vec<f64>, Vec<Origin>, usize) {
    let (n, m) = (problem.variables(), problem.l.len());
    // Rows of C, then bounds; each goes to at most two rows of the stack: [upper or equal, lower].
    let two_sided: Vec<(Row, f64, f64)> = (0..m)
        .map(|i| (Row::Inequality(i), problem.l[i], problem.u[i]))
        .chain((0..n).map(|i| (Row::Bound(i), problem.lb[i], problem.ub[i])))
        .collect();
    let mut places: Vec<[Option<usize>; 2]> = vec![[None; 2]; m + n];
    let (mut origins, mut rhs) = (Vec::new(), Vec::new());
    let mut push = |row, sign: f64, side: f64| {
        origins.push(Origin { row, sign });
        rhs.push(sign * side);
        Some(origins.len() - 1)
    };
    for (i, b) in problem.b.iter().enumerate() {
        push(Row::Equality(i), 1.0, *b);
    }
    let mut equalities = problem.b.len();
    for ((row, lower, upper), place) in
        two_sided.iter().zip(&mut places).filter(|((_, lower, upper), _)| lower == upper)
    {
        debug_assert!(lower.is_finite());
        place[0] = push(*row, 1.0, *upper);
        equalities += 1;
    }
    for ((row, lower, upper), place) in
        two_sided.iter().zip(&mut places).filter(|((_, lower, upper), _)| lower != upper)
    {
        if upper.is_finite() {
            place[0] = push(*row, 1.0, *upper);
        }
        if lower.is_finite() {
            place[1] = push(*row, -1.0, *lower);
        }
    }
    let mut triplets = crate::Triplets::with_capacity(problem.A.entries() + 2 * problem.C.entries() + 2 * n);
    for (i, j, value) in problem.A.iter() {
        triplets.add(i, j, value);
    }
    let entries = problem.C.iter().chain((0..n).map(|i| (m + i, i, 1.0)));
    for (i, j, value) in entries {
        for (row, sign) in places[i].into_iter().zip([1.0, -1.0]) {
            if let Some(row) = row {
                triplets.add(row, j, sign * value);
            }
        }
    }
    let matrix = to_csc(&triplets.into_matrix(origins.len(), n), |_, _| true);
    (matrix, rhs, origins, equalities)
}

fn to_csc(matrix: &SparseMatrix, keep: impl Fn(usize, usize) -> bool) -> CscMatrix<f64> {
    let (mut colptr, mut rowval, mut nzval) = (vec![0; matrix.columns() + 1], Vec::new(), Vec::new());
    for (i, j, value) in matrix.iter().filter(|(i, j, _)| keep(*i, *j)) {
        rowval.push(i);
        nzval.push(value);
        colptr[j + 1] += 1;
    }
    for j in 0..matrix.columns() {
        colptr[j + 1] += colptr[j];
    }
    CscMatrix::new(matrix.rows(), matrix.columns(), colptr, rowval, nzval)
}

fn status(status: SolverStatus) -> Status {
    match status {
        SolverStatus::Solved => Status::Solved,
        SolverStatus::AlmostSolved => Status::SolvedInaccurately,
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Status::Infeasible,
        SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Status::Unbounded,
        SolverStatus::MaxIterations => Status::IterationLimit,
        SolverStatus::MaxTime => Status::TimeLimit,
        SolverStatus::Unsolved
        | SolverStatus::NumericalError
        | SolverStatus::InsufficientProgress
        | SolverStatus::CallbackTerminated => Status::NumericalFailure,
    }
}
