//! The fault campaign: short walks, each with one fault of a control PC at a random instant.
//!
//! `cargo xtask faults --walks N --seed S` runs it; the tests make a few walks. The faults are those
//! that nobody can keep from happening: a process is killed or stopped, somebody presses Ctrl-C, the disk is full, a second controller
//! is started. Of none may come a launch without an end, an end without a name, a file that stays, or a recording that is lost.

use crate::alone;
use harness::{Finished, Launch, PATIENCE, Running, binaries, living_in, may_mount};
use recording::{Recording, recover};
use rustix::process::{Pid, Resource, Rlimit, prlimit};
use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// After so many seconds of silence a process hangs: less than a launch waits by default, more than a busy machine makes of a moment.
const HUNG_AFTER_S: &str = "4";
/// Walks of the campaign where nobody says how many.
const WALKS_OF_A_TEST: u64 = 4;
/// The processes of a walk.
const PROCESSES: [&str; 5] = ["planner", "estimator", "controller", "simulator", "recorder"];

/// What happens to a walk.
#[derive(Debug, Clone, Copy)]
enum Fault {
    /// kill -9 of a process.
    Kill(&'static str),
    /// SIGSTOP of a process.
    Pause(&'static str),
    /// Ctrl-C.
    Interrupt,
    /// The launcher is asked to stop, as by systemd.
    Terminate,
    /// kill -9 of the launcher.
    KillLauncher,
    /// No byte more for the recorder (RLIMIT_FSIZE).
    FullDisk,
    /// No byte more on the disk of the run's folder (a tmpfs that is filled).
    FilledDisk,
    /// A second controller with the configuration of the first.
    SecondController,
}

impl Fault {
    /// One of all kinds, or of those that need no file system of their own.
    fn any(random: &mut fastrand::Rng, may_mount: bool) -> Self {
        let process = PROCESSES[random.usize(..PROCESSES.len())];
        match random.u32(..if may_mount { 8 } else { 7 }) {
            0 => Self::Kill(process),
            1 => Self::Pause(process),
            2 => Self::Interrupt,
            3 => Self::Terminate,
            4 => Self::KillLauncher,
            5 => Self::FullDisk,
            6 => Self::SecondController,
            _ => Self::FilledDisk,
        }
    }

    /// The exit codes that tell of it, and what is said with them. A walk that ended before its fault ends with 0.
    fn told(self, finished: &Finished) -> bool {
        let (code, said) = (finished.code(), &finished.stderr);
        let killed = |process: &str| said.contains(&format!("the {process} was killed by signal 9"));
        match self {
            Self::KillLauncher => true,
            _ if code == 0 => true,
            Self::Kill("recorder") => code == 9 && killed("recorder"),
            Self::Kill(process) => code == 4 && killed(process),
            Self::Pause(process) => {
                let hung = said.contains(&format!("the {process} (process ")) && said.contains("has said nothing for");
                // Stopped while it was ending: killed in the end.
                (code == 8 && hung) || ([4, 9].contains(&code) && killed(process))
            }
            // Before it could hear of it the launcher ends as any program does.
            Self::Interrupt | Self::Terminate => (code == 130 && said.contains("interrupted")) || code == -1,
            // From its first byte on the recorder can neither record nor make its shared memory.
            Self::FullDisk => [3, 9].contains(&code) && (said.contains("the recorder") || said.contains("not whole")),
            // The recording is broken off; before there was one, logs or the folder could not be written.
            Self::FilledDisk => {
                [1, 3, 9].contains(&code) && (said.contains("No space left") || said.contains("not whole"))
            }
            // It came before the first one.
            Self::SecondController => code == 7 && said.contains("a living controller (process "),
        }
    }
}

/// What must not happen.
#[derive(Debug, Default)]
struct Figures {
    walks: u64,
    undisturbed: u64,
    hangs: u64,
    unnamed: u64,
    files_left: u64,
    recordings_lost: u64,
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { walks, undisturbed, hangs, unnamed, files_left, recordings_lost } = self;
        write!(
            f,
            "{walks} walks ({undisturbed} ended well all the same): {hangs} hangs, {unnamed} ends without a name, {files_left} with files \
             left, {recordings_lost} recordings lost"
        )
    }
}

fn short_walk() -> Launch {
    Launch::short_walk().set("recorder.flush_period_s=0.05").argument("--hung-after").argument(HUNG_AFTER_S)
}

/// The file that takes what is left of a disk.
const FILLER: &str = "of-somebody-else";
/// A disk on which a short walk has room, until somebody else fills it (bytes).
const DISK_BYTES: u64 = 64 << 20;

/// Writes until nothing more can be written.
fn fill(path: &Path) -> io::Result<()> {
    let mut file = File::create(path)?;
    while file.write_all(&[1; 4096]).is_ok() {}
    Ok(())
}

/// A disk of its own for a folder, as long as it lives.
struct Disk(PathBuf);

impl Disk {
    fn mount(folder: PathBuf) -> Self {
        std::fs::create_dir(&folder).expect("a new folder");
        let size = format!("size={DISK_BYTES}");
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &size, "none"]).arg(&folder).status();
        assert!(mounted.expect("there is a mount").success(), "root may mount");
        Self(folder)
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

/// Lets the fault happen; says whether a recording had been begun by then.
fn happen(fault: Fault, running: &Running) -> bool {
    let recording = running.partial_recording().metadata().is_ok_and(|metadata| metadata.len() > 0);
    let child = |process: &str| {
        let name = format!("soleus-{process}");
        running.children().into_iter().find(|(child, _)| *child == name).map(|(_, id)| id)
    };
    // Whoever has ended already is not disturbed any more.
    let _ = match fault {
        Fault::Kill(process) => child(process).map_or(Ok(()), node::kill),
        Fault::Pause(process) => child(process).map_or(Ok(()), node::pause),
        Fault::Interrupt => node::interrupt(running.id()),
        Fault::Terminate => node::terminate(running.id()),
        Fault::KillLauncher => node::kill(running.id()),
        Fault::FullDisk => {
            if let Some(recorder) = child("recorder").and_then(|id| Pid::from_raw(id.try_into().expect("an id"))) {
                let bytes = running.partial_recording().metadata().map_or(0, |metadata| metadata.len());
                let limit = Rlimit { current: Some(bytes), maximum: Some(bytes) };
                let _ = prlimit(Some(recorder), Resource::Fsize, limit);
            }
            Ok(())
        }
        Fault::FilledDisk => fill(&running.folder().join(FILLER)),
        Fault::SecondController => {
            let second = Command::new(binaries().join("soleus-controller"))
                .arg("--config")
                .arg(running.folder().join("config/controller.toml"))
                .arg("--domain")
                .arg(running.domain().to_string())
                .output()
                .expect("it can be started");
            // Refused; or the walk is over, or not begun; or it was asked to stop with all others of the domain.
            assert!([7, 3, 2, 0, 4].map(Some).contains(&second.status.code()), "{second:?}");
            Ok(())
        }
    };
    recording
}

/// Whether there is a recording that can be read, as it is or recovered.
fn is_recorded(finished: &Finished) -> bool {
    let folder = finished.folder();
    if recover(&folder).is_err() {
        return false;
    }
    let files = folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.path());
    files
        .into_iter()
        .any(|path| path.extension().is_some_and(|ending| ending == "mcap") && Recording::open(&path).is_ok())
}

fn number(variable: &str, default: u64) -> u64 {
    let text = std::env::var(variable).unwrap_or_default();
    if text.is_empty() { default } else { text.parse().unwrap_or_else(|_| panic!("{variable} = {text}: no number")) }
}

#[test]
fn no_fault_hangs_is_unnamed_or_loses_a_recording() {
    let _alone = alone();
    let (walks, seed) = (number("SOLEUS_FAULT_WALKS", WALKS_OF_A_TEST), number("SOLEUS_FAULT_SEED", 1));
    let may_mount = may_mount();
    if !may_mount {
        eprintln!("SKIPPED: a disk that is filled by somebody else; only who may mount can have one");
    }
    // One that nobody disturbs says how long they take; building them is no part of it.
    let _ = binaries();
    let start = Instant::now();
    let undisturbed = short_walk().finish();
    assert_eq!(undisturbed.code(), 0, "{}", undisturbed.stderr);
    let duration_s = start.elapsed().as_secs_f64();
    let mut figures = Figures::default();
    for walk in 0..walks {
        let mut random = fastrand::Rng::with_seed(seed.wrapping_add(walk));
        let fault = Fault::any(&mut random, may_mount);
        let after_s = random.f64() * duration_s;
        let launch = short_walk();
        let disk = matches!(fault, Fault::FilledDisk).then(|| Disk::mount(launch.folder()));
        let running = launch.start();
        let domain = running.domain().clone();
        std::thread::sleep(Duration::from_secs_f64(after_s));
        let was_recorded = happen(fault, &running);
        let Some(finished) = running.finish_within(PATIENCE) else {
            figures.hangs += 1;
            eprintln!("seed {}: {fault:?} after {after_s:.3} s: hangs", seed + walk);
            continue;
        };
        figures.walks += 1;
        figures.undisturbed += u64::from(finished.code() == 0);
        let gone = eventually_within(PATIENCE, || living_in(&domain).is_empty() && domain.leftovers().is_empty());
        // Who wants to recover a recording makes room first.
        let _ = std::fs::remove_file(finished.folder().join(FILLER));
        let (told, recorded) = (fault.told(&finished), !was_recorded || is_recorded(&finished));
        figures.unnamed += u64::from(!told);
        figures.files_left += u64::from(!gone);
        figures.recordings_lost += u64::from(!recorded);
        if !(told && gone && recorded) {
            let (code, said) = (finished.code(), &finished.stderr);
            eprintln!(
                "seed {}: {fault:?} after {after_s:.3} s: code {code}, told {told}, nothing left {gone}, recorded {recorded}; {:?} {:?}\n{said}",
                seed + walk,
                living_in(&domain),
                domain.leftovers(),
            );
        }
        eprintln!("seed {}: {fault:?} after {after_s:.3} s: code {}", seed + walk, finished.code());
        drop(disk);
    }
    eprintln!("{figures}");
    let bad = figures.hangs + figures.unnamed + figures.files_left + figures.recordings_lost;
    assert_eq!(bad, 0, "{figures}");
}

fn eventually_within(patience: Duration, mut condition: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while !condition() {
        if start.elapsed() > patience {
            return false;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    true
}

/// A walk after which the robot stands for longer than any test.
fn long_walk() -> Launch {
    short_walk().set("simulator.run.after_walk_s=8e4")
}

#[test]
fn a_process_that_hangs_is_named_and_ends_the_launch() {
    let _alone = alone();
    for process in ["controller", "recorder"] {
        let mut running = long_walk().start();
        running.wait_until_walking();
        node::pause(running.wait_for_child(&format!("soleus-{process}"))).expect("it lives");
        let run = running.finish();
        assert_eq!(run.code(), 8, "{}", run.stderr);
        for said in [format!("the {process} (process "), "stopped by a signal) has said nothing for".to_string()] {
            assert!(run.stderr.contains(&said), "no `{said}` in\n{}", run.stderr);
        }
        // A recorder that was stopped may go on to finish its file.
        assert!(run.stdout.contains("recording              complete\n"), "{}", run.stdout);
        run.assert_nothing_left();
        Recording::open(&run.recording()).expect("finished");
    }
}

#[test]
fn a_second_controller_is_refused_and_disturbs_nothing() {
    let _alone = alone();
    let mut running = long_walk().start();
    running.wait_until_walking();
    let first = running.wait_for_child("soleus-controller");
    let second = Command::new(binaries().join("soleus-controller"))
        .arg("--config")
        .arg(running.folder().join("config/controller.toml"))
        .args(["--domain", &running.domain().to_string()])
        .output()
        .expect("it can be started");
    let said = String::from_utf8_lossy(&second.stderr);
    assert_eq!(second.status.code(), Some(7), "{said}");
    assert!(said.contains(&format!("a living controller (process {first}) is in domain")), "{said}");
    node::interrupt(running.id()).expect("it lives");
    let run = running.finish();
    assert_eq!(run.code(), 130, "{}", run.stderr);
    run.assert_nothing_left();
}
