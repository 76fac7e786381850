//! Names the process that hangs.
//!
//! Every process says ten times a second that it lives, also while it waits for others. One that says nothing is stopped, blocked, or in a
//! computation without an end; those that only wait for it go on speaking. While a process starts it builds its models and is silent:
//! there its processor time takes the place of its words.

use crate::Ending;
use messages::Health;
use messages::code::{Process, State};
use node::ExitCode;
use std::time::{Duration, Instant, SystemTime};

/// A silence that is told.
const TOLD_AFTER: Duration = Duration::from_secs(1);
/// The longest part of a silence that counts between two looks. A launcher that was held up itself has heard nobody meanwhile.
const LOOK_MAX: Duration = Duration::from_millis(200);

/// Listens for silence.
pub struct Watchdog {
    hung_after: Duration,
    looked: Instant,
    watched: Vec<Watched>,
}

struct Watched {
    process: Process,
    id: u32,
    /// Whether it has built what it needs; from then on it speaks.
    started: bool,
    /// How long it has been silent, and since when.
    silent: Duration,
    since: SystemTime,
    tick: i64,
    processor_time: u64,
    told: bool,
}

impl Watchdog {
    /// For processes with their ids. Who is silent for `hung_after` hangs.
    pub fn new(processes: impl Iterator<Item = (Process, u32)>, hung_after: Duration) -> Self {
        let watched = processes.map(|(process, id)| Watched {
            process,
            id,
            started: false,
            silent: Duration::ZERO,
            since: SystemTime::now(),
            tick: -1,
            processor_time: 0,
            told: false,
        });
        Self { hung_after, looked: Instant::now(), watched: watched.collect() }
    }

    /// A process spoke.
    pub fn heard(&mut self, health: &Health) {
        let process = Process::from_code(health.process);
        let Some(watched) = self.watched.iter_mut().find(|watched| Some(watched.process) == process) else { return };
        watched.started |= State::from_code(health.state) != Some(State::Starting);
        watched.tick = health.header.tick;
        watched.speaks();
    }

    /// A process is gone, and nobody waits for it.
    pub fn release(&mut self, process: Process) {
        self.watched.retain(|watched| watched.process != process);
    }

    /// Tells who has become silent, and says so when one of them hangs.
    pub fn look(&mut self) -> Option<Ending> {
        let passed = self.looked.elapsed().min(LOOK_MAX);
        self.looked = Instant::now();
        for watched in &mut self.watched {
            watched.silent += passed;
            if watched.silent >= TOLD_AFTER && !watched.started {
                // Looked up only where it decides.
                let (_, processor_time) = system_state(watched.id);
                if processor_time != watched.processor_time {
                    watched.processor_time = processor_time;
                    watched.speaks();
                }
            }
            let told_after = if watched.started { TOLD_AFTER } else { self.hung_after / 2 };
            if watched.silent >= told_after && !watched.told {
                watched.told = true;
                tracing::warn!("{}", watched.words());
            }
        }
        let longest = self.watched.iter().max_by_key(|watched| watched.silent)?;
        (longest.silent >= self.hung_after).then(|| {
            let limit_s = self.hung_after.as_secs_f64();
            Ending::new(ExitCode::Hung, format!("{}: it hangs (--hung-after {limit_s} s)", longest.words()))
        })
    }
}

impl Watched {
    fn speaks(&mut self) {
        if self.told {
            tracing::info!("the {} speaks again after {:.1} s", self.process, self.silent.as_secs_f64());
        }
        (self.silent, self.since, self.told) = (Duration::ZERO, SystemTime::now(), false);
    }

    /// Who says nothing, since when, and what the system knows of it.
    fn words(&self) -> String {
        let (state, _) = system_state(self.id);
        let since_s = self.since.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
        let (hour, minute, second) = (since_s / 3600 % 24, since_s / 60 % 60, since_s % 60);
        let Self { process, id, tick, silent, .. } = self;
        let silent_s = silent.as_secs_f64();
        format!(
            "the {process} (process {id}, {state}) has said nothing for {silent_s:.1} s, since {hour:02}:{minute:02}:{second:02} UTC, tick \
             {tick}"
        )
    }
}

/// What the system says a process is doing, and how long it has computed (in clock ticks).
fn system_state(id: u32) -> (&'static str, u64) {
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    // State and times follow the name, which is in parentheses and may hold anything.
    let mut fields = stat.rsplit_once(") ").map_or("", |(_, rest)| rest).split(' ');
    let state = match fields.next() {
        Some("T" | "t") => "stopped by a signal",
        Some("R") => "computing",
        Some("D") => "waiting for a disk",
        Some("Z" | "X") => "ended",
        _ => "waiting",
    };
    // Of the man page's numbering, 14 and 15: the state is 3.
    let times: u64 = fields.skip(10).take(2).filter_map(|time| time.parse::<u64>().ok()).sum();
    (state, times)
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::code::Reason;

    fn watchdog(hung_after: Duration) -> Watchdog {
        Watchdog::new([(Process::Planner, std::process::id()), (Process::Controller, 0)].into_iter(), hung_after)
    }

    fn health(process: Process, state: State) -> Health {
        Health::new(process, state, Reason::None)
    }

    #[test]
    fn the_silent_one_hangs_and_those_who_speak_do_not() {
        let mut watchdog = watchdog(Duration::from_millis(500));
        let running = health(Process::Controller, State::Running);
        watchdog.heard(&running);
        watchdog.heard(&health(Process::Planner, State::Running));
        assert!(watchdog.look().is_none());
        let start = Instant::now();
        let ending = loop {
            watchdog.heard(&running);
            if let Some(ending) = watchdog.look() {
                break ending;
            }
            assert!(start.elapsed() < Duration::from_secs(60), "never");
            std::thread::sleep(Duration::from_millis(5));
        };
        assert_eq!(ending.code, ExitCode::Hung);
        let said = format!("the planner (process {}, ", std::process::id());
        assert!(ending.reason.starts_with(&said) && ending.reason.contains("tick 0: it hangs"), "{}", ending.reason);
        watchdog.heard(&health(Process::Planner, State::Running));
        assert!(watchdog.look().is_none(), "it speaks again");
    }

    #[test]
    fn a_launcher_that_was_held_up_blames_nobody() {
        let mut watchdog = watchdog(Duration::from_millis(500));
        watchdog.heard(&health(Process::Planner, State::Running));
        watchdog.heard(&health(Process::Controller, State::Running));
        std::thread::sleep(Duration::from_millis(700));
        assert!(watchdog.look().is_none());
    }

    #[test]
    fn who_starts_is_silent_and_at_work() {
        let (state, before) = system_state(std::process::id());
        assert!(["computing", "waiting"].contains(&state), "{state}");
        let mut sum = 0_u64;
        while system_state(std::process::id()).1 == before {
            sum = (0..1_000_000_u64).fold(sum, |sum, i| std::hint::black_box(sum ^ i));
        }
        let mut watchdog = watchdog(Duration::from_secs(3600));
        watchdog.watched.truncate(1);
        watchdog.watched[0].silent = TOLD_AFTER;
        assert!(watchdog.look().is_none());
        assert_eq!(watchdog.watched[0].silent, Duration::ZERO, "it computes");
    }
}
