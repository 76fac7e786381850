use crate::gauss_seidel::sweep;
use crate::{ContactProblem, Report, Settings, Status, Workspace};
use nalgebra::DVector;

/// Proximal point method: `F_k+1` solves the problem with `W + alpha I` and `q - alpha F_k`, whose solution is unique and quick to
/// find however rank-deficient `W` is; at a fixed point the two added terms cancel. `alpha` shrinks while that goes well.
pub fn proximal(problem: &ContactProblem, workspace: &mut Workspace, settings: &Settings) -> Report {
    /// First weight, relative to the mean diagonal of `W`, and what it is multiplied by after easy and hard problems.
    const FIRST: f64 = 0.1;
    const EASIER: f64 = 0.3;
    const HARDER: f64 = 3.0;
    /// An inner problem is easy when it takes no more sweeps than this, and is given up after as many as the second.
    const EASY_SWEEPS: usize = 30;
    const INNER_SWEEPS: usize = 200;
    /// The inner problem is solved to this fraction of the present residual.
    const INNER_ACCURACY: f64 = 0.1;
    let n = problem.contact_count();
    if n == 0 {
        return workspace.report(problem, settings.tolerance, 0, Status::Solved);
    }
    let mean = problem.delassus().trace() / (3 * n) as f64;
    let mut alpha = FIRST * mean;
    let mut iterations = 0;
    let mut free = DVector::zeros(3 * n);
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
        for (i, value) in free.iter_mut().enumerate() {
            *value = problem.free()[i] - alpha * workspace.force[i];
        }
        let mut shifted = problem.delassus().clone();
        for i in 0..3 * n {
            shifted[(i, i)] += alpha;
        }
        let Ok(inner) = ContactProblem::new(shifted, free.clone(), problem.mu().to_vec()) else { break };
        let Some(contacts) = &inner.contacts else { break };
        inner.displacement_into(&workspace.force, &mut workspace.delta);
        let mut sweeps = 0;
        while sweeps < INNER_SWEEPS {
            sweeps += 1;
            let (change, size) = sweep(&inner, contacts, workspace, 1.0);
            if change <= INNER_ACCURACY * residual.max(settings.tolerance) * size {
                break;
            }
        }
        iterations += sweeps;
        alpha *= if sweeps <= EASY_SWEEPS {
            EASIER
        } else if sweeps == INNER_SWEEPS {
            HARDER
        } else {
            1.0
        };
        alpha = alpha.max(f64::EPSILON * mean);
    }
    workspace.force.copy_from_slice(&best.1);
    workspace.states.copy_from_slice(&best.2);
    workspace.report(problem, settings.tolerance, iterations, Status::IterationLimit)
}
