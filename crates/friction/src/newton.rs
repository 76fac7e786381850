//! Semi-smooth Newton.

use crate::dense::{lu_factor, lu_solve};
use crate::{ContactProblem, ContactState, Report, Settings, Status, Workspace};
use nalgebra::{Matrix2, Vector2};

/// Semi-smooth Newton on all contacts at once, Alart-Curnier form. Unknown are the forces of the contacts that touch:
///
/// - sticking: `delta_a = 0`;
/// - sliding: `delta_n = 0` and `F_t - mu F_n z/|z| = 0` with `z = F_t - rho delta_t`;
/// - open: `F_a = 0`.
///
/// After each step the states are read off `F_n - rho delta_n` and `z`. No line search: it slows this iteration without
/// helping. Starts from the workspace's forces; quadratic once the states are right. Keeps the best forces found.
pub fn newton(problem: &ContactProblem, workspace: &mut Workspace, settings: &Settings) -> Report {
    workspace.reserve_newton();
    let n = problem.contact_count();
    let ld = 3 * n;
    let w = problem.delassus().as_slice();
    let mut iterations = 0;
    let mut otherwise = Status::IterationLimit;
    let mut best = (f64::INFINITY, workspace.force.clone());
    loop {
        problem.displacement_into(&workspace.force, &mut workspace.delta);
        let residual = problem.residual_at(&workspace.force, &workspace.delta).relative;
        if residual < best.0 {
            best.0 = residual;
            best.1.copy_from_slice(&workspace.force);
        }
        if residual <= settings.tolerance || iterations == settings.newton_iterations_max {
            break;
        }
        iterations += 1;
        classify(problem, workspace);
        let m = 3 * workspace.active.len();
        for (row_slot, a) in workspace.active.iter().enumerate() {
            let row = 3 * row_slot;
            let i = 3 * a;
            let slides = workspace.states[*a] == ContactState::Slip;
            let (rho, mu) = (problem.rho[*a], problem.mu()[*a]);
            let tangential = Vector2::new(workspace.force[i], workspace.force[i + 1]);
            let z = tangential - rho * Vector2::new(workspace.delta[i], workspace.delta[i + 1]);
            let length = z.norm();
            let d = if length > 0.0 { z / length } else { Vector2::zeros() };
            let normal = workspace.force[i + 2];
            let turning = if length > 0.0 {
                (Matrix2::identity() - d * d.transpose()) * (mu * normal.max(0.0) / length)
            } else {
                Matrix2::zeros()
            };
            for (column_slot, b) in workspace.active.iter().enumerate() {
                for axis in 0..3 {
                    let source = &w[(3 * b + axis) * ld + i..];
                    let target = &mut workspace.matrix[(3 * column_slot + axis) * ld + row..];
                    target[2] = source[2];
                    if slides {
                        // d z = dF_t - rho W_t dF
                        let own = if a == b && axis < 2 { Vector2::ith(axis, 1.0) } else { Vector2::zeros() };
                        let turn = turning * (own - rho * Vector2::new(source[0], source[1]));
                        let lift = if a == b && axis == 2 { mu * d } else { Vector2::zeros() };
                        // Divided by rho: all rows in metres per newton.
                        let entry = (own - turn - lift) / rho;
                        (target[0], target[1]) = (entry.x, entry.y);
                    } else {
                        (target[0], target[1]) = (source[0], source[1]);
                    }
                }
            }
            workspace.right[row + 2] = -workspace.delta[i + 2];
            if slides {
                let r = (tangential - mu * normal * d) / rho;
                (workspace.right[row], workspace.right[row + 1]) = (-r.x, -r.y);
            } else {
                (workspace.right[row], workspace.right[row + 1]) = (-workspace.delta[i], -workspace.delta[i + 1]);
            }
        }
        // Open contacts lose their force, which moves the others: W_ab (0 - F_b) goes to the right-hand side through
        // delta.
        for b in 0..n {
            if workspace.states[b] != ContactState::Open {
                continue;
            }
            let lost = [workspace.force[3 * b], workspace.force[3 * b + 1], workspace.force[3 * b + 2]];
            if lost == [0.0; 3] {
                continue;
            }
            for axis in 0..3 {
                let column = &w[(3 * b + axis) * ld..(3 * b + axis + 1) * ld];
                for (slot, a) in workspace.active.iter().enumerate() {
                    let rows = if workspace.states[*a] == ContactState::Slip { 2..3 } else { 0..3 };
                    for row in rows {
                        workspace.right[3 * slot + row] += column[3 * a + row] * lost[axis];
                    }
                }
                workspace.force[3 * b + axis] = 0.0;
            }
        }
        if lu_factor(&mut workspace.matrix, ld, m, 0, &mut workspace.pivots) == 0.0 {
            otherwise = Status::Singular;
            break;
        }
        lu_solve(&workspace.matrix, ld, m, &workspace.pivots, &mut workspace.right, 1);
        for (slot, a) in workspace.active.iter().enumerate() {
            for axis in 0..3 {
                workspace.force[3 * a + axis] += workspace.right[3 * slot + axis];
            }
        }
    }
    workspace.force.copy_from_slice(&best.1);
    workspace.report(problem, settings.tolerance, iterations, otherwise)
}

/// States from forces and displacements, and the list of contacts that touch.
fn classify(problem: &ContactProblem, workspace: &mut Workspace) {
    workspace.active.clear();
    for a in 0..problem.contact_count() {
        let i = 3 * a;
        let (rho, mu) = (problem.rho[a], problem.mu()[a]);
        let pressed = workspace.force[i + 2] - rho * workspace.delta[i + 2];
        let z = Vector2::new(
            workspace.force[i] - rho * workspace.delta[i],
            workspace.force[i + 1] - rho * workspace.delta[i + 1],
        );
        workspace.states[a] = if pressed <= 0.0 {
            ContactState::Open
        } else if z.norm() <= mu * pressed {
            ContactState::Stick
        } else {
            ContactState::Slip
        };
        if workspace.states[a] != ContactState::Open {
            workspace.active.push(a);
        }
    }
}
