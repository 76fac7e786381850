//! Projected gradient with momentum: slow to the last digits, and never in a circle for long.

use crate::{ContactProblem, ContactState, Workspace, project_on_cone};
use nalgebra::{DVector, Vector3};

/// Steps of the power iteration for the largest eigenvalue, and what its estimate, which is from below, is enlarged by.
const POWER_STEPS: usize = 30;
const ENLARGED: f64 = 1.05;
/// Relative distance from the cone that is rounding of the projection.
const ON_THE_CONE: f64 = 1e-12;

/// `F <- P_K(Y - rho (delta(Y) + mu |delta_t| n))` with `Y` the forces carried on by their last change (Nesterov 1983),
/// afresh whenever that points uphill (O'Donoghue, Candes 2015). The step of a contact is its own `rho`, times one over
/// the largest eigenvalue of `W` in these units. Leaves the forces with the smallest residual seen, and their
/// states.
pub(crate) fn accelerate(problem: &ContactProblem, workspace: &mut Workspace, iterations: usize) {
    /// Iterations between two judgements.
    const JUDGED: usize = 20;
    let n = problem.contact_count();
    let theta = 1.0 / (ENLARGED * largest_eigenvalue(problem));
    let mut ahead = workspace.force.clone();
    let mut momentum = 1.0_f64;
    let mut best = (f64::INFINITY, workspace.force.clone());
    for iteration in 0..iterations {
        problem.displacement_into(&ahead, &mut workspace.delta);
        let mut uphill = 0.0;
        let next_momentum = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
        let carried = (momentum - 1.0) / next_momentum;
        for a in 0..n {
            let (mu, step) = (problem.mu()[a], theta * problem.rho[a]);
            let at = |v: &[f64]| Vector3::new(v[3 * a], v[3 * a + 1], v[3 * a + 2]);
            let (y, before, delta) = (at(&ahead), at(&workspace.force), at(&workspace.delta));
            let lifted = delta + Vector3::new(0.0, 0.0, mu * delta.xy().norm());
            let next = project_on_cone(mu, &(y - step * lifted));
            uphill += (y - next).dot(&(next - before)) / step;
            workspace.force[3 * a..3 * a + 3].copy_from_slice(next.as_slice());
            ahead[3 * a..3 * a + 3].copy_from_slice((next + carried * (next - before)).as_slice());
        }
        momentum = next_momentum;
        if uphill > 0.0 {
            momentum = 1.0;
            ahead.copy_from_slice(&workspace.force);
        }
        if iteration % JUDGED == JUDGED - 1 {
            problem.displacement_into(&workspace.force, &mut workspace.delta);
            let residual = problem.residual_at(&workspace.force, &workspace.delta).relative;
            if residual < best.0 {
                best.0 = residual;
                best.1.copy_from_slice(&workspace.force);
            }
        }
    }
    workspace.force.copy_from_slice(&best.1);
    for (a, state) in workspace.states.iter_mut().enumerate() {
        let force = Vector3::new(best.1[3 * a], best.1[3 * a + 1], best.1[3 * a + 2]);
        *state = if force == Vector3::zeros() {
            ContactState::Open
        } else if force.xy().norm() < (1.0 - ON_THE_CONE) * problem.mu()[a] * force.z {
            ContactState::Stick
        } else {
            ContactState::Slip
        };
    }
}

/// Of `R W R`, `R` being the roots of `rho`: from below.
fn largest_eigenvalue(problem: &ContactProblem) -> f64 {
    let rows = 3 * problem.contact_count();
    let root = DVector::from_fn(rows, |i, _| problem.rho[i / 3].sqrt());
    let mut vector = DVector::from_fn(rows, |i, _| 1.0 + 0.5 * ((i * 7) % 11) as f64 / 11.0).normalize();
    let mut value = 0.0;
    for _ in 0..POWER_STEPS {
        let image = root.component_mul(&(problem.delassus() * root.component_mul(&vector)));
        value = image.norm();
        vector = image / value.max(f64::MIN_POSITIVE);
    }
    value.max(f64::MIN_POSITIVE)
}
