//! What happens when a program has no solution.
//!
//! 1. **Infeasible**: the solver names rows that exclude each other and by how much. Of these the one of lowest rank is
//!    widened by just that much, and the program is solved again:
//!
//!    | rank | limit | why it gives way |
//!    |---|---|---|
//!    | 1 | load of a foot | a matter of smoothness |
//!    | 2 | collision damper | speeds of approach, far from touching |
//!    | 3 | joint position and speed | the robot's own controller guards them too |
//!    | 4 | joint torque | set below what the motors can do |
//!    | 5 | motion of a stance ankle | the foot would slide or the sole deform otherwise |
//!    | – | dynamics, pushing-only contacts | physics: never |
//!
//! 2. **No solution** after [`ATTEMPTS_MAX`] attempts, out of iterations, or a numerical failure: joints are brought to rest
//!    with the deceleration they can count on, the last torques and wrenches are kept.
//!
//! Every widening and every contradiction is in the report.

use crate::constraint::limits::JointLimits;
use crate::formulation::Formulation;
use crate::layout::ConstraintId;
use crate::reference::RobotState;
use crate::report::{Relaxation, StepReport, StepStatus};
use qp::dense::{Contradiction, Problem};
use qp::{Conflict, Row, Status};

/// Programs solved per step at most.
pub const ATTEMPTS_MAX: usize = 12;

/// A row is widened by a little more than what the certificate demands, else rounding decides: relative and in the row's
/// unit.
const GENEROSITY: f64 = 1e-6;

/// Time constant (s) of the damping of a held robot.
const HOLD_TIME_S: f64 = 0.1;

/// Solves, widening limits where they contradict each other.
pub fn solve(formulation: &mut Formulation, report: &mut StepReport) -> StepStatus {
    for _ in 0..ATTEMPTS_MAX {
        let outcome = formulation.solver.solve(&formulation.problem);
        report.iterations += outcome.report.iterations;
        report.solver_status = outcome.report.status;
        report.residuals = outcome.report.residuals;
        match outcome.report.status {
            Status::Solved | Status::SolvedInaccurately => {
                return if report.relaxed.is_empty() { StepStatus::Solved } else { StepStatus::Relaxed };
            }
            Status::Infeasible => {}
            _ => return StepStatus::Held,
        }
        report.contradiction.clear();
        let rows = outcome.contradiction.rows.iter().filter_map(|c| formulation.layout.meaning(c.row));
        report.contradiction.extend(rows);
        let Some((conflict, id)) = weakest(&outcome.contradiction, |row| formulation.layout.meaning(row)) else {
            return StepStatus::Held;
        };
        let amount = demanded(&outcome.contradiction, &conflict);
        widen(&mut formulation.problem, &conflict, amount);
        report.relaxed.push(Relaxation { id, amount });
    }
    StepStatus::Held
}

fn rank(id: ConstraintId) -> Option<u8> {
    match id {
        ConstraintId::Load { .. } => Some(1),
        ConstraintId::Collision(_) => Some(2),
        ConstraintId::JointMotion(_) => Some(3),
        ConstraintId::Torque(_) => Some(4),
        ConstraintId::Contact { .. } => Some(5),
        ConstraintId::BaseDynamics(_) | ConstraintId::Intensity { .. } => None,
    }
}

/// The row that gives way: lowest rank, then heaviest.
fn weakest(
    contradiction: &Contradiction,
    meaning: impl Fn(Row) -> Option<ConstraintId>,
) -> Option<(Conflict, ConstraintId)> {
    contradiction
        .rows
        .iter()
        .filter_map(|conflict| meaning(conflict.row).map(|id| (*conflict, id)))
        .filter_map(|(conflict, id)| rank(id).map(|rank| (rank, conflict, id)))
        .min_by_key(|(rank, ..)| *rank) // the first of equals: rows are sorted, heaviest first
        .map(|(_, conflict, id)| (conflict, id))
}

/// Widening of one row that removes the contradiction: what the combination lacks, divided by the row's weight in it.
fn demanded(contradiction: &Contradiction, conflict: &Conflict) -> f64 {
    let unmet = contradiction.rows.iter().find(|c| Some(c.row) == contradiction.unmet).map_or(1.0, |c| c.weight.abs());
    let amount = contradiction.amount * unmet / conflict.weight.abs();
    amount + GENEROSITY * (1.0 + amount)
}

/// Moves the side of a row that takes part in the contradiction outwards.
fn widen(problem: &mut Problem, conflict: &Conflict, amount: f64) {
    // Positive weights stand for upper sides.
    let signed = amount.copysign(conflict.weight);
    match conflict.row {
        Row::Equality(i) => problem.b[i] += signed,
        Row::Inequality(i) if conflict.weight > 0.0 => problem.u[i] += amount,
        Row::Inequality(i) => problem.l[i] -= amount,
        Row::Bound(i) if conflict.weight > 0.0 => problem.ub[i] += amount,
        Row::Bound(i) => problem.lb[i] -= amount,
    }
}

/// Brings all joints to rest; base twist too, as far as a reference can.
pub fn hold(limits: &[JointLimits], state: &RobotState, dt_s: f64, report: &mut StepReport) {
    let rate = 1.0 / HOLD_TIME_S.max(dt_s);
    let base = state.v.len() - limits.len();
    for (i, (a, v)) in report.acceleration.iter_mut().zip(state.v.iter()).enumerate() {
        let braking = i.checked_sub(base).map_or(f64::INFINITY, |joint| limits[joint].braking);
        *a = (-rate * v).clamp(-braking, braking);
    }
}
