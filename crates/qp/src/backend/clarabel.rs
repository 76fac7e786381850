//! Clarabel, an interior-point method (Goulart and Chen, 2024): `min 1/2 x'Px + q'x, A x + s = b, s in K`.
//!
//! Each finite side becomes one row of the nonnegative cone, `C x + s = u` and `-C x + s = -l`; rows whose sides coincide
//! join the equalities (zero cone), because a pair of opposite inequalities without interior breaks interior points.

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
    /// Relative and absolute tolerance on residuals and duality gap, in Clarabel's equilibrated problem. Useful: 1e-6 to
    /// 1e-11; an interior point gains about one digit per iteration near the end, so tight tolerances are cheap.
    pub tolerance: f64,
    /// Limit of interior-point iterations; 10 to 30 are usual.
    pub iterations_max: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: 1e-10, iterations_max: 200 }
    }
}

/// Where a row of Clarabel's constraint matrix comes from: `sign` = +1 for an upper side or an equality, -1 for a lower side.
struct Origin {
    row: Row,
    sign: f64,
}

/// Solves the problem from scratch.
///
/// # Errors
/// If the problem's arrays do not fit together ([`QuadraticProgram::check`]).
///
/// # Panics
/// If Clarabel refuses data that passed the check: a defect of this conversion.
pub fn solve(problem: &QuadraticProgram, settings: &Settings) -> Result<Report, ProblemError> {
    problem.check()?;
    let n = problem.variables();
    let (constraints, rhs, origins, equalities) = stack(problem);
    let cones = [ZeroConeT(equalities), NonnegativeConeT(origins.len() - equalities)];
    let clarabel_settings = DefaultSettings {
        verbose: false,
        max_iter: settings.iterations_max,
        tol_gap_abs: settings.tolerance,
        tol_gap_rel: settings.tolerance,
        tol_feas: settings.tolerance,
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
    Ok(report)
}

/// `[A; C and bounds with coinciding sides; finite sides]`, its right-hand side, the origin of each row, and how many rows
/// are equalities.
fn stack(problem: &QuadraticProgram) -> (CscMatrix<f64>, Vec<f64>, Vec<Origin>, usize) {
    let n = problem.variables();
    let (mut origins, mut rhs) = (Vec::new(), Vec::new());
    let mut push = |row, sign: f64, side: f64| {
        origins.push(Origin { row, sign });
        rhs.push(sign * side);
        origins.len() - 1
    };
    const NONE: usize = usize::MAX;
    // Rows of the stacked matrix into which row i of C, and bound i, go: [upper or equal, lower].
    let mut rows_of_C = vec![[NONE; 2]; problem.l.len()];
    let mut rows_of_bound = vec![[NONE; 2]; n];
    for (i, b) in problem.b.iter().enumerate() {
        push(Row::Equality(i), 1.0, *b);
    }
    let parts: [(&mut Vec<[usize; 2]>, _, _, fn(usize) -> Row); 2] = [
        (&mut rows_of_C, &problem.l, &problem.u, Row::Inequality),
        (&mut rows_of_bound, &problem.lb, &problem.ub, Row::Bound),
    ];
    let mut parts = parts;
    for (rows, lower, upper, row) in &mut parts {
        for i in 0..rows.len() {
            if lower[i] == upper[i] {
                rows[i][0] = push(row(i), 1.0, upper[i]);
            }
        }
    }
    let mut equalities = problem.b.len();
    for (rows, lower, upper, row) in &mut parts {
        for i in 0..rows.len() {
            if lower[i] == upper[i] {
                equalities += 1;
                continue;
            }
            if upper[i].is_finite() {
                rows[i][0] = push(row(i), 1.0, upper[i]);
            }
            if lower[i].is_finite() {
                rows[i][1] = push(row(i), -1.0, lower[i]);
            }
        }
    }
    let mut triplets = crate::Triplets::with_capacity(problem.A.entries() + 2 * problem.C.entries() + 2 * n);
    for (i, j, value) in problem.A.iter() {
        triplets.add(i, j, value);
    }
    let bounds = (0..n).map(|i| (i, i, 1.0));
    let inequalities = problem.C.iter().map(|(i, j, v)| (rows_of_C[i], j, v));
    for (rows, j, value) in inequalities.chain(bounds.map(|(i, j, v)| (rows_of_bound[i], j, v))) {
        for (row, sign) in rows.into_iter().zip([1.0, -1.0]) {
            if row != NONE {
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
