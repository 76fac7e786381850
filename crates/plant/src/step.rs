//! One integration step: implicit Euler in the stiff forces, exact momentum balance.
//!
//! With `M(q)` the mass matrix (rotor inertia included), `h(q, v)` the bias forces, `tau` the drives, `F` the wrench of the
//! ground on each sole and `J` the sole frames' Jacobians, the step solves for `v1`
//!
//! ```text
//! M(q0) (v1 - v0) = dt ( tau(q1, v1) - h(q0, v0) + sum J(q0)^T F(X_WS(q1)) + pushes ),    q1 = q0 (+) dt v1
//! ```
//!
//! by Newton's method with the matrix `M + dt D - dt^2 J^T T J`: `D` the drives' derivative, `T` the sole's tangent stiffness
//! (negative definite in the main) from the contact solver, at frozen node states. From `v1 = v0` the contact is
//! evaluated at the *predicted* pose, and one Newton step from there is the linearly-implicit Euler method. Stopping there would leave
//! the wrench that acted different from the wrench of the contact law at the pose that is then accepted; iterating until no
//! generalised force is off by more than a tolerance removes that difference, for one or two further contact evaluations in
//! the steps where nodes land, lift or slip. A saturated drive has derivative zero: the next iteration re-solves without its
//! stiffness. The history of the soles is committed once, at the end.
//!
//! **Work.** Matrix and tangents change little from step to step while no node and no drive changes its state. So the factors are used
//! again, in this step and the next ones, as long as each use makes the residual ten times smaller; and where the last step met no such
//! change, the first iterate is `v0` with its last change once more. What is accepted is judged by the same residual.
//!
//! **Momentum.** `h(q0, v0)` is explicit, so the total momentum would drift by terms of order dt. The total momentum of a
//! floating system is known exactly, however: it changes by the impulse of the external forces. So after the step the base's
//! twist is set to the one that gives momentum and angular momentum about the centre of mass
//!
//! ```text
//! p1 = p0 + dt (m g + sum F + pushes),     L1 = L0 + dt sum ( (r - c0) x F + moments )
//! ```
//!
//! The base rows of `M(q1) v1` are the total momentum, and `M(q1)` is needed by the next step anyway, so this costs a 6 x 6 solve. The
//! correction is of the order of the method's own error (the tests show first order with it), the balance exact to rounding.
//!
//! **Substeps.** Contact work is counted with the force at the end of a step, which differs from the force on the way: by
//! `1/2 (F1 - F0) . dx` to leading order. That is what the integrator takes where a foot lands fast. A step in which it is more than
//! [`StepSettings::work_error_max_j`] is not accepted but taken anew with half its length, down to a sixteenth; steps grow again once it
//! is less than a sixteenth of that. Walking has no such steps.
//!
//! **Why first order.** The contact law has jumps in its derivatives, where higher orders are lost; implicit Euler damps what it cannot
//! resolve instead of ringing. Its numerical damping ratio for a mode of frequency `w` is about `w dt / 2`: 0.07 for the vertical mode
//! on one sole (150 rad/s at 1 ms), against about 1.5 from the sole's own viscosity; 0.002 for the slow roll mode (4 rad/s).
//! The [energies](crate::energy) name what the integrator itself dissipates.

use multibody::{Configuration, FrameIndex, Model, Workspace, bias_forces, crba, forward_kinematics};
use nalgebra::{DMatrix, DVector};
use sole::Ground;
use spatial::{Mat3, Mat6, Transform, Vec3, Vec6, Wrench, so3};

use crate::energy::EnergyFlows;
use crate::foot::Foot;
use crate::linear::{Factors, Singular};
use crate::servo::{DriveState, DriveTorque, Servo};
use crate::settings::StepSettings;

/// Where the robot is and how it moves.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Configuration.
    pub q: Configuration,
    /// Base twist (base frame) and joint rates.
    pub v: DVector<f64>,
}

/// A force on a frame during one step, world axes, mean over the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AppliedForce {
    pub frame: FrameIndex,
    pub force: Vec3,
}

/// How a step went.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepReport {
    /// Newton steps.
    pub newton_steps: usize,
    /// Largest generalised force left unbalanced (N, N m).
    pub residual_n: f64,
    /// The residual is within tolerance.
    pub converged: bool,
    /// Both contact problems were solved at the accepted pose.
    pub contacts_converged: bool,
    /// Drives at their torque limit.
    pub saturated_drives: usize,
    /// The Newton matrix had no inverse; the step was taken without contact stiffness.
    pub singular: bool,
    /// Error of the contact's work (J), see the module.
    pub work_error_j: f64,
    /// Not taken: that error is larger than wished for, and a shorter step can be tried.
    pub rejected: bool,
}

/// Total momentum: linear, angular about the centre of mass, world axes; and the centre of mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Momentum {
    pub linear: Vec3,
    pub angular: Vec3,
    pub com: Vec3,
}

/// What a matrix of the Newton iteration holds for: labels of the feet's tangents, drives at their limits (a hash), step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Label {
    feet: [u64; 2],
    saturated: u64,
    step_s: f64,
}

/// Factors are used again while each use makes the residual this many times smaller.
const SAME_FACTORS: f64 = 0.1;

/// Memory of the integrator.
pub(crate) struct Stepper {
    settings: StepSettings,
    sole_frames: [FrameIndex; 2],
    ws: Workspace,
    M: DMatrix<f64>,
    bias: DVector<f64>,
    J: [DMatrix<f64>; 2],
    J_applied: DMatrix<f64>,
    TJ: DMatrix<f64>,
    factors: Factors,
    /// What the factors hold for.
    factored: Option<Label>,
    applied: DVector<f64>,
    residual: DVector<f64>,
    v1: DVector<f64>,
    dv: DVector<f64>,
    step_v: DVector<f64>,
    /// Change of the velocity in the last step, and whether the next may be expected to be alike.
    last_dv: DVector<f64>,
    steady: Option<Label>,
    q1: Configuration,
    drives: Vec<DriveTorque>,
    damping: DVector<f64>,
    slip_work_j: f64,
    /// Origins of the sole frames and points of the applied forces at the beginning of the step, world axes.
    soles_before: [Vec3; 2],
    pushed_before: Vec<Vec3>,
    /// Wrenches of the ground about the sole frames' origins, world axes, at the beginning of the step.
    wrenches_before: [Wrench; 2],
    /// The same at the accepted pose.
    pub wrenches: [Wrench; 2],
}

/// What does not change during a step.
pub(crate) struct Scene<'a> {
    pub model: &'a Model,
    pub servo: &'a Servo,
    pub ground: &'a dyn Ground,
    pub applied: &'a [AppliedForce],
}

/// Where the step lies in the control period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepTime {
    pub step_s: f64,
    pub period_s: f64,
    /// Share of the period that has passed at the end of the step.
    pub share_at_end: f64,
    /// The step is taken whatever its error.
    pub last_resort: bool,
}

impl Stepper {
    /// At most `pushes_max` forces are applied in a step.
    pub fn new(model: &Model, settings: StepSettings, sole_frames: [FrameIndex; 2], pushes_max: usize) -> Self {
        let nv = model.nv();
        let zero = DVector::zeros(nv);
        Self {
            settings,
            sole_frames,
            ws: Workspace::new(model),
            M: DMatrix::zeros(nv, nv),
            bias: zero.clone(),
            J: [DMatrix::zeros(6, nv), DMatrix::zeros(6, nv)],
            J_applied: DMatrix::zeros(6, nv),
            TJ: DMatrix::zeros(6, nv),
            factors: Factors::new(nv),
            factored: None,
            applied: zero.clone(),
            residual: zero.clone(),
            v1: zero.clone(),
            dv: zero.clone(),
            step_v: zero.clone(),
            last_dv: zero.clone(),
            steady: None,
            q1: model.neutral(),
            drives: vec![DriveTorque::default(); model.joint_count()],
            damping: zero,
            slip_work_j: 0.0,
            soles_before: [Vec3::zeros(); 2],
            pushed_before: Vec::with_capacity(pushes_max),
            wrenches_before: [Wrench::zero(); 2],
            wrenches: [Wrench::zero(); 2],
        }
    }

    /// To be called when the state was set from outside.
    pub fn place(&mut self, model: &Model, state: &State, wrenches: [Wrench; 2]) {
        crba(model, &mut self.ws, &state.q, &mut self.M);
        self.wrenches = wrenches;
        self.drives.fill(DriveTorque::default());
        self.factored = None;
        self.steady = None;
    }

    /// Mass matrix at the present state.
    pub fn mass_matrix(&self) -> &DMatrix<f64> {
        &self.M
    }

    /// Torques of the drives at the present state.
    pub fn drives(&self) -> &[DriveTorque] {
        &self.drives
    }

    pub fn momentum(&self, state: &State) -> Momentum {
        momentum(&self.M, state)
    }

    /// Advances `state` by one step, or leaves it as it was if the step is rejected.
    pub fn step(
        &mut self,
        scene: &Scene<'_>,
        state: &mut State,
        feet: &mut [Foot; 2],
        time: StepTime,
        flows: &mut EnergyFlows,
    ) -> StepReport {
        let before = self.momentum(state);
        self.wrenches_before = self.wrenches;
        self.prepare(scene, state);

        // Newton on the velocity at the end of the step.
        let dt = time.step_s;
        self.v1.copy_from(&state.v);
        let at_start = self.label(feet, dt);
        if self.steady == Some(at_start) {
            self.v1 += &self.last_dv;
        }
        let mut report = StepReport::default();
        let mut before_n = f64::INFINITY;
        loop {
            self.evaluate(scene, state, feet, time, &mut report);
            report.converged = report.residual_n <= self.settings.force_tolerance_n;
            if report.converged || report.newton_steps == self.settings.newton_steps_max {
                break;
            }
            let label = self.label(feet, dt);
            let serve = report.newton_steps == 0 || report.residual_n < SAME_FACTORS * before_n;
            before_n = report.residual_n;
            if !(serve && self.factored == Some(label)) {
                self.factored = self.factorise(feet, dt).ok().map(|()| label);
            }
            if self.factored.is_some() {
                self.factors.solve(&mut self.residual);
                self.v1 -= &self.residual;
            } else {
                report.singular = true;
            }
            report.newton_steps += 1;
        }
        report.work_error_j = self.work_error_j();
        report.rejected = !time.last_resort && report.work_error_j > self.settings.work_error_max_j;
        if report.rejected {
            self.wrenches = self.wrenches_before;
            self.steady = None;
            return report;
        }
        for foot in feet.iter_mut() {
            foot.commit();
        }

        self.balance_momentum(scene, &before, dt);
        self.account(scene, flows);
        self.last_dv.copy_from(&self.v1);
        self.last_dv -= &state.v;
        let at_end = self.label(feet, dt);
        self.steady = (report.converged && at_end == at_start).then_some(at_end);
        std::mem::swap(&mut state.q, &mut self.q1);
        state.v.copy_from(&self.v1);
        report.saturated_drives = self.drives.iter().filter(|drive| drive.saturated).count();
        report
    }

    /// `1/2 |(F1 - F0) . dx|` of both feet (J).
    fn work_error_j(&self) -> f64 {
        let of_foot = |i: usize| {
            let change = self.wrenches[i].to_vector() - self.wrenches_before[i].to_vector();
            let J = &self.J[i];
            let along = |row: usize| J.row(row).iter().zip(self.step_v.iter()).map(|(j, v)| j * v).sum::<f64>();
            0.5 * (0..6).map(|row| change[row] * along(row)).sum::<f64>().abs()
        };
        of_foot(0) + of_foot(1)
    }

    /// What a matrix made now would hold for.
    fn label(&self, feet: &[Foot; 2], step_s: f64) -> Label {
        // Order matters and a handful of joints is enough: Horner's rule with an odd factor.
        let saturated =
            self.drives.iter().fold(1_u64, |hash, drive| hash.wrapping_mul(3).wrapping_add(u64::from(drive.saturated)));
        Label { feet: [feet[0].tangent_label(), feet[1].tangent_label()], saturated, step_s }
    }

    /// Everything that stays during the Newton steps: bias forces, Jacobians, applied forces.
    fn prepare(&mut self, scene: &Scene<'_>, state: &State) {
        let model = scene.model;
        bias_forces(model, &mut self.ws, &state.q, &state.v, &mut self.bias);
        let mut placed = forward_kinematics(model, &mut self.ws, &state.q);
        for (i, frame) in self.sole_frames.into_iter().enumerate() {
            placed.jacobian(frame, &mut self.J[i]);
            self.soles_before[i] = placed.pose(frame).translation;
        }
        self.applied.fill(0.0);
        self.pushed_before.clear();
        for push in scene.applied {
            placed.jacobian(push.frame, &mut self.J_applied);
            self.pushed_before.push(placed.pose(push.frame).translation);
            self.applied.gemv_tr(1.0, &self.J_applied.rows(0, 3), &push.force, 1.0);
        }
    }

    /// Forces and residual (as an impulse) at the present `v1`.
    fn evaluate(
        &mut self,
        scene: &Scene<'_>,
        state: &State,
        feet: &mut [Foot; 2],
        time: StepTime,
        report: &mut StepReport,
    ) {
        let model = scene.model;
        let dt = time.step_s;
        let base_dofs = model.base_dofs();
        self.step_v.copy_from(&self.v1);
        self.step_v *= dt;
        model.integrate(&state.q, &self.step_v, &mut self.q1);
        let placed = forward_kinematics(model, &mut self.ws, &self.q1);
        let soles = self.sole_frames.map(|frame| placed.pose(frame));

        // residual = M (v1 - v0) - dt (tau - h + J^T F + applied)
        self.dv.copy_from(&self.v1);
        self.dv -= &state.v;
        self.residual.gemv(1.0, &self.M, &self.dv, 0.0);
        self.residual.axpy(dt, &self.bias, 1.0);
        self.residual.axpy(-dt, &self.applied, 1.0);
        for i in 0..model.joint_count() {
            let end = DriveState {
                share: time.share_at_end,
                period_s: time.period_s,
                step_s: dt,
                position: self.q1.joints[i],
                rate: self.v1[base_dofs + i],
            };
            let drive = scene.servo.torque(i, &end);
            self.residual[base_dofs + i] -= dt * (drive.motor_nm + drive.friction_nm);
            self.damping[base_dofs + i] = -drive.derivative;
            self.drives[i] = drive;
        }
        report.contacts_converged = true;
        self.slip_work_j = 0.0;
        for (i, foot) in feet.iter_mut().enumerate() {
            let contact = foot.evaluate(&soles[i], scene.ground, dt);
            report.contacts_converged &= contact.converged;
            self.slip_work_j += contact.slip_work_j;
            self.wrenches[i] = contact.wrench;
            self.residual.gemv_tr(-dt, &self.J[i], &contact.wrench.to_vector(), 1.0);
        }
        report.residual_n = self.residual.amax() / dt;
    }

    /// Factors of `M + dt D - dt^2 J^T T J` at the present `v1`.
    fn factorise(&mut self, feet: &mut [Foot; 2], dt: f64) -> Result<(), Singular> {
        let A = self.factors.matrix_mut();
        A.copy_from(&self.M);
        for i in 0..self.damping.len() {
            A[(i, i)] += dt * self.damping[i];
        }
        for (J, foot) in self.J.iter().zip(feet) {
            let tangent = foot.tangent();
            if tangent != Mat6::zeros() {
                self.TJ.gemm(1.0, &tangent, J, 0.0);
                A.gemm_tr(-dt * dt, J, &self.TJ, 1.0);
            }
        }
        self.factors.factorise()
    }

    /// Sets the base's twist so that the total momentum has changed by exactly the impulse of the external forces.
    fn balance_momentum(&mut self, scene: &Scene<'_>, before: &Momentum, dt: f64) {
        let model = scene.model;
        if model.base_dofs() != 6 {
            crba(model, &mut self.ws, &self.q1, &mut self.M);
            return;
        }
        let mass = self.M[(0, 0)];
        let mut force = mass * model.gravity();
        let mut moment = Vec3::zeros();
        // The balance about the old centre of mass uses the points of the beginning, as the equation of motion does.
        for (wrench, point) in self.wrenches.iter().zip(&self.soles_before) {
            let arm = point - before.com;
            force += wrench.force;
            moment += wrench.moment + arm.cross(&wrench.force);
        }
        for (push, point) in scene.applied.iter().zip(&self.pushed_before) {
            let arm = point - before.com;
            force += push.force;
            moment += arm.cross(&push.force);
        }
        crba(model, &mut self.ws, &self.q1, &mut self.M);
        let wanted = (before.linear + dt * force, before.angular + dt * moment);

        // In base coordinates, about the base's origin: p_B and L_B = R^T L + c x p.
        let R = &self.q1.base.rotation;
        let com_B = com_in_base(&self.M);
        let p_B = R.tr_mul(&wanted.0);
        let L_B = R.tr_mul(&wanted.1) + com_B.cross(&p_B);
        let is = base_momentum(&self.M, &self.v1);
        let missing = Vec6::new(p_B.x, p_B.y, p_B.z, L_B.x, L_B.y, L_B.z) - is;
        let locked: Mat6 = self.M.fixed_view::<6, 6>(0, 0).into_owned();
        let correction =
            locked.cholesky().expect("the inertia of the whole robot is positive definite").solve(&missing);
        let mut base = self.v1.fixed_rows_mut::<6>(0);
        base += correction;
    }

    /// Work of the step's forces over the step's displacement `dt v1`.
    fn account(&self, scene: &Scene<'_>, flows: &mut EnergyFlows) {
        let base_dofs = scene.model.base_dofs();
        for (i, drive) in self.drives.iter().enumerate() {
            let angle = self.step_v[base_dofs + i];
            flows.servo_j += drive.motor_nm * angle;
            flows.joint_friction_j += drive.friction_nm * angle;
        }
        for (J, wrench) in self.J.iter().zip(&self.wrenches) {
            flows.contact_j += wrench.to_vector().dot(&(J * &self.step_v));
        }
        flows.slip_j -= self.slip_work_j;
        if !scene.applied.is_empty() {
            flows.push_j += self.applied.dot(&self.step_v);
        }
    }
}

/// Momentum about the base's origin in base axes: the base rows of `M v`.
fn base_momentum(M: &DMatrix<f64>, v: &DVector<f64>) -> Vec6 {
    Vec6::from_fn(|row, _| M.row(row).iter().zip(v.iter()).map(|(m, v)| m * v).sum())
}

/// Centre of mass in the base frame: the base block of the mass matrix holds `m skew(c)`.
pub(crate) fn com_in_base(M: &DMatrix<f64>) -> Vec3 {
    let first_moment: Mat3 = M.fixed_view::<3, 3>(3, 0).into_owned();
    so3::vee(&first_moment) / M[(0, 0)]
}

fn momentum(M: &DMatrix<f64>, state: &State) -> Momentum {
    let X_WB: &Transform = &state.q.base;
    let b = base_momentum(M, &state.v);
    let (p_B, L_B): (Vec3, Vec3) = (b.fixed_rows::<3>(0).into(), b.fixed_rows::<3>(3).into());
    let com_B = com_in_base(M);
    Momentum {
        linear: X_WB.rotation * p_B,
        angular: X_WB.rotation * (L_B - com_B.cross(&p_B)),
        com: X_WB.point(&com_B),
    }
}

#[cfg(test)]
mod tests;
