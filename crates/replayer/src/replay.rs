//! The processes on recorded inputs.

use crate::compare::Comparison;
use crate::error::ReplayError;
use crate::inputs::Inputs;
use controller::{ControllerProcess, ControllerSettings};
use estimator::{EstimatorProcess, EstimatorSettings};
use messages::code::{Mode, Process};
use messages::{
    Header, PatternHeader, PatternPhase, RobotCommand, RobotState, SoleContact, SoleDeformation, Truth, WalkStart,
    topic,
};
use planner::PlannerSettings;
use scenario::Config;
use simulator::{SimulatorOutput, SimulatorProcess, SimulatorSettings};
use soles::Store;
use std::error::Error;

/// The processes that can be run again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Replayable {
    /// Configuration to pattern.
    Planner,
    /// States to deformations.
    Estimator,
    /// States and deformations to commands.
    Controller,
    /// Commands to states.
    Simulator,
}

impl From<Replayable> for Process {
    fn from(replayable: Replayable) -> Self {
        match replayable {
            Replayable::Planner => Self::Planner,
            Replayable::Estimator => Self::Estimator,
            Replayable::Controller => Self::Controller,
            Replayable::Simulator => Self::Simulator,
        }
    }
}

/// What a process says as it is run again, for whoever wants to keep it.
#[derive(Debug)]
pub enum Said<'a> {
    /// The walk.
    Pattern(&'a PatternHeader, &'a [PatternPhase]),
    /// Time zero.
    Start(&'a WalkStart),
    /// What the robot measures.
    State(&'a RobotState),
    /// What the soles do.
    Deformation(&'a SoleDeformation),
    /// Node by node.
    Contact(&'a SoleContact),
    /// What the robot is told.
    Command(&'a RobotCommand),
    /// What really is.
    Truth(&'a Truth),
}

/// Who hears what a process says, and ends the replay by an error.
pub type Hear<'a> = &'a mut dyn FnMut(Said) -> Result<(), ReplayError>;

/// Runs a process again on the inputs of a run and compares; `said` hears everything it says.
///
/// # Errors
/// If the process cannot be built or the inputs are not for it, and those of `said`.
pub fn replay(
    process: Replayable,
    inputs: &Inputs,
    config: &Config,
    store: &mut Store,
    said: Hear,
) -> Result<Comparison, ReplayError> {
    let mut comparison = Comparison::default();
    match process {
        Replayable::Planner => plan(inputs, config, &mut comparison, said)?,
        Replayable::Estimator => estimate(inputs, config, store, &mut comparison, said)?,
        Replayable::Controller => control(inputs, config, &mut comparison, said)?,
        Replayable::Simulator => simulate(inputs, config, store, &mut comparison, said)?,
    }
    Ok(comparison)
}

fn plan(inputs: &Inputs, config: &Config, comparison: &mut Comparison, said: Hear) -> Result<(), ReplayError> {
    let settings: PlannerSettings = config.parse()?;
    let planned = planner::plan(&settings).map_err(build(Process::Planner))?;
    said(Said::Pattern(&planned.header, &planned.phases))?;
    let name = topic::WALK_PATTERN.name();
    let (header, phases) = inputs.pattern_for(Process::Planner)?;
    // A hash differs as a whole when a last digit does; what it is of is compared here.
    let now = PatternHeader { pattern_hash: header.pattern_hash, ..planned.header };
    comparison.message(name, Some(header), Some(&now));
    for index in 0..phases.len().max(planned.phases.len()) {
        if let Some((then, now)) = comparison.both(name, phases.get(index), planned.phases.get(index)) {
            comparison.value(name, index as i64, then, now);
        }
    }
    Ok(())
}

fn estimate(
    inputs: &Inputs,
    config: &Config,
    store: &mut Store,
    comparison: &mut Comparison,
    said: Hear,
) -> Result<(), ReplayError> {
    let settings: EstimatorSettings = config.parse()?;
    let mut process = EstimatorProcess::with_store(&settings, store).map_err(build(Process::Estimator))?;
    let (header, phases) = pattern(inputs, Process::Estimator, process.robot_fingerprint())?;
    if inputs.by_the_clock {
        process.bound_work();
        inputs.deformations.iter().try_for_each(|said| inputs.states.used_at(said.header.tick).map(drop))?;
    }
    process.take_pattern(header, phases)?;
    for state in inputs.states.iter() {
        let tick = state.header.tick;
        if inputs.by_the_clock {
            // It heard of the start when it came, and said so in its walk time.
            let said_s = inputs.deformations.at(tick).map(|said| said.walk_time_s);
            let heard = inputs.starts.iter().find(|start| said_s == Some(start.walk_time_s(tick)));
            heard.into_iter().for_each(|start| process.take_start(start));
        }
        let output = process.step(state);
        if let Some(output) = &output {
            said(Said::Deformation(&output.deformation))?;
            said(Said::Contact(&output.contact))?;
        }
        // The answer to the last state may not have been waited for.
        let then = inputs.deformations.at(tick);
        if then.is_some() {
            comparison.message(inputs.deformations.topic(), then, output.as_ref().map(|output| &output.deformation));
        }
        let then = inputs.contacts.at(tick);
        if then.is_some() {
            comparison.message(inputs.contacts.topic(), then, output.as_ref().map(|output| &output.contact));
        }
        // Decided on the answer to this state, heard before the next one.
        if let Some(start) = inputs.starts.at(tick).filter(|_| !inputs.by_the_clock) {
            process.take_start(start);
        }
    }
    Ok(())
}

/// By the clock each command says which deformation it was made from.
fn control_by_the_clock(
    inputs: &Inputs,
    process: &mut ControllerProcess,
    comparison: &mut Comparison,
    said: Hear,
) -> Result<(), ReplayError> {
    if inputs.ordered {
        process.wait_for_start();
    }
    let (mut used_tick, mut held) = (None, false);
    for then in inputs.commands.iter() {
        let tick = then.header.tick;
        let state = inputs.states.used_at(tick)?;
        let is_new = used_tick != Some(then.deformation_tick);
        let deformation = if is_new { Some(inputs.deformations.used_at(then.deformation_tick)?) } else { None };
        used_tick = Some(then.deformation_tick);
        // An order takes effect at the tick at which the robot obeys.
        if inputs.ordered && inputs.starts.at(tick).is_some() {
            process.start();
        }
        let holds = then.mode == Mode::Holding.code();
        if holds && !held {
            process.stop();
        }
        held = holds;
        let output = match process.step(state, deformation) {
            Ok(output) => output,
            Err(cannot) => {
                tracing::warn!("tick {tick}: {cannot}");
                comparison.message(inputs.commands.topic(), Some(then), None);
                break;
            }
        };
        let command = output.as_ref().map(|output| &output.command);
        let start = output.as_ref().and_then(|output| output.start.as_ref());
        start.map(Said::Start).into_iter().chain(command.map(Said::Command)).try_for_each(&mut *said)?;
        comparison.message(inputs.commands.topic(), Some(then), command);
        comparison.message(inputs.starts.topic(), inputs.starts.at(tick), start);
    }
    Ok(())
}

fn control(inputs: &Inputs, config: &Config, comparison: &mut Comparison, said: Hear) -> Result<(), ReplayError> {
    let settings: ControllerSettings = config.parse()?;
    let mut process = ControllerProcess::new(&settings).map_err(build(Process::Controller))?;
    let (header, phases) = pattern(inputs, Process::Controller, process.robot_fingerprint())?;
    process.take_pattern(header, phases)?;
    if inputs.by_the_clock {
        return control_by_the_clock(inputs, &mut process, comparison, said);
    }
    for state in inputs.states.iter() {
        let tick = state.header.tick;
        // Without it the controller did not step: the last state of a run that was broken off.
        let Some(deformation) = inputs.deformations.at(tick) else { break };
        let then = inputs.commands.at(tick);
        let output = match process.step(state, Some(deformation)) {
            Ok(output) => output,
            Err(cannot) => {
                tracing::warn!("tick {tick}: {cannot}");
                comparison.message(inputs.commands.topic(), then, None);
                break;
            }
        };
        let command = output.as_ref().map(|output| &output.command);
        let start = output.as_ref().and_then(|output| output.start.as_ref());
        start.map(Said::Start).into_iter().chain(command.map(Said::Command)).try_for_each(&mut *said)?;
        // A run that was broken off may have been so before the step, or between step and recording.
        if then.is_some() {
            comparison.message(inputs.commands.topic(), then, command);
            comparison.message(inputs.starts.topic(), inputs.starts.at(tick), start);
        }
    }
    Ok(())
}

fn simulate(
    inputs: &Inputs,
    config: &Config,
    store: &mut Store,
    comparison: &mut Comparison,
    said: Hear,
) -> Result<(), ReplayError> {
    let settings: SimulatorSettings = config.parse()?;
    let mut process = SimulatorProcess::with_store(settings, store).map_err(build(Process::Simulator))?;
    let mut compare =
        |comparison: &mut Comparison, state: &RobotState, truth: Option<&Truth>| -> Result<(), ReplayError> {
            said(Said::State(state))?;
            // The last command of a run that was broken off may have been recorded, and the state after it not.
            let then = inputs.states.at(state.header.tick);
            if then.is_some() {
                comparison.message(inputs.states.topic(), then, Some(state));
            }
            if let Some(truth) = truth {
                said(Said::Truth(truth))?;
                let then = inputs.truths.at(state.header.tick);
                if then.is_some() {
                    comparison.message(inputs.truths.topic(), then, Some(truth));
                }
            }
            Ok(())
        };
    let mut commands = inputs.commands.iter();
    let Some(placing) = commands.next() else { return Ok(()) };
    same_robot(&placing.header, process.robot_fingerprint())?;
    compare(comparison, &process.unplaced(), None)?;
    let SimulatorOutput { state, truth, mut over } = process.place(placing).map_err(build(Process::Simulator))?;
    compare(comparison, &state, Some(&truth))?;
    let mut last_tick = state.header.tick;
    // By the clock each truth says under which command the robot came there.
    let mut acting_tick = placing.header.tick;
    for then in inputs.truths.iter().filter(|truth| inputs.by_the_clock && truth.header.tick > 0) {
        if over.is_some() {
            break;
        }
        let tick = then.header.tick - 1;
        if then.command_tick != acting_tick {
            acting_tick = then.command_tick;
            if let Some(why) = process.take_command(inputs.commands.used_at(acting_tick)?) {
                tracing::warn!("tick {tick}: {why}");
            }
        }
        if let Some(start) = inputs.starts.iter().find(|start| then.walk_time_s == start.walk_time_s(tick + 1)) {
            process.take_start(start);
        }
        let output = process.advance();
        compare(comparison, &output.state, Some(&output.truth))?;
        last_tick = output.state.header.tick;
        over = output.over;
    }
    for command in commands.filter(|_| !inputs.by_the_clock) {
        if over.is_some() {
            break;
        }
        let output = process.advance();
        if let Some(why) = process.take_command(command) {
            tracing::warn!("tick {}: {why}", command.header.tick);
        }
        if let Some(start) = inputs.starts.at(command.header.tick) {
            process.take_start(start);
        }
        compare(comparison, &output.state, Some(&output.truth))?;
        last_tick = output.state.header.tick;
        over = output.over;
    }
    if over.is_some() {
        // It may have gone on then where it ends now.
        for state in inputs.states.iter().filter(|state| state.header.tick > last_tick) {
            comparison.message(inputs.states.topic(), Some(state), None);
        }
    }
    Ok(())
}

fn pattern(inputs: &Inputs, process: Process, robot: u64) -> Result<(&PatternHeader, &[PatternPhase]), ReplayError> {
    let (header, phases) = inputs.pattern_for(process)?;
    same_robot(&header.header, robot)?;
    Ok((header, phases))
}

fn same_robot(header: &Header, configured: u64) -> Result<(), ReplayError> {
    let recorded = header.robot_fingerprint;
    if recorded == configured { Ok(()) } else { Err(ReplayError::OtherRobot { recorded, configured }) }
}

fn build<E: Error + Send + Sync + 'static>(process: Process) -> impl FnOnce(E) -> ReplayError {
    move |source| ReplayError::Build { process, source: Box::new(source) }
}
