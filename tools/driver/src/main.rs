//! A robot's driver, to start from: it takes the simulator's place in a domain and keeps the manners of `docs/drivers.md`.
//!
//! The robot here is one that does at once what it is told. Replace [`Mirror::read_sensors`] and [`Mirror::write_drives`] by those of a
//! real one; all else stays.

use lateness::RightsSettings;
use messages::code::{Mode, Process, Reason};
use messages::missing::{Answer, STOP_AFTER_TICKS, command_instead};
use messages::{CONTROL_PERIOD_S, Header, RobotCommand, RobotState, topic};
use node::{End, Failure, Grid, Program, Shell};
use robot::Robot;
use serde::Deserialize;
use std::path::PathBuf;

/// Ticks of standing after the walk, before the driver says that it is over: a second.
const AFTER_WALK_TICKS: u32 = 200;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    /// Folder of the robot: its fingerprint is in every message, its joints give the order of the arrays.
    robot: PathBuf,
    /// Policy, priority and core by the clock.
    #[serde(default = "own_rights")]
    real_time: RightsSettings,
}

fn own_rights() -> RightsSettings {
    RightsSettings::fifo(70, 0)
}

struct Mirror {
    robot: Robot,
    /// What the drives have reached.
    reached: RobotCommand,
}

impl Mirror {
    /// What the robot measures: joints, inertial unit, force sensors. In the order and the units of `docs/messages.md`.
    fn read_sensors(&self, tick: i64) -> RobotState {
        let plan = &self.reached.plan;
        let mut state = RobotState { header: Header::new(tick, self.robot.fingerprint), ..RobotState::default() };
        state.joint_count = self.robot.description.joints.len() as u32;
        state.joint_position_rad = self.reached.joint_position_reference_rad;
        state.joint_velocity_rad_per_s = self.reached.joint_velocity_reference_rad_per_s;
        state.imu_orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
        state.accelerometer_m_per_s2 = [0.0, 0.0, 9.81];
        state.foot_wrench_n_nm = [plan.feet[0].wrench_n_nm, plan.feet[1].wrench_n_nm];
        state
    }

    /// Sends references to the drives, which go there linearly within the period: at the next tick they are there.
    fn write_drives(&mut self, command: &RobotCommand) {
        self.reached = *command;
    }
}

impl Program for Mirror {
    // Its place in the domain: a simulator beside it is refused, as is a second driver.
    const PROCESS: Process = Process::Simulator;
    const ABOUT: &'static str = "A driver to start from: its robot does at once what it is told.";
    type Settings = Settings;

    fn build(settings: Settings) -> Result<Self, Failure> {
        let robot = Robot::load(&settings.robot).map_err(Failure::unusable)?;
        Ok(Self { robot, reached: RobotCommand::default() })
    }

    fn rights(settings: &Settings) -> RightsSettings {
        settings.real_time
    }

    fn robot_fingerprint(&self) -> Option<u64> {
        Some(self.robot.fingerprint)
    }

    fn run(&mut self, shell: &mut Shell) -> Result<End, Failure> {
        let mut commands = shell.subscriber(topic::ROBOT_COMMAND, 16)?;
        let mut states = shell.publisher(topic::ROBOT_STATE)?;
        shell.ready()?;
        if !shell.wait_for_others(&[Process::Planner, Process::Estimator, Process::Controller])? {
            return Ok(End::Asked);
        }
        // Tick -1, before the clock begins, with a stamp of zero: the answer says where the walk starts. A real robot is brought there, slowly,
        // before tick 0; this is also the moment at which every port is warm.
        states.publish(&self.read_sensors(-1))?;
        let Some(placing) = shell.wait_tick(&mut commands, -1)? else { return Ok(End::Asked) };
        self.write_drives(&placing);
        let mut newest = placing;
        let mut grid = shell.real_time().then(Grid::start);
        let mut finished_ticks = 0;
        for tick in 0.. {
            // The tick's time is the scheduled one, also when we woke late. Nobody else keeps a grid.
            let due_ns = grid.as_mut().map_or(0, Grid::wait);
            shell.cycle_wakes(due_ns);
            if grid.is_some() {
                // By the clock: the command of the tick before must be there by now. Looked for before the state is out: the state's own answer
                // acts from the next tick on, and must not be found here when we are held up.
                while let Some(command) = commands.try_next()? {
                    newest = if command.header.tick > newest.header.tick { command } else { newest };
                }
                shell.cycle_starts();
            }
            let mut state = self.read_sensors(tick);
            state.header.clock_monotonic_ns = due_ns;
            states.publish(&state)?;
            shell.published(states.sent_ns());
            if let Some(grid) = &grid {
                // One that is missing is stood in for, as every driver does.
                let missing = tick - 1 - newest.header.tick;
                shell.figures().late += u64::from(missing > 0);
                if Answer::after(missing) == Answer::Stop {
                    return Err(Failure::Deadline { misses: STOP_AFTER_TICKS as u64 });
                }
                self.write_drives(&command_instead(&newest, missing));
                shell.figures().clock_slips = grid.slips();
            } else {
                // Lock-step: the command of this tick is waited for; it acts from the next one.
                let Some(command) = shell.wait_tick(&mut commands, tick)? else { return Ok(End::Asked) };
                shell.cycle_starts();
                self.write_drives(&newest);
                newest = command;
            }
            shell.figures().walk_time_s = newest.walk_time_s - CONTROL_PERIOD_S;
            shell.cycle_ends(tick)?;
            finished_ticks += u32::from(newest.mode == Mode::Finished.code());
            if finished_ticks > AFTER_WALK_TICKS {
                return Ok(End::Over(Reason::Finished));
            }
            if shell.ends(newest.mode == Mode::Walking.code()) {
                return Ok(End::Asked);
            }
        }
        Ok(End::Asked)
    }
}

fn main() -> std::process::ExitCode {
    node::main::<Mirror>()
}
