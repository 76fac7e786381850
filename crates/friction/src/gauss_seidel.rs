use crate::dense::add_three;
use crate::{ContactProblem, Report, Settings, Status, Workspace};
use nalgebra::Vector3;

/// Block Gauss-Seidel: sweep after sweep each contact is solved exactly with all others held. `delta` follows by columns, and only
/// where a force changed, so open contacts cost nothing. Starts from the workspace's forces.
pub fn gauss_seidel(problem: &ContactProblem, workspace: &mut Workspace, settings: &Settings) -> Report {
    problem.displacement_into(&workspace.force, &mut workspace.delta);
    let mut before = f64::INFINITY;
    let mut iterations = 0;
    while iterations < settings.sweeps_max {
        iterations += 1;
        let (change, size) = sweep(problem, workspace);
        // The next sweep's change, if it shrinks as the last one did, is what the residual will be: judge only when that pays.
        let expected = if before.is_finite() && before > 0.0 { change * (change / before).min(1.0) } else { change };
        before = change;
        if expected <= settings.tolerance * size {
            // Column updates leave rounding behind: judge from fresh displacements.
            problem.displacement_into(&workspace.force, &mut workspace.delta);
            let residual = problem.residual_at(&workspace.force, &workspace.delta);
            if residual.relative <= settings.tolerance {
                break;
            }
        }
    }
    workspace.report(problem, settings.tolerance, iterations, Status::IterationLimit)
}

/// One sweep; returns `|change of F|` and `|F|`.
pub(crate) fn sweep(problem: &ContactProblem, workspace: &mut Workspace) -> (f64, f64) {
    let rows = 3 * problem.contact_count();
    let w = problem.delassus().as_slice();
    let (mut change, mut size) = (0.0, 0.0);
    for contact in 0..problem.contact_count() {
        let i = 3 * contact;
        let c = &w[i * rows..(i + 3) * rows];
        let (c0, rest) = c.split_at(rows);
        let (c1, c2) = rest.split_at(rows);
        let force = Vector3::new(workspace.force[i], workspace.force[i + 1], workspace.force[i + 2]);
        let delta = &mut workspace.delta[..rows];
        let mut b = Vector3::new(delta[i], delta[i + 1], delta[i + 2]);
        for axis in 0..3 {
            b[axis] -= c0[i + axis] * force.x + c1[i + axis] * force.y + c2[i + axis] * force.z;
        }
        let (next, state) = problem.contacts[contact].solve(&b, &mut workspace.lambda[contact]);
        workspace.states[contact] = state;
        let step = next - force;
        size += next.norm_squared();
        let moved = step.norm_squared();
        if moved > 0.0 {
            change += moved;
            workspace.force[i] = next.x;
            workspace.force[i + 1] = next.y;
            workspace.force[i + 2] = next.z;
            add_three(delta, c0, c1, c2, step.x, step.y, step.z);
        }
    }
    (change.sqrt(), size.sqrt())
}
