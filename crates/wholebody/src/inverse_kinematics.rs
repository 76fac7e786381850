//! The configuration in which a walk starts.

use crate::task;
use multibody::{Configuration, FrameIndex, Model, Workspace, forward_kinematics};
use nalgebra::{DMatrix, DVector};
use qp::Status;
use qp::dense::{ActiveSet, ActiveSetSettings, Problem, Size, Solver};
use spatial::{Mat3, Transform, Vec3};
use thiserror::Error;

/// What [`initial_configuration`] shall find.
#[derive(Debug, Clone, PartialEq)]
pub struct ConfigurationTargets {
    /// Position of the centre of mass (m).
    pub com: Vec3,
    /// Ankle frames, left and right.
    pub ankles: [FrameIndex; 2],
    /// Their poses.
    pub ankle_poses: [Transform; 2],
    /// Frame of the torso.
    pub torso: FrameIndex,
    /// Its orientation.
    pub torso_rotation: Mat3,
    /// Joint positions to stay close to and to start from, in the model's order (rad).
    pub posture: DVector<f64>,
    /// Distance kept from the joints' limits (rad).
    pub limit_margin_rad: f64,
}

/// No such configuration was found.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ConfigurationError {
    /// Within the joint limits the targets cannot all be met: `error` is what remains. Move the targets closer.
    #[error("no configuration within the joint limits meets the targets: {error:e} m or rad remain{}", at_limit(.joints))]
    OutOfReach {
        /// Largest remaining component (m, rad).
        error: f64,
        /// Joints at their limits.
        joints: Vec<String>,
    },
}

fn at_limit(joints: &[String]) -> String {
    if joints.is_empty() { String::new() } else { format!("; at their limits: {}", joints.join(", ")) }
}

/// Rows: two ankles, centre of mass, torso.
const ROWS: usize = 18;
/// Targets are met to rounding (m, rad).
const TOLERANCE: f64 = 1e-11;
/// Steps below this change nothing (m, rad).
const SETTLED: f64 = 1e-10;
/// A step that leaves more than this part of the error is no progress.
const PROGRESS: f64 = 0.9;
/// Steps without progress after which the targets are met as well as possible instead of exactly.
const STALLED_MAX: usize = 10;
/// Strides shorten by this from then on, so that the search comes to rest.
const SHRINKING: f64 = 0.7;
/// Newton steps.
const STEPS_MAX: usize = 100;
/// Longest step of any joint (rad) and of the base (m, rad).
const STRIDE_MAX: f64 = 0.2;
/// A joint this near to its bound counts as being there (rad).
const AT_LIMIT_RAD: f64 = 1e-6;
/// Weight of the targets against that of the posture when they cannot be met exactly.
const TARGET_WEIGHT: f64 = 1e6;

/// Finds q with both ankles and the torso as wanted and the centre of mass at its place, nearest to the posture, within the
/// joint limits: Gauss-Newton, each step a quadratic program with the targets as equalities.
///
/// # Errors
/// [`ConfigurationError`] when the targets are out of reach.
pub fn initial_configuration(
    model: &Model,
    targets: &ConfigurationTargets,
) -> Result<Configuration, ConfigurationError> {
    let nv = model.nv();
    let base = model.base_dofs();
    let mut q = model.neutral();
    let mut ws = Workspace::new(model);
    q.joints.copy_from(&targets.posture);
    place_base(model, &mut ws, targets, &mut q);
    let mut problem = Problem::new(Size { variables: nv, equalities: ROWS, inequalities: 0 });
    let mut solver = ActiveSet::new(problem.size(), ActiveSetSettings::default());
    let soft_size = Size { variables: nv, equalities: 0, inequalities: 0 };
    let mut soft_solver = ActiveSet::new(soft_size, ActiveSetSettings::default());
    let mut next = q.clone();
    let (mut error, mut stride) = (f64::INFINITY, f64::INFINITY);
    let (mut best, mut stalled, mut reach) = (f64::INFINITY, 0, STRIDE_MAX);
    for _ in 0..STEPS_MAX {
        error = linearise(model, &mut ws, targets, &q, &mut problem);
        // The posture has to have settled too, so that the result does not depend on the way.
        if error < TOLERANCE && stride < SETTLED {
            return Ok(q);
        }
        for j in 0..nv {
            let (lower, upper, wanted) = match j.checked_sub(base) {
                None => (-reach, reach, 0.0),
                Some(joint) => {
                    let (low, high) = range(model, joint, targets.limit_margin_rad);
                    let at = q.joints[joint];
                    let stride = |x: f64| x.clamp(-reach, reach);
                    (stride(low - at), stride(high - at), targets.posture[joint] - at)
                }
            };
            (problem.lb[j], problem.ub[j]) = (lower, upper);
            problem.c[j] = -wanted;
        }
        // Near stretched legs the linear model promises what the robot cannot do, step after step.
        if error < PROGRESS * best {
            (best, stalled) = (error, 0);
        } else {
            stalled += 1;
            if stalled > STALLED_MAX {
                reach *= SHRINKING;
            }
        }
        let may_be_exact = stalled < STALLED_MAX || error < TOLERANCE;
        let step = if may_be_exact && solver.solve(&problem).report.status == Status::Solved {
            solver.outcome().report.x.clone()
        } else {
            // Too far for one step, or out of reach: as near as the bounds allow.
            let mut soft = Problem::new(soft_size);
            soft.P = &problem.P + TARGET_WEIGHT * problem.A.tr_mul(&problem.A);
            soft.c = &problem.c - TARGET_WEIGHT * problem.A.tr_mul(&problem.b);
            (soft.lb, soft.ub) = (problem.lb.clone(), problem.ub.clone());
            soft_solver.solve(&soft).report.x.clone()
        };
        stride = step.amax();
        model.integrate(&q, &step, &mut next);
        std::mem::swap(&mut q, &mut next);
    }
    let joints = (0..model.joint_count())
        .filter(|&j| {
            let (low, high) = range(model, j, targets.limit_margin_rad);
            q.joints[j] < low + AT_LIMIT_RAD || q.joints[j] > high - AT_LIMIT_RAD
        })
        .map(|j| model.joints()[j].name.clone())
        .collect();
    Err(ConfigurationError::OutOfReach { error, joints })
}

fn range(model: &Model, joint: usize, margin: f64) -> (f64, f64) {
    let limits = &model.joints()[joint].limits;
    let margin = margin.min(0.25 * (limits.upper - limits.lower));
    (limits.lower + margin, limits.upper - margin)
}

/// Base such that the torso is upright and the centre of mass in place: a good start whatever the world's origin.
fn place_base(model: &Model, ws: &mut Workspace, targets: &ConfigurationTargets, q: &mut Configuration) {
    let torso = forward_kinematics(model, ws, q).pose(targets.torso).rotation;
    q.base.rotation = targets.torso_rotation * torso.transpose();
    q.base.translation += targets.com - forward_kinematics(model, ws, q).center_of_mass();
}

/// `A dq = b`: rows of ankles, centre of mass and torso at q. Returns the largest error.
fn linearise(
    model: &Model,
    ws: &mut Workspace,
    targets: &ConfigurationTargets,
    q: &Configuration,
    problem: &mut Problem,
) -> f64 {
    let nv = model.nv();
    let mut placed = forward_kinematics(model, ws, q);
    let mut jacobian = DMatrix::zeros(6, nv);
    for i in 0..2 {
        placed.jacobian(targets.ankles[i], &mut jacobian);
        problem.A.rows_mut(6 * i, 6).copy_from(&jacobian);
        let error = task::pose_error(&targets.ankle_poses[i], &placed.pose(targets.ankles[i]));
        problem.b.rows_mut(6 * i, 6).copy_from(&error);
    }
    placed.jacobian(targets.torso, &mut jacobian);
    problem.A.rows_mut(15, 3).copy_from(&jacobian.rows(3, 3));
    let rotation = placed.pose(targets.torso).rotation;
    problem.b.rows_mut(15, 3).copy_from(&task::rotation_error(&targets.torso_rotation, &rotation));
    let mut com = DMatrix::zeros(3, nv);
    placed.com_jacobian(&mut com);
    problem.A.rows_mut(12, 3).copy_from(&com);
    problem.b.rows_mut(12, 3).copy_from(&(targets.com - placed.center_of_mass()));
    problem.b.amax()
}
