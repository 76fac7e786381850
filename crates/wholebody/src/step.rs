//! One control step.

use crate::collision::{Body, FrameList, Pairs};
use crate::constraint::friction::FrictionCones;
use crate::constraint::limits::JointLimits;
use crate::error::WholeBodyError;
use crate::fallback;
use crate::formulation::Formulation;
use crate::layout::{ConstraintId, Layout};
use crate::reference::{FootTarget, RobotState, WholeBodyReference};
use crate::report::{ActiveConstraint, ContactError, FootForce, StepReport, StepStatus, TaskId, TaskReport, Timings};
use crate::settings::WholeBodySettings;
use crate::task::{self, NormalEquations};
use multibody::{Base, Model, WholeBodyTerms, Workspace, whole_body_terms};
use nalgebra::{DVector, RowDVector};
use qp::dense::{Active, Problem};
use qp::{Residuals, Row, Status};
use spatial::{Transform, Vec3, Vec6, Wrench};
use std::ops::Range;

/// Positions in the list of frames that a step computes.
const TORSO: usize = 2;

/// Nanoseconds of some clock, handed in by the process: libraries know none.
pub type Clock = fn() -> u64;

/// Rows of the normal equations that belong to one task.
#[derive(Debug, Clone)]
struct TaskRows {
    id: TaskId,
    rows: Range<usize>,
    tracking_error: f64,
    weight: f64,
}

/// The whole-body controller. Everything is allocated here; with the active-set backend a step allocates nothing.
pub struct WholeBody {
    model: Model,
    settings: WholeBodySettings,
    workspace: Workspace,
    terms: WholeBodyTerms,
    cones: [FrictionCones; 2],
    /// Columns of v that move each foot.
    foot_columns: [Vec<usize>; 2],
    limits: Vec<JointLimits>,
    /// Position and gains of each joint's posture.
    posture: Vec<(f64, crate::settings::Gains)>,
    pairs: Pairs,
    pair_row: RowDVector<f64>,
    motion_rows: NormalEquations,
    force_rows: [NormalEquations; 2],
    motion_tasks: Vec<TaskRows>,
    formulations: [Formulation; 4],
    contact_set: Option<usize>,
    increment: DVector<f64>,
    guess: Vec<Active>,
    clock: Option<Clock>,
    report: StepReport,
}

impl WholeBody {
    /// Resolves all names and allocates all memory.
    ///
    /// # Errors
    /// [`WholeBodyError`] names the setting that does not fit.
    pub fn new(model: Model, settings: WholeBodySettings) -> Result<Self, WholeBodyError> {
        if model.base() != Base::Floating {
            return Err(WholeBodyError::FixedBase);
        }
        check(&settings)?;
        let mut frames = FrameList::default();
        let ankles = [model.frame(&settings.feet[0].ankle_link)?, model.frame(&settings.feet[1].ankle_link)?];
        frames.0.extend(ankles);
        frames.0.push(model.frame(&settings.torso_link)?);
        let mut bodies = Vec::new();
        for capsule in &settings.collision.capsules {
            let slot = frames.slot(model.frame(&capsule.link)?);
            bodies.push(Body { slot, from: capsule.from_m, to: capsule.to_m, radius: capsule.radius_m });
        }
        let pairs = resolve_pairs(&settings)?;
        let pairs = Pairs::new(&settings.collision, bodies, pairs);

        let (nv, joints) = (model.nv(), model.joint_count());
        let foot_columns = ankles.map(|ankle| {
            let moving = (0..joints).filter(|j| model.moves(multibody::JointIndex(*j), ankle)).map(|j| nv - joints + j);
            (0..nv - joints).chain(moving).collect::<Vec<_>>()
        });
        let limits = joint_limits(&model, &settings);
        let mut posture: Vec<_> = (0..joints)
            .map(|j| {
                let in_leg = foot_columns.iter().any(|columns| columns.contains(&(nv - joints + j)));
                (0.0, if in_leg { settings.tasks.leg_posture } else { settings.tasks.posture })
            })
            .collect();
        for target in &settings.posture {
            posture[model.joint(&target.joint)?.0].0 = target.position_rad;
        }
        let constraints = &settings.constraints;
        let cones = [0, 1].map(|i: usize| {
            FrictionCones::new(
                settings.sole.length_m,
                settings.sole.width_m,
                &settings.feet[i].ankle_in_sole_m,
                constraints.friction,
                constraints.generators_per_point,
            )
        });
        let intensities = cones[0].len();
        let formulations = [[false, false], [true, false], [false, true], [true, true]].map(|contacts| {
            let layout = Layout { nv, joints, pairs: pairs.len(), contacts, intensities };
            Formulation::new(layout, settings.backend, settings.iterations_max)
        });
        let variables = nv + 2 * intensities;
        let report = StepReport {
            status: StepStatus::Held,
            acceleration: DVector::zeros(nv),
            torques: DVector::zeros(joints),
            feet: [FootForce::default(); 2],
            contact_errors: [ContactError::default(); 2],
            q_next: model.neutral(),
            v_next: DVector::zeros(nv),
            tasks: Vec::with_capacity(16),
            active: Vec::with_capacity(variables),
            relaxed: Vec::with_capacity(fallback::ATTEMPTS_MAX),
            contradiction: Vec::with_capacity(2 * variables),
            distance_min_m: f64::INFINITY,
            body_error: Vec6::zeros(),
            solver_status: Status::NumericalFailure,
            residuals: Residuals::default(),
            iterations: 0,
            timings: Timings::default(),
        };
        Ok(Self {
            workspace: Workspace::new(&model),
            terms: WholeBodyTerms::new(&model, &frames.0),
            force_rows: [0, 1].map(|_: usize| NormalEquations::new(intensities, 6)),
            motion_rows: NormalEquations::new(nv, 24),
            motion_tasks: Vec::with_capacity(16),
            increment: DVector::zeros(nv),
            guess: Vec::with_capacity(variables),
            pair_row: RowDVector::zeros(nv),
            contact_set: None,
            clock: None,
            model,
            settings,
            cones,
            foot_columns,
            limits,
            posture,
            pairs,
            formulations,
            report,
        })
    }

    /// The model it controls.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The settings it was made with.
    #[must_use]
    pub fn settings(&self) -> &WholeBodySettings {
        &self.settings
    }

    /// The last step's result.
    #[must_use]
    pub fn report(&self) -> &StepReport {
        &self.report
    }

    /// Kinematics and dynamics of the last step's state.
    #[must_use]
    pub fn terms(&self) -> &WholeBodyTerms {
        &self.terms
    }

    /// Measures the stages of every step with this clock (nanoseconds).
    pub fn set_clock(&mut self, clock: Clock) {
        self.clock = Some(clock);
    }

    /// The last step's program as it was given to the solver, after any widening: [`Problem::to_json`] writes it down, and
    /// `soleus-inspect qp` solves it again. `None` before the first step.
    #[must_use]
    pub fn last_program(&self) -> Option<&Problem> {
        self.contact_set.map(|set| &self.formulations[set].problem)
    }

    /// What a row of [`Self::last_program`] means.
    #[must_use]
    pub fn meaning(&self, row: Row) -> Option<ConstraintId> {
        self.contact_set.and_then(|set| self.formulations[set].layout.meaning(row))
    }

    /// Forgets warm starts: the next step is as the first.
    pub fn forget(&mut self) {
        self.contact_set = None;
        self.report.active.clear();
        for formulation in &mut self.formulations {
            formulation.solver.forget();
        }
    }

    /// Computes accelerations, torques, contact wrenches and the state one period `dt_s` later.
    ///
    /// # Panics
    /// Sizes of the state are not those of the model.
    pub fn step(&mut self, state: &RobotState, reference: &WholeBodyReference, dt_s: f64) -> &StepReport {
        let started = self.now();
        whole_body_terms(&self.model, &mut self.workspace, &state.q, &state.v, &mut self.terms);
        let terms_done = self.now();
        let set = usize::from(reference.feet[0].in_contact) + 2 * usize::from(reference.feet[1].in_contact);
        self.prepare_guess(set);
        self.write_collisions(set, dt_s);
        let collision_done = self.now();
        self.write_constraints(set, state, reference, dt_s);
        self.write_objective(set, state, reference, dt_s);
        let assembled = self.now();
        self.report.relaxed.clear();
        self.report.contradiction.clear();
        self.report.iterations = 0;
        let status = fallback::solve(&mut self.formulations[set], &mut self.report);
        let solved = self.now();
        self.conclude(set, state, reference, dt_s, status);
        self.contact_set = Some(set);
        self.report.timings = Timings {
            terms_ns: terms_done - started,
            collision_ns: collision_done - terms_done,
            assembly_ns: assembled - collision_done,
            solve_ns: solved - assembled,
            output_ns: self.now() - solved,
        };
        &self.report
    }

    fn now(&self) -> u64 {
        self.clock.map_or(0, |clock| clock())
    }

    /// When the contacts have changed, what held before is the guess for the program of another size.
    fn prepare_guess(&mut self, set: usize) {
        if self.contact_set == Some(set) {
            return;
        }
        self.guess.clear();
        let layout = &self.formulations[set].layout;
        for active in &self.report.active {
            if let Some(row) = layout.row(active.id) {
                self.guess.push(Active { row, side: active.side });
            }
        }
        self.formulations[set].solver.guess(&self.guess);
    }

    fn write_collisions(&mut self, set: usize, dt_s: f64) {
        let Formulation { layout, problem, .. } = &mut self.formulations[set];
        let rows = problem.C.nrows();
        self.pairs.fill(&self.terms, dt_s, &mut self.pair_row, |pair, row| {
            let i = layout.collision(pair);
            let entries = problem.C.as_mut_slice()[i..].iter_mut().step_by(rows);
            match row {
                Some((gradient, lower)) => {
                    entries.zip(gradient.iter()).for_each(|(entry, g)| *entry = *g);
                    problem.l[i] = lower;
                }
                None => {
                    entries.take(layout.nv).for_each(|entry| *entry = 0.0);
                    problem.l[i] = f64::NEG_INFINITY;
                }
            }
        });
    }

    fn write_constraints(&mut self, set: usize, state: &RobotState, reference: &WholeBodyReference, dt_s: f64) {
        let formulation = &mut self.formulations[set];
        formulation.write_dynamics(&self.terms, &self.limits);
        let base = self.model.base_dofs();
        for (j, limits) in self.limits.iter().enumerate() {
            let (lower, upper) = limits.acceleration_bounds(state.q.joints[j], state.v[base + j], dt_s);
            formulation.problem.lb[base + j] = lower;
            formulation.problem.ub[base + j] = upper;
        }
        let settings = &self.settings.constraints;
        let stiffness = [settings.contact_position_stiffness, settings.contact_orientation_stiffness]
            .map(|kp| task::usable_stiffness(kp, dt_s));
        let weight_n = self.model.total_mass_kg() * self.model.gravity().norm();
        for foot in 0..2 {
            let target = &reference.feet[foot];
            self.report.contact_errors[foot] = ContactError::default();
            self.report.feet[foot] = FootForce::default();
            if !target.in_contact {
                continue;
            }
            let frame = &self.terms.frames[foot];
            let cones = &mut self.cones[foot];
            cones.place(&frame.placement);
            formulation.write_forces(foot, &self.foot_columns[foot], &frame.jacobian, cones);
            let error = task::pose_error(&target.ankle_pose, &frame.placement);
            let desired =
                task::desired_motion(frame, &error, &target.ankle_twist, &target.ankle_acceleration, stiffness);
            formulation.write_contact(foot, &self.foot_columns[foot], &frame.jacobian, &(desired - frame.drift));
            let load_max = (target.load_share + target.load_share.min(settings.load_margin)).max(0.0) * weight_n;
            formulation.problem.u[formulation.layout.load(foot)] = load_max;
            self.report.feet[foot].load_max_n = load_max;
            self.report.contact_errors[foot] = ContactError {
                position_m: error.fixed_rows::<3>(0).norm(),
                orientation_rad: error.fixed_rows::<3>(3).norm(),
            };
        }
    }

    fn write_objective(&mut self, set: usize, state: &RobotState, reference: &WholeBodyReference, dt_s: f64) {
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
        if let Some(weight) = tasks.torque_weight {
            add_torques(layout, problem, &self.terms, weight);
        }
        task::mirror(&mut problem.P);
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
        let desired = task::desired(&Vec3::zeros(), &-torso.velocity.angular, &error, stiffness);
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

        if let Some(gains) = tasks.angular_momentum {
            let first = rows.len();
            let rate = gains.stiffness.min(0.5 / dt_s);
            for axis in 3..6 {
                let target = -rate * terms.momentum[axis] - terms.centroidal_drift[axis];
                rows.push(&terms.centroidal_matrix, axis, target, gains.weight);
            }
            begin(TaskId::AngularMomentum, first, rows, &terms.momentum.as_slice()[3..], gains.weight);
        }
    }

    fn conclude(
        &mut self,
        set: usize,
        state: &RobotState,
        reference: &WholeBodyReference,
        dt_s: f64,
        status: StepStatus,
    ) {
        self.report.status = status;
        self.report.tasks.clear();
        self.report.active.clear();
        self.report.distance_min_m =
            self.pairs.proximities.iter().map(|near| near.distance).fold(f64::INFINITY, f64::min);
        if status == StepStatus::Held {
            fallback::hold(&self.limits, state, dt_s, &mut self.report);
        } else {
            self.read_solution(set);
            self.report_tasks(set, reference, state, dt_s);
        }
        // Constant accelerations over the period.
        let Self { report, increment, model, .. } = self;
        for ((dv, v), a) in increment.iter_mut().zip(state.v.iter()).zip(report.acceleration.iter()) {
            *dv = dt_s * (v + 0.5 * dt_s * a);
        }
        model.integrate(&state.q, increment, &mut report.q_next);
        for ((next, v), a) in report.v_next.iter_mut().zip(state.v.iter()).zip(report.acceleration.iter()) {
            *next = v + dt_s * a;
        }
    }

    /// Accelerations, torques, wrenches and active constraints from the solution.
    fn read_solution(&mut self, set: usize) {
        let Self { report, terms, cones, formulations, model, .. } = self;
        let Formulation { layout, problem, solver } = &formulations[set];
        let outcome = solver.outcome();
        let x = outcome.report.x.as_slice();
        report.acceleration.as_mut_slice().copy_from_slice(&x[..layout.nv]);
        // tau = M_a vd + h_a - J_aᵀ G f: the first rows of C.
        let base = model.base_dofs();
        let rows = problem.C.nrows();
        for (tau, h) in report.torques.iter_mut().zip(terms.bias.as_slice()[base..].iter()) {
            *tau = *h;
        }
        for (column, x) in problem.C.as_slice().chunks_exact(rows).zip(x) {
            for (tau, c) in report.torques.iter_mut().zip(column) {
                *tau += c * x;
            }
        }
        for foot in layout.standing() {
            let first = layout.force(foot);
            report.feet[foot].wrench = cones[foot].wrench(&x[first..first + layout.intensities]);
        }
        for active in &outcome.active {
            if let Some(id) = layout.meaning(active.row) {
                let multiplier = match active.row {
                    Row::Equality(i) => outcome.report.y_eq[i],
                    Row::Inequality(i) => outcome.report.y_in[i],
                    Row::Bound(i) => outcome.report.y_bound[i],
                };
                report.active.push(ActiveConstraint { id, side: active.side, multiplier });
            }
        }
    }

    /// Error and cost of every objective; together the costs are twice the program's objective up to its constant.
    fn report_tasks(&mut self, set: usize, reference: &WholeBodyReference, state: &RobotState, dt_s: f64) {
        let Self { report, motion_rows, motion_tasks, force_rows, posture, settings, formulations, terms, .. } = self;
        let layout = &formulations[set].layout;
        let x = formulations[set].solver.outcome().report.x.as_slice();
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
        if let Some(weight) = tasks.torque_weight {
            let cost = weight * report.torques.norm_squared();
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

fn joint_limits(model: &Model, settings: &WholeBodySettings) -> Vec<JointLimits> {
    let constraints = &settings.constraints;
    model
        .joints()
        .iter()
        .map(|joint| {
            let limits = joint.limits;
            let margin = constraints.position_margin_rad.min(0.25 * (limits.upper - limits.lower));
            JointLimits {
                lower: limits.lower + margin,
                upper: limits.upper - margin,
                velocity: constraints.velocity_fraction * limits.velocity,
                torque: constraints.torque_fraction * limits.effort,
                braking: constraints.braking_rad_per_s2,
                acceleration: constraints.acceleration_max_rad_per_s2,
            }
        })
        .collect()
}

fn resolve_pairs(settings: &WholeBodySettings) -> Result<Vec<[usize; 2]>, WholeBodyError> {
    let position = |name: &String| {
        settings
            .collision
            .capsules
            .iter()
            .position(|capsule| capsule.name == *name)
            .ok_or_else(|| WholeBodyError::UnknownCapsule { name: name.clone() })
    };
    settings.collision.pairs.iter().map(|[a, b]| Ok([position(a)?, position(b)?])).collect()
}

/// Settings that the equations cannot take.
fn check(settings: &WholeBodySettings) -> Result<(), WholeBodyError> {
    let positive = |setting: &'static str, found: f64| {
        if found > 0.0 && found.is_finite() {
            Ok(())
        } else {
            Err(WholeBodyError::Setting { setting, found, expected: "positive and finite" })
        }
    };
    let (tasks, constraints, collision) = (&settings.tasks, &settings.constraints, &settings.collision);
    for (setting, gains) in [
        ("tasks.com", tasks.com),
        ("tasks.torso", tasks.torso),
        ("tasks.posture", tasks.posture),
        ("tasks.leg_posture", tasks.leg_posture),
        ("tasks.swing_position", tasks.swing_position),
        ("tasks.swing_orientation", tasks.swing_orientation),
    ] {
        positive(setting, gains.weight)?;
        positive(setting, gains.stiffness)?;
    }
    positive("tasks.com_height_factor", tasks.com_height_factor)?;
    positive("tasks.wrench_lever_m", tasks.wrench_lever_m)?;
    positive("tasks.intensity_damping", tasks.intensity_damping)?;
    positive("sole.length_m", settings.sole.length_m)?;
    positive("sole.width_m", settings.sole.width_m)?;
    positive("constraints.friction", constraints.friction)?;
    positive("constraints.torque_fraction", constraints.torque_fraction)?;
    positive("constraints.velocity_fraction", constraints.velocity_fraction)?;
    positive("constraints.braking_rad_per_s2", constraints.braking_rad_per_s2)?;
    positive("constraints.acceleration_max_rad_per_s2", constraints.acceleration_max_rad_per_s2)?;
    positive("collision.damping_m_per_s", collision.damping_m_per_s)?;
    positive("collision.interaction_m - collision.safety_m", collision.interaction_m - collision.safety_m)?;
    if constraints.generators_per_point < 3 {
        return Err(WholeBodyError::Setting {
            setting: "constraints.generators_per_point",
            found: constraints.generators_per_point as f64,
            expected: "at least 3",
        });
    }
    Ok(())
}
