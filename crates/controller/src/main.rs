//! The controller over the bus: robot state and deformation of a tick are answered by a command.

use controller::{ControllerProcess, ControllerSettings, Summary, new_joints};
use lateness::RightsSettings;
use messages::code::{Mode, Order, Process, Reason, State};
use messages::missing::{HOLD_AFTER_TICKS, STOP_AFTER_TICKS};
use messages::timing::DEFORMATION_WAIT_NS;
use messages::{ControllerFigures, topic};
use node::{End, Failure, Program, Shell};
use programs::ProgramWriter;

mod programs;

/// Messages that may wait: those of a time in which this process was held up are answered all the same, in turn.
const QUEUE: usize = 16;

struct Control {
    process: ControllerProcess,
    /// As it was after the last tick.
    told: Summary,
    programs: ProgramWriter,
}

impl Program for Control {
    const PROCESS: Process = Process::Controller;
    const ABOUT: &'static str = "Tracks pattern and ankle poses with the whole body.";
    type Settings = ControllerSettings;

    fn build(settings: ControllerSettings) -> Result<Self, Failure> {
        let process = ControllerProcess::new(&settings).map_err(Failure::unusable)?;
        Ok(Self { process, told: Summary::default(), programs: ProgramWriter::new(settings.programs) })
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
        let mut patterns = shell.pattern_subscriber()?;
        let mut states = shell.subscriber(topic::ROBOT_STATE, QUEUE)?;
        let mut deformations = shell.subscriber(topic::SOLE_DEFORMATION, QUEUE)?;
        let mut commands = shell.publisher(topic::ROBOT_COMMAND)?;
        let mut starts = shell.publisher(topic::WALK_START)?;
        let mut orders = shell.subscriber(topic::WALK_ORDER, 1)?;
        let Some(pattern) = shell.wait_pattern(&mut patterns)? else { return Ok(End::Asked) };
        self.process
            .take_pattern(&pattern.header, &pattern.phases)
            .map_err(|error| Failure::safety(Reason::PatternRefused, error))?;
        shell.figures().walk_duration_s = pattern.header.duration_s;
        if !shell.may_walk_off() {
            self.process.wait_for_start();
        }
        shell.ready()?;
        let mut wanting_ticks = 0;
        while let Some(state) = shell.wait(&mut states)? {
            let due_ns = shell.woken_by(&state.header);
            let deformation = match due_ns {
                Some(due_ns) => {
                    shell.wait_tick_until(&mut deformations, state.header.tick, due_ns + DEFORMATION_WAIT_NS)?
                }
                None => {
                    let Some(deformation) = shell.wait_tick(&mut deformations, state.header.tick)? else { break };
                    Some(deformation)
                }
            };
            shell.cycle_starts();
            match orders.latest()?.and_then(|order| Order::from_code(order.order)) {
                Some(Order::Start) => self.process.start(),
                Some(Order::Stop) => self.process.stop(),
                Some(Order::None) | None => {}
            }
            if shell.asked_to_stop() {
                self.process.stop();
            }
            let mut walks = false;
            let output = self.process.step(&state, deformation.as_ref());
            shell.step_done("solving");
            if let Some(output) = output.map_err(|error| Failure::safety(error.reason(), error))? {
                // Before the command: whoever has the command of this tick then also has the start decided at it.
                if let Some(start) = &output.start {
                    starts.publish(start)?;
                }
                commands.publish(&output.command)?;
                shell.published(commands.sent_ns());
                self.tell(&output.summary, state.header.tick);
                let holding = output.command.mode == Mode::Holding.code();
                // Nothing is solved while the posture is held.
                if !holding {
                    self.programs.write(state.header.tick, output.command.status, self.process.whole_body());
                }
                let figures = shell.figures();
                figures.state = if holding { State::Holding } else { State::Running }.code();
                let stopped = if output.summary.stopped { Reason::Asked } else { Reason::None };
                figures.reason = output.summary.holding.unwrap_or(stopped).code();
                figures.solver_status = output.command.status;
                figures.solver_iterations = output.command.solver_iterations;
                figures.solver_residual = output.command.solver_residual;
                figures.walk_time_s = output.command.walk_time_s;
                figures.late = output.summary.deformation_missing;
                figures.controller = controller_figures(&output.summary);
                walks = output.command.mode == Mode::Walking.code();
                let wants = due_ns.is_some() && output.summary.holding == Some(Reason::InputMissing);
                wanting_ticks = if wants { wanting_ticks + 1 } else { 0 };
            }
            shell.cycle_ends(state.header.tick)?;
            if wanting_ticks > STOP_AFTER_TICKS - HOLD_AFTER_TICKS {
                return Err(Failure::Deadline { misses: STOP_AFTER_TICKS as u64 });
            }
            if shell.ends(walks) {
                break;
            }
        }
        Ok(End::Asked)
    }
}

impl Control {
    /// The first of each kind of trouble goes to the log; health counts the rest.
    fn tell(&mut self, now: &Summary, tick: i64) {
        let before = std::mem::replace(&mut self.told, *now);
        if let (0, Some(worst)) = (before.relaxed, &now.worst) {
            tracing::warn!(
                "tick {tick}: limits exclude each other, gave way: {}",
                worst.describe(self.process.whole_body())
            );
        }
        let body = self.process.whole_body();
        let limits = [
            ("as fast or as far as they may be", before.joints_limited_bits, now.joints_limited_bits),
            ("at the torque that they may have", before.torques_limited_bits, now.torques_limited_bits),
        ];
        for (which, before, now) in limits {
            let joints = new_joints(before, now, body);
            if !joints.is_empty() {
                tracing::warn!("tick {tick}: {which}, for the first time: {}", joints.join(", "));
            }
        }
        if before.by_backup == 0 && now.by_backup > 0 {
            tracing::warn!("tick {tick}: the solver has no answer, the backup is asked");
        }
        if before.held == 0 && now.held > 0 {
            let outcome = self.process.whole_body().report().solver_status;
            tracing::warn!("tick {tick}: no usable step ({outcome:?}), the joints are brought to rest");
        }
        if before.deformation_missing == 0 && now.deformation_missing > 0 {
            tracing::warn!("tick {tick}: no deformation of the soles for this tick, the last one is used");
        }
        if let (0, Some(why)) = (before.measurements_refused, now.last_refused) {
            tracing::warn!("tick {tick}: a measurement is not used for feedback: {why}");
        }
        if let (None, Some(reason)) = (before.holding, now.holding) {
            tracing::warn!("tick {tick}: the posture is held: {reason}");
        }
    }
}

fn controller_figures(summary: &Summary) -> ControllerFigures {
    let worst = summary.worst.as_ref();
    ControllerFigures {
        steps_solved: summary.solved,
        steps_relaxed: summary.relaxed,
        steps_held: summary.held,
        steps_by_backup: summary.by_backup,
        states_refused: summary.state_refused,
        measurements_refused: summary.measurements_refused,
        joint_distance_max_rad: summary.joint_distance_rad,
        com_distance_m: summary.com_error_m,
        collision_distance_m: summary.collision_distance_m,
        worst_limit: worst.map_or(0, |worst| worst.limit.code()),
        worst_limit_index: worst.map_or(0, |worst| worst.index as u32),
        worst_limit_amount: worst.map_or(0.0, |worst| worst.amount),
        base_distance_m: summary.base_distance_m,
        base_distance_rad: summary.base_distance_rad,
        feet_disagreement_m: summary.feet_disagreement_m,
    }
}

fn main() -> std::process::ExitCode {
    node::main::<Control>()
}
