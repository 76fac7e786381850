//! The steps of all processes composed in one thread: for tests, replay, experiments and sweeps.
//!
//! The same scenario files, the same settings, the same step functions and the same order of messages as the processes have
//! over shared memory in lock-step, so the numbers are the same to the bit: what holds here holds there.
//!
//! ```text
//! planner -> pattern
//! state -1 -> deformation -1 -> command -1: the robot is placed
//! state k  -> deformation k  -> command k;  the plant moves from t_k to t_(k+1) under command k - 1
//! ```

mod hash;

pub use hash::NumberHash;

use anyhow::Context;
use controller::{ControllerProcess, ControllerSettings};
use estimator::{EstimatorOutput, EstimatorProcess, EstimatorSettings};
use messages::code::Reason;
use messages::{RobotCommand, RobotState, SoleContact, SoleDeformation, Truth, WalkStart};
use planner::{PlannerOutput, PlannerSettings};
use report::{Gather, ReportSettings, Said, WalkFigures};
use scenario::Scenario;
use simulator::{SimulatorOutput, SimulatorProcess, SimulatorSettings};
use soles::Store;
use std::collections::BTreeMap;

/// A part of the loop that takes time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Sole equilibria.
    Estimator,
    /// Observer and whole-body step.
    Controller,
    /// Simulated robot, sensors and stabiliser.
    Plant,
}

/// Messages that do not come at a tick: what the clock does to a walk, without a clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Lost {
    /// The controller hears nothing of the estimator.
    pub deformation: bool,
    /// The robot hears nothing of the controller.
    pub command: bool,
    /// Nobody hears of the robot's state: a driver that skips the tick. There is no answer then, and the tick shows the one before.
    pub state: bool,
}

/// Everything that was said at a tick.
#[derive(Debug, Clone)]
pub struct Tick {
    /// What the robot measured.
    pub state: RobotState,
    /// What really was.
    pub truth: Truth,
    /// What the soles did.
    pub deformation: SoleDeformation,
    /// Node by node.
    pub contact: SoleContact,
    /// What the robot was told.
    pub command: RobotCommand,
    /// Time zero, at the tick of the decision.
    pub start: Option<WalkStart>,
}

/// What walks in one process have in common: each sole is condensed once, each walk planned once.
#[derive(Debug)]
pub struct Shared {
    soles: Store,
    /// By the planner's effective configuration.
    plans: BTreeMap<String, PlannerOutput>,
}

impl Default for Shared {
    fn default() -> Self {
        Self { soles: Store::in_memory(), plans: BTreeMap::new() }
    }
}

impl Shared {
    fn plan(&mut self, scenario: &Scenario) -> anyhow::Result<PlannerOutput> {
        let config = scenario.config("planner")?;
        let text = config.effective_text();
        if let Some(planned) = self.plans.get(&text) {
            return Ok(planned.clone());
        }
        let settings = config.parse::<PlannerSettings>()?;
        let planned = planner::plan_with_store(&settings, &mut self.soles).context("planner")?;
        self.plans.insert(text, planned.clone());
        Ok(planned)
    }
}

/// The processes of a scenario, without the recorder.
pub struct ClosedLoop {
    /// The walk.
    pub planned: PlannerOutput,
    estimator: EstimatorProcess,
    controller: ControllerProcess,
    simulator: SimulatorProcess,
    now: SimulatorOutput,
    /// The last answer.
    answered: Option<(EstimatorOutput, RobotCommand)>,
    gather: Gather,
}

impl ClosedLoop {
    /// Builds all processes of a scenario and places the robot.
    ///
    /// # Errors
    /// Whatever is wrong with configuration, robot, gait or start configuration.
    pub fn new(scenario: &Scenario) -> anyhow::Result<Self> {
        Self::sharing(scenario, &mut Shared::default())
    }

    /// The same, with what earlier walks of this process have built. A plan is that of the files as they were when it was made.
    ///
    /// # Errors
    /// Whatever is wrong with configuration, robot, gait or start configuration.
    pub fn sharing(scenario: &Scenario, shared: &mut Shared) -> anyhow::Result<Self> {
        let planned = shared.plan(scenario)?;
        let settings: EstimatorSettings = scenario.config("estimator")?.parse()?;
        let mut estimator = EstimatorProcess::with_store(&settings, &mut shared.soles).context("estimator")?;
        let settings: ControllerSettings = scenario.config("controller")?.parse()?;
        let mut controller = ControllerProcess::new(&settings).context("controller")?;
        let settings: SimulatorSettings = scenario.config("simulator")?.parse()?;
        let mut simulator = SimulatorProcess::with_store(settings, &mut shared.soles).context("simulator")?;
        estimator.take_pattern(&planned.header, &planned.phases)?;
        controller.take_pattern(&planned.header, &planned.phases)?;
        let unplaced = simulator.unplaced();
        let (_, command, _) = answer(&mut estimator, &mut controller, &unplaced, |_| {}, &mut |_| {}, Lost::default())?;
        let now = simulator.place(&command).context("simulator")?;
        let mut gather = Gather::default();
        gather.take(Said::Pattern(&planned.header, &planned.phases));
        gather.take(Said::Command(&command));
        Ok(Self { planned, estimator, controller, simulator, now, answered: None, gather })
    }

    /// One control period; `None` once the run is over.
    ///
    /// # Errors
    /// If the controller cannot go on.
    pub fn step(&mut self) -> anyhow::Result<Option<Tick>> {
        self.step_measuring(|_| {})
    }

    /// The same; `done` is called when a part has done its work of the tick: for timing.
    ///
    /// # Errors
    /// If the controller cannot go on.
    pub fn step_probed(&mut self, done: impl FnMut(Part)) -> anyhow::Result<Option<Tick>> {
        self.step_with(|_| {}, |_| {}, SimulatorProcess::advance, done, Lost::default())
    }

    /// The same, with an estimator that says something else: what it says goes through `deform` first.
    ///
    /// # Errors
    /// If the controller cannot go on.
    pub fn step_deforming(&mut self, deform: impl FnOnce(&mut SoleDeformation)) -> anyhow::Result<Option<Tick>> {
        self.step_with(|_| {}, deform, SimulatorProcess::advance, |_| {}, Lost::default())
    }

    /// The same, with sensors that fail: what the robot says it measures goes through `fault` first.
    ///
    /// # Errors
    /// If the controller cannot go on.
    pub fn step_measuring(&mut self, fault: impl FnOnce(&mut RobotState)) -> anyhow::Result<Option<Tick>> {
        self.step_around(fault, SimulatorProcess::advance)
    }

    /// The same, where the caller lets the simulator advance: to time it, say.
    ///
    /// # Errors
    /// If the controller cannot go on.
    pub fn step_around(
        &mut self,
        fault: impl FnOnce(&mut RobotState),
        advance: impl FnOnce(&mut SimulatorProcess) -> SimulatorOutput,
    ) -> anyhow::Result<Option<Tick>> {
        self.step_with(fault, |_| {}, advance, |_| {}, Lost::default())
    }

    /// The same, where messages do not come in time; they are part of the tick all the same.
    ///
    /// # Errors
    /// If the controller cannot go on.
    pub fn step_losing(&mut self, lost: Lost) -> anyhow::Result<Option<Tick>> {
        self.step_with(|_| {}, |_| {}, SimulatorProcess::advance, |_| {}, lost)
    }

    /// The operator's word: the robot is to stand.
    pub fn stop(&mut self) {
        self.controller.stop();
    }

    fn step_with(
        &mut self,
        fault: impl FnOnce(&mut RobotState),
        deform: impl FnOnce(&mut SoleDeformation),
        advance: impl FnOnce(&mut SimulatorProcess) -> SimulatorOutput,
        mut done: impl FnMut(Part),
        lost: Lost,
    ) -> anyhow::Result<Option<Tick>> {
        if self.now.over.is_some() {
            return Ok(None);
        }
        let SimulatorOutput { mut state, truth, .. } = self.now;
        fault(&mut state);
        if lost.state
            && let Some((estimate, command)) = self.answered.clone()
        {
            self.gather.take(Said::Truth(&truth));
            self.now = advance(&mut self.simulator);
            let EstimatorOutput { deformation, contact, .. } = estimate;
            return Ok(Some(Tick { state, truth, deformation, contact, command, start: None }));
        }
        let (estimator, controller) = (&mut self.estimator, &mut self.controller);
        let (estimate, command, start) = answer(estimator, controller, &state, deform, &mut done, lost)?;
        self.gather.take(Said::Truth(&truth));
        self.gather.take(Said::Command(&command));
        self.gather.take(Said::Deformation(&estimate.deformation));
        if let Some(start) = &start {
            self.gather.take(Said::Start(start));
        }
        self.now = advance(&mut self.simulator);
        done(Part::Plant);
        if !lost.command {
            self.simulator.take_command(&command);
        }
        if let Some(start) = &start {
            self.estimator.take_start(start);
            self.simulator.take_start(start);
        }
        let EstimatorOutput { deformation, contact, .. } = estimate;
        self.answered = Some((estimate, command));
        Ok(Some(Tick { state, truth, deformation, contact, command, start }))
    }

    /// Why the run is over, once it is.
    #[must_use]
    pub fn over(&self) -> Option<Reason> {
        self.now.over
    }

    /// The figures of the walk so far, as of a recording; nobody measures times here.
    #[must_use]
    pub fn figures(&self) -> WalkFigures {
        let simulator = self.simulator.figures();
        WalkFigures {
            periods_unconverged: simulator.periods_unconverged,
            commands_refused: simulator.commands_refused,
            ..self.gather.finish(&ReportSettings::default())
        }
    }

    /// The controller, with the report of its last step.
    #[must_use]
    pub fn controller(&self) -> &ControllerProcess {
        &self.controller
    }

    /// The simulator, with the plant.
    #[must_use]
    pub fn simulator(&self) -> &SimulatorProcess {
        &self.simulator
    }
}

fn answer(
    estimator: &mut EstimatorProcess,
    controller: &mut ControllerProcess,
    state: &RobotState,
    deform: impl FnOnce(&mut SoleDeformation),
    done: &mut impl FnMut(Part),
    lost: Lost,
) -> anyhow::Result<(EstimatorOutput, RobotCommand, Option<WalkStart>)> {
    let mut estimate = estimator.step(state).context("the estimator has no pattern")?;
    deform(&mut estimate.deformation);
    done(Part::Estimator);
    let heard = (!lost.deformation).then_some(&estimate.deformation);
    let output = controller.step(state, heard).context("controller")?;
    let output = output.context("the controller has no pattern")?;
    done(Part::Controller);
    Ok((estimate, output.command, output.start))
}
