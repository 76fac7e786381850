//! Solving with few rows first.
//!
//! Of many two-sided rows, few sides are active at the solution, and a side that is not active costs an interior point
//! as much as one that is. [`solve_generating`] starts with the rows the caller picks, goes on with the sides that the
//! solution breaks or keeps by less than the largest violation (they are next), adds such sides, and repeats until none
//! is broken. The relaxed problem's solution is then feasible, hence optimal, for the whole one; the report's residuals
//! are those of the whole problem.
//!
//! Only the caller's first choice is left behind, being a guess; afterwards sides are added and none is dropped, so
//! that no two choices can alternate.

use crate::backend::clarabel::{Settings, not_convex, solve, solve_once};
use crate::sparse::ProblemError;
use crate::{QuadraticProgram, Report, Status, Triplets};
use nalgebra::DVector;

/// Rounds after which all rows are taken at once.
const ROUNDS_MAX: u32 = 6;

/// Like [`solve`], but begins with the inequality rows (of `C`) for which `first` is true.
///
/// # Errors
/// If the problem's arrays do not fit together ([`QuadraticProgram::check`]).
///
/// # Panics
/// If `first` has another length than `l`.
pub fn solve_generating(
    problem: &QuadraticProgram,
    first: &[bool],
    settings: &Settings,
) -> Result<Report, ProblemError> {
    problem.check()?;
    if let Some(report) = not_convex(problem) {
        return Ok(report);
    }
    let m = problem.l.len();
    assert_eq!(first.len(), m);
    // Which side of which row takes part: [lower, upper].
    let mut sides: Vec<[bool; 2]> = first.iter().map(|take| [*take; 2]).collect();
    let mut iterations = 0;
    for round in 0..ROUNDS_MAX {
        let (part, rows) = restricted(problem, &sides);
        let solved = solve_once(&part, settings);
        iterations += solved.iterations;
        if !solved.status.has_solution() {
            // Infeasible, unbounded or too hard already in part: the whole problem says it with all its rows.
            break;
        }
        let Cx = problem.C.product(&solved.x);
        let violations = |i: usize| [problem.l[i] - Cx[i], Cx[i] - problem.u[i]];
        let missing = (0..m).flat_map(|i| (0..2).map(move |side| (i, side))).filter(|(i, side)| !sides[*i][*side]);
        let largest = missing.clone().map(|(i, side)| violations(i)[side]).fold(f64::NEG_INFINITY, f64::max);
        if largest <= settings.tolerance * Cx.amax().max(1.0) {
            let mut y_in = DVector::zeros(m);
            rows.iter().zip(&solved.y_in).for_each(|(row, y)| y_in[*row] = *y);
            let residuals = problem.residuals(&solved.x, &solved.y_eq, &y_in, &solved.y_bound);
            return Ok(Report { y_in, residuals, iterations, ..solved });
        }
        for (i, taken) in sides.iter_mut().enumerate() {
            let near = violations(i).map(|violation| violation > -largest);
            *taken = [0, 1].map(|side| near[side] || (taken[side] && round > 0));
        }
    }
    let whole = solve(problem, settings)?;
    // A limit counts for each solve; only the report adds them up.
    let iterations =
        if whole.status == Status::IterationLimit { whole.iterations } else { iterations + whole.iterations };
    Ok(Report { iterations, ..whole })
}

/// The problem with some sides only, and which rows are left.
fn restricted(problem: &QuadraticProgram, sides: &[[bool; 2]]) -> (QuadraticProgram, Vec<usize>) {
    let rows: Vec<usize> = (0..sides.len()).filter(|i| sides[*i][0] || sides[*i][1]).collect();
    let mut place = vec![usize::MAX; sides.len()];
    rows.iter().enumerate().for_each(|(new, old)| place[*old] = new);
    let mut triplets = Triplets::with_capacity(problem.C.entries());
    for (i, j, value) in problem.C.iter().filter(|(i, _, _)| place[*i] != usize::MAX) {
        triplets.add(place[i], j, value);
    }
    let side = |taken: bool, value: f64, none: f64| if taken { value } else { none };
    let part = QuadraticProgram {
        P: problem.P.clone(),
        c: problem.c.clone(),
        A: problem.A.clone(),
        b: problem.b.clone(),
        C: triplets.into_matrix(rows.len(), problem.variables()),
        l: DVector::from_iterator(
            rows.len(),
            rows.iter().map(|i| side(sides[*i][0], problem.l[*i], f64::NEG_INFINITY)),
        ),
        u: DVector::from_iterator(rows.len(), rows.iter().map(|i| side(sides[*i][1], problem.u[*i], f64::INFINITY))),
        lb: problem.lb.clone(),
        ub: problem.ub.clone(),
    };
    (part, rows)
}
