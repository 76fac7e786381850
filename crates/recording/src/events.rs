//! What happens in a run, as lines of a log that viewers show on their time line: `foxglove.Log`.
//!
//! It is read off the messages: processes that change their state, the begin of the walk, its steps, messages that
//! were lost, the fall.

use crate::wire::{VARINT, put_key, put_text, put_time, put_varint};
use messages::code::{Fall, PhaseKind, Process, Reason, State};
use messages::{CONTROL_PERIOD_NS, Health, PatternPhase, Truth, WalkStart};
use std::collections::BTreeMap;

/// How much a line matters; numbers of `foxglove.Log.Level`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// As it should be.
    Info = 2,
    /// Not as it should be.
    Warning = 3,
    /// The end of something.
    Error = 4,
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// How much it matters.
    pub level: Level,
    /// Who says so.
    pub name: &'static str,
    /// What happened.
    pub message: String,
}

/// Watches messages for what happens.
#[derive(Debug, Default)]
pub(crate) struct Events {
    states: BTreeMap<u32, (u32, u32, u64)>,
    /// Steps of the walk that are to come: walk time and what is said, in order.
    steps: Vec<(f64, String)>,
    steps_said: usize,
    tick_zero: Option<i64>,
    fallen: bool,
}

impl Events {
    /// A walk to come.
    pub(crate) fn pattern(&mut self, phases: &[PatternPhase], found: &mut Vec<Event>) {
        let mut last = 0;
        self.steps = phases
            .iter()
            .filter(|phase| {
                phase.kind == PhaseKind::SingleSupport.code() && std::mem::replace(&mut last, phase.step) != phase.step
            })
            .map(|phase| {
                let foot = if phase.feet[0].in_the_air == 1 { "left" } else { "right" };
                (phase.start_s, format!("step {}: the {foot} foot swings", phase.step))
            })
            .collect();
        self.steps_said = 0;
        let message = format!("a walk of {} steps is planned", self.steps.len());
        found.push(Event { level: Level::Info, name: Process::Planner.word(), message });
    }

    /// The begin of a walk.
    pub(crate) fn start(&mut self, start: &WalkStart, found: &mut Vec<Event>) {
        self.tick_zero = Some(start.tick_zero);
        let message = format!("the walk begins at tick {}", start.tick_zero);
        found.push(Event { level: Level::Info, name: Process::Controller.word(), message });
    }

    /// A tick has come.
    pub(crate) fn tick(&mut self, tick: i64, found: &mut Vec<Event>) {
        let Some(tick_zero) = self.tick_zero else { return };
        let walk_time_s = tick.saturating_sub(tick_zero) as f64 * (CONTROL_PERIOD_NS as f64 * 1e-9);
        while let Some((_, message)) = self.steps.get(self.steps_said).filter(|(start_s, _)| *start_s <= walk_time_s) {
            found.push(Event { level: Level::Info, name: Process::Controller.word(), message: message.clone() });
            self.steps_said += 1;
        }
    }

    /// The simulated robot.
    pub(crate) fn truth(&mut self, truth: &Truth, found: &mut Vec<Event>) {
        if truth.fallen == 1 && !self.fallen {
            let cause = Fall::from_code(truth.fall_cause).map_or("cause unknown", Fall::word);
            let message = format!("the robot has fallen at tick {}: {cause}", truth.fall_tick);
            found.push(Event { level: Level::Error, name: Process::Simulator.word(), message });
        }
        self.fallen = truth.fallen == 1;
    }

    /// How a process is doing.
    pub(crate) fn health(&mut self, health: &Health, found: &mut Vec<Event>) {
        let Some(process) = Process::from_code(health.process) else { return };
        let now = (health.state, health.reason, health.lost);
        let (state, reason, lost) = self.states.insert(health.process, now).unwrap_or((0, 0, 0));
        if (state, reason) != (health.state, health.reason) {
            let level = match (State::from_code(health.state), Reason::from_code(health.reason)) {
                (Some(State::Holding), _) => Level::Warning,
                (_, Some(Reason::None | Reason::Finished | Reason::Asked)) => Level::Info,
                _ => Level::Error,
            };
            let word = |word: Option<&'static str>| word.filter(|word| !word.is_empty());
            let state = word(State::from_code(health.state).map(State::word)).unwrap_or("in an unknown state");
            let reason = word(Reason::from_code(health.reason).map(Reason::word));
            let message = reason.map_or_else(|| state.to_string(), |reason| format!("{state}: {reason}"));
            found.push(Event { level, name: process.word(), message });
        }
        if health.lost > lost {
            let message = format!("{} messages were lost, {} in all", health.lost - lost, health.lost);
            found.push(Event { level: Level::Warning, name: process.word(), message });
        }
    }
}

impl Event {
    /// Appends it as `foxglove.Log`.
    pub(crate) fn put(&self, time_ns: u64, out: &mut Vec<u8>) {
        put_time(out, 1, time_ns);
        put_key(out, 2, VARINT);
        put_varint(out, self.level as u64);
        put_text(out, 3, &self.message);
        put_text(out, 4, self.name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{Header, Plain};

    fn said(found: &mut Vec<Event>) -> Vec<(Level, String)> {
        found.drain(..).map(|event| (event.level, format!("{}: {}", event.name, event.message))).collect()
    }

    #[test]
    fn changes_are_said_once() {
        let (mut events, mut found) = (Events::default(), Vec::new());
        let health = |state: State, reason, lost| Health { lost, ..Health::new(Process::Estimator, state, reason) };
        for _ in 0..3 {
            events.health(&health(State::Running, Reason::None, 0), &mut found);
        }
        assert_eq!(said(&mut found), [(Level::Info, "estimator: running".to_string())]);
        events.health(&health(State::Holding, Reason::SolverFailed, 2), &mut found);
        let expected = ["estimator: holding: solver failed", "estimator: 2 messages were lost, 2 in all"];
        assert_eq!(said(&mut found), expected.map(|text| (Level::Warning, text.to_string())));
        let mut truth = Truth { fallen: 1, fall_tick: 7, fall_cause: Fall::Tilted.code(), ..Truth::ZERO };
        truth.header = Header::new(8, 0);
        (0..2).for_each(|_| events.truth(&truth, &mut found));
        let fall = "simulator: the robot has fallen at tick 7: tilted too far".to_string();
        assert_eq!(said(&mut found), [(Level::Error, fall)]);
    }

    #[test]
    fn steps_are_said_when_they_begin() {
        let (mut events, mut found) = (Events::default(), Vec::new());
        let phase = |start_s, step, kind: PhaseKind, foot: usize| {
            let mut phase = PatternPhase { start_s, step, kind: kind.code(), ..PatternPhase::ZERO };
            phase.feet[foot].in_the_air = 1;
            phase
        };
        let swing = PhaseKind::SingleSupport;
        let phases = [
            phase(0.0, 1, PhaseKind::Start, 0),
            phase(1.0, 1, swing, 0),
            phase(1.2, 1, swing, 0),
            phase(2.0, 2, swing, 1),
        ];
        events.pattern(&phases, &mut found);
        assert_eq!(said(&mut found)[0].1, "planner: a walk of 2 steps is planned");
        events.tick(1000, &mut found);
        assert!(found.is_empty(), "not begun");
        events.start(&WalkStart { tick_zero: 100, ..WalkStart::ZERO }, &mut found);
        found.clear();
        let mut at = Vec::new();
        for tick in 100..700 {
            events.tick(tick, &mut found);
            at.extend(said(&mut found).into_iter().map(|(_, text)| (tick, text)));
        }
        let expected = [(300, "step 1: the left foot swings"), (500, "step 2: the right foot swings")];
        assert_eq!(at, expected.map(|(tick, text)| (tick, format!("controller: {text}"))));
    }
}
