//! What ships for a control PC: units of systemd, and a driver to start from.

use crate::alone;
use bus::DomainName;
use harness::{binaries, eventually, root};
use messages::topic;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

/// The units and what they start: program and arguments.
fn units() -> Vec<(PathBuf, Vec<String>)> {
    let folder = root().join("config/systemd");
    let files = std::fs::read_dir(&folder).expect("it ships").map(|entry| entry.expect("readable").path());
    let mut units: Vec<_> =
        files.filter(|path| path.extension().is_some_and(|kind| kind == "service")).map(start).collect();
    units.sort();
    assert!(units.len() >= 6, "{units:?}");
    units
}

fn start(unit: PathBuf) -> (PathBuf, Vec<String>) {
    let text = std::fs::read_to_string(&unit).expect("it ships");
    let line = text.lines().find_map(|line| line.strip_prefix("ExecStart=")).expect("it starts something");
    (unit, line.split(' ').map(str::to_string).collect())
}

/// The binary that was built for a program of `/usr/local/bin`.
fn built(program: &str) -> PathBuf {
    binaries().join(Path::new(program).file_name().expect("a program"))
}

#[test]
fn every_unit_starts_a_program_that_takes_its_arguments() {
    for (unit, words) in units() {
        let name = unit.file_stem().expect("a name").to_string_lossy().into_owned();
        let process =
            name.strip_prefix("soleus-").and_then(|name| name.strip_suffix('@')).expect("soleus-NAME@.service");
        let mut command = Command::new(built(&words[0]));
        for word in &words[1..] {
            // As shipped, in place of what a person puts into /etc.
            let shipped = root().join("config").join(format!("{process}.toml")).display().to_string();
            command.arg(word.replace(&format!("/etc/soleus/%i/{process}.toml"), &shipped).replace("%i", "unit-test"));
        }
        command.arg(if words[1] == "serve" { "--help" } else { "--check" });
        let said = command.stdin(Stdio::null()).output().expect("it can be started");
        assert!(said.status.success(), "{name}: {}", String::from_utf8_lossy(&said.stderr));
    }
}

#[test]
fn systemd_has_nothing_to_say_against_the_units() {
    if Command::new("systemd-analyze").arg("--version").output().is_err() {
        eprintln!("SKIPPED: there is no systemd-analyze, so the units are not verified");
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut paths = Vec::new();
    for (unit, words) in units() {
        // It wants programs that are there.
        let text = std::fs::read_to_string(&unit).expect("it ships");
        let path = folder.path().join(unit.file_name().expect("a name"));
        let program = built(&words[0]).display().to_string();
        std::fs::write(&path, text.replace(&words[0], &program)).expect("writable");
        paths.push(path);
    }
    let verify = |paths: &[PathBuf]| -> Output {
        Command::new("systemd-analyze").args(["verify", "--man=no"]).args(paths).output().expect("it is there")
    };
    let said = verify(&paths);
    let stderr = String::from_utf8_lossy(&said.stderr);
    // Units of the host itself are none of ours.
    let ours: Vec<&str> = stderr.lines().filter(|line| line.contains("soleus")).collect();
    assert!(ours.is_empty(), "{ours:?}");
    // A check that finds nothing in anything shows nothing.
    let wrong = folder.path().join("soleus-wrong@.service");
    std::fs::write(&wrong, "[Service]\nExecStart=/bin/true\nLimitRTPRIOO=80\nTimerSlackNSec=fast\n").expect("writable");
    let stderr = String::from_utf8_lossy(&verify(&[wrong]).stderr).into_owned();
    assert!(stderr.contains("LimitRTPRIOO") || stderr.contains("TimerSlackNSec"), "{stderr}");
}

/// Killed when dropped.
struct Alive(Child);

impl Drop for Alive {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Processes as services start them, one by one, with the driver to start from in the simulator's place.
struct Bench {
    domain: DomainName,
    alive: Vec<Alive>,
}

impl Bench {
    fn serve(name: &str) -> Self {
        let domain: DomainName = format!("{name}-{}", std::process::id()).parse().expect("short and lower-case");
        let mut bench = Self { domain, alive: Vec::new() };
        bench.start("soleus-launch", &["serve"]);
        let domain = bench.domain.clone();
        eventually("an owner", || domain.living().iter().any(|(process, _)| process.is_none()));
        bench
    }

    fn start(&mut self, program: &str, arguments: &[&str]) -> u32 {
        let mut command = Command::new(binaries().join(program));
        command.args(arguments).arg("--domain").arg(self.domain.to_string()).stdin(Stdio::null()).stdout(Stdio::null());
        let child = command.spawn().expect("it can be started");
        let id = child.id();
        self.alive.push(Alive(child));
        id
    }

    fn process(&mut self, process: &str, more: &[&str]) -> u32 {
        let config = root().join("config").join(format!("{process}.toml")).display().to_string();
        self.start(&format!("soleus-{process}"), &[&["--config", &config], more].concat())
    }

    fn check(&self, ticks: &str) -> (Option<i32>, String) {
        let mut command = Command::new(binaries().join("soleus-inspect"));
        command.args(["driver-check", "--ticks", ticks, "--patience", "60", "--domain"]).arg(self.domain.to_string());
        let said = command.arg("--robot").arg(root().join("robots/hrp4")).output().expect("it can be started");
        let text = String::from_utf8_lossy(&said.stdout).into_owned() + &String::from_utf8_lossy(&said.stderr);
        (said.status.code(), text)
    }
}

#[test]
fn the_driver_to_start_from_walks_in_lock_step_and_has_manners() {
    let _alone = alone();
    let mut bench = Bench::serve("driver");
    bench.process("planner", &["--set", "gait.walk.swings=1"]);
    bench.process("estimator", &[]);
    bench.process("controller", &[]);
    let observer = bus::Domain::observe(&bench.domain, harness::PATIENCE).expect("it has an owner");
    let mut starts = observer.subscriber(topic::WALK_START, bus::Robot::Any, 4).expect("a topic");
    let mut commands = observer.subscriber(topic::ROBOT_COMMAND, bus::Robot::Any, 128).expect("a topic");
    let driver = bench.process("driver", &[]);
    let (code, said) = bench.check("300");
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("300 states in lock-step") && !said.contains("WRONG"), "{said}");
    let mut last = None;
    eventually("the end of the walk", || {
        last = commands.latest().expect("works").or(last);
        last.is_some_and(|command| command.mode == messages::code::Mode::Finished.code())
    });
    assert!(starts.latest().expect("works").is_some(), "the robot that does what it is told settles");
    // Its work is over, and it says so until it is asked to stop.
    node::terminate(driver).expect("it lives");
    eventually("the driver's end", || !harness::is_alive(driver));
}

#[test]
fn a_domain_without_a_driver_is_told_as_silence() {
    let _alone = alone();
    let bench = Bench::serve("no-driver");
    let mut command = Command::new(binaries().join("soleus-inspect"));
    command.args(["driver-check", "--patience", "0.3", "--domain"]).arg(bench.domain.to_string());
    let said = command.arg("--robot").arg(root().join("robots/hrp4")).output().expect("it can be started");
    let text = String::from_utf8_lossy(&said.stdout);
    assert_eq!(said.status.code(), Some(1), "{text}");
    assert!(text.contains("silence  WRONG") && text.contains("place    WRONG"), "{text}");
}
