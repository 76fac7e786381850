//! The process: messages in, messages out.

use messages::code::{Limit, Mode, Outcome, Reason};
use messages::{
    CONTROL_PERIOD_S, Header, MAX_JOINTS, OwnSoles, PatternHeader, PatternPhase, PatternRefused, Plain, RobotCommand,
    RobotState as StateMessage, SoleDeformation, WalkStart, read_pattern,
};
use multibody::{Configuration, FrameIndex, Workspace, forward_kinematics};
use nalgebra::DVector;
use pattern::WalkPattern;
use robot::{JointMap, Robot};
use robot_model::{RobotModelError, walking_model};
use wholebody::{
    AnsweredBy, ConfigurationError, ConfigurationTargets, ConstraintId, Relaxation, RelaxationSettings, RobotState,
    StateIntegrator, StepReport, StepStatus, WholeBody, initial_configuration,
};

use crate::convert::{plan, reference, unit_rotation, vertical_forces};
use crate::feedback::{Feedback, Refused};
use crate::integration::{IntegrationMode, IntegrationSettings};
use crate::settings::{ControllerError, ControllerSettings};
use crate::settle::{NotSettled, SettleDetector, Stance};

/// A deformation older than this is not used (ticks).
const DEFORMATION_AGE_MAX_TICKS: i64 = 2;
/// Steps without a usable solution in a row after which the posture is held for good.
const HELD_IN_A_ROW_MAX: u32 = 10;

/// The walk cannot be walked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CannotWalk {
    /// There is no configuration in which it begins.
    #[error("start configuration: {0}")]
    StartConfiguration(#[from] ConfigurationError),
    /// The robot does not stand still.
    #[error(transparent)]
    NotSettled(#[from] NotSettled),
}

impl CannotWalk {
    /// What health says.
    #[must_use]
    pub fn reason(&self) -> Reason {
        match self {
            Self::StartConfiguration(_) => Reason::Infeasible,
            Self::NotSettled(_) => Reason::NotSettled,
        }
    }
}

/// What one tick says.
#[derive(Debug, Clone)]
pub struct ControllerOutput {
    /// For the robot.
    pub command: RobotCommand,
    /// Time zero, at the tick at which it is decided.
    pub start: Option<WalkStart>,
    /// For health.
    pub summary: Summary,
}

/// A limit that gave way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaveWay {
    /// Which kind.
    pub limit: Limit,
    /// Which of its kind: foot, joint of the model, collision pair.
    pub index: usize,
    /// By how much, in its unit.
    pub amount: f64,
    /// Position of its kind in the configured order of giving way.
    pub rank: usize,
}

impl GaveWay {
    fn new(relaxed: &Relaxation, order: &RelaxationSettings) -> Self {
        let (limit, index) = match relaxed.id {
            ConstraintId::Load { foot } => (Limit::Load, foot),
            ConstraintId::Collision(pair) => (Limit::Collision, pair),
            ConstraintId::JointMotion(joint) => (Limit::JointMotion, joint),
            ConstraintId::Torque(joint) => (Limit::Torque, joint),
            ConstraintId::Contact { foot, .. } => (Limit::Contact, foot),
            // Physics never gives way.
            ConstraintId::BaseDynamics(_) | ConstraintId::Intensity { .. } => (Limit::None, 0),
        };
        let rank = relaxed.id.limit().and_then(|limit| order.rank(limit)).unwrap_or(0);
        Self { limit, index, amount: relaxed.amount, rank }
    }

    /// A limit that gives way later is worse, and of one kind the larger amount.
    fn is_worse_than(&self, other: &Self) -> bool {
        (self.rank, self.amount) > (other.rank, other.amount)
    }
}

/// Counts and figures for health.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Summary {
    /// Steps in which all limits held, so far.
    pub solved: u64,
    /// The worst limit that gave way, so far.
    pub worst: Option<GaveWay>,
    /// Why the posture is held now, if it is.
    pub holding: Option<Reason>,
    /// Steps whose limits had to be widened, so far.
    pub relaxed: u64,
    /// Steps without a usable solution, so far.
    pub held: u64,
    /// Steps that the backup solver answered, for the first had no answer; so far.
    pub by_backup: u64,
    /// Ticks whose deformation was missing or older than allowed, so far.
    pub deformation_missing: u64,
    /// Ticks whose robot state had a number that is not finite, so far.
    pub state_refused: u64,
    /// Largest distance between a measured joint and its reference now (rad).
    pub joint_distance_rad: f64,
    /// Distance of the model's centre of mass from its reference now (m).
    pub com_error_m: f64,
    /// Distance of the observed base from the own one at the last measurement used (m); feedback only.
    pub base_distance_m: f64,
    /// The same of its orientation (rad).
    pub base_distance_rad: f64,
    /// Distance between where the two standing feet place the base now (m); feedback only.
    pub feet_disagreement_m: f64,
    /// Measurements that were not used for feedback, so far.
    pub measurements_refused: u64,
    /// Why the last one of them was not.
    pub last_refused: Option<Refused>,
    /// Smallest distance of a collision pair now (m).
    pub collision_distance_m: f64,
}

/// The controller without clock or bus.
pub struct ControllerProcess {
    robot_fingerprint: u64,
    joints: JointMap,
    whole_body: WholeBody,
    workspace: Workspace,
    ankles: [FrameIndex; 2],
    torso: FrameIndex,
    imu: FrameIndex,
    half_sitting: DVector<f64>,
    limit_margin_rad: f64,
    own_soles: OwnSoles,
    pattern: Option<(u64, WalkPattern)>,
    start: Option<WalkStart>,
    settle: SettleDetector,
    state: Option<StateIntegrator>,
    integration: IntegrationSettings,
    feedback: Option<Feedback>,
    measured: Configuration,
    deformation: Option<SoleDeformation>,
    last_command: Option<RobotCommand>,
    held_in_a_row: u32,
    summary: Summary,
}

impl ControllerProcess {
    /// Builds the model and allocates everything.
    ///
    /// # Errors
    /// [`ControllerError`] names file, field and value.
    pub fn new(settings: &ControllerSettings) -> Result<Self, ControllerError> {
        settings.check()?;
        let robot = Robot::load_on(&settings.robot, settings.sole_file.as_deref())?;
        let (model, joints) = walking_model(&robot)?;
        let whole_body_settings = settings.whole_body(&robot, &model)?;
        if joints.interface_count() > MAX_JOINTS {
            let file = robot.folder.join("robot.toml");
            return Err(ControllerError::TooManyJoints { file, found: joints.interface_count() });
        }
        let frame = |name: &str| model.frame(name).map_err(|source| RobotModelError::unknown(&robot, source));
        let feet = &robot.description.feet;
        let ankles = [frame(&feet[0].ankle_frame)?, frame(&feet[1].ankle_frame)?];
        let torso = frame(&robot.description.torso_link)?;
        let imu = frame(&robot.description.imu_frame)?;
        let mut half_sitting = DVector::zeros(model.joint_count());
        joints.from_interface(joints.resting_rad(), half_sitting.as_mut_slice());
        let measured = model.neutral();
        let ankle_links = [feet[0].ankle_frame.clone(), feet[1].ankle_frame.clone()];
        let feedback = (settings.integration.mode == IntegrationMode::Feedback)
            .then(|| Feedback::new(&settings.integration, &model, &robot.description.imu_frame, ankle_links))
            .transpose()
            .map_err(|source| RobotModelError::unknown(&robot, source))?;
        Ok(Self {
            robot_fingerprint: robot.fingerprint,
            joints,
            workspace: Workspace::new(&model),
            ankles,
            torso,
            imu,
            half_sitting,
            limit_margin_rad: whole_body_settings.constraints.position_margin_rad,
            whole_body: WholeBody::new(model, whole_body_settings)?,
            own_soles: OwnSoles {
                ankle_in_sole_m: [0, 1].map(|foot| robot.sole.foot.ankle_in_sole_m(foot)),
                file: robot.sole_file.clone(),
            },
            pattern: None,
            start: None,
            settle: SettleDetector::new(settings.settle, CONTROL_PERIOD_S),
            integration: settings.integration,
            feedback,
            state: None,
            measured,
            deformation: None,
            last_command: None,
            held_in_a_row: 0,
            summary: Summary::default(),
        })
    }

    /// The robot it was built for: messages of another one must not be used.
    #[must_use]
    pub fn robot_fingerprint(&self) -> u64 {
        self.robot_fingerprint
    }

    /// The whole-body step, with the report of the last tick.
    #[must_use]
    pub fn whole_body(&self) -> &WholeBody {
        &self.whole_body
    }

    /// The whole-body step, to give it a clock.
    pub fn whole_body_mut(&mut self) -> &mut WholeBody {
        &mut self.whole_body
    }

    /// Counts and figures so far, as after the last step.
    #[must_use]
    pub fn summary(&self) -> &Summary {
        &self.summary
    }

    /// Duration of the pattern (s), once there is one.
    #[must_use]
    pub fn walk_duration_s(&self) -> Option<f64> {
        self.pattern.as_ref().map(|(_, walk)| walk.duration_s())
    }

    /// Takes a pattern; one that comes when the walk has begun is not used.
    ///
    /// # Errors
    /// [`PatternRefused`]; the present pattern stays.
    pub fn take_pattern(&mut self, header: &PatternHeader, phases: &[PatternPhase]) -> Result<(), PatternRefused> {
        if self.start.is_none() && self.pattern.as_ref().is_none_or(|(hash, _)| *hash != header.pattern_hash) {
            let walk = read_pattern(header, phases)?;
            self.own_soles.check(&walk)?;
            self.pattern = Some((header.pattern_hash, walk));
            // Nothing of the walk before is of any use to this one.
            self.state = None;
            self.deformation = None;
            if let Some(feedback) = &mut self.feedback {
                feedback.restart();
            }
        }
        Ok(())
    }

    /// One tick; `None` before there are a pattern and a deformation.
    ///
    /// # Errors
    /// [`CannotWalk`] when the start configuration does not exist, or the robot does not come to stand still.
    pub fn step(
        &mut self,
        measured: &StateMessage,
        deformation: Option<&SoleDeformation>,
    ) -> Result<Option<ControllerOutput>, CannotWalk> {
        let tick = measured.header.tick;
        if let Some(deformation) = deformation.filter(|deformation| self.is_usable(deformation)) {
            self.deformation = Some(*deformation);
        }
        let (Some((pattern_hash, walk)), Some(deformation)) = (&self.pattern, self.deformation) else {
            return Ok(None);
        };
        let pattern_hash = *pattern_hash;
        if self.state.is_none() {
            let start = self.start_state(walk, &deformation)?;
            self.state = Some(StateIntegrator::new(self.integration.integration(), start));
        }
        let age_ticks = tick.saturating_sub(deformation.header.tick).max(0);
        let fresh_enough = age_ticks <= DEFORMATION_AGE_MAX_TICKS;
        self.summary.deformation_missing += u64::from(age_ticks > 0);
        let state_usable = measured.all_finite();
        self.summary.state_refused += u64::from(!state_usable);
        let walk_time_s = |tick: i64| {
            self.start.map_or(-CONTROL_PERIOD_S, |start| (tick - start.tick_zero) as f64 * CONTROL_PERIOD_S)
        };
        let (now_s, next_s) = (walk_time_s(tick), walk_time_s(tick + 1));
        let mode = match self.start {
            _ if self.held_in_a_row >= HELD_IN_A_ROW_MAX || !fresh_enough => Mode::Holding,
            None => Mode::Standing,
            Some(_) if now_s > walk.duration_s() => Mode::Finished,
            Some(_) if now_s >= 0.0 => Mode::Walking,
            Some(_) => Mode::Standing,
        };
        let why_held =
            if self.held_in_a_row >= HELD_IN_A_ROW_MAX { Reason::SolverFailed } else { Reason::InputMissing };
        self.summary.holding = (mode == Mode::Holding).then_some(why_held);
        let next = walk.evaluate(next_s);
        let own = self.state.as_mut().expect("set above");
        if let Some(feedback) = &mut self.feedback {
            feedback.remember(&deformation);
            // Before tick 0 the robot is not placed yet.
            if tick >= 0 {
                let observed = if state_usable {
                    feedback.observe(self.whole_body.model(), &self.joints, measured, own.state())
                } else {
                    Err(Refused::NotFinite)
                };
                self.summary.measurements_refused += u64::from(observed.is_err());
                self.summary.last_refused = observed.as_ref().err().copied().or(self.summary.last_refused);
                if mode != Mode::Holding {
                    own.begin(self.whole_body.model(), observed.ok(), CONTROL_PERIOD_S);
                }
            }
        }
        let mut command = RobotCommand {
            header: Header {
                clock_monotonic_ns: measured.header.clock_monotonic_ns,
                ..Header::new(tick, self.robot_fingerprint)
            },
            pattern_hash,
            walk_time_s: next_s,
            joint_count: self.joints.interface_count() as u32,
            mode: mode.code(),
            deformation_age_ticks: age_ticks.try_into().unwrap_or(u32::MAX),
            ..self.last_command.unwrap_or_default()
        };
        command.joint_velocity_reference_rad_per_s.fill(0.0);
        let mut computed = None;
        if mode == Mode::Holding {
            own.rest();
            command.status = Outcome::Held.code();
        } else {
            let mut wanted = reference(&walk.evaluate(now_s), &deformation);
            if let Some(feedback) = &mut self.feedback {
                let last = self.whole_body.report().feet.each_ref().map(|foot| foot.wrench);
                feedback.move_ankles(&deformation, last, &mut wanted.feet);
            }
            self.whole_body.step(own.state(), &wanted, CONTROL_PERIOD_S);
            let report = self.whole_body.report();
            let held = report.status == StepStatus::Held;
            computed = (!held).then(|| [0, 1].map(|foot| report.feet[foot].wrench));
            self.held_in_a_row = if held { self.held_in_a_row + 1 } else { 0 };
            self.summary.held += u64::from(held);
            self.summary.solved += u64::from(report.status == StepStatus::Solved);
            self.summary.by_backup += u64::from(report.answered_by == AnsweredBy::Backup);
            let relaxed = if report.status == StepStatus::Relaxed { report.relaxed.as_slice() } else { &[] };
            let order = &self.whole_body.settings().relaxation;
            for gave_way in relaxed.iter().map(|relaxed| GaveWay::new(relaxed, order)) {
                if self.summary.worst.is_none_or(|worst| gave_way.is_worse_than(&worst)) {
                    self.summary.worst = Some(gave_way);
                }
            }
            self.summary.relaxed += u64::from(report.status == StepStatus::Relaxed);
            self.summary.com_error_m = report.body_error.fixed_rows::<3>(0).norm();
            self.summary.collision_distance_m = report.distance_min_m;
            own.advance(report);
            let state = own.state();
            write_report(&mut command, report);
            let resting = self.joints.resting_rad();
            command.joint_position_reference_rad[..resting.len()].copy_from_slice(resting);
            let joints = state.q.joints.as_slice();
            self.joints.to_interface(joints, &mut command.joint_position_reference_rad);
            let base = state.v.len() - joints.len();
            self.joints.to_interface(&state.v.as_slice()[base..], &mut command.joint_velocity_reference_rad_per_s);
            self.joints.to_interface(report.torques.as_slice(), &mut command.feed_forward_torque_nm);
        }
        if let Some(feedback) = &self.feedback {
            let distance = own.distance();
            (self.summary.base_distance_m, self.summary.base_distance_rad) = (distance.base_m, distance.base_rad);
            self.summary.feet_disagreement_m = feedback.estimate().disagreement_m;
        }
        let model = self.whole_body.model();
        let state = own.state();
        forward_kinematics(model, &mut self.workspace, &state.q);
        let ankles = self.ankles.map(|frame| self.workspace.placement(model, frame));
        command.plan = plan(&next, &state.q.base, &ankles, computed);
        self.last_command = Some(command);
        if state_usable {
            self.observe(measured);
        }
        let start = if self.start.is_none() && tick >= 0 {
            let stance =
                if state_usable && mode == Mode::Standing { self.stance(measured, &deformation) } else { None };
            let header = Header::new(tick, self.robot_fingerprint);
            let tick_zero = self.settle.observe(tick, stance.as_ref())?;
            tick_zero.map(|tick_zero| WalkStart { header, pattern_hash, tick_zero })
        } else {
            None
        };
        self.start = self.start.or(start);
        Ok(Some(ControllerOutput { command, start, summary: self.summary }))
    }

    /// A limit that gave way, in words.
    #[must_use]
    pub fn describe(&self, gave_way: &GaveWay) -> String {
        let GaveWay { limit, index, amount, .. } = *gave_way;
        let body = &self.whole_body;
        let which = match limit {
            Limit::JointMotion | Limit::Torque => body.model().joints()[index].name.clone(),
            Limit::Collision => body.settings().collision.pairs[index].join(" and "),
            _ => ["left", "right"][index.min(1)].to_string(),
        };
        format!("{limit} {which} by {amount:.3e} (SI units)")
    }

    fn is_usable(&self, deformation: &SoleDeformation) -> bool {
        let ours = self.pattern.as_ref().is_some_and(|(hash, _)| *hash == deformation.pattern_hash);
        ours && deformation.header.robot_fingerprint == self.robot_fingerprint && deformation.all_finite()
    }

    /// Where the walk begins: nearest to half-sitting with centre of mass, ankles and torso in place.
    fn start_state(&self, walk: &WalkPattern, deformation: &SoleDeformation) -> Result<RobotState, ConfigurationError> {
        let model = self.whole_body.model();
        let wanted = reference(&walk.evaluate(0.0), deformation);
        let targets = ConfigurationTargets {
            com: wanted.com_position,
            ankles: self.ankles,
            ankle_poses: wanted.feet.map(|foot| foot.ankle_pose),
            torso: self.torso,
            torso_rotation: wanted.torso_rotation,
            posture: self.half_sitting.clone(),
            limit_margin_rad: self.limit_margin_rad,
        };
        let q = initial_configuration(model, &targets)?;
        Ok(RobotState { q, v: DVector::zeros(model.nv()) })
    }

    /// Takes the measured joints over and compares them with the model's.
    fn observe(&mut self, measured: &StateMessage) {
        self.joints.from_interface(&measured.joint_position_rad, self.measured.joints.as_mut_slice());
        if let Some(state) = &self.state {
            self.summary.joint_distance_rad = (&self.measured.joints - &state.state().q.joints).amax();
        }
    }

    /// How the robot stands, from its encoders, its orientation and its feet; `None` without an orientation.
    fn stance(&mut self, measured: &StateMessage, deformation: &SoleDeformation) -> Option<Stance> {
        let imu_rotation = unit_rotation(measured.imu_orientation_xyzw)?;
        let model = self.whole_body.model();
        // The measured configuration has its base at the origin.
        forward_kinematics(model, &mut self.workspace, &self.measured);
        let imu_in_base = self.workspace.placement(model, self.imu).rotation;
        let base_rotation = imu_rotation * imu_in_base.transpose();
        let ankle = |frame| base_rotation * self.workspace.placement(model, frame).translation;
        Some(Stance {
            base_rotation,
            ankles_from_base_m: self.ankles.map(ankle),
            measured_n: vertical_forces(measured),
            planned_n: [deformation.feet[0].planned_force_n[2], deformation.feet[1].planned_force_n[2]],
        })
    }
}

fn write_report(command: &mut RobotCommand, report: &StepReport) {
    command.status = match report.status {
        StepStatus::Solved => Outcome::Solved,
        StepStatus::Relaxed => Outcome::Relaxed,
        StepStatus::Held => Outcome::Held,
    }
    .code();
    command.fallback = match report.status {
        StepStatus::Solved => 0,
        StepStatus::Relaxed => 1,
        StepStatus::Held => 2,
    };
    command.active_constraints = report.active.len() as u32;
    command.solver_residual = report.residuals.feasibility;
    command.solver_iterations = report.iterations;
}

#[cfg(test)]
mod tests {
    use super::*;
    use wholebody::Limit as Kind;

    #[test]
    fn the_limit_that_should_have_given_way_last_is_the_worst_and_of_one_kind_the_larger_amount() {
        let relaxed = |id, amount| Relaxation { id, amount, times: 1 };
        let (torque, contact) = (ConstraintId::Torque(3), ConstraintId::Contact { foot: 1, axis: 2 });
        for order in [[Kind::Torque, Kind::Contact], [Kind::Contact, Kind::Torque]] {
            let settings = RelaxationSettings { order: order.to_vec(), ..RelaxationSettings::default() };
            let gave_way = |id, amount| GaveWay::new(&relaxed(id, amount), &settings);
            let is_torque_worse = order[1] == Kind::Torque;
            for (torque_nm, contact_m_per_s2) in [(1.0, 100.0), (100.0, 1.0)] {
                let [torque, contact] = [gave_way(torque, torque_nm), gave_way(contact, contact_m_per_s2)];
                assert_eq!(torque.is_worse_than(&contact), is_torque_worse, "{order:?}");
                assert_eq!(contact.is_worse_than(&torque), !is_torque_worse, "{order:?}");
            }
            assert!(gave_way(torque, 2.0).is_worse_than(&gave_way(torque, 1.0)));
            assert!(!gave_way(torque, 1.0).is_worse_than(&gave_way(torque, 1.0)));
        }
    }
}
