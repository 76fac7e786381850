//! One control step.

mod fit;
mod objective;
mod validate;

use crate::collision::{Body, FrameList, Pairs};
use crate::constraint::friction::FrictionCones;
use crate::constraint::limits::JointLimits;
use crate::error::WholeBodyError;
use crate::fallback;
use crate::formulation::Formulation;
use crate::layout::{ConstraintId, Layout};
use crate::reference::{RobotState, WholeBodyReference};
use crate::report::{ActiveConstraint, AnsweredBy, ContactError, FootForce, StepReport, StepStatus, Timings};
use crate::settings::WholeBodySettings;
use crate::task::{self, NormalEquations};
use multibody::{Base, Model, WholeBodyTerms, Workspace, whole_body_terms};
use nalgebra::{DVector, RowDVector};
use qp::dense::{Active, Problem, Side};
use qp::{Residuals, Row, Status};
use spatial::{Transform, Vec6};

/// Positions in the list of frames that a step computes.
const TORSO: usize = 2;

/// Nanoseconds of some clock, handed in by the process: libraries know none.
pub type Clock = fn() -> u64;

/// The whole-body controller. Everything is allocated here; a step that the active set answers allocates nothing.
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
    motion_tasks: Vec<objective::TaskRows>,
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
        validate::check(&settings)?;
        let mut frames = FrameList::default();
        let ankles = [model.frame(&settings.feet[0].ankle_link)?, model.frame(&settings.feet[1].ankle_link)?];
        frames.0.extend(ankles);
        frames.0.push(model.frame(&settings.torso_link)?);
        let mut bodies = Vec::new();
        let capsules = if settings.collision.on { settings.collision.capsules.as_slice() } else { &[] };
        for capsule in capsules {
            let slot = frames.slot(model.frame(&capsule.link)?);
            bodies.push(Body { slot, from: capsule.from_m, to: capsule.to_m, radius: capsule.radius_m });
        }
        let pairs = fit::resolve_pairs(&settings)?;
        let pairs = Pairs::new(&settings.collision, bodies, pairs);

        let (nv, joints) = (model.nv(), model.joint_count());
        let foot_columns = ankles.map(|ankle| {
            let moving = (0..joints).filter(|j| model.moves(multibody::JointIndex(*j), ankle)).map(|j| nv - joints + j);
            (0..nv - joints).chain(moving).collect::<Vec<_>>()
        });
        let limits = fit::joint_limits(&model, &settings);
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
                settings.friction(),
                constraints.generators_per_point,
            )
        });
        let intensities = cones[0].len();
        let formulations = [[false, false], [true, false], [false, true], [true, true]].map(|contacts| {
            let layout = Layout { nv, joints, pairs: pairs.len(), contacts, intensities };
            Formulation::new(layout, &settings)
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
            answered_by: AnsweredBy::default(),
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

    /// Limits of the joints, in the model's order.
    #[must_use]
    pub fn joint_limits(&self) -> &[JointLimits] {
        &self.limits
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
            formulation.solvers.forget();
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
        let relaxation = &self.settings.relaxation;
        let status = fallback::solve(&mut self.formulations[set], &self.limits, relaxation, &mut self.report);
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

    /// When the contacts have changed, what held before is the guess for the program of another size; and a foot that has just
    /// come carries nothing yet.
    fn prepare_guess(&mut self, set: usize) {
        if self.contact_set == Some(set) {
            return;
        }
        self.guess.clear();
        let layout = &self.formulations[set].layout;
        let stood = self.contact_set.map_or([true; 2], |before| self.formulations[before].layout.contacts);
        for foot in layout.standing().filter(|foot| !stood[*foot]) {
            let rows = (0..layout.intensities).filter_map(|index| layout.row(ConstraintId::Intensity { foot, index }));
            self.guess.extend(rows.map(|row| Active { row, side: Side::Lower }));
        }
        for active in &self.report.active {
            if let Some(row) = layout.row(active.id) {
                self.guess.push(Active { row, side: active.side });
            }
        }
        self.formulations[set].solvers.guess(&self.guess);
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
        let stiffness = [settings.contact_position_stiffness_per_s2, settings.contact_orientation_stiffness_per_s2]
            .map(|kp| task::usable_stiffness(kp, dt_s));
        let weight_n = self.model.total_mass_kg() * self.model.gravity().norm();
        for foot in 0..2 {
            let target = &reference.feet[foot];
            self.report.contact_errors[foot] = ContactError::default();
            if !target.in_contact {
                self.report.feet[foot] = FootForce::default();
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
            if !is_finite(state) {
                // Nothing can be said about the state that follows: the last one stands, at rest.
                self.report.acceleration.fill(0.0);
                self.report.v_next.fill(0.0);
                return;
            }
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
        let Self { report, terms, cones, formulations, model, limits, .. } = self;
        let Formulation { layout, problem, solvers } = &formulations[set];
        let outcome = solvers.outcome();
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
        // Rows hold to rounding, or to an interior point's tolerance; what is sent holds.
        for (tau, limits) in report.torques.iter_mut().zip(limits) {
            *tau = tau.clamp(-limits.motor_torque, limits.motor_torque);
        }
        for foot in layout.standing() {
            let first = layout.force(foot);
            let intensities = &x[first..first + layout.intensities];
            report.feet[foot].wrench = cones[foot].wrench(intensities);
            report.feet[foot].corners = cones[foot].corner_forces(intensities);
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
}

fn is_finite(state: &RobotState) -> bool {
    let Transform { rotation, translation } = &state.q.base;
    let base = rotation.iter().chain(translation.iter());
    base.chain(state.q.joints.iter()).chain(state.v.iter()).all(|x| x.is_finite())
}
