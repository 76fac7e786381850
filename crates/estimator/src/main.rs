//! The estimator over the bus: each robot state is answered by the deformation of the soles.

use estimator::{EstimatorProcess, EstimatorSettings};
use lateness::RightsSettings;
use messages::code::{Process, Reason, State};
use messages::timing::DEFORMATION_WAIT_NS;
use messages::topic;
use node::{End, Failure, Program, Shell};
use soles::Store;

/// States that may wait: those of a time in which this process was held up are answered all the same, in turn.
const QUEUE: usize = 16;

struct Estimate {
    process: EstimatorProcess,
    soles: Store,
}

impl Program for Estimate {
    const PROCESS: Process = Process::Estimator;
    const ABOUT: &'static str = "Turns the planned forces into ankle poses through the soles.";
    type Settings = EstimatorSettings;
    // Later, the controller has gone on without it.
    const ANSWER_DEADLINE_NS: u64 = DEFORMATION_WAIT_NS;

    fn build(settings: EstimatorSettings) -> Result<Self, Failure> {
        let mut soles = Store::from_environment();
        let process = EstimatorProcess::with_store(&settings, &mut soles).map_err(Failure::unusable)?;
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
        let mut patterns = shell.pattern_subscriber()?;
        let mut starts = shell.subscriber(topic::WALK_START, 1)?;
        let mut states = shell.subscriber(topic::ROBOT_STATE, QUEUE)?;
        let mut deformations = shell.publisher(topic::SOLE_DEFORMATION)?;
        let mut contacts = shell.publisher(topic::SOLE_CONTACT)?;
        if shell.real_time() {
            self.process.bound_work();
        }
        let Some(pattern) = shell.wait_pattern(&mut patterns)? else { return Ok(End::Asked) };
        self.process
            .take_pattern(&pattern.header, &pattern.phases)
            .map_err(|error| Failure::safety(Reason::PatternRefused, error))?;
        shell.figures().walk_duration_s = pattern.header.duration_s;
        shell.ready()?;
        while let Some(state) = shell.wait(&mut states)? {
            shell.woken_by(&state.header);
            shell.cycle_starts();
            if let Some(start) = starts.latest()? {
                self.process.take_start(&start);
            }
            let output = self.process.step(&state);
            shell.step_done("estimating");
            if let Some(output) = output {
                deformations.publish(&output.deformation)?;
                shell.published(deformations.sent_ns());
                contacts.publish(&output.contact)?;
                let figures = shell.figures();
                let held = output.summary.age_ticks > 0;
                figures.state = if held { State::Holding } else { State::Running }.code();
                figures.reason = if held { Reason::SolverFailed } else { Reason::None }.code();
                figures.solver_status = output.summary.status;
                figures.solver_iterations = output.summary.iterations;
                figures.solver_residual = output.summary.residual;
                figures.walk_time_s = output.deformation.walk_time_s;
            }
            shell.cycle_ends(state.header.tick)?;
            // Asked to stop by the clock, it goes on as long as there is a robot that needs it.
            if shell.ends(true) {
                break;
            }
        }
        Ok(End::Asked)
    }
}

fn main() -> std::process::ExitCode {
    node::main::<Estimate>()
}
