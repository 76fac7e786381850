//! All solvers in turn.

use crate::accelerated::accelerate;
use crate::obstruction::obstruction;
use crate::{ContactProblem, ContactState, Report, Settings, Status, Workspace, gauss_seidel, newton, proximal};

/// Gauss-Seidel for the contact states, Newton for the digits, in turns. When both stall: the proof that there is no
/// solution, or the proximal method. Starts from the workspace.
pub fn solve(problem: &ContactProblem, workspace: &mut Workspace, settings: &Settings) -> Report {
    /// Sweeps before each try of Newton, the last time `sweeps_max`. The first number finds the states of an elastic
    /// body. Where Newton then runs in circles, as at friction 2 on a thick nearly incompressible sole, other starts
    /// do.
    const SWEEPS: [usize; 4] = [60, 20, 100, usize::MAX];
    /// Tries of the proximal method, and accelerated steps before each but the first: at most ten
    /// times `sweeps_max`.
    const PROXIMAL_TURNS: usize = 4;
    const ACCELERATED: usize = 2000;
    let mut iterations = 0;
    let mut best: Option<(Report, Vec<ContactState>)> = None;
    let mut keep = |report: Report, states: &[ContactState]| {
        let better = best.as_ref().is_none_or(|(best, _)| report.residual.relative < best.residual.relative);
        if better {
            best = Some((report, states.to_vec()));
        }
    };
    for sweeps in SWEEPS {
        let turn = Settings { sweeps_max: settings.sweeps_max.min(sweeps), ..*settings };
        let swept = gauss_seidel(problem, workspace, &turn);
        iterations += swept.iterations;
        if swept.status == Status::Solved {
            return Report { iterations, ..swept };
        }
        let (start, states) = (workspace.force.clone(), workspace.states.clone());
        keep(swept, &states);
        let polished = newton(problem, workspace, settings);
        iterations += polished.iterations;
        if polished.status == Status::Solved {
            return Report { iterations, ..polished };
        }
        keep(polished, &workspace.states);
        // The next turn goes on from the sweeps: a Newton that runs in circles leads nowhere.
        workspace.force.copy_from_slice(&start);
        workspace.states.copy_from_slice(&states);
    }
    let obstruction = obstruction(problem);
    if obstruction.is_none() {
        for turn in 0..PROXIMAL_TURNS {
            if turn > 0 {
                let steps = ACCELERATED.min(10 * settings.sweeps_max);
                accelerate(problem, workspace, steps);
                iterations += steps;
            }
            let last = proximal(problem, workspace, settings);
            iterations += last.iterations;
            if last.status == Status::Solved {
                return Report { iterations, ..last };
            }
            keep(last, &workspace.states);
        }
    }
    let (best, states) = best.expect("four turns and the proximal method have said something");
    workspace.force.copy_from_slice(best.force.as_slice());
    workspace.delta.copy_from_slice(best.delta.as_slice());
    workspace.states.copy_from_slice(&states);
    let status = if obstruction.is_some() { Status::Impossible } else { best.status };
    Report { status, iterations, obstruction, ..best }
}
