//! The table of topics: which message travels where, how often, and who keeps it.
//!
//! It exists once, here. The owner of a domain creates one service per row, the recorder subscribes to every row, and
//! [`visit`] hands each row with its message type to code that must treat all of them.

use crate::code::Process;
use crate::{
    Health, Message, PatternHeader, PatternPhase, RobotCommand, RobotState, SoleContact, SoleDeformation, Truth,
    WalkOrder, WalkStart,
};
use std::marker::PhantomData;

/// One row of the table; `T` is the message that travels.
pub struct Topic<T> {
    /// What it carries, and who says and hears it.
    pub row: Row,
    message: PhantomData<fn() -> T>,
}

/// A row without its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Name of the topic; the simulator's truth and health have one level more.
    pub name: &'static str,
    /// Messages per second; zero: once.
    pub rate_hz: u32,
    /// How many past messages the publisher keeps for those who come later.
    pub kept: u32,
    /// Whether publishing wakes those who wait for the topic; otherwise they look when they come by.
    pub wakes: bool,
    /// Who publishes.
    pub from: Process,
    /// Who needs it to work. The recorder takes everything, the launcher reads health and truth.
    pub to: &'static [Process],
}

impl<T> Topic<T> {
    const fn once(name: &'static str, from: Process, to: &'static [Process]) -> Self {
        Self { row: Row { name, rate_hz: 0, kept: 1, wakes: true, from, to }, message: PhantomData }
    }

    const fn word(name: &'static str, from: Process, to: &'static [Process]) -> Self {
        Self { row: Row { name, rate_hz: 0, kept: 1, wakes: false, from, to }, message: PhantomData }
    }

    const fn control(name: &'static str, from: Process, to: &'static [Process]) -> Self {
        Self { row: Row { name, rate_hz: 200, kept: 0, wakes: true, from, to }, message: PhantomData }
    }

    const fn observed(name: &'static str, kept: u32, from: Process, to: &'static [Process]) -> Self {
        Self { row: Row { name, rate_hz: 200, kept, wakes: false, from, to }, message: PhantomData }
    }

    /// Name of the topic.
    pub const fn name(&self) -> &'static str {
        self.row.name
    }
}

impl<T> Clone for Topic<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Topic<T> {}

use Process::{Controller, Estimator, Launcher, Planner, Recorder, Simulator};

/// The walking pattern: a slice of [`PatternPhase`] with a [`PatternHeader`].
pub const WALK_PATTERN: Topic<PatternHeader> =
    Topic::once("walk/pattern", Planner, &[Estimator, Controller, Simulator]);
/// Time zero of the walk.
pub const WALK_START: Topic<WalkStart> = Topic::once("walk/start", Controller, &[Estimator, Simulator]);
/// The operator's word: `soleus-inspect start` and `stop` say it, who looks on and takes no process's place.
pub const WALK_ORDER: Topic<WalkOrder> = Topic::word("walk/order", Launcher, &[Controller]);
/// Sensors.
pub const ROBOT_STATE: Topic<RobotState> = Topic::control("robot/state", Simulator, &[Estimator, Controller]);
/// Deformation of the soles.
pub const SOLE_DEFORMATION: Topic<SoleDeformation> = Topic::control("sole/deformation", Estimator, &[Controller]);
/// Contact node by node.
pub const SOLE_CONTACT: Topic<SoleContact> = Topic::observed("sole/contact", 0, Estimator, &[]);
/// Joint references and plan.
pub const ROBOT_COMMAND: Topic<RobotCommand> = Topic::control("robot/command", Controller, &[Simulator]);
/// What the simulator really did.
pub const TRUTH_ROBOT: Topic<Truth> = Topic::observed("truth/robot", 0, Simulator, &[]);

/// Health of a process.
pub const fn health(process: Process) -> Topic<Health> {
    let (name, to): (_, &[Process]) = match process {
        Planner => ("health/planner", &[Simulator]),
        Estimator => ("health/estimator", &[Simulator]),
        Controller => ("health/controller", &[Simulator]),
        Simulator => ("health/simulator", &[]),
        Recorder => ("health/recorder", &[Simulator]),
        Launcher => ("health/launcher", &[]),
    };
    Topic::observed(name, 1, process, to)
}

/// All rows.
pub const ROWS: [Row; 14] = [
    WALK_PATTERN.row,
    WALK_START.row,
    WALK_ORDER.row,
    ROBOT_STATE.row,
    SOLE_DEFORMATION.row,
    SOLE_CONTACT.row,
    ROBOT_COMMAND.row,
    TRUTH_ROBOT.row,
    health(Planner).row,
    health(Estimator).row,
    health(Controller).row,
    health(Simulator).row,
    health(Recorder).row,
    health(Launcher).row,
];

/// Something to be done for each topic, whatever its message.
pub trait Visitor {
    /// What may go wrong.
    type Error;

    /// A topic of single messages.
    ///
    /// # Errors
    /// As the implementation says.
    fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), Self::Error>;

    /// A topic of slices: elements `E` with a header `H`.
    ///
    /// # Errors
    /// As the implementation says.
    fn slice<H: Message, E: Element>(&mut self, topic: Topic<H>) -> Result<(), Self::Error>;
}

/// What an element of a slice must be: a message without a header of its own.
pub trait Element: crate::Plain + std::fmt::Debug + iceoryx2::prelude::ZeroCopySend + 'static {}
impl Element for PatternPhase {}

/// Does it for each topic, in the order of [`ROWS`].
///
/// # Errors
/// The first error of the visitor.
pub fn visit<V: Visitor>(visitor: &mut V) -> Result<(), V::Error> {
    visitor.slice::<PatternHeader, PatternPhase>(WALK_PATTERN)?;
    visitor.message(WALK_START)?;
    visitor.message(WALK_ORDER)?;
    visitor.message(ROBOT_STATE)?;
    visitor.message(SOLE_DEFORMATION)?;
    visitor.message(SOLE_CONTACT)?;
    visitor.message(ROBOT_COMMAND)?;
    visitor.message(TRUTH_ROBOT)?;
    for process in Process::ALL {
        visitor.message(health(*process))?;
    }
    Ok(())
}
