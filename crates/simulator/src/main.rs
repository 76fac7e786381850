//! The simulator over the bus: commands move the robot, its state wakes the others.

use lateness::RightsSettings;
use messages::code::{Process, Reason};
use messages::topic;
use node::{End, Failure, Program, Shell};
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
        if shell.real_time() {
            return Err(Failure::unusable("the simulator runs in lock-step only: start it without --real-time"));
        }
        // Not before there is work to do: who only checks a configuration leaves nothing behind.
        if let Err(error) = self.soles.write() {
            tracing::warn!("condensed soles cannot be kept: {error}");
        }
        let mut commands = shell.subscriber(topic::ROBOT_COMMAND, 8)?;
        let mut starts = shell.subscriber(topic::WALK_START, 1)?;
        let mut states = shell.publisher(topic::ROBOT_STATE)?;
        let mut truths = shell.publisher(topic::TRUTH_ROBOT)?;
        shell.ready()?;
        if !shell.wait_for_others(&NEEDED)? {
            return Ok(End::Asked);
        }
        states.publish(&self.process.unplaced())?;
        let Some(placing) = shell.wait_tick(&mut commands, -1)? else { return Ok(End::Asked) };
        let placed = self.process.place(&placing);
        let mut output = placed.map_err(|error| Failure::safety(Reason::Infeasible, error))?;
        loop {
            let tick = output.state.header.tick;
            states.publish(&output.state)?;
            truths.publish(&output.truth)?;
            if let Some(reason) = output.over {
                // The last state is answered too, so that every recording of a walk ends with the same message. After a fall
                // nobody is owed an answer, and the fall is what is to be told.
                if reason == Reason::Finished && shell.wait_tick(&mut commands, tick)?.is_none() {
                    return Ok(End::Asked);
                }
                self.report(shell, &output);
                if reason == Reason::NotSettled {
                    let limit = "no walk/start within run.settle_time_max_s; the controller knows what it waits for";
                    return Err(Failure::safety(reason, limit));
                }
                if reason == Reason::Infeasible {
                    let refused = "for a second, every command was one that no robot could follow; the log above says why the first was";
                    return Err(Failure::safety(reason, refused));
                }
                return Ok(End::Over(reason));
            }
            // The plant moves under the command before, while the others compute the answer to this state.
            shell.cycle_starts();
            output = self.process.advance();
            shell.cycle_waits();
            let Some(command) = shell.wait_tick(&mut commands, tick)? else { return Ok(End::Asked) };
            if let Some(why) = self.process.take_command(&command) {
                tracing::warn!("tick {tick}: {why}: refused, the one before stays in force (health counts the rest)");
            }
            // Published before the command: looked for earlier, it would be there or not as the machine's load has it.
            if let Some(start) = starts.latest()? {
                self.process.take_start(&start);
            }
            if !shell.wait_for_recorder(tick)? {
                return Ok(End::Asked);
            }
            self.report(shell, &output);
            shell.cycle_ends(tick)?;
        }
    }
}

impl Simulate {
    fn report(&self, shell: &mut Shell, output: &SimulatorOutput) {
        let health = shell.figures();
        health.walk_time_s = output.truth.walk_time_s;
        health.late = self.process.late();
        health.solver_iterations = output.truth.contact_iterations;
        health.reason = output.over.unwrap_or(Reason::None).code();
        health.simulator = *self.process.figures();
    }
}

fn main() -> std::process::ExitCode {
    node::main::<Simulate>()
}
