//! Gauss-Seidel, contact by contact.

use crate::dense::add_three;
use crate::{ContactProblem, Report, Settings, SingleContact, Status, Workspace};
use nalgebra::Vector3;

/// Sweeps run in circles when the smallest change in as many of them is no less than this part of that in as many
/// before. Soles need 15 to 60 sweeps in all for 1e-8, and slow but steady sweeps (0.999 each) still pass.
const WINDOW: usize = 25;
const STALLED: f64 = 0.98;
/// The step then becomes this part of what it was, down to the last.
const SHORTER: f64 = 0.8;
const SHORTEST: f64 = 0.2;

/// Block Gauss-Seidel: sweep after sweep each contact is solved exactly with all others held. `delta` follows by
/// columns, and only where a force changed, so open contacts cost nothing. Starts from the workspace's forces.
///
/// Full steps, unless they run in circles: thick nearly incompressible soles do that at friction 1.5, where a contact's
/// state flips with its neighbours' for ever. Then only a part of each step is taken, and a smaller one while that goes
/// on.
///
/// [`Status::Singular`] at once when a contact's own block is only semi-definite.
pub fn gauss_seidel(problem: &ContactProblem, workspace: &mut Workspace, settings: &Settings) -> Report {
    let Some(contacts) = &problem.contacts else {
        return workspace.report(problem, settings.tolerance, 0, Status::Singular);
    };
    problem.displacement_into(&workspace.force, &mut workspace.delta);
    let mut before = f64::INFINITY;
    let mut iterations = 0;
    let mut relaxation = 1.0;
    // Smallest change in this window of sweeps and in the last one.
    let (mut least, mut least_before) = (f64::INFINITY, f64::INFINITY);
    while iterations < settings.sweeps_max {
        iterations += 1;
        let (change, size) = sweep(problem, contacts, workspace, relaxation);
        least = least.min(change);
        if iterations % WINDOW == 0 {
            if least > STALLED * least_before {
                relaxation = f64::max(SHORTER * relaxation, SHORTEST);
            }
            (least_before, least) = (least, f64::INFINITY);
        }
        // The next sweep's change, if it shrinks as the last one did, is what the residual will be: judge only when
        // that pays.
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

/// One sweep that goes `relaxation` of the way to each local solution; returns `|change of F|` and `|F|`.
pub(crate) fn sweep(
    problem: &ContactProblem,
    contacts: &[SingleContact],
    workspace: &mut Workspace,
    relaxation: f64,
) -> (f64, f64) {
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
        let (local, state) = contacts[contact].solve(&b, &mut workspace.lambda[contact]);
        workspace.states[contact] = state;
        let next = if relaxation < 1.0 { force + relaxation * (local - force) } else { local };
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
