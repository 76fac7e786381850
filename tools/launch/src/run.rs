//! A launch from beginning to end.

use crate::conclusion::Conclusion;
use crate::folder::RunFolder;
use crate::heard::Heard;
use crate::process::{Start, Supervised};
use crate::progress::Progress;
use crate::{Ending, Launch};
use bus::{Domain, DomainName, Owner, ReceiveError, Robot, Subscriber};
use messages::code::{Process, Reason, State};
use messages::{Health, topic};
use node::Stop;
use report::ReportSettings;
use scenario::Scenario;
use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

/// How often processes and messages are looked at: well within what the subscribers' buffers hold.
const ROUND: Duration = Duration::from_millis(20);
/// How often what the dead left in shared memory is looked for: a hundred file operations each time.
pub(crate) const REAPING: Duration = Duration::from_secs(1);
/// How long a process may take to stop.
const STOP_PATIENCE: Duration = Duration::from_secs(3);
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
    if arguments.real_time {
        // The shell, the controller and the recorder know this pace; the simulator does not keep it yet.
        return Err(Ending::new(2, "--real-time: the simulator runs in lock-step only so far"));
    }
    let stop = Stop::on_signals().map_err(|error| Ending::with_causes(3, error))?;
    let path = arguments.scenario.as_ref().expect("clap requires it");
    let scenario = Scenario::load(path, &arguments.settings).map_err(|error| Ending::with_causes(2, error))?;
    let judged_by: ReportSettings = scenario.report.parse().map_err(|error| Ending::with_causes(2, error))?;
    judged_by.check().map_err(|error| Ending::with_causes(2, error))?;
    let processes: Vec<Process> = scenario.processes().filter_map(|(name, _)| process_called(name)).collect();
    let domain_name = match &arguments.domain {
        Some(name) => name.clone(),
        None => format!("run-{}", std::process::id()).parse().expect("letters and digits"),
    };
    let folder = RunFolder::create(&scenario, arguments)?;
    let owner = Owner::claim(&domain_name).map_err(|error| Ending::with_causes(3, error))?;
    let ended = supervise(arguments, &processes, &folder, &domain_name, &owner, &stop);
    // Whatever happened: the processes are gone now, and with the owner goes the shared memory.
    drop(owner);
    let leftovers = domain_name.leftovers();
    if !leftovers.is_empty() {
        tracing::warn!("left in shared memory: {leftovers:?}");
    }
    let (heard, ended) = ended?;
    // Of what came to no good end, too: what there is to see is in the run folder.
    let conclusion = heard.any().then(|| Conclusion::draw(&folder, &heard, &judged_by, !arguments.no_report));
    if let Some(conclusion) = &conclusion {
        print!("{}", conclusion.table());
        if let Some(page) = &conclusion.page {
            println!("{:<22} {}", "page", page.display());
        }
        println!("{:<22} {}", "run folder", folder.path.display());
    }
    folder.recovered().iter().for_each(|said| tracing::warn!("{said}"));
    let reason = ended?;
    tracing::info!("the walk is over: {reason}");
    conclusion.map_or(Ok(()), |conclusion| conclusion.ending())
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
) -> Result<(Heard, Result<Reason, Ending>), Ending> {
    let failed = |error: anyhow::Error| Ending::with_causes(3, error);
    let domain =
        Domain::join(domain_name, Process::Launcher, Duration::from_secs(5)).map_err(|error| failed(error.into()))?;
    let mut ears = Ears::new(&domain, processes).map_err(|error| failed(error.into()))?;
    let start =
        Start { domain: domain_name, real_time: arguments.real_time, processes, log_format: arguments.log_format };
    let mut children = Vec::new();
    for process in processes {
        children.push(Supervised::start(*process, folder, &start)?);
    }
    let mut progress = Progress::new();
    let ended = watch(&mut children, &mut ears, &mut progress, owner, stop);
    progress.end();
    stop_all(&mut children, &mut ears, stop);
    Ok((ears.heard, ended))
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
            return Err(Ending::new(130, "interrupted"));
        }
        ears.listen().map_err(|error| Ending::with_causes(1, error))?;
        if let Some(reason) = ears.over {
            return Ok(reason);
        }
        if let Some(ending) = first_death(children, ears, stop) {
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

/// The unexpected end of a process, if one has ended. When several did, the one that did not merely follow another.
fn first_death(children: &mut [Supervised], ears: &mut Ears, stop: &Stop) -> Option<Ending> {
    children.iter_mut().find_map(Supervised::ended)?;
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

/// Rank of an ending that another one caused.
const FOLLOWED: u8 = 4;

/// How far an ending is from what went wrong first, by its exit code.
fn rank(ending: &Ending, followed: bool) -> u8 {
    match ending.code {
        2 => 0,
        1 | 5 | 6 => 1,
        3 => 2,
        _ if followed => FOLLOWED,
        _ => 3,
    }
}

/// Stops all processes: first those of the loop, then the recorder, which stores what they said last.
fn stop_all(children: &mut [Supervised], ears: &mut Ears, stop: &Stop) {
    // From now on, being asked once more means to hurry.
    stop.forget();
    let hurry = || stop.asked();
    let (recorder, others): (Vec<_>, Vec<_>) =
        children.iter_mut().partition(|child| child.process == Process::Recorder);
    for (group, patience) in [(others, STOP_PATIENCE), (recorder, RECORDER_PATIENCE)] {
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
    over: Option<Reason>,
}

impl Ears {
    fn new(domain: &Domain, processes: &[Process]) -> Result<Self, bus::PortError> {
        let health = |process: &Process| Ok((*process, domain.subscriber(topic::health(*process), Robot::Any, DEPTH)?));
        Ok(Self {
            health: processes.iter().map(health).collect::<Result<_, bus::PortError>>()?,
            states: processes.iter().map(|process| (*process, None, Reason::None)).collect(),
            heard: Heard::default(),
            over: None,
        })
    }

    fn listen(&mut self) -> Result<(), ReceiveError> {
        for (process, subscriber) in &mut self.health {
            while let Some(health) = subscriber.try_next()? {
                self.heard.take(&health);
                let state = State::from_code(health.state);
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
    fn what_went_wrong_first_is_named_before_what_followed() {
        let ranks = |endings: &[(u8, bool)]| {
            endings.iter().map(|(code, followed)| rank(&Ending::new(*code, ""), *followed)).collect::<Vec<_>>()
        };
        // A wrong configuration; a failure; no start; a safety stop; one for want of the other.
        let order = ranks(&[(2, false), (6, false), (3, false), (4, false), (4, true)]);
        assert!(order.is_sorted_by(|one, next| one < next), "{order:?}");
        assert_eq!(ranks(&[(1, false), (5, false), (6, true)]), ranks(&[(6, false); 3]));
        assert!(order[3] < FOLLOWED && order[4] == FOLLOWED);
    }
}
