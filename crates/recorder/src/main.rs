//! Takes every topic from the bus and stores it.
//!
//! Health says the last tick that has been dealt with, so that in lock-step the simulator can wait and nothing is
//! lost. Asked to stop, it stores what is still there, then finishes the file.

use bus::{PatternSubscriber, PortError, ReceiveError, Robot, Subscriber};
use lateness::RightsSettings;
use messages::code::{Process, Reason, State};
use messages::topic::{Element, Visitor, visit};
use messages::{MAX_PHASES, Message, Topic};
use node::{End, Failure, Program, Shell};
use recorder::{Recorder, RecorderSettings};
use recording::WriteError;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// How many messages of a topic may wait: more than half a second's.
const DEPTH: usize = 128;
/// How long it sleeps between two looks: half a tick.
const NAP: Duration = Duration::from_micros(2500);

struct RecorderProcess(RecorderSettings);

impl Program for RecorderProcess {
    const PROCESS: Process = Process::Recorder;
    const ABOUT: &'static str = "Writes every topic to an MCAP file.";
    type Settings = RecorderSettings;

    fn build(mut settings: RecorderSettings) -> Result<Self, Failure> {
        settings.read_robot().map_err(Failure::unusable)?;
        Ok(Self(settings))
    }

    fn rights(settings: &Self::Settings) -> RightsSettings {
        settings.real_time
    }

    fn robot_fingerprint(&self) -> Option<u64> {
        None
    }

    fn run(&mut self, shell: &mut Shell) -> Result<End, Failure> {
        let utc_minus_monotonic_ns = shell.real_time().then(utc_minus_monotonic_ns);
        let log_time = if shell.real_time() { "universal time" } else { "control time: tick x 5 ms" };
        let facts = [
            ("started_utc", files::utc::text(SystemTime::now())),
            ("host", host()),
            ("version", node::VERSION.to_string()),
            ("vector_instructions", node::vector_instructions()),
            ("domain", shell.domain().name().to_string()),
            ("pace", if shell.real_time() { "real time" } else { "lock-step" }.to_string()),
            ("log_time", log_time.to_string()),
            ("kept sole/contact", format!("1 of {} ticks", self.0.contact_every_ticks)),
            ("kept health/recorder", format!("1 of {} ticks", recorder::OWN_HEALTH_TICKS)),
            ("units", "SI, radians; world frame z up; feet left, right".to_string()),
        ];
        let mut info = self.0.run_info(&facts).map_err(Failure::running)?;
        info.utc_minus_monotonic_ns = utc_minus_monotonic_ns;
        let mut recorder = Recorder::create(&self.0, info).map_err(|error| match error {
            WriteError::Exists { .. } => Failure::unusable(error),
            _ => Failure::Storage(error.into()),
        })?;
        let mut inputs = Inputs { shell, inputs: Vec::new() };
        visit(&mut inputs)?;
        let mut inputs = inputs.inputs;
        // The topics are listed as they follow from each other. Looked at the other way round, what a message answers
        // is recorded with it even if this round should be the last one.
        inputs.reverse();
        shell.ready()?;
        let mut flushed = Instant::now();
        // Whatever ends it, the file is finished.
        let end = loop {
            // Asked before looking: what was published before the wish to stop is stored.
            let last_round = shell.asked_to_stop();
            shell.cycle_starts();
            let mut drained = Drained { lost: recorder.dropped(), news: 0 };
            let heard = inputs.iter_mut().try_for_each(|input| input.drain(&mut recorder, &mut drained));
            if let Err(failure) = heard {
                break Err(failure.into());
            }
            if flushed.elapsed().as_secs_f64() >= self.0.flush_period_s {
                recorder.flush();
                flushed = Instant::now();
            }
            if recorder.failure().is_some() {
                shell.figures().state = State::Holding.code();
                shell.figures().reason = Reason::Storage.code();
            }
            shell.figures().lost = drained.lost;
            shell.figures().recorder.stored_tick = recorder.last_tick();
            let goes_on = if drained.news > 0 {
                // Also after news a nap: looking for more at once finds one message at a time, and looking costs more
                // than storing.
                shell.cycle_ends(recorder.last_tick()).and_then(|()| shell.idle(NAP).map(drop))
            } else if last_round {
                break Ok(End::Asked);
            } else {
                shell.idle(NAP).map(drop)
            };
            if let Err(failure) = goes_on {
                break Err(failure);
            }
        };
        let stored = recorder.stored();
        match recorder.finish() {
            Ok(path) => {
                tracing::info!("{stored} messages in {}", path.display());
                end
            }
            Err(broken_off) => {
                shell.figures().state = State::Holding.code();
                shell.figures().reason = Reason::Storage.code();
                shell.figures().lost = broken_off.dropped;
                Err(Failure::Storage(broken_off.into()))
            }
        }
    }
}

/// What makes universal time of `CLOCK_MONOTONIC`.
fn utc_minus_monotonic_ns() -> i128 {
    let utc = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    utc.as_nanos() as i128 - i128::from(node::clock_monotonic_ns())
}

/// Name of this machine.
fn host() -> String {
    let name = files::read_text(Path::new("/proc/sys/kernel/hostname"), 1 << 10).unwrap_or_default();
    name.trim().to_string()
}

/// What a round brought.
struct Drained {
    /// Messages lost since the beginning.
    lost: u64,
    /// Messages of others. Our own health does not count: it would keep us busy with ourselves.
    news: u64,
}

/// One topic.
trait Input {
    /// Stores everything that waits.
    fn drain(&mut self, recorder: &mut Recorder, drained: &mut Drained) -> Result<(), ReceiveError>;
}

struct Messages<T: Message>(Topic<T>, Subscriber<T>);

impl<T: Message> Input for Messages<T> {
    fn drain(&mut self, recorder: &mut Recorder, drained: &mut Drained) -> Result<(), ReceiveError> {
        while let Some(message) = self.1.try_next()? {
            recorder.store(self.0, &message);
            drained.news += u64::from(self.0.row.from != Process::Recorder);
        }
        drained.lost += self.1.counts().lost;
        Ok(())
    }
}

impl Input for PatternSubscriber {
    fn drain(&mut self, recorder: &mut Recorder, drained: &mut Drained) -> Result<(), ReceiveError> {
        while let Some(pattern) = self.latest()? {
            recorder.store_pattern(&pattern.header, &pattern.phases);
            drained.news += 1;
        }
        Ok(())
    }
}

/// Subscribes to every topic.
struct Inputs<'a> {
    shell: &'a Shell,
    inputs: Vec<Box<dyn Input>>,
}

impl Visitor for Inputs<'_> {
    type Error = PortError;

    fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), PortError> {
        let subscriber = self.shell.domain().subscriber(topic, Robot::Any, DEPTH)?;
        self.inputs.push(Box::new(Messages(topic, subscriber)));
        Ok(())
    }

    fn slice<H: Message, E: Element>(&mut self, _: Topic<H>) -> Result<(), PortError> {
        self.inputs.push(Box::new(self.shell.domain().pattern_subscriber(Robot::Any, MAX_PHASES)?));
        Ok(())
    }
}

fn main() -> ExitCode {
    // Where files may not grow beyond a size, writing shall fail and not kill. Without it the default stays.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
    node::main::<RecorderProcess>()
}
