//! What happens when a program has no solution.
//!
//! 1. **Infeasible**: the solver names rows that exclude each other and by how much. Of these the one that comes first in
//!    [`RelaxationSettings::order`] is widened by just that much (twice as much each time it comes up again), provided that all
//!    its widenings together stay within its allowance, and the program is solved again. With the default order:
//!
//!    | rank | limit | default allowance | why it gives way |
//!    |---|---|---|---|
//!    | 1 | load of a foot | 1000 N | a matter of smoothness |
//!    | 2 | collision damper | 20 m/s² | speeds of approach, far from touching |
//!    | 3 | joint position and speed | 200 rad/s² | the robot's own controller guards them too |
//!    | 4 | joint torque | up to what the motor can do | the controller's limit may be a part of the motor's |
//!    | 5 | motion of a stance ankle | 1e4 m/s² or rad/s² | the foot would slide or the sole deform otherwise |
//!    | – | dynamics, pushing-only contacts | none | physics: never |
//!
//!    No torque beyond the motor's own limit is ever sent.
//! 2. **Out of iterations, or a numerical failure**: the backup, a solver that shares no code with the first, takes the same
//!    program (by default Clarabel, which allocates then), and the first one starts cold at the next step. If the backup finds
//!    the program infeasible, the ladder goes on with rung 1.
//! 3. **No solution** after [`ATTEMPTS_MAX`] attempts, or neither solver has one: joints are brought to rest with the
//!    deceleration they can count on, the last torques and wrenches are kept. From a state that is not a number nothing
//!    follows: the last step's next configuration stands, at rest.
//!
//! Every widening, every contradiction and who answered is in the report.

use crate::constraint::limits::JointLimits;
use crate::formulation::Formulation;
use crate::layout::{ConstraintId, Layout};
use crate::reference::RobotState;
use crate::report::{AnsweredBy, Relaxation, StepReport, StepStatus};
use crate::settings::RelaxationSettings;
use qp::dense::{Contradiction, Outcome, Problem};
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

/// Largest relative violation with which an answer is used.
const FEASIBILITY_MAX: f64 = 1e-6;

/// Solves, widening limits where they contradict each other.
pub fn solve(
    formulation: &mut Formulation,
    limits: &[JointLimits],
    settings: &RelaxationSettings,
    report: &mut StepReport,
) -> StepStatus {
    report.answered_by = AnsweredBy::Solver;
    formulation.solvers.begin();
    for attempt in 0..ATTEMPTS_MAX {
        let status = answer(formulation, report);
        let Formulation { layout, problem, solvers } = formulation;
        match status {
            Status::Solved | Status::SolvedInaccurately => {
                return if report.relaxed.is_empty() { StepStatus::Solved } else { StepStatus::Relaxed };
            }
            Status::Infeasible => {}
            _ => return StepStatus::Held,
        }
        let contradiction = &solvers.outcome().contradiction;
        report.contradiction.clear();
        report.contradiction.extend(contradiction.rows.iter().filter_map(|c| layout.meaning(c.row)));
        let ladder = Ladder { settings, limits, relaxed: &report.relaxed, layout };
        let rank_least = attempt / ATTEMPTS_PER_RANK;
        let Some((conflict, id, amount)) =
            ladder.weakest(contradiction, rank_least).or_else(|| ladder.weakest(contradiction, 0))
        else {
            return StepStatus::Held;
        };
        // A row that comes up again is widened twice as generously each time: contradictions have many sides, and each
        // certificate shows one.
        let before = report.relaxed.iter().position(|relaxed| relaxed.id == id);
        let times = before.map_or(0, |k| report.relaxed[k].times);
        let amount = (amount * f64::from(1_u32 << times)).min(ladder.left(id));
        widen(problem, &conflict, amount);
        match before {
            Some(k) => {
                report.relaxed[k].amount += amount;
                report.relaxed[k].times += 1;
            }
            None => report.relaxed.push(Relaxation { id, amount, times: 1 }),
        }
    }
    StepStatus::Held
}

/// One attempt: the first solver's answer, or the backup's when the first has none.
fn answer(formulation: &mut Formulation, report: &mut StepReport) -> Status {
    let Formulation { problem, solvers, .. } = formulation;
    if report.answered_by == AnsweredBy::Solver {
        note(report, solvers.solve(problem));
        let has_answer = report.solver_status.has_solution() || report.solver_status == Status::Infeasible;
        if has_answer || !solvers.switch_to_backup(problem) {
            return report.solver_status;
        }
        report.answered_by = AnsweredBy::Backup;
    }
    note(report, solvers.solve(problem));
    report.solver_status
}

/// A solution that misses its limits by more than [`FEASIBILITY_MAX`], or that is no number, is none.
fn note(report: &mut StepReport, outcome: &Outcome) {
    let found = &outcome.report;
    report.iterations += found.iterations;
    report.residuals = found.residuals;
    // A NaN is not within the limit; and residuals, being maxima, may not show one of the point.
    let is_usable = found.residuals.feasibility <= FEASIBILITY_MAX && found.x.iter().all(|x| x.is_finite());
    let is_refused = found.status.has_solution() && !is_usable;
    report.solver_status = if is_refused { Status::NumericalFailure } else { found.status };
}

/// Which limits give way, and how far.
struct Ladder<'a> {
    settings: &'a RelaxationSettings,
    limits: &'a [JointLimits],
    relaxed: &'a [Relaxation],
    layout: &'a Layout,
}

impl Ladder<'_> {
    /// Position in the order; `None` for what never gives way.
    fn rank(&self, id: ConstraintId) -> Option<usize> {
        id.limit().and_then(|limit| self.settings.rank(limit))
    }

    /// What is left of a row's allowance, in its unit.
    fn left(&self, id: ConstraintId) -> f64 {
        let settings = self.settings;
        let allowance = match id {
            ConstraintId::Load { .. } => settings.load_n,
            ConstraintId::Collision(_) => settings.collision_m_per_s2,
            ConstraintId::JointMotion(_) => settings.joint_motion_rad_per_s2,
            ConstraintId::Torque(joint) => {
                let JointLimits { torque, motor_torque, .. } = self.limits[joint];
                settings.torque_factor * motor_torque - torque
            }
            ConstraintId::Contact { .. } => settings.contact_m_per_s2,
            ConstraintId::BaseDynamics(_) | ConstraintId::Intensity { .. } => 0.0,
        };
        let used = self.relaxed.iter().find(|relaxed| relaxed.id == id).map_or(0.0, |relaxed| relaxed.amount);
        allowance - used
    }

    /// The row that gives way, and by how much: lowest rank from `rank_least` on, then heaviest.
    fn weakest(&self, contradiction: &Contradiction, rank_least: usize) -> Option<(Conflict, ConstraintId, f64)> {
        let mut best: Option<(usize, Conflict, ConstraintId, f64)> = None;
        for conflict in &contradiction.rows {
            let Some(id) = self.layout.meaning(conflict.row) else { continue };
            let Some(rank) = self.rank(id) else { continue };
            let amount = demanded(contradiction, conflict);
            // Of equals the first stays: rows are sorted, heaviest first.
            if amount <= self.left(id) && rank >= rank_least && best.as_ref().is_none_or(|(least, ..)| rank < *least) {
                best = Some((rank, *conflict, id, amount));
            }
        }
        best.map(|(_, conflict, id, amount)| (conflict, id, amount))
    }
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
