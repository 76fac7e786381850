//! Proximal point method, for `W` of deficient rank.

use crate::gauss_seidel::sweep;
use crate::{ContactProblem, Report, Settings, SingleContact, Status, Workspace, newton};
use nalgebra::DVector;

/// First weight, relative to the mean diagonal of `W`, and the least: below it rounding of `W` is larger.
const FIRST: f64 = 0.1;
const LEAST: f64 = 1e-13;
/// What the weight is multiplied by when the inner problem was solved by Newton, by sweeps, or not at all.
const EASIER: f64 = 0.1;
const HARDER: f64 = 1.5;
const TOO_HARD: f64 = 10.0;
/// Sweeps on an inner problem before each further try of Newton.
const INNER_SWEEPS: [usize; 3] = [10, 40, 150];
/// Newton steps on an inner problem: near its solution few are needed, elsewhere more do not help.
const INNER_NEWTON: usize = 12;
/// The inner problem is solved to this fraction of the present residual.
const INNER_ACCURACY: f64 = 0.1;
/// After so many inner problems in a row that were not solved, over as many decades of the weight, the next will not be
/// either.
const FAILURES_MAX: usize = 8;

/// Proximal point method: `F_k+1` solves the problem with `W + alpha I` and `q - alpha F_k`, whose solution is unique
/// and quick to find however rank-deficient `W` is; at a fixed point the two added terms cancel. `alpha` shrinks while
/// that goes well.
///
/// The outer error falls by about `alpha / (alpha + w)` per step, `w` being the least eigenvalue of `W` that is not
/// zero: with the smallest `alpha` one step gives all digits. Small weights are what sweeps cannot solve and Newton
/// can, started from the solution before.
pub fn proximal(problem: &ContactProblem, workspace: &mut Workspace, settings: &Settings) -> Report {
    let n = problem.contact_count();
    if n == 0 {
        return workspace.report(problem, settings.tolerance, 0, Status::Solved);
    }
    let mean = problem.delassus().trace() / (3 * n) as f64;
    let mut alpha = FIRST * mean;
    let (mut iterations, mut failures) = (0, 0);
    // The states go with the forces that are kept.
    let mut best = (f64::INFINITY, workspace.force.clone(), workspace.states.clone());
    for _ in 0..settings.proximal_iterations_max {
        problem.displacement_into(&workspace.force, &mut workspace.delta);
        let residual = problem.residual_at(&workspace.force, &workspace.delta).relative;
        if residual < best.0 {
            best.0 = residual;
            best.1.copy_from_slice(&workspace.force);
            best.2.copy_from_slice(&workspace.states);
        }
        if residual <= settings.tolerance {
            break;
        }
        let Some(inner) = shifted(problem, &workspace.force, alpha) else { break };
        let Some(contacts) = &inner.contacts else { break };
        let accuracy = INNER_ACCURACY * residual.max(settings.tolerance);
        let (factor, steps) = solve_inner(&inner, contacts, workspace, accuracy);
        iterations += steps;
        alpha = (alpha * factor).clamp(LEAST * mean, mean);
        failures = if factor < TOO_HARD { 0 } else { failures + 1 };
        if failures == FAILURES_MAX {
            break;
        }
    }
    workspace.force.copy_from_slice(&best.1);
    workspace.states.copy_from_slice(&best.2);
    workspace.report(problem, settings.tolerance, iterations, Status::IterationLimit)
}

/// The problem with `W + alpha I` and `q - alpha F`.
fn shifted(problem: &ContactProblem, force: &[f64], alpha: f64) -> Option<ContactProblem> {
    let mut delassus = problem.delassus().clone();
    for i in 0..force.len() {
        delassus[(i, i)] += alpha;
    }
    let free = DVector::from_fn(force.len(), |i, _| problem.free()[i] - alpha * force[i]);
    ContactProblem::of_model(delassus, free, problem.mu().to_vec()).ok()
}

/// Newton, after more and more sweeps where it fails. Ends with a sweep: forces and states then agree. Returns what the
/// next weight is of this one, and the iterations.
fn solve_inner(
    inner: &ContactProblem,
    contacts: &[SingleContact],
    workspace: &mut Workspace,
    accuracy: f64,
) -> (f64, usize) {
    let settings = Settings { tolerance: accuracy, newton_iterations_max: INNER_NEWTON, ..Settings::default() };
    let mut iterations = 0;
    let mut start = (workspace.force.clone(), workspace.states.clone());
    for (turn, sweeps) in [0].into_iter().chain(INNER_SWEEPS).enumerate() {
        workspace.force.copy_from_slice(&start.0);
        workspace.states.copy_from_slice(&start.1);
        inner.displacement_into(&workspace.force, &mut workspace.delta);
        for _ in 0..sweeps {
            sweep(inner, contacts, workspace, 1.0);
        }
        start.0.copy_from_slice(&workspace.force);
        start.1.copy_from_slice(&workspace.states);
        let polished = newton(inner, workspace, &settings);
        iterations += sweeps + polished.iterations;
        if polished.status == Status::Solved {
            sweep(inner, contacts, workspace, 1.0);
            return (if turn == 0 { EASIER } else { HARDER }, iterations + 1);
        }
    }
    // Newton keeps the best forces it has seen; the sweeps' are consistent, and nearer the solution than what they
    // started from.
    workspace.force.copy_from_slice(&start.0);
    inner.displacement_into(&workspace.force, &mut workspace.delta);
    sweep(inner, contacts, workspace, 1.0);
    (TOO_HARD, iterations + 1)
}
