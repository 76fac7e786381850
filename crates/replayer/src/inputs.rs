//! The messages of a recording, by tick, complete or refused.

use crate::error::ReplayError;
use messages::code::Process;
use messages::{
    Header, Message, PatternHeader, PatternPhase, RobotCommand, RobotState, SoleContact, SoleDeformation, Topic, Truth,
    WalkOrder, WalkStart, topic,
};
use recording::{ReadError, Recording};
use std::collections::BTreeMap;

/// The messages of a topic by tick.
#[derive(Debug, Clone)]
pub struct Messages<T> {
    topic: &'static str,
    by_tick: BTreeMap<i64, T>,
}

impl<T: Message> Messages<T> {
    /// Messages of a topic as they lie in a recording, in whatever order that is.
    fn of(topic: Topic<T>, messages: Vec<T>) -> Result<Self, ReplayError> {
        let topic = topic.name();
        let mut by_tick = BTreeMap::new();
        for message in messages {
            let tick = message.header().tick;
            if by_tick.insert(tick, message).is_some() {
                return Err(ReplayError::Restart { topic, tick, before: tick });
            }
        }
        // A publisher that was started anew counts anew. Of a replay's recording nobody counted.
        let mut before: Option<&Header> = None;
        for header in by_tick.values().map(Message::header) {
            if let Some(before) = before.filter(|before| before.sequence > header.sequence) {
                return Err(ReplayError::Restart { topic, tick: header.tick, before: before.tick });
            }
            before = Some(header);
        }
        Ok(Self { topic, by_tick })
    }

    /// That no tick is missing from `first` to the last.
    fn complete_from(self, first: i64) -> Result<Self, ReplayError> {
        match (first..).zip(self.by_tick.keys()).find(|(expected, tick)| expected != *tick) {
            Some((expected, &tick)) => Err(ReplayError::Gap { topic: self.topic, tick, lost: tick - expected }),
            None => Ok(self),
        }
    }

    /// That there is any.
    fn needed_by(self, process: Process) -> Result<Self, ReplayError> {
        if self.by_tick.is_empty() { Err(ReplayError::Missing { topic: self.topic, process }) } else { Ok(self) }
    }

    /// The message of a tick.
    #[must_use]
    pub fn at(&self, tick: i64) -> Option<&T> {
        self.by_tick.get(&tick)
    }

    /// The message of a tick that was used there.
    ///
    /// # Errors
    /// [`ReplayError::Gap`] if it is not in the recording.
    pub fn used_at(&self, tick: i64) -> Result<&T, ReplayError> {
        self.at(tick).ok_or(ReplayError::Gap { topic: self.topic, tick: tick + 1, lost: 1 })
    }

    /// That no message was lost on its way into the recording: the publisher numbers what it says.
    fn unbroken(self) -> Result<Self, ReplayError> {
        let mut before: Option<&Header> = None;
        for header in self.by_tick.values().map(Message::header) {
            if let Some(before) = before.filter(|before| before.sequence + 1 < header.sequence) {
                let lost = (header.sequence - before.sequence - 1) as i64;
                return Err(ReplayError::Gap { topic: self.topic, tick: header.tick, lost });
            }
            before = Some(header);
        }
        Ok(self)
    }

    /// The messages in the order of their ticks.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.by_tick.values()
    }

    /// The topic's name.
    #[must_use]
    pub fn topic(&self) -> &'static str {
        self.topic
    }
}

/// Everything that was said in a run.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// Whether the run was by the clock: then the messages themselves say which inputs they were made from.
    pub by_the_clock: bool,
    /// Whether an operator told the robot to walk, or to stand.
    pub ordered: bool,
    /// The walk; `None` if it was refused or never planned.
    pub pattern: Option<(PatternHeader, Vec<PatternPhase>)>,
    /// Time zero, at the tick at which it was decided.
    pub starts: Messages<WalkStart>,
    /// What the robot measured, from tick -1 on.
    pub states: Messages<RobotState>,
    /// What the soles did, from tick -1 on.
    pub deformations: Messages<SoleDeformation>,
    /// Node by node; not of every tick.
    pub contacts: Messages<SoleContact>,
    /// What the robot was told, from tick -1 on.
    pub commands: Messages<RobotCommand>,
    /// What really was, from tick 0 on.
    pub truths: Messages<Truth>,
}

/// The tick of the first state: the robot before it stands.
const FIRST_TICK: i64 = -1;

impl Inputs {
    /// Takes the messages of a run out of its recording; those that the process listens to must be complete.
    ///
    /// # Errors
    /// What cannot be read, was recorded at a pace that is not known, or is missing.
    pub fn of(recording: &Recording, process: Process) -> Result<Self, ReplayError> {
        let by_the_clock = match recording.facts()?.remove("pace") {
            Some(pace) if pace == "lock-step" => false,
            Some(pace) if pace == "real time" => true,
            pace => return Err(ReplayError::Pace { found: pace.unwrap_or_else(|| "?".to_string()) }),
        };
        let mut orders = Vec::<WalkOrder>::new();
        let mut patterns = Vec::new();
        let (mut starts, mut states, mut deformations) = (Vec::new(), Vec::new(), Vec::new());
        let (mut contacts, mut commands, mut truths) = (Vec::new(), Vec::new(), Vec::new());
        recording.each(|entry| {
            patterns.extend(entry.pattern()?);
            starts.extend(entry.read(topic::WALK_START)?);
            orders.extend(entry.read(topic::WALK_ORDER)?);
            // What the process neither hears nor says is not kept: a long recording is large.
            if process != Process::Planner {
                states.extend(entry.read(topic::ROBOT_STATE)?);
                if process != Process::Simulator {
                    deformations.extend(entry.read(topic::SOLE_DEFORMATION)?);
                }
            }
            match process {
                Process::Estimator => contacts.extend(entry.read(topic::SOLE_CONTACT)?),
                Process::Controller => commands.extend(entry.read(topic::ROBOT_COMMAND)?),
                Process::Simulator => {
                    commands.extend(entry.read(topic::ROBOT_COMMAND)?);
                    truths.extend(entry.read(topic::TRUTH_ROBOT)?);
                }
                _ => {}
            }
            Ok::<_, ReadError>(())
        })?;
        let mut inputs = Self {
            by_the_clock,
            ordered: !orders.is_empty(),
            pattern: patterns.into_iter().min_by_key(|(header, _)| header.header.sequence),
            starts: Messages::of(topic::WALK_START, starts)?,
            states: Messages::of(topic::ROBOT_STATE, states)?,
            deformations: Messages::of(topic::SOLE_DEFORMATION, deformations)?,
            contacts: Messages::of(topic::SOLE_CONTACT, contacts)?,
            commands: Messages::of(topic::ROBOT_COMMAND, commands)?,
            truths: Messages::of(topic::TRUTH_ROBOT, truths)?,
        };
        match process {
            // Which of them were used is known when they are.
            Process::Estimator if by_the_clock => inputs.states = inputs.states.needed_by(process)?,
            Process::Controller if by_the_clock => inputs.commands = inputs.commands.needed_by(process)?.unbroken()?,
            Process::Simulator if by_the_clock => {
                inputs.commands = inputs.commands.needed_by(process)?;
                inputs.truths = inputs.truths.needed_by(process)?.complete_from(FIRST_TICK + 1)?;
            }
            Process::Estimator => inputs.states = inputs.states.needed_by(process)?.complete_from(FIRST_TICK)?,
            Process::Controller => {
                inputs.states = inputs.states.needed_by(process)?.complete_from(FIRST_TICK)?;
                inputs.deformations = inputs.deformations.needed_by(process)?.complete_from(FIRST_TICK)?;
            }
            Process::Simulator => {
                inputs.commands = inputs.commands.needed_by(process)?.complete_from(FIRST_TICK)?;
            }
            Process::Planner | Process::Recorder | Process::Launcher => {}
        }
        Ok(inputs)
    }

    /// The recorded walk.
    ///
    /// # Errors
    /// [`ReplayError::Missing`] if there is none.
    pub fn pattern_for(&self, process: Process) -> Result<(&PatternHeader, &[PatternPhase]), ReplayError> {
        let pattern = self.pattern.as_ref().map(|(header, phases)| (header, phases.as_slice()));
        pattern.ok_or(ReplayError::Missing { topic: topic::WALK_PATTERN.name(), process })
    }
}
