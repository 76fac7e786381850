//! What happens when a program has no solution.
//!
//! 1. **Infeasible**: the solver names rows that exclude each other and by how much. Of these the one of lowest rank is
//!    widened by just that much (twice as much each time it comes up again), provided that it is within its allowance, and
//!    the program is solved again:
//!
//!    | rank | limit | allowance | why it gives way |
//!    |---|---|---|---|
//!    | 1 | load of a foot | 1000 N | a matter of smoothness |
//!    | 2 | collision damper | 20 m/s² | speeds of approach, far from touching |
//!    | 3 | joint position and speed | 200 rad/s² | the robot's own controller guards them too |
//!    | 4 | joint torque | 50 N m | set below what the motors can do |
//!    | 5 | motion of a stance ankle | any | the foot would slide or the sole deform otherwise |
//!    | – | dynamics, pushing-only contacts | none | physics: never |
//!
//! 2. **No solution** after [`ATTEMPTS_MAX`] attempts, out of iterations, or a numerical failure: joints are brought to rest
//!    with the deceleration they can count on, the last torques and wrenches are kept. From a state that is not a number
//!    nothing follows: the last step's next configuration stands, at rest.
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
pub const ATTEMPTS_MAX: usize = 16;

/// Attempts after which limits of the next rank may give way although those below still could: widening one row at a time
/// must not use up all attempts.
const ATTEMPTS_PER_RANK: usize = 3;

/// A row is widened by a little more than what the certificate demands, else rounding decides: relative and in the row's
/// unit.
const GENEROSITY: f64 = 1e-6;

/// Time constant (s) of the damping of a held robot.
const HOLD_TIME_S: f64 = 0.1;

/// Solves, widening limits where they contradict each other.
pub fn solve(formulation: &mut Formulation, report: &mut StepReport) -> StepStatus {
    for attempt in 0..ATTEMPTS_MAX {
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
        let rank_least = u8::try_from(1 + attempt / ATTEMPTS_PER_RANK).unwrap_or(u8::MAX);
        let meaning = |row| formulation.layout.meaning(row);
        let found = weakest(&outcome.contradiction, meaning, rank_least);
        let Some((conflict, id, amount)) = found.or_else(|| weakest(&outcome.contradiction, meaning, 0)) else {
            return StepStatus::Held;
        };
        // A row that comes up again is widened twice as generously each time: contradictions have many sides, and each
        // certificate shows one.
        let times = report.relaxed.iter().filter(|relaxed| relaxed.id == id).count();
        let amount = amount * f64::from(1_u32 << times.min(ATTEMPTS_MAX));
        widen(&mut formulation.problem, &conflict, amount);
        report.relaxed.push(Relaxation { id, amount });
    }
    StepStatus::Held
}

/// Rank and allowance (in the limit's unit).
fn rank(id: ConstraintId) -> Option<(u8, f64)> {
    match id {
        ConstraintId::Load { .. } => Some((1, 1000.0)),
        ConstraintId::Collision(_) => Some((2, 20.0)),
        ConstraintId::JointMotion(_) => Some((3, 200.0)),
        ConstraintId::Torque(_) => Some((4, 50.0)),
        ConstraintId::Contact { .. } => Some((5, f64::INFINITY)),
        ConstraintId::BaseDynamics(_) | ConstraintId::Intensity { .. } => None,
    }
}

/// The row that gives way, and by how much: lowest rank from `rank_least` on, then heaviest.
fn weakest(
    contradiction: &Contradiction,
    meaning: impl Fn(Row) -> Option<ConstraintId>,
    rank_least: u8,
) -> Option<(Conflict, ConstraintId, f64)> {
    let mut best: Option<(u8, Conflict, ConstraintId, f64)> = None;
    for conflict in &contradiction.rows {
        let Some(id) = meaning(conflict.row) else { continue };
        let Some((rank, allowance)) = rank(id) else { continue };
        let amount = demanded(contradiction, conflict);
        // Of equals the first stays: rows are sorted, heaviest first.
        if amount <= allowance && rank >= rank_least && best.as_ref().is_none_or(|(least, ..)| rank < *least) {
            best = Some((rank, *conflict, id, amount));
        }
    }
    best.map(|(_, conflict, id, amount)| (conflict, id, amount))
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
