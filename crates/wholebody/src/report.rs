//! What comes out.

use crate::constraint::friction::POINTS;
use crate::layout::ConstraintId;
use multibody::Configuration;
use nalgebra::DVector;
use qp::dense::Side;
use qp::{Residuals, Status};
use spatial::{Vec3, Vec6, Wrench};

/// How a step was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StepStatus {
    /// All constraints hold.
    Solved,
    /// Some limits contradicted each other and were widened: see [`StepReport::relaxed`].
    Relaxed,
    /// No usable solution: joints are brought to rest, the last torques are kept.
    Held,
}

/// Which solver gave the last answer of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AnsweredBy {
    /// [`SolverSettings::backend`](crate::SolverSettings::backend).
    #[default]
    Solver,
    /// [`SolverSettings::backup`](crate::SolverSettings::backup), for the first ran out of iterations or failed.
    Backup,
}

/// The objectives of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TaskId {
    /// Position of a swinging ankle (left 0, right 1).
    SwingPosition(usize),
    /// Orientation of a swinging ankle.
    SwingOrientation(usize),
    /// Centre of mass.
    Com,
    /// Absolute orientation of the torso.
    Torso,
    /// Angular momentum about the centre of mass.
    AngularMomentum,
    /// Posture of all joints.
    Posture,
    /// Planned wrench of a stance foot.
    Wrench(usize),
    /// Joint torques.
    Torque,
    /// Damping on the intensities.
    Damping,
}

/// One objective at the solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaskReport {
    /// Which.
    pub id: TaskId,
    /// Largest component of `x_ref - x` at the state the step started from (m, rad; N, N m for wrenches; 0 where a task
    /// has no position).
    pub tracking_error: f64,
    /// Largest component of `J vd + Jdot v - a_des` (m/s², rad/s²; N, N m).
    pub residual: f64,
    /// `alpha |E|²`, its part of the objective.
    pub cost: f64,
}

/// A constraint that holds with equality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActiveConstraint {
    /// Which.
    pub id: ConstraintId,
    /// At which side.
    pub side: Side,
    /// Its multiplier, positive at the upper side, negative at the lower: its size is how much the objective would fall per
    /// unit of widening.
    pub multiplier: f64,
}

/// A limit that had to be widened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxation {
    /// Which.
    pub id: ConstraintId,
    /// By how much in all, in its unit (N m, m/s², rad/s², N).
    pub amount: f64,
    /// In how many attempts.
    pub times: u32,
}

/// A stance foot's part of the result.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FootForce {
    /// Wrench of the ground on the foot about the ankle's origin, world axes; zero in the air.
    pub wrench: Wrench,
    /// Forces of the ground on the sole's corners, world axes (N): front left, front right, rear right, rear left.
    pub corners: [Vec3; POINTS],
    /// Highest load that was allowed (N).
    pub load_max_n: f64,
}

/// Largest deviation of a stance ankle from where the estimator has it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactError {
    /// Position (m).
    pub position_m: f64,
    /// Orientation (rad).
    pub orientation_rad: f64,
}

/// Time spent in each stage (ns); zero unless a clock was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Timings {
    /// Kinematics and dynamics of the model.
    pub terms_ns: u64,
    /// Filling the program.
    pub assembly_ns: u64,
    /// Distances of the collision pairs and their rows (not part of `assembly_ns`).
    pub collision_ns: u64,
    /// Solver, with all re-solves.
    pub solve_ns: u64,
    /// Torques, integration, report.
    pub output_ns: u64,
}

/// Result of one step. All memory is allocated once.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// How it was found.
    pub status: StepStatus,
    /// `vd`, nv.
    pub acceleration: DVector<f64>,
    /// Joint torques (N m).
    pub torques: DVector<f64>,
    /// Left, right.
    pub feet: [FootForce; 2],
    /// Left, right; zero in the air.
    pub contact_errors: [ContactError; 2],
    /// Configuration one period later.
    pub q_next: Configuration,
    /// Velocity one period later.
    pub v_next: DVector<f64>,
    /// Every objective with its error and cost.
    pub tasks: Vec<TaskReport>,
    /// Inequalities and bounds that hold with equality.
    pub active: Vec<ActiveConstraint>,
    /// Limits that were widened, each once.
    pub relaxed: Vec<Relaxation>,
    /// The constraints that contradicted each other last, heaviest first; empty when there was no contradiction.
    pub contradiction: Vec<ConstraintId>,
    /// Smallest distance over all collision pairs within reach (m), infinite if there is none.
    pub distance_min_m: f64,
    /// `x_ref - x` of centre of mass (first three) and torso orientation (last three).
    pub body_error: Vec6,
    /// Which solver gave the answer.
    pub answered_by: AnsweredBy,
    /// How it ended.
    pub solver_status: Status,
    /// Residuals of the program.
    pub residuals: Residuals,
    /// Changes of the active set or interior-point steps, all re-solves together.
    pub iterations: u32,
    /// Time per stage.
    pub timings: Timings,
}
