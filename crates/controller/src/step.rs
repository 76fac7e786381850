//! The process: messages in, messages out. [`ControllerProcess::step`] reads as its phases.

use messages::code::{Mode, Outcome, Reason};
use messages::missing::{HOLD_AFTER_TICKS, brought_to_rest, deformation_instead};
use messages::timing::{DRIVES_BEHIND_TICKS, walk_time_s};
use messages::{
    CONTROL_PERIOD_S, Header, MAX_JOINTS, OwnSoles, PatternHeader, PatternPhase, PatternRefused, Plain, RobotCommand,
    RobotState as StateMessage, SoleDeformation, WalkStart, read_pattern,
};
use multibody::{Configuration, FrameIndex, Workspace, forward_kinematics};
use pattern::WalkPattern;
use robot::{JointMap, Robot};
use robot_model::{RobotModelError, walking_model};
use spatial::Wrench;
use state::{
    FeedbackFrames, IntegrationMode, IntegrationSettings, InternalState, Measured, NotSettled, SettleDetector, Stance,
};
use wholebody::{ConfigurationError, ConstraintId, RobotState, StepReport, StepStatus, WholeBody};

use crate::balance::Balance;
use crate::convert;
use crate::feedback::Feedback;
use crate::progress::{Planned, Progress, Tracking};
use crate::settings::{ControllerError, ControllerSettings};
use crate::summary::Summary;

/// The divergent component is this far on its way from the foot that has carried to the one that will, or further: standing there is
/// possible, and earlier less so.
const STANDS_FROM: f64 = 0.4;
/// Further on than this it is not: the step after is walked, too.
const STANDS_TO: f64 = 0.75;
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

/// The controller without clock or bus.
pub struct ControllerProcess {
    progress: Progress,
    core: Core,
}

/// Everything that lives longer than a walk.
struct Core {
    robot_fingerprint: u64,
    joints: JointMap,
    whole_body: WholeBody,
    workspace: Workspace,
    ankles: [FrameIndex; 2],
    imu: FrameIndex,
    own_soles: OwnSoles,
    integration: IntegrationSettings,
    settle: SettleDetector,
    feedback: Option<Feedback>,
    /// The stabiliser, where the robot's driver has none.
    balance: Option<Balance>,
    /// The last measurement whose numbers are finite.
    measured: Measured,
    /// Its joints, the base at the origin.
    posture: Configuration,
    last_command: Option<RobotCommand>,
    held_in_a_row: u32,
    held: Option<Held>,
    /// Whether the walk may begin.
    may_walk: bool,
    /// Tick since which it may, and the time in which it then has to (s).
    stands_since: Option<i64>,
    settle_time_max_s: f64,
    /// Whether the walk is to end as soon as the robot can stand.
    stop_asked: bool,
    summary: Summary,
}

/// The posture is held.
struct Held {
    why: Reason,
    /// The last command before.
    from: RobotCommand,
    /// In a walk it is: the plan goes on meanwhile, and the way back to it would be a jump.
    for_good: bool,
}

/// What comes in at a tick.
#[derive(Clone, Copy)]
struct Inputs {
    /// Of the robot's state.
    tick: i64,
    /// The robot's clock then (ns).
    clock_monotonic_ns: u64,
    /// Whether all numbers of the robot's state are finite.
    usable: bool,
    /// Age of the deformation (ticks).
    age_ticks: i64,
    /// The tick for which it stands in.
    used_tick: i64,
    /// Walk time now and at the next tick (s).
    now_s: f64,
    next_s: f64,
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
        let imu = frame(&robot.description.imu_frame)?;
        let frames = FeedbackFrames {
            imu_link: robot.description.imu_frame.clone(),
            ankle_links: [feet[0].ankle_frame.clone(), feet[1].ankle_frame.clone()],
        };
        let feedback = (settings.integration.mode == IntegrationMode::Feedback)
            .then(|| Feedback::new(&settings.integration, &model, frames))
            .transpose()
            .map_err(|source| RobotModelError::unknown(&robot, source))?;
        let balance = settings
            .stabiliser
            .filter(|stabiliser| stabiliser.enabled)
            .map(|stabiliser| Balance::new(stabiliser, &robot, &model, ankles, imu))
            .transpose()?;
        let core = Core {
            robot_fingerprint: robot.fingerprint,
            joints,
            workspace: Workspace::new(&model),
            ankles,
            imu,
            measured: Measured::new(&model),
            posture: model.neutral(),
            whole_body: WholeBody::new(model, whole_body_settings)?,
            own_soles: OwnSoles {
                ankle_in_sole_m: [0, 1].map(|foot| robot.sole.foot.ankle_in_sole_m(foot)),
                file: robot.sole_file.clone(),
            },
            settle: SettleDetector::new(settings.settle, CONTROL_PERIOD_S),
            integration: settings.integration,
            feedback,
            balance,
            last_command: None,
            held_in_a_row: 0,
            held: None,
            may_walk: true,
            stands_since: None,
            settle_time_max_s: settings.settle.time_max_s,
            stop_asked: false,
            summary: Summary::default(),
        };
        Ok(Self { progress: Progress::Waiting, core })
    }

    /// The robot it was built for: messages of another one must not be used.
    #[must_use]
    pub fn robot_fingerprint(&self) -> u64 {
        self.core.robot_fingerprint
    }

    /// The whole-body step, with the report of the last tick.
    #[must_use]
    pub fn whole_body(&self) -> &WholeBody {
        &self.core.whole_body
    }

    /// What the step models, one part a line.
    #[must_use]
    pub fn models(&self) -> Vec<String> {
        let settings = self.core.whole_body.settings();
        let on = |is_on: bool| if is_on { "on" } else { "off" };
        let tasks = &settings.tasks;
        let pairs = if settings.collision.on { settings.collision.pairs.len() } else { 0 };
        vec![
            format!("start of a step: {}", if self.core.feedback.is_some() { "feedback" } else { "open loop" }),
            format!("friction of the forces: {}", settings.friction()),
            format!("stabiliser: {}", on(self.core.balance.is_some())),
            format!("collision pairs watched: {pairs}"),
            format!("objective of least torques: {}", on(tasks.torque_weight > 0.0)),
            format!("objective on the angular momentum: {}", on(tasks.angular_momentum.weight > 0.0)),
        ]
    }

    /// Counts and figures so far, as after the last step.
    #[must_use]
    pub fn summary(&self) -> &Summary {
        &self.core.summary
    }

    /// Duration of the pattern (s), once there is one.
    #[must_use]
    pub fn walk_duration_s(&self) -> Option<f64> {
        self.progress.planned().map(|planned| planned.pattern.duration_s())
    }

    /// Takes a pattern; one that comes when the walk has begun is not used.
    ///
    /// # Errors
    /// [`PatternRefused`]; the present pattern stays.
    pub fn take_pattern(&mut self, header: &PatternHeader, phases: &[PatternPhase]) -> Result<(), PatternRefused> {
        let hash = header.pattern_hash;
        let known = self.progress.planned().is_some_and(|planned| planned.hash == hash);
        if known || self.progress.has_start() {
            return Ok(());
        }
        let pattern = read_pattern(header, phases)?;
        self.core.own_soles.check(&pattern)?;
        // Nothing of the walk before is of any use to this one.
        self.core.held = None;
        self.progress = Progress::Planned(Planned { hash, pattern });
        if let Some(feedback) = &mut self.core.feedback {
            feedback.restart();
        }
        Ok(())
    }

    /// From now on the robot stands until it is told to walk.
    pub fn wait_for_start(&mut self) {
        self.core.may_walk = false;
    }

    /// The robot may walk off as soon as it stands still.
    pub fn start(&mut self) {
        (self.core.may_walk, self.core.stop_asked) = (true, false);
    }

    /// The robot is to stand: before the walk it does not begin; in it, the step under way is completed, and the posture held where both
    /// feet carry.
    pub fn stop(&mut self) {
        (self.core.may_walk, self.core.stop_asked) = (false, true);
    }

    /// One tick; `None` before there are a pattern and a deformation.
    ///
    /// # Errors
    /// [`CannotWalk`] when the start configuration does not exist, or the robot does not come to stand still.
    pub fn step(
        &mut self,
        state: &StateMessage,
        deformation: Option<&SoleDeformation>,
    ) -> Result<Option<ControllerOutput>, CannotWalk> {
        self.take_deformation(deformation)?;
        let (Progress::Tracking(walk), core) = (&mut self.progress, &mut self.core) else { return Ok(None) };
        let inputs = core.take_inputs(state, walk);
        let mode = core.mode(&inputs, walk);
        walk.used = deformation_instead(&walk.deformation, inputs.age_ticks);
        core.blend_with_measured(&inputs, mode, walk);
        let computed = match mode {
            Mode::Holding => core.hold(walk),
            _ => core.solve(&inputs, walk),
        };
        let mut command = core.command(&inputs, mode, &computed, walk);
        core.correct(&inputs, state, &mut command);
        core.compare_with_measured(&inputs, walk);
        let start = core.decide_start(&inputs, mode, walk)?;
        walk.start = walk.start.or(start);
        Ok(Some(ControllerOutput { command, start, summary: core.summary }))
    }

    /// Takes a deformation of this robot's soles under this pattern; the first one says where the walk begins.
    fn take_deformation(&mut self, deformation: Option<&SoleDeformation>) -> Result<(), CannotWalk> {
        let Some(deformation) = deformation else { return Ok(()) };
        let ours = self.progress.planned().is_some_and(|planned| planned.hash == deformation.pattern_hash);
        let fits = deformation.header.robot_fingerprint == self.core.robot_fingerprint && deformation.all_finite();
        if !(ours && fits) {
            return Ok(());
        }
        match std::mem::replace(&mut self.progress, Progress::Waiting) {
            Progress::Waiting => {}
            Progress::Planned(planned) => {
                let start = self.core.start_state(&planned.pattern, deformation);
                match start {
                    Ok(start) => {
                        let behind_ticks = self.core.integration.measurement_delay_ticks as usize + DRIVES_BEHIND_TICKS;
                        let internal = InternalState::new(&self.core.integration, start, behind_ticks);
                        let (deformation, used) = (*deformation, *deformation);
                        let tracking = Tracking { planned, internal, deformation, used, start: None };
                        self.progress = Progress::Tracking(Box::new(tracking));
                    }
                    Err(error) => {
                        self.progress = Progress::Planned(planned);
                        return Err(error.into());
                    }
                }
            }
            Progress::Tracking(mut tracking) => {
                tracking.deformation = *deformation;
                self.progress = Progress::Tracking(tracking);
            }
        }
        Ok(())
    }
}

/// The phases of a tick.
impl Core {
    /// Looks at what has come in.
    fn take_inputs(&mut self, state: &StateMessage, walk: &Tracking) -> Inputs {
        let tick = state.header.tick;
        let usable = state.all_finite();
        if usable {
            convert::measured(state, &self.joints, &mut self.measured);
            self.posture.joints.copy_from(&self.measured.joints);
        }
        let age_ticks = tick.saturating_sub(walk.deformation.header.tick).max(0);
        self.summary.deformation_missing += u64::from(age_ticks > 0);
        self.summary.state_refused += u64::from(!usable);
        Inputs {
            tick,
            clock_monotonic_ns: state.header.clock_monotonic_ns,
            usable,
            age_ticks,
            used_tick: if age_ticks < HOLD_AFTER_TICKS { tick } else { walk.deformation.header.tick },
            now_s: walk_time_s(walk.start.as_ref(), tick),
            next_s: walk_time_s(walk.start.as_ref(), tick + 1),
        }
    }

    /// What is to be done.
    fn mode(&mut self, inputs: &Inputs, walk: &Tracking) -> Mode {
        let mode = match walk.start {
            Some(_) if inputs.now_s > walk.planned.pattern.duration_s() => Mode::Finished,
            Some(_) if inputs.now_s >= 0.0 => Mode::Walking,
            _ => Mode::Standing,
        };
        let last_tick = self.last_command.filter(|_| mode == Mode::Walking).map(|last| last.header.tick);
        let missed_ticks = last_tick.map_or(0, |last| inputs.tick - last - 1);
        let why_held = if self.held_in_a_row >= HELD_IN_A_ROW_MAX {
            Some(Reason::SolverFailed)
        } else if [inputs.age_ticks, missed_ticks].into_iter().any(|ticks| ticks >= HOLD_AFTER_TICKS) {
            // Of a deformation or of states: the drives have been without a command for as long then.
            Some(Reason::InputMissing)
        } else if self.stop_asked && mode == Mode::Walking && can_stand(&walk.planned.pattern, inputs.now_s) {
            Some(Reason::Asked)
        } else {
            None
        };
        self.held = match (self.held.take(), why_held) {
            (Some(held), _) if held.for_good => Some(held),
            (Some(held), Some(why)) => Some(Held { why, for_good: mode == Mode::Walking, ..held }),
            (None, Some(why)) => self.last_command.map(|from| Held { why, from, for_good: mode == Mode::Walking }),
            (_, None) => None,
        };
        self.summary.holding = self.held.as_ref().map(|held| held.why).or(why_held);
        self.summary.stopped = self.stop_asked && (mode != Mode::Walking || self.summary.holding.is_some());
        if self.summary.holding.is_some() { Mode::Holding } else { mode }
    }

    /// Blends the internal state with what is measured; in feedback only.
    fn blend_with_measured(&mut self, inputs: &Inputs, mode: Mode, walk: &mut Tracking) {
        let Some(feedback) = &mut self.feedback else { return };
        feedback
            .remember(&SoleDeformation { header: Header { tick: inputs.used_tick, ..walk.used.header }, ..walk.used });
        // Before tick 0 the robot is not placed yet.
        if inputs.tick < 0 {
            return;
        }
        let model = self.whole_body.model();
        let measured = inputs.usable.then_some(&self.measured);
        let observed = feedback.observe(model, measured, &walk.internal);
        self.summary.count_measurement(observed.as_ref().err().copied());
        if mode != Mode::Holding {
            walk.internal.begin(model, observed.ok(), CONTROL_PERIOD_S);
        }
    }

    /// Brings the internal state to rest where it is: the last references are kept.
    fn hold(&mut self, walk: &mut Tracking) -> Computed {
        walk.internal.rest();
        Computed::Nothing
    }

    /// One whole-body step, and its result taken over.
    fn solve(&mut self, inputs: &Inputs, walk: &mut Tracking) -> Computed {
        let mut wanted = convert::reference(&walk.planned.pattern.evaluate(inputs.now_s), &walk.used);
        if let Some(feedback) = &mut self.feedback {
            let last = self.whole_body.report().feet.each_ref().map(|foot| foot.wrench);
            feedback.move_ankles(&walk.used, last, &mut wanted.feet);
        }
        let report = self.whole_body.step(walk.internal.state(), &wanted, CONTROL_PERIOD_S);
        walk.internal.advance(report);
        let held = report.status == StepStatus::Held;
        let wrenches = [0, 1].map(|foot| report.feet[foot].wrench);
        self.held_in_a_row = if held { self.held_in_a_row + 1 } else { 0 };
        self.summary.count_step(self.whole_body.report(), &self.whole_body.settings().relaxation);
        if held { Computed::AtRest } else { Computed::Wrenches(wrenches) }
    }

    /// The command: references for the next tick, and the plan behind them.
    fn command(&mut self, inputs: &Inputs, mode: Mode, computed: &Computed, walk: &Tracking) -> RobotCommand {
        let state = walk.internal.state();
        let held = self.held.as_ref().filter(|_| matches!(computed, Computed::Nothing));
        let held = held.map(|held| brought_to_rest(&held.from, inputs.tick - held.from.header.tick));
        let mut command = RobotCommand {
            header: Header {
                clock_monotonic_ns: inputs.clock_monotonic_ns,
                ..Header::new(inputs.tick, self.robot_fingerprint)
            },
            pattern_hash: walk.planned.hash,
            walk_time_s: inputs.next_s,
            joint_count: self.joints.interface_count() as u32,
            mode: mode.code(),
            deformation_tick: walk.deformation.header.tick,
            deformation_age_ticks: inputs.age_ticks.try_into().unwrap_or(u32::MAX),
            ..held.or(self.last_command).unwrap_or_default()
        };
        (command.joints_limited_bits, command.torques_limited_bits) = (0, 0);
        if held.is_some() {
            // The plan comes to rest with the joints.
            command.status = Outcome::Held.code();
            self.last_command = Some(command);
            return command;
        }
        command.joint_velocity_reference_rad_per_s.fill(0.0);
        if matches!(computed, Computed::Nothing) {
            command.status = Outcome::Held.code();
        } else {
            let report = self.whole_body.report();
            write_report(&mut command, report);
            let resting = self.joints.resting_rad();
            command.joint_position_reference_rad[..resting.len()].copy_from_slice(resting);
            let joints = state.q.joints.as_slice();
            self.joints.to_interface(joints, &mut command.joint_position_reference_rad);
            let base = state.v.len() - joints.len();
            self.joints.to_interface(&state.v.as_slice()[base..], &mut command.joint_velocity_reference_rad_per_s);
            self.joints.to_interface(report.torques.as_slice(), &mut command.feed_forward_torque_nm);
            for active in &report.active {
                match active.id {
                    ConstraintId::JointMotion(joint) => command.joints_limited_bits |= self.joints.interface_bit(joint),
                    ConstraintId::Torque(joint) => command.torques_limited_bits |= self.joints.interface_bit(joint),
                    _ => {}
                }
            }
        }
        let model = self.whole_body.model();
        let placed = forward_kinematics(model, &mut self.workspace, &state.q);
        let ankles = self.ankles.map(|frame| placed.pose(frame));
        let next = walk.planned.pattern.evaluate(inputs.next_s);
        command.plan = convert::plan(&next, &state.q.base, &ankles, computed.wrenches());
        self.last_command = Some(command);
        command
    }

    /// Corrects what leaves the process by what is measured, where a stabiliser is asked for.
    fn correct(&mut self, inputs: &Inputs, state: &StateMessage, command: &mut RobotCommand) {
        let Some(balance) = &mut self.balance else { return };
        if inputs.usable {
            balance.feel(state);
        }
        // Before tick 0 the robot is not placed yet: the command is where it shall be.
        if inputs.tick >= 0 {
            balance.correct(self.whole_body.model(), &self.joints, &self.measured, command);
        }
    }

    /// How far robot and internal state are apart, for health.
    fn compare_with_measured(&mut self, inputs: &Inputs, walk: &Tracking) {
        if let Some(feedback) = &self.feedback {
            let distance = walk.internal.distance();
            (self.summary.base_distance_m, self.summary.base_distance_rad) = (distance.base_m, distance.base_rad);
            self.summary.feet_disagreement_m = feedback.estimate().disagreement_m;
        }
        if inputs.usable {
            self.summary.joint_distance_rad = (&self.measured.joints - &walk.internal.state().q.joints).amax();
        }
    }

    /// Time zero, if the robot has now stood still for long enough.
    fn decide_start(&mut self, inputs: &Inputs, mode: Mode, walk: &Tracking) -> Result<Option<WalkStart>, NotSettled> {
        if walk.start.is_some() || inputs.tick < 0 {
            return Ok(None);
        }
        let seen = inputs.usable && mode == Mode::Standing;
        let stance = if seen { self.stance(&walk.deformation) } else { None };
        let header = Header::new(inputs.tick, self.robot_fingerprint);
        let settled = self.settle.observe(inputs.tick, stance.as_ref());
        // Who waits to be told may wait for long, and moves perhaps: that is nobody's failure.
        let waiting = self.stands_since.get_or_insert(inputs.tick);
        if !self.may_walk {
            *waiting = inputs.tick;
            return Ok(None);
        }
        let waited_s = (inputs.tick - *waiting) as f64 * CONTROL_PERIOD_S;
        let tick_zero = if waited_s < self.settle_time_max_s { settled.unwrap_or(None) } else { settled? };
        Ok(tick_zero.map(|tick_zero| WalkStart { header, pattern_hash: walk.planned.hash, tick_zero }))
    }

    /// How the robot stands, from its encoders, its orientation and its feet; `None` without an orientation.
    fn stance(&mut self, deformation: &SoleDeformation) -> Option<Stance> {
        let imu_rotation = self.measured.imu_rotation?;
        let model = self.whole_body.model();
        let placed = forward_kinematics(model, &mut self.workspace, &self.posture);
        let base_rotation = imu_rotation * placed.pose(self.imu).rotation.transpose();
        let ankle = |frame| base_rotation * placed.pose(frame).translation;
        Some(Stance {
            base_rotation,
            ankles_from_base_m: self.ankles.map(ankle),
            measured_n: self.measured.vertical_n,
            planned_n: [deformation.feet[0].planned_force_n[2], deformation.feet[1].planned_force_n[2]],
        })
    }

    /// Where the walk begins: nearest to half-sitting with centre of mass, ankles and torso in place.
    fn start_state(
        &self,
        pattern: &WalkPattern,
        deformation: &SoleDeformation,
    ) -> Result<RobotState, ConfigurationError> {
        let wanted = convert::reference(&pattern.evaluate(0.0), deformation);
        tracking::start(&self.whole_body, &tracking::Start::of(&self.whole_body), &wanted)
    }
}

/// Whether a robot that walks can be brought to rest now: both feet carry, and the divergent component of motion is between them, on its way
/// from the one to the other. Where it is, the centre of mass comes to rest if the ZMP is brought there.
fn can_stand(pattern: &WalkPattern, now_s: f64) -> bool {
    let planned = pattern.evaluate(now_s);
    let [left, right] = planned.feet.each_ref().map(|foot| foot.zmp.position);
    if !planned.feet.iter().all(|foot| foot.in_contact) {
        return false;
    }
    let dcm = planned.com_position().xy() + planned.com_velocity().xy() / pattern.omega();
    let rising = planned.feet[1].share.rate >= 0.0;
    let right_of = (dcm - left).dot(&(right - left)) / (right - left).norm_squared();
    let onwards = if rising { right_of } else { 1.0 - right_of };
    (STANDS_FROM..=STANDS_TO).contains(&onwards)
}

/// What a tick has computed.
enum Computed {
    /// Nothing: the posture is held.
    Nothing,
    /// The step found no usable solution: the joints are brought to rest.
    AtRest,
    /// The wrenches of the ground on the feet about the ankles, world axes.
    Wrenches([Wrench; 2]),
}

impl Computed {
    fn wrenches(&self) -> Option<[Wrench; 2]> {
        match self {
            Self::Wrenches(wrenches) => Some(*wrenches),
            Self::Nothing | Self::AtRest => None,
        }
    }
}

fn write_report(command: &mut RobotCommand, report: &StepReport) {
    command.status = match report.status {
        StepStatus::Solved => Outcome::Solved,
        StepStatus::Relaxed => Outcome::Relaxed,
        StepStatus::Held => Outcome::Held,
    }
    .code();
    command.active_constraints = report.active.len() as u32;
    command.solver_residual = report.residuals.feasibility;
    command.solver_iterations = report.iterations;
}
