//! What a recording says of time, tick by tick.

use lateness::Lateness;
use lateness::reference::{Excused, Reference};
use messages::code::Process;
use messages::{CONTROL_PERIOD_NS, Health, Message, RobotCommand, Truth, timing, topic};
use recording::{ReadError, Recording};
use std::collections::BTreeMap;

/// The processes of the 200 Hz loop.
pub const LOOP: [Process; 3] = [Process::Simulator, Process::Estimator, Process::Controller];

/// Lateness of one process over a walk.
#[derive(Debug, Clone, Default)]
pub struct Cycles {
    /// From the tick's time to when the thread ran (ns).
    pub woke: Lateness,
    /// To when the answer was out (ns).
    pub published: Lateness,
    /// Time of the processor (ns).
    pub processor: Lateness,
}

impl Cycles {
    /// Those of another walk as well.
    pub fn add(&mut self, other: &Self) {
        self.woke.add(&other.woke);
        self.published.add(&other.published);
        self.processor.add(&other.processor);
    }
}

/// A walk as its recording has it.
#[derive(Debug, Clone, Default)]
pub struct Ticks {
    /// Of each process of the loop.
    pub cycles: BTreeMap<u32, Cycles>,
    /// The last health of each process.
    pub health: BTreeMap<u32, Health>,
    /// Time of each tick (ns) that the truth has, by tick.
    pub times_ns: BTreeMap<i64, u64>,
    /// The command under which the robot came to a tick, by tick.
    acted: BTreeMap<i64, i64>,
    /// What was commanded, by tick.
    commands: BTreeMap<i64, RobotCommand>,
    /// When the state of a tick was out, and when the controller woke for it: from the tick's time (ns), by tick.
    state_out_ns: BTreeMap<i64, u64>,
    controller_woke_ns: BTreeMap<i64, u64>,
}

impl Ticks {
    /// Of a recording.
    pub fn read(recording: &Recording) -> Result<Self, ReadError> {
        let mut ticks = Self::default();
        recording.each(|entry| {
            if let Some(truth) = entry.read(topic::TRUTH_ROBOT)? {
                ticks.truth(&truth);
            } else if let Some(command) = entry.read(topic::ROBOT_COMMAND)? {
                ticks.commands.insert(command.header.tick, command);
            } else {
                for process in LOOP {
                    if let Some(health) = entry.read(topic::health(process))? {
                        ticks.health(&health);
                    }
                }
            }
            Ok::<_, ReadError>(())
        })?;
        Ok(ticks)
    }

    fn truth(&mut self, truth: &Truth) {
        self.times_ns.insert(truth.header.tick, truth.header.clock_monotonic_ns);
        self.acted.insert(truth.header.tick, truth.command_tick);
    }

    fn health(&mut self, health: &Health) {
        let before = self.health.insert(health.process, *health);
        // While a process waits it repeats its health; each cycle counts once, and those before the clock begins have no lateness.
        let news = before.is_none_or(|before| health.cycles > before.cycles) && health.header.tick >= 0;
        if news && health.cycles > 1 {
            let cycles = self.cycles.entry(health.process).or_default();
            cycles.woke.record(health.wake_lateness_ns);
            if health.publish_lateness_ns > 0 {
                cycles.published.record(health.publish_lateness_ns);
            }
            cycles.processor.record(health.processor_time_ns);
            if health.process == Process::Simulator.code() {
                self.state_out_ns.insert(health.header.tick, health.publish_lateness_ns);
            } else if health.process == Process::Controller.code() {
                self.controller_woke_ns.insert(health.header.tick, health.wake_lateness_ns);
            }
        }
    }

    /// Of a process of the loop; empty if it said nothing.
    pub fn of(&self, process: Process) -> Cycles {
        self.cycles.get(&process.code()).cloned().unwrap_or_default()
    }

    /// From when a state was out to when the controller woke for it (ns): it is woken by a message, not by a timer.
    pub fn hand_over(&self) -> Lateness {
        let woke = self.controller_woke_ns.iter();
        Lateness::of(woke.filter_map(|(tick, woke_ns)| woke_ns.checked_sub(*self.state_out_ns.get(tick)?)))
    }

    /// The grid's periods that were not five milliseconds long, by the tick at their end.
    pub fn slips(&self) -> Vec<i64> {
        let pairs = self.times_ns.iter().zip(self.times_ns.iter().skip(1));
        let slipped = pairs.filter(|((tick, time_ns), (next, next_ns))| {
            *next == &(*tick + 1) && next_ns.saturating_sub(**time_ns) != CONTROL_PERIOD_NS
        });
        slipped.map(|(_, (next, _))| *next).collect()
    }

    /// Commands that were not there when they should have begun to act, with what excuses them: a stall while they were on their way.
    pub fn missing(&self, cores: &[Reference]) -> Excused {
        let mut missing = Excused::default();
        for (tick, acted) in &self.acted {
            let expected = tick - timing::REACHED_TICKS;
            // The first is the one that placed the robot.
            let Some(sent_ns) = self.times_ns.get(&expected).filter(|_| expected >= 0) else { continue };
            missing.take(*acted < expected, (*sent_ns, sent_ns + CONTROL_PERIOD_NS), cores);
        }
        missing
    }

    /// Commands whose deformation was of an earlier tick, by its age: one tick, two, more.
    pub fn stale_deformations(&self) -> [u64; 3] {
        let mut ages = [0; 3];
        for command in self.commands.values().filter(|command| command.deformation_age_ticks > 0) {
            ages[(command.deformation_age_ticks as usize - 1).min(2)] += 1;
        }
        ages
    }

    /// The first tick whose command was computed from, or after, anything that lock-step does not have: an old deformation, another command
    /// than that of two ticks before. `None`: there was none.
    pub fn first_stale(&self) -> Option<i64> {
        let deformation = self.commands.values().find(|command| command.deformation_age_ticks > 0);
        let deformation = deformation.map(|command| command.header.tick);
        let missing = self.acted.iter().find(|(tick, acted)| {
            let expected = *tick - timing::REACHED_TICKS;
            expected >= 0 && **acted != expected
        });
        let missing = missing.map(|(tick, _)| *tick);
        [deformation, missing].into_iter().flatten().min()
    }

    /// Compares the commands with those of lock-step up to the first stale input.
    pub fn same_as(&self, lock_step: &Self) -> Compared {
        let end = self.first_stale().unwrap_or(i64::MAX);
        let mut compared = Compared { ticks: 0, first_difference: None, stale: self.first_stale() };
        for (tick, command) in self.commands.range(..end) {
            let Some(expected) = lock_step.commands.get(tick) else { break };
            if bits(command) != bits(expected) {
                compared.first_difference = Some(*tick);
                break;
            }
            compared.ticks += 1;
        }
        compared
    }
}

/// How far two walks say the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Compared {
    /// Commands that are the same to the bit.
    pub ticks: u64,
    /// The first that is not, though nothing stale came before it.
    pub first_difference: Option<i64>,
    /// The first stale input, where comparing ends.
    pub stale: Option<i64>,
}

/// What must not depend on clock and counting: everything but stamp and sequence.
fn bits(command: &RobotCommand) -> Vec<u8> {
    use messages::Plain;
    let mut command = *command;
    let header = command.header_mut();
    (header.sequence, header.clock_monotonic_ns) = (0, 0);
    let mut bytes = Vec::new();
    command.write_bytes(&mut bytes);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use lateness::reference::Sample;
    use messages::Header;

    const MS: u64 = 1_000_000;

    /// Twenty ticks by the clock from 1 s on: the command of tick 7 comes too late, the grid slips before tick 15.
    fn walk() -> Ticks {
        let mut ticks = Ticks::default();
        for tick in 0..20_i64 {
            let slip_ns = if tick >= 15 { 8 * MS } else { 0 };
            let clock_monotonic_ns = 1_000 * MS + tick as u64 * CONTROL_PERIOD_NS + slip_ns;
            let header = Header { clock_monotonic_ns, ..Header::new(tick, 7) };
            let command_tick = if tick == 9 { 6 } else { (tick - 2).max(-1) };
            ticks.truth(&Truth { header, command_tick, ..Truth::default() });
            let command = RobotCommand { header, walk_time_s: tick as f64, ..RobotCommand::default() };
            ticks.commands.insert(tick, command);
        }
        ticks
    }

    #[test]
    fn a_missing_command_and_a_slip_are_found_and_a_stall_excuses_what_it_overlaps() {
        let ticks = walk();
        assert_eq!(ticks.slips(), [15]);
        let missing = ticks.missing(&[]);
        assert_eq!((missing.all, missing.bad, missing.excused), (18, 1, 0));
        // State 7 was at 1035 ms; its command was due at 1040 ms.
        let stall = |at_ms: u64| Reference::of(0, &[Sample { due_ns: at_ms * MS, late_ns: 2 * MS }]);
        assert_eq!(ticks.missing(&[stall(1_038)]).excused, 1);
        assert_eq!(ticks.missing(&[stall(1_041)]).excused, 0);
        assert_eq!(ticks.first_stale(), Some(9));
    }

    #[test]
    fn commands_are_compared_until_the_first_stale_input() {
        let (real_time, mut lock_step) = (walk(), walk());
        let compared = real_time.same_as(&lock_step);
        assert_eq!(compared, Compared { ticks: 9, first_difference: None, stale: Some(9) });
        lock_step.commands.get_mut(&12).expect("there").walk_time_s += 1.0;
        assert_eq!(real_time.same_as(&lock_step).first_difference, None, "after the stale one anything may differ");
        lock_step.commands.get_mut(&4).expect("there").walk_time_s += 1e-9;
        let compared = real_time.same_as(&lock_step);
        assert_eq!((compared.ticks, compared.first_difference), (4, Some(4)));
    }

    #[test]
    fn each_cycle_counts_once_and_stale_deformations_by_their_age() {
        let mut ticks = walk();
        for (cycles, wake_lateness_ns) in [(1, 900), (2, 30_000), (2, 30_000), (3, 40_000)] {
            let header = Header::new(cycles as i64, 7);
            let process = Process::Controller.code();
            ticks.health(&Health { header, process, cycles, wake_lateness_ns, ..Health::default() });
        }
        assert_eq!(ticks.of(Process::Controller).woke.count(), 2, "the first has what was built before");
        assert_eq!(ticks.of(Process::Estimator).woke.count(), 0);
        assert_eq!(ticks.hand_over().count(), 0, "no state is known to have been out");
        let header = Header::new(3, 7);
        let process = Process::Simulator.code();
        ticks.health(&Health { header, process, cycles: 4, publish_lateness_ns: 15_000, ..Health::default() });
        assert_eq!((ticks.hand_over().count(), ticks.hand_over().max_ns()), (1, 25_000));
        for (tick, age) in [(3, 1), (4, 1), (5, 2), (6, 9)] {
            ticks.commands.get_mut(&tick).expect("there").deformation_age_ticks = age;
        }
        assert_eq!((ticks.stale_deformations(), ticks.first_stale()), ([2, 1, 1], Some(3)));
    }
}
