//! The objective of a step: tasks become rows, rows become Hessian and gradient, and afterwards a report.

use super::{TORSO, WholeBody};
use crate::formulation::Formulation;
use crate::layout::Layout;
use crate::reference::{FootTarget, RobotState, WholeBodyReference};
use crate::report::{TaskId, TaskReport};
use crate::settings::MomentumSettings;
use crate::task::{self, NormalEquations};
use multibody::WholeBodyTerms;
use qp::dense::Problem;
use spatial::{Transform, Vec3, Wrench};
use std::ops::Range;

/// Rows of the normal equations that belong to one task.
#[derive(Debug, Clone)]
pub(super) struct TaskRows {
    id: TaskId,
    rows: Range<usize>,
    tracking_error: f64,
    weight: f64,
}

impl WholeBody {
    pub(super) fn write_objective(
        &mut self,
        set: usize,
        state: &RobotState,
        reference: &WholeBodyReference,
        dt_s: f64,
    ) {
        self.gather_motion_tasks(reference, dt_s);
        let Formulation { layout, problem, .. } = &mut self.formulations[set];
        let base = self.model.base_dofs();
        self.motion_rows.write(0, &mut problem.P, &mut problem.c);
        for (j, (position, gains)) in self.posture.iter().enumerate() {
            let kp = gains.stiffness_at(dt_s);
            let desired = kp * (position - state.q.joints[j]) - 2.0 * kp.sqrt() * state.v[base + j];
            problem.P[(base + j, base + j)] += gains.weight;
            problem.c[base + j] -= gains.weight * desired;
        }
        let tasks = &self.settings.tasks;
        let moment_weight = tasks.wrench_weight / (tasks.wrench_lever_m * tasks.wrench_lever_m);
        for foot in layout.standing() {
            let planned = planned_about_ankle(&reference.feet[foot], &self.terms.frames[foot].placement);
            let rows = &mut self.force_rows[foot];
            rows.clear();
            for (axis, value) in planned.to_vector().iter().enumerate() {
                let weight = if axis < 3 { tasks.wrench_weight } else { moment_weight };
                rows.push(&self.cones[foot].map, axis, *value, weight);
            }
            let first = layout.force(foot);
            rows.write(first, &mut problem.P, &mut problem.c);
            for i in first..first + layout.intensities {
                problem.P[(i, i)] += tasks.intensity_damping;
            }
        }
        if tasks.torque_weight > 0.0 {
            add_torques(layout, problem, &self.terms, tasks.torque_weight);
            task::mirror(&mut problem.P, 0..layout.size().variables);
        } else {
            // Nothing couples motion and intensities, or one foot's with the other's.
            task::mirror(&mut problem.P, 0..layout.nv);
            for first in layout.standing().map(|foot| layout.force(foot)) {
                task::mirror(&mut problem.P, first..first + layout.intensities);
            }
        }
    }

    /// Rows of all tasks on motion, and their errors.
    fn gather_motion_tasks(&mut self, reference: &WholeBodyReference, dt_s: f64) {
        let Self { terms, settings, motion_rows: rows, motion_tasks: list, report, .. } = self;
        let tasks = &settings.tasks;
        rows.clear();
        list.clear();
        let mut begin = |id, first: usize, rows: &NormalEquations, error: &[f64], weight| {
            list.push(TaskRows { id, rows: first..rows.len(), tracking_error: largest(error), weight });
        };

        let error = reference.com_position - terms.com;
        let stiffness = tasks.com.stiffness_at(dt_s);
        let desired = task::desired(
            &reference.com_acceleration,
            &(reference.com_velocity - terms.com_velocity),
            &error,
            stiffness,
        );
        for axis in 0..3 {
            let weight = tasks.com.weight * if axis == 2 { tasks.com_height_factor } else { 1.0 };
            rows.push(&terms.com_jacobian, axis, desired[axis] - terms.com_drift[axis], weight);
        }
        begin(TaskId::Com, 0, rows, error.as_slice(), tasks.com.weight);
        report.body_error.fixed_rows_mut::<3>(0).copy_from(&error);

        let torso = &terms.frames[TORSO];
        let error = task::rotation_error(&reference.torso_rotation, &torso.placement.rotation);
        let stiffness = tasks.torso.stiffness_at(dt_s);
        let rate_error = reference.torso_angular_velocity - torso.velocity.angular;
        let desired = task::desired(&reference.torso_angular_acceleration, &rate_error, &error, stiffness);
        let first = rows.len();
        for axis in 0..3 {
            rows.push(&torso.jacobian, 3 + axis, desired[axis] - torso.drift[3 + axis], tasks.torso.weight);
        }
        begin(TaskId::Torso, first, rows, error.as_slice(), tasks.torso.weight);
        report.body_error.fixed_rows_mut::<3>(3).copy_from(&error);

        for (foot, target) in reference.feet.iter().enumerate().filter(|(_, target)| !target.in_contact) {
            let frame = &terms.frames[foot];
            let error = task::pose_error(&target.ankle_pose, &frame.placement);
            let gains = [tasks.swing_position, tasks.swing_orientation];
            let stiffness = gains.map(|g| g.stiffness_at(dt_s));
            let desired =
                task::desired_motion(frame, &error, &target.ankle_twist, &target.ankle_acceleration, stiffness);
            for (part, id) in [TaskId::SwingPosition(foot), TaskId::SwingOrientation(foot)].into_iter().enumerate() {
                let first = rows.len();
                for axis in 3 * part..3 * part + 3 {
                    rows.push(&frame.jacobian, axis, desired[axis] - frame.drift[axis], gains[part].weight);
                }
                begin(id, first, rows, &error.as_slice()[3 * part..3 * part + 3], gains[part].weight);
            }
        }

        let MomentumSettings { weight, rate_per_s } = tasks.angular_momentum;
        if weight > 0.0 {
            let first = rows.len();
            let rate = rate_per_s.min(0.5 / dt_s);
            for axis in 3..6 {
                let target = -rate * terms.momentum[axis] - terms.centroidal_drift[axis];
                rows.push(&terms.centroidal_matrix, axis, target, weight);
            }
            begin(TaskId::AngularMomentum, first, rows, &terms.momentum.as_slice()[3..], weight);
        }
    }

    /// Error and cost of every objective; together the costs are twice the program's objective up to its constant.
    pub(super) fn report_tasks(&mut self, set: usize, reference: &WholeBodyReference, state: &RobotState, dt_s: f64) {
        let Self { report, motion_rows, motion_tasks, force_rows, posture, settings, formulations, terms, .. } = self;
        let layout = &formulations[set].layout;
        let x = formulations[set].solvers.outcome().report.x.as_slice();
        let sum = |rows: &NormalEquations, range: Range<usize>, x: &[f64], weight: f64| {
            range.fold((0.0_f64, 0.0), |(residual, cost), row| {
                let defect = rows.weighted_defect(row, x).abs();
                (residual.max(defect / weight.sqrt()), cost + defect * defect)
            })
        };
        let motion = &x[..layout.nv];
        for task in motion_tasks.iter() {
            let (residual, cost) = sum(motion_rows, task.rows.clone(), motion, task.weight);
            report.tasks.push(TaskReport { id: task.id, tracking_error: task.tracking_error, residual, cost });
        }
        let base = layout.nv - layout.joints;
        let mut whole = TaskReport { id: TaskId::Posture, tracking_error: 0.0, residual: 0.0, cost: 0.0 };
        for (j, (position, gains)) in posture.iter().enumerate() {
            let kp = gains.stiffness_at(dt_s);
            let error = position - state.q.joints[j];
            let residual = motion[base + j] - kp * error + 2.0 * kp.sqrt() * state.v[base + j];
            whole.tracking_error = whole.tracking_error.max(error.abs());
            whole.residual = whole.residual.max(residual.abs());
            whole.cost += gains.weight * residual * residual;
        }
        report.tasks.push(whole);
        let tasks = &settings.tasks;
        let mut damping = 0.0;
        for foot in layout.standing() {
            let first = layout.force(foot);
            let f = &x[first..first + layout.intensities];
            let planned = planned_about_ankle(&reference.feet[foot], &terms.frames[foot].placement);
            let missed = report.feet[foot].wrench - planned;
            let (_, cost) = sum(&force_rows[foot], 0..6, f, 1.0);
            let residual = largest(missed.to_vector().as_slice());
            report.tasks.push(TaskReport { id: TaskId::Wrench(foot), tracking_error: residual, residual, cost });
            damping += tasks.intensity_damping * f.iter().map(|f| f * f).sum::<f64>();
        }
        let largest_intensity = largest(&x[layout.nv..]);
        report.tasks.push(TaskReport {
            id: TaskId::Damping,
            tracking_error: 0.0,
            residual: largest_intensity,
            cost: damping,
        });
        if tasks.torque_weight > 0.0 {
            let cost = tasks.torque_weight * report.torques.norm_squared();
            let residual = largest(report.torques.as_slice());
            report.tasks.push(TaskReport { id: TaskId::Torque, tracking_error: 0.0, residual, cost });
        }
    }
}

/// `alpha |tau|²` with `tau = T x + h_a`, T the first rows of C.
fn add_torques(layout: &Layout, problem: &mut Problem, terms: &WholeBodyTerms, weight: f64) {
    let (n, rows, joints) = (problem.c.len(), problem.C.nrows(), layout.joints);
    let bias = &terms.bias.as_slice()[layout.nv - joints..];
    let column = |j: usize| &problem.C.as_slice()[j * rows..j * rows + joints];
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0, |sum, (a, b)| a.mul_add(*b, sum));
    for j in 0..n {
        problem.c[j] += weight * dot(column(j), bias);
        for i in j..n {
            let product = weight * dot(column(i), column(j));
            let coupled = j < layout.nv && i >= layout.nv;
            // Blocks that couple motion and intensities are written by nobody else.
            problem.P[(i, j)] = if coupled { product } else { problem.P[(i, j)] + product };
        }
    }
}

/// The planned wrench, given about the planned ZMP, about the ankle's origin.
fn planned_about_ankle(target: &FootTarget, ankle: &Transform) -> Wrench {
    let zmp = Vec3::new(target.zmp.x, target.zmp.y, 0.0);
    target.wrench.about(&(ankle.translation - zmp))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |s: f64, x| s.max(x.abs()))
}
