//! A launch from beginning to end.

use crate::conclusion::Conclusion;
use crate::folder::RunFolder;
use crate::heard::Heard;
use crate::process::{Start, Supervised};
use crate::progress::Progress;
use crate::recorded::Recorded;
use crate::watchdog::Watchdog;
use crate::{Ending, Launch, claim};
use bus::{Domain, DomainName, Owner, ReceiveError, Robot, Subscriber};
use messages::code::{Process, Reason, State};
use messages::{Health, topic};
use node::{ExitCode, START_PATIENCE, Stop};
use report::ReportSettings;
use scenario::Scenario;
use std::cell::Cell;
use std::fmt::Display;
use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

/// How often processes and messages are looked at: well within what the subscribers' buffers hold.
const ROUND: Duration = Duration::from_millis(20);
/// How often what the dead left in shared memory is looked for: a hundred file operations each time.
pub(crate) const REAPING: Duration = Duration::from_secs(1);
/// How long a process may take to stop.
const STOP_PATIENCE: Duration = Duration::from_secs(3);
/// How long by the clock, where a walking robot completes its step and comes to stand first.
const STAND_PATIENCE: Duration = Duration::from_secs(8);
/// How long one that said that it stops may take to end, when another has ended because of it.
const CULPRIT_PATIENCE: Duration = Duration::from_secs(10);
/// How long the recorder may take to store what is left and write its index.
const RECORDER_PATIENCE: Duration = Duration::from_secs(20);
/// How often those that are not ready are named.
const IMPATIENCE: Duration = Duration::from_secs(10);
/// Messages that may wait for us.
const DEPTH: usize = 128;

/// Starts a scenario, sees it through, and says what it was like.
pub fn launch(arguments: &Launch) -> Result<(), Ending> {
    let stop = Stop::on_signals().map_err(|error| Ending::with_causes(ExitCode::Start, error))?;
    let path = arguments.scenario.as_ref().expect("clap requires it");
    let wrong = |error: anyhow::Error| Ending::with_causes(ExitCode::Configuration, error);
    let scenario = Scenario::load(path, &arguments.settings).map_err(|error| wrong(error.into()))?;
    let judged_by: ReportSettings = scenario.report.parse().map_err(|error| wrong(error.into()))?;
    judged_by.check().map_err(|error| wrong(error.into()))?;
    let processes: Vec<Process> = scenario.processes().filter_map(|(name, _)| process_called(name)).collect();
    let domain_name = match &arguments.domain {
        Some(name) => name.clone(),
        None => format!("run-{}", std::process::id()).parse().expect("letters and digits"),
    };
    let owner = claim(&domain_name, &stop, ExitCode::Interrupted)?;
    tracing::info!("domain `{domain_name}`, runtime folder {}", bus::runtime_folder().display());
    let folder = RunFolder::create(&scenario, arguments)?;
    let ended = supervise(arguments, &processes, &folder, &domain_name, &owner, &stop);
    // Whatever happened: the processes are gone now, and with the owner goes the shared memory.
    drop(owner);
    let leftovers = domain_name.leftovers();
    if !leftovers.is_empty() {
        tracing::warn!("left in shared memory: {leftovers:?}");
    }
    let (heard, recorded, ended) = ended.inspect_err(|_| folder.remove())?;
    // Of what came to no good end, too: what there is to see is in the run folder.
    let conclusion = heard.any().then(|| Conclusion::draw(&folder, &heard, &judged_by, !arguments.no_report));
    if let Some(conclusion) = &conclusion {
        let mut text = conclusion.table();
        let mut row = |name: &str, value: &dyn Display| text += &format!("{name:<22} {value}\n");
        if arguments.real_time {
            row("by the clock", &heard.kept_time());
        }
        row("recording", &recorded);
        conclusion.page.iter().for_each(|page| row("page", &page.display()));
        row("run folder", &folder.path.display());
        node::say(&text).map_err(|error| Ending::with_causes(ExitCode::Failed, error))?;
    } else if let Err(Ending { code: ExitCode::Configuration, reason }) = ended {
        folder.remove();
        let (path, scenario) = (folder.path.display(), scenario.path.display());
        let note = format!(
            "{path} held what {scenario} and --set say, process by process; nothing moved, and it is removed again"
        );
        return Err(Ending::new(ExitCode::Configuration, format!("{reason}\n  {note}")));
    }
    folder.recovered().iter().for_each(|said| tracing::warn!("{said}"));
    let reason = ended?;
    tracing::info!("the walk is over: {reason}");
    conclusion.map_or(Ok(()), |conclusion| conclusion.ending())?;
    recorded.ending(arguments.real_time).map_or(Ok(()), Err)
}

fn process_called(word: &str) -> Option<Process> {
    Process::ALL.iter().find(|process| process.word() == word).copied()
}

fn supervise(
    arguments: &Launch,
    processes: &[Process],
    folder: &RunFolder,
    domain_name: &DomainName,
    owner: &Owner,
    stop: &Stop,
) -> Result<(Heard, Recorded, Result<Reason, Ending>), Ending> {
    let failed = |error: anyhow::Error| Ending::with_causes(ExitCode::Start, error);
    let join = || Domain::join(domain_name, Process::Launcher, Duration::from_secs(5));
    let joined = stop.bound("joining the domain", START_PATIENCE, ExitCode::Interrupted, join);
    let domain = joined.map_err(|error| failed(error.into()))?;
    let mut ears = Ears::new(&domain, processes).map_err(|error| failed(error.into()))?;
    let start = Start {
        domain: domain_name,
        real_time: arguments.real_time,
        require_real_time: arguments.require_real_time,
        pace: arguments.pace,
        processes,
        log_format: arguments.log_format,
    };
    let mut children = Vec::new();
    for process in processes {
        children.push(Supervised::start(*process, folder, &start)?);
    }
    ears.watchdog = Watchdog::new(children.iter().map(|child| (child.process, child.id())), arguments.hung_after);
    let mut progress = Progress::new();
    let ended = watch(&mut children, &mut ears, &mut progress, owner, stop);
    progress.end();
    stop_all(&mut children, &mut ears, stop, if arguments.real_time { STAND_PATIENCE } else { STOP_PATIENCE });
    let recorded = Recorded::of(&mut children, ears.recorder.as_ref());
    Ok((ears.heard, recorded, ended.and_then(|reason| all_ended_well(&mut children, reason))))
}

/// Looks on until the walk is over or something goes wrong.
fn watch(
    children: &mut [Supervised],
    ears: &mut Ears,
    progress: &mut Progress,
    owner: &Owner,
    stop: &Stop,
) -> Result<Reason, Ending> {
    let (mut named, mut reaped) = (Instant::now(), Instant::now());
    loop {
        if stop.asked() {
            return Err(Ending::new(ExitCode::Interrupted, "interrupted"));
        }
        ears.listen().map_err(|error| Ending::with_causes(ExitCode::Failed, error))?;
        if let Some(reason) = ears.over {
            return Ok(reason);
        }
        ears.let_go_of_the_planner(children);
        if let Some(ending) = first_death(children, ears, stop) {
            return Err(ending);
        }
        if let Some(ending) = ears.watchdog.look() {
            return Err(ending);
        }
        if !ears.begun() && named.elapsed() > IMPATIENCE {
            named = Instant::now();
            tracing::info!("waiting for {}", ears.not_ready().join(", "));
        }
        progress.show(&ears.heard);
        if reaped.elapsed() > REAPING {
            reaped = Instant::now();
            owner.reap_dead();
        }
        std::thread::sleep(ROUND);
    }
}

/// A walk is over only if every process could say so and end in order.
fn all_ended_well(children: &mut [Supervised], reason: Reason) -> Result<Reason, Ending> {
    let badly = children.iter_mut().filter_map(|child| {
        let status = child.ended().filter(|status| !status.success())?;
        // What it says itself of its recording, the recording's verdict says as well.
        let told_there = child.process == Process::Recorder && status.signal().is_none();
        (!told_there).then(|| child.explain(status))
    });
    badly.min_by_key(|ending| ending.code.rank()).map_or(Ok(reason), Err)
}

/// The unexpected end of a process, if one has ended. When several did, the one that did not merely follow another.
fn first_death(children: &mut [Supervised], ears: &mut Ears, stop: &Stop) -> Option<Ending> {
    children.iter_mut().filter(|child| ears.needs(child.process)).find_map(Supervised::ended)?;
    // Those that die of the same cause do so within a moment. Who only lost a partner may be quicker than the partner, which says that
    // it stops before it has put away what it holds.
    let start = Instant::now();
    loop {
        std::thread::sleep(Duration::from_millis(50));
        let ended: Vec<Option<ExitStatus>> = children.iter_mut().map(Supervised::ended).collect();
        // After seeing who has ended: all that they said before is there now. A broken subscriber no longer matters.
        let _ = ears.listen();
        let endings = children.iter().zip(ended).filter_map(|(child, ended)| {
            let status = ended?;
            let followed = status.signal().is_none() && ears.lost_a_partner(child.process);
            let ending = child.explain(status);
            Some((rank(&ending, followed), ending))
        });
        let first = endings.min_by_key(|(rank, _)| *rank);
        if start.elapsed() > CULPRIT_PATIENCE
            || stop.asked()
            || first.as_ref().is_some_and(|(rank, _)| *rank < FOLLOWED)
        {
            return first.map(|(_, ending)| ending);
        }
    }
}

/// Rank of an ending that another one caused: behind all that can be a cause.
const FOLLOWED: u8 = ExitCode::Done.rank();

/// How far an ending is from what went wrong first.
fn rank(ending: &Ending, followed: bool) -> u8 {
    if followed { FOLLOWED } else { ending.code.rank() }
}

/// Whether those who are stopping are to be killed: when somebody asks once more.
struct Haste<'a> {
    stop: &'a Stop,
    obeyed: Cell<bool>,
}

impl<'a> Haste<'a> {
    /// Who has asked before is obeyed from now on.
    fn new(stop: &'a Stop) -> Self {
        let obeyed = Cell::new(stop.asked());
        stop.forget();
        Self { stop, obeyed }
    }

    /// The first to ask while all are stopping anyway is obeyed already: that costs no recording.
    fn is_due(&self) -> bool {
        if !self.stop.asked() {
            return false;
        }
        let due = self.obeyed.replace(true);
        if !due {
            self.stop.forget();
        }
        due
    }
}

/// Stops all processes: first those of the loop, then the recorder, which stores what they said last.
fn stop_all(children: &mut [Supervised], ears: &mut Ears, stop: &Stop, patience: Duration) {
    let haste = Haste::new(stop);
    let hurry = || haste.is_due();
    let (recorder, others): (Vec<_>, Vec<_>) =
        children.iter_mut().partition(|child| child.process == Process::Recorder);
    for (group, patience) in [(others, patience), (recorder, RECORDER_PATIENCE)] {
        let mut group = group;
        for child in &mut group {
            child.ask_to_stop();
        }
        for child in &mut group {
            child.wait_or_kill(patience, &hurry);
        }
        // The last words count; a broken subscriber no longer matters.
        let _ = ears.listen();
    }
}

/// What the launcher hears.
struct Ears {
    health: Vec<(Process, Subscriber<Health>)>,
    states: Vec<(Process, Option<State>, Reason)>,
    heard: Heard,
    watchdog: Watchdog,
    /// What the recorder said last.
    recorder: Option<Health>,
    over: Option<Reason>,
    /// Whether the controller commands: whoever needs the pattern has it.
    walking: bool,
    /// The planner ended after that.
    planner_gone: bool,
}

impl Ears {
    fn new(domain: &Domain, processes: &[Process]) -> Result<Self, bus::PortError> {
        let health = |process: &Process| Ok((*process, domain.subscriber(topic::health(*process), Robot::Any, DEPTH)?));
        Ok(Self {
            health: processes.iter().map(health).collect::<Result<_, bus::PortError>>()?,
            states: processes.iter().map(|process| (*process, None, Reason::None)).collect(),
            heard: Heard::default(),
            watchdog: Watchdog::new(std::iter::empty(), Duration::MAX),
            recorder: None,
            over: None,
            walking: false,
            planner_gone: false,
        })
    }

    fn listen(&mut self) -> Result<(), ReceiveError> {
        for (process, subscriber) in &mut self.health {
            while let Some(health) = subscriber.try_next()? {
                self.heard.take(&health);
                self.watchdog.heard(&health);
                if *process == Process::Recorder {
                    self.recorder = Some(health);
                }
                let state = State::from_code(health.state);
                self.walking |= *process == Process::Controller && state == Some(State::Running);
                if let Some(entry) = self.states.iter_mut().find(|(other, ..)| other == process) {
                    entry.1 = state;
                    entry.2 = Reason::from_code(health.reason).unwrap_or(Reason::None);
                }
                // Any other reason ends the simulator itself, and its exit code says more.
                if *process == Process::Simulator
                    && state == Some(State::Stopping)
                    && let Some(reason @ (Reason::Finished | Reason::Fallen)) = Reason::from_code(health.reason)
                {
                    self.over = Some(reason);
                }
            }
        }
        Ok(())
    }

    /// Whether the walk cannot go on without a process.
    fn needs(&self, process: Process) -> bool {
        process != Process::Planner || !self.planner_gone
    }

    /// A planner that ends while the controller commands is told; the walk that it has published goes on. To stop in mid-step would be a fall. How
    /// it ended is how the launch ends.
    fn let_go_of_the_planner(&mut self, children: &mut [Supervised]) {
        if !self.walking || self.planner_gone {
            return;
        }
        let Some(planner) = children.iter_mut().find(|child| child.process == Process::Planner) else { return };
        if let Some(status) = planner.ended() {
            tracing::warn!("{}; the walk that it has published goes on", planner.explain(status).reason);
            self.planner_gone = true;
            self.watchdog.release(Process::Planner);
        }
    }

    fn begun(&self) -> bool {
        self.heard.any()
    }

    /// Whether a process said that it stops because another one has.
    fn lost_a_partner(&self, process: Process) -> bool {
        self.states.contains(&(process, Some(State::Stopping), Reason::InputMissing))
    }

    fn not_ready(&self) -> Vec<&'static str> {
        let ready = |state: &Option<State>| matches!(state, Some(State::Ready | State::Running | State::Holding));
        self.states.iter().filter(|(_, state, _)| !ready(state)).map(|(process, ..)| process.word()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_who_asks_twice_is_in_a_hurry() {
        let stop = Stop::on_signals().expect("signals can be caught");
        let ask = || {
            node::interrupt(std::process::id()).expect("we live");
            while !stop.asked() {
                std::thread::yield_now();
            }
        };
        // The walk ends by itself; the first to ask comes too late to matter.
        let haste = Haste::new(&stop);
        assert!(!haste.is_due());
        ask();
        assert!(!haste.is_due() && !haste.is_due());
        ask();
        assert!(haste.is_due() && haste.is_due());
        // Who asked before all were stopped asks for the second time.
        let haste = Haste::new(&stop);
        ask();
        assert!(haste.is_due());
    }

    #[test]
    fn what_went_wrong_first_is_named_before_what_followed() {
        use ExitCode::{Configuration, Deadlines, Failed, NotSettled, Recording, SafetyStop, Start};
        let ranks = |endings: &[(ExitCode, bool)]| {
            endings.iter().map(|(code, followed)| rank(&Ending::new(*code, ""), *followed)).collect::<Vec<_>>()
        };
        // A wrong configuration; a failure; no start; a safety stop; one for want of the other.
        let order =
            [(Configuration, false), (NotSettled, false), (Start, false), (SafetyStop, false), (SafetyStop, true)];
        let order = ranks(&order);
        assert!(order.is_sorted_by(|one, next| one < next), "{order:?}");
        assert_eq!(ranks(&[(Failed, false), (Deadlines, false), (Recording, false)]), ranks(&[(NotSettled, false); 3]));
        assert!(order[3] < FOLLOWED && order[4] == FOLLOWED);
    }
}
