//! The process: commands in, states out.

use messages::code::{Mode, Reason};
use messages::missing::{Answer, HOLD_AFTER_TICKS, command_instead};
use messages::{CONTROL_PERIOD_S, Header, MAX_JOINTS, RobotCommand, RobotState, SimulatorFigures, Truth, WalkStart};
use nalgebra::DVector;
use plant::{Plant, PlantCommand, PlantSole, PlantSoleSettings};
use robot::{JointMap, Robot};
use robot_model::walking_model;
use soles::Store;

use crate::command::{ImpossibleCommand, check_command};
use crate::convert::{configuration, fall_code, plant_command, state_message, truth_message, unplaced_state};
use crate::settings::{SimulatorError, SimulatorSettings, frames};

/// What a tick brings.
#[derive(Debug, Clone, Copy)]
pub struct SimulatorOutput {
    /// What the robot measures.
    pub state: RobotState,
    /// What really is.
    pub truth: Truth,
    /// Why the run is over, once it is.
    pub over: Option<Reason>,
}

/// The simulator without clock or bus.
pub struct SimulatorProcess {
    settings: SimulatorSettings,
    robot_fingerprint: u64,
    joints: JointMap,
    joint_count: usize,
    gravity: f64,
    plant: Plant,
    command: PlantCommand,
    /// Last command taken.
    taken: Option<RobotCommand>,
    /// Commands stayed away for so long that the posture is held, whatever comes.
    held: bool,
    refused_in_a_row: u64,
    /// Tick of the command under which the robot came here.
    acting_tick: i64,
    tick: i64,
    start: Option<WalkStart>,
    finished_tick: Option<i64>,
    first_middle_m: Option<[f64; 2]>,
    last_zmp_m: [f64; 2],
    figures: SimulatorFigures,
    late: u64,
}

impl SimulatorProcess {
    /// Builds robot and soles.
    ///
    /// # Errors
    /// [`SimulatorError`] names file, field and value.
    pub fn new(settings: SimulatorSettings) -> Result<Self, SimulatorError> {
        Self::with_store(settings, &mut Store::none())
    }

    /// The same with condensed soles that may have been kept.
    ///
    /// # Errors
    /// [`SimulatorError`] names file, field and value.
    pub fn with_store(settings: SimulatorSettings, store: &mut Store) -> Result<Self, SimulatorError> {
        settings.check()?;
        let robot = Robot::load_on(&settings.robot, settings.sole_file.as_deref())?;
        settings.check_stabiliser(&robot)?;
        let (model, joints) = walking_model(&robot)?;
        if joints.interface_count() > MAX_JOINTS {
            let file = robot.folder.join("robot.toml");
            return Err(SimulatorError::TooManyJoints { file, found: joints.interface_count() });
        }
        let soles = soles(&settings.sole, &robot, store)?;
        let plant_settings = settings.plant(&robot, &model);
        let joint_count = model.joint_count();
        let gravity = model.gravity().norm();
        let plant = Plant::new(plant_settings, model, soles, &frames(&robot)?)?;
        Ok(Self {
            settings,
            robot_fingerprint: robot.fingerprint,
            joints,
            joint_count,
            gravity,
            plant,
            command: PlantCommand {
                joint_positions: DVector::zeros(joint_count),
                joint_torques: DVector::zeros(joint_count),
                plan: None,
            },
            taken: None,
            held: false,
            refused_in_a_row: 0,
            acting_tick: -1,
            tick: -1,
            start: None,
            finished_tick: None,
            first_middle_m: None,
            last_zmp_m: [0.0; 2],
            figures: SimulatorFigures::default(),
            late: 0,
        })
    }

    /// The robot it was built for: messages of another one must not be used.
    #[must_use]
    pub fn robot_fingerprint(&self) -> u64 {
        self.robot_fingerprint
    }

    /// State -1: the robot before it stands.
    #[must_use]
    pub fn unplaced(&self) -> RobotState {
        unplaced_state(self.robot_fingerprint, &self.joints, self.gravity)
    }

    /// Puts the robot where the answer to state -1 wants it; returns state 0.
    ///
    /// # Errors
    /// [`ImpossibleCommand`]: there is no such place.
    pub fn place(&mut self, command: &RobotCommand) -> Result<SimulatorOutput, ImpossibleCommand> {
        check_command(command, self.joints.interface_count(), 0)?;
        self.plant.place(&configuration(command, &self.joints, self.joint_count));
        self.taken = Some(*command);
        self.acting_tick = command.header.tick;
        self.tick = 0;
        Ok(self.output())
    }

    /// From now on a walk may begin at any time: who has to be told to walk may stand for long.
    pub fn wait_for_start(&mut self) {
        self.settings.run.settle_time_max_s = f64::INFINITY;
    }

    /// Takes time zero.
    pub fn take_start(&mut self, start: &WalkStart) {
        self.start = Some(*start);
    }

    /// Takes the answer to a state. One of the past is not used, and one that no robot could follow is counted as refused: the command
    /// before stays. Says why the first one was. Once the posture is held for want of commands, none is taken any more.
    pub fn take_command(&mut self, command: &RobotCommand) -> Option<ImpossibleCommand> {
        let newer = self.taken.is_none_or(|taken| command.header.tick > taken.header.tick);
        if !newer || self.held || command.header.robot_fingerprint != self.robot_fingerprint {
            return None;
        }
        match check_command(command, self.joints.interface_count(), self.tick) {
            Err(why) => {
                self.figures.commands_refused += 1;
                self.refused_in_a_row += 1;
                (self.figures.commands_refused == 1).then_some(why)
            }
            Ok(()) => {
                self.taken = Some(*command);
                self.refused_in_a_row = 0;
                None
            }
        }
    }

    /// One control period under the last command taken; returns the state at its end.
    pub fn advance(&mut self) -> SimulatorOutput {
        if let Some(taken) = &self.taken {
            let missing = self.missing_ticks(taken);
            self.late += u64::from(missing > 0);
            self.held |= missing >= HOLD_AFTER_TICKS;
            plant_command(&command_instead(taken, missing), &self.joints, &mut self.command);
            self.acting_tick = taken.header.tick;
            if taken.mode == Mode::Finished.code() {
                self.finished_tick.get_or_insert(self.tick);
            }
        }
        if self.start.is_some_and(|start| start.tick_zero == self.tick) {
            self.plant.start_clock();
        }
        self.plant.tick(&self.command);
        self.tick += 1;
        self.output()
    }

    /// What the plant models, one part a line.
    #[must_use]
    pub fn models(&self) -> Vec<String> {
        self.settings.models()
    }

    /// What health says of the run so far.
    #[must_use]
    pub fn figures(&self) -> &SimulatorFigures {
        &self.figures
    }

    /// Ticks whose command did not come in time, so far.
    #[must_use]
    pub fn late(&self) -> u64 {
        self.late
    }

    /// Whether the command in force is one of a walk under way.
    #[must_use]
    pub fn walks(&self) -> bool {
        self.taken.as_ref().is_some_and(|taken| taken.mode == Mode::Walking.code())
    }

    /// What is done for want of a command at this tick.
    #[must_use]
    pub fn answer(&self) -> Answer {
        Answer::after(self.taken.as_ref().map_or(0, |taken| self.missing_ticks(taken)))
    }

    /// Ticks without a command until now: the last one should have been that of the tick before.
    fn missing_ticks(&self, taken: &RobotCommand) -> i64 {
        (self.tick - taken.header.tick - 1).max(0)
    }

    /// What the plant is made of and where it is.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    fn walk_time_s(&self) -> f64 {
        messages::timing::walk_time_s(self.start.as_ref(), self.tick)
    }

    fn output(&mut self) -> SimulatorOutput {
        let header = Header::new(self.tick, self.robot_fingerprint);
        let walk_time_s = self.walk_time_s();
        let state = state_message(header, &self.joints, self.plant.sensors());
        let exact = self.plant.state();
        let base = exact.v.len() - exact.q.joints.len();
        let exact = (exact.q.joints.as_slice(), &exact.v.as_slice()[base..]);
        let (real, sensors) = (self.plant.truth(), self.plant.sensors());
        let mut truth = truth_message(header, walk_time_s, &self.joints, real, sensors, exact, self.last_zmp_m);
        for axis in 0..3 {
            truth.linear_momentum_kg_m_per_s[axis] = self.plant.model().total_mass_kg() * real.com_velocity[axis];
        }
        truth.command_tick = self.acting_tick;
        for (joint, limits) in self.plant.model().joints().iter().map(|joint| &joint.limits).enumerate() {
            let bit = self.joints.interface_bit(joint);
            let angle_rad = self.plant.state().q.joints[joint];
            let within = limits.lower < angle_rad && angle_rad < limits.upper;
            truth.joints_at_limit_bits |= if within { 0 } else { bit };
            truth.drives_saturated_bits |= if self.plant.drive_saturated(joint) { bit } else { 0 };
        }
        self.figures.joints_at_limit_bits |= truth.joints_at_limit_bits;
        self.figures.drives_saturated_bits |= truth.drives_saturated_bits;
        let soft = [0, 1].map(|foot| self.plant.contact(foot).map_or(0.0, |contact| contact.residual));
        truth.contact_residual = soft[0].max(soft[1]);
        let stored = [0, 1].map(|foot| self.plant.contact(foot).map_or(0.0, |contact| contact.elastic_energy_j));
        truth.elastic_energy_j = stored[0] + stored[1];
        let unconverged = real.integration.unconverged_steps + real.integration.unconverged_contacts > 0;
        self.figures.periods_unconverged += u64::from(unconverged);
        self.last_zmp_m = truth.zmp_m;
        let fall = self.plant.fallen();
        if let Some(fall) = fall {
            truth.fallen = 1;
            truth.fall_tick = (fall.t_s / CONTROL_PERIOD_S).round() as i64;
            truth.fall_cause = fall_code(fall).code();
        }
        let over = self.over(fall.is_some());
        (self.figures.fallen, self.figures.fall_cause) = (truth.fallen, truth.fall_cause);
        let [left, right] = truth.sole_position_m;
        let middle = [0.5 * (left[0] + right[0]), 0.5 * (left[1] + right[1])];
        let first = *self.first_middle_m.get_or_insert(middle);
        self.figures.distance_m = (middle[0] - first[0]).hypot(middle[1] - first[1]);
        SimulatorOutput { state, truth, over }
    }

    fn over(&self, fallen: bool) -> Option<Reason> {
        let run = &self.settings.run;
        let seconds = |ticks: i64| ticks as f64 * CONTROL_PERIOD_S;
        if fallen {
            Some(Reason::Fallen)
        } else if self.finished_tick.is_some_and(|tick| seconds(self.tick - tick) >= run.after_walk_s) {
            Some(Reason::Finished)
        } else if self.answer() == Answer::Stop {
            // None came, or none that a robot could follow.
            Some(if self.refused_in_a_row > 0 { Reason::Infeasible } else { Reason::Deadline })
        } else if self.start.is_none() && seconds(self.tick) >= run.settle_time_max_s {
            Some(Reason::NotSettled)
        } else {
            None
        }
    }
}

/// The plant's own soles, left and right.
fn soles(settings: &PlantSoleSettings, robot: &Robot, store: &mut Store) -> Result<[PlantSole; 2], soles::SolesError> {
    if settings.mesh_cells.is_some() {
        soles::needs_a_block(robot, "sole.mesh_cells")?;
    }
    let nominal = soles::nominal(robot);
    if let Some(plates) = settings.plates(&nominal) {
        soles::needs_one_friction(robot)?;
        return Ok(plates);
    }
    let models = soles::both(robot, &settings.left(&nominal), Some(settings.friction_factor), store)?;
    Ok(models.map(PlantSole::from))
}
