//! The simulator over the bus: commands move the robot, its state wakes the others.

use bus::{Publisher, Subscriber};
use lateness::RightsSettings;
use messages::code::{Process, Reason, State};
use messages::missing::{Answer, STOP_AFTER_TICKS};
use messages::{RobotCommand, RobotState, Truth, WalkStart, topic};
use node::{End, Failure, Grid, Pace, Program, Shell};
use simulator::{SimulatorOutput, SimulatorProcess, SimulatorSettings};
use soles::Store;

struct Simulate {
    process: SimulatorProcess,
    soles: Store,
}

/// Who must be ready before time begins when nobody else is named.
const NEEDED: [Process; 3] = [Process::Planner, Process::Estimator, Process::Controller];

impl Program for Simulate {
    const PROCESS: Process = Process::Simulator;
    const ABOUT: &'static str = "Plays the robot: HRP-4 on soft soles.";
    type Settings = SimulatorSettings;

    fn build(settings: SimulatorSettings) -> Result<Self, Failure> {
        let mut soles = Store::from_environment();
        let process = SimulatorProcess::with_store(settings, &mut soles).map_err(Failure::unusable)?;
        soles.starts().iter().for_each(|start| tracing::info!("{start}"));
        Ok(Self { process, soles })
    }

    fn rights(settings: &Self::Settings) -> RightsSettings {
        settings.real_time
    }

    fn robot_fingerprint(&self) -> Option<u64> {
        Some(self.process.robot_fingerprint())
    }

    fn models(&self) -> Vec<String> {
        self.process.models()
    }

    fn run(&mut self, shell: &mut Shell) -> Result<End, Failure> {
        // Not before there is work to do: who only checks a configuration leaves nothing behind.
        if let Err(error) = self.soles.write() {
            tracing::warn!("condensed soles cannot be kept: {error}");
        }
        let mut ports = Ports {
            commands: shell.subscriber(topic::ROBOT_COMMAND, QUEUE)?,
            starts: shell.subscriber(topic::WALK_START, 1)?,
            states: shell.publisher(topic::ROBOT_STATE)?,
            truths: shell.publisher(topic::TRUTH_ROBOT)?,
        };
        shell.ready()?;
        if !shell.wait_for_others(&NEEDED)? {
            return Ok(End::Asked);
        }
        // Before the clock begins: the stamp of this state is zero, and whoever answers it takes the time it needs.
        ports.states.publish(&self.process.unplaced())?;
        let Some(placing) = shell.wait_tick(&mut ports.commands, -1)? else { return Ok(End::Asked) };
        let placed = self.process.place(&placing);
        let output = placed.map_err(|error| Failure::safety(Reason::Infeasible, error))?;
        if shell.real_time() {
            self.by_the_clock(shell, ports, output)
        } else {
            self.in_lock_step(shell, ports, output)
        }
    }
}

/// Messages that may wait: those of a process that was held up for a while are answered all the same, in turn.
const QUEUE: usize = 16;

/// What is said and heard.
struct Ports {
    commands: Subscriber<RobotCommand>,
    starts: Subscriber<WalkStart>,
    states: Publisher<RobotState>,
    truths: Publisher<Truth>,
}

impl Simulate {
    /// Time is the tick: the command of a tick is waited for, however long it takes.
    fn in_lock_step(
        &mut self,
        shell: &mut Shell,
        mut ports: Ports,
        mut output: SimulatorOutput,
    ) -> Result<End, Failure> {
        let mut pace = shell.pace().map(Pace::start);
        loop {
            pace.iter_mut().for_each(Pace::wait);
            let tick = output.state.header.tick;
            ports.states.publish(&output.state)?;
            ports.truths.publish(&output.truth)?;
            if let Some(reason) = output.over {
                // The last state is answered too, so that every recording of a walk ends with the same message. After a fall
                // nobody is owed an answer, and the fall is what is to be told.
                if reason == Reason::Finished && shell.wait_tick(&mut ports.commands, tick)?.is_none() {
                    return Ok(End::Asked);
                }
                self.report(shell, &output);
                return ended(reason);
            }
            // The plant moves under the command before, while the others compute the answer to this state.
            shell.cycle_starts();
            output = self.process.advance();
            shell.cycle_waits();
            let Some(command) = shell.wait_tick(&mut ports.commands, tick)? else { return Ok(End::Asked) };
            self.take(&command, tick);
            // Published before the command: looked for earlier, it would be there or not as the machine's load has it.
            if let Some(start) = ports.starts.latest()? {
                self.process.take_start(&start);
            }
            if !shell.wait_for_recorder(tick)? {
                return Ok(End::Asked);
            }
            self.report(shell, &output);
            shell.cycle_ends(tick)?;
        }
    }

    /// The clock grid is kept here. At each of its times whatever commands are there are taken and the state is published, with that time as
    /// its stamp; then the plant moves to the next time under the newest command.
    fn by_the_clock(
        &mut self,
        shell: &mut Shell,
        mut ports: Ports,
        mut output: SimulatorOutput,
    ) -> Result<End, Failure> {
        if !shell.may_walk_off() {
            self.process.wait_for_start();
        }
        let mut grid = Grid::start();
        loop {
            let (due_ns, slips) = (grid.wait(), grid.slips());
            shell.cycle_wakes(due_ns);
            shell.figures().clock_slips = slips;
            let tick = output.state.header.tick;
            // Before the state is out: its own answer acts from the next tick on, and must not be found here when this process is held up.
            while let Some(command) = ports.commands.try_next()? {
                self.take(&command, tick);
            }
            if let Some(start) = ports.starts.latest()? {
                self.process.take_start(&start);
            }
            shell.cycle_starts();
            output.state.header.clock_monotonic_ns = due_ns;
            output.truth.header.clock_monotonic_ns = due_ns;
            ports.states.publish(&output.state)?;
            shell.published(ports.states.sent_ns());
            ports.truths.publish(&output.truth)?;
            if let Some(reason) = output.over {
                self.report(shell, &output);
                tracing::info!("the clock grid was moved {slips} times, {} commands were missing", self.process.late());
                return ended(reason);
            }
            let walks = self.process.walks();
            output = self.process.advance();
            shell.step_done("moving the plant");
            self.report(shell, &output);
            shell.cycle_ends(tick)?;
            if shell.ends(walks) {
                return Ok(End::Asked);
            }
        }
    }

    fn take(&mut self, command: &RobotCommand, tick: i64) {
        if let Some(why) = self.process.take_command(command) {
            tracing::warn!("tick {tick}: {why}: refused, the one before stays in force (health counts the rest)");
        }
    }

    fn report(&self, shell: &mut Shell, output: &SimulatorOutput) {
        let held = matches!(self.process.answer(), Answer::Hold | Answer::Stop);
        let health = shell.figures();
        health.walk_time_s = output.truth.walk_time_s;
        health.late = self.process.late();
        health.solver_iterations = output.truth.contact_iterations;
        if held {
            health.state = State::Holding.code();
        }
        health.reason = output.over.unwrap_or(if held { Reason::InputMissing } else { Reason::None }).code();
        health.simulator = *self.process.figures();
    }
}

/// How a run ends that is over for this reason.
fn ended(reason: Reason) -> Result<End, Failure> {
    match reason {
        Reason::NotSettled => {
            let limit = "no walk/start within run.settle_time_max_s; the controller knows what it waits for";
            Err(Failure::safety(reason, limit))
        }
        Reason::Infeasible => {
            let refused =
                "every command was one that no robot could follow, for too long; the log above says why the first was";
            Err(Failure::safety(reason, refused))
        }
        Reason::Deadline => Err(Failure::Deadline { misses: STOP_AFTER_TICKS as u64 }),
        _ => Ok(End::Over(reason)),
    }
}

fn main() -> std::process::ExitCode {
    node::main::<Simulate>()
}
