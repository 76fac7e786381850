//! Programs in their shells, as real processes: this test program starts itself again in other roles.

use bus::{Domain, DomainName, Owner, Robot};
use messages::code::{Process, Reason, State};
use messages::{Header, Health, RecorderFigures, RobotState, SoleDeformation, topic};
use node::{End, Failure, Program, Shell};
use serde::Deserialize;
use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Far longer than anything here takes, even on a busy machine; only a hanging test meets it.
const PATIENCE: Duration = Duration::from_secs(120);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    gain: f64,
}

/// Answers each state with a deformation.
struct Echo(f64);

impl Program for Echo {
    const PROCESS: Process = Process::Estimator;
    const ABOUT: &'static str = "Answers each state.";
    type Settings = Settings;

    fn build(settings: Settings) -> Result<Self, Failure> {
        if settings.gain <= 0.0 {
            return Err(Failure::unusable(format!("gain = {}: must be positive", settings.gain)));
        }
        Ok(Self(settings.gain))
    }

    fn robot_fingerprint(&self) -> Option<u64> {
        Some(7)
    }

    fn run(&mut self, shell: &mut Shell) -> Result<End, Failure> {
        let mut states = shell.subscriber(topic::ROBOT_STATE, 4)?;
        let mut answers = shell.publisher(topic::SOLE_DEFORMATION)?;
        shell.ready()?;
        while let Some(state) = shell.wait(&mut states)? {
            shell.cycle_starts();
            let walk_time_s = self.0 * state.joint_position_rad[0];
            answers.publish(&SoleDeformation { header: state.header, walk_time_s, ..Default::default() })?;
            shell.cycle_ends(state.header.tick)?;
        }
        Ok(End::Asked)
    }
}

/// Asks `gain` questions in lock-step and is done; half a question is a failure.
struct Asker(f64);

impl Program for Asker {
    const PROCESS: Process = Process::Simulator;
    const ABOUT: &'static str = "Asks.";
    type Settings = Settings;

    fn build(settings: Settings) -> Result<Self, Failure> {
        Ok(Self(settings.gain))
    }

    fn robot_fingerprint(&self) -> Option<u64> {
        Some(7)
    }

    fn run(&mut self, shell: &mut Shell) -> Result<End, Failure> {
        let mut states = shell.publisher(topic::ROBOT_STATE)?;
        let mut answers = shell.subscriber(topic::SOLE_DEFORMATION, 4)?;
        if !shell.wait_for_others(&[Process::Estimator])? {
            return Ok(End::Asked);
        }
        for tick in 0..self.0 as i64 {
            shell.cycle_starts();
            states.publish(&RobotState { header: Header::new(tick, 7), ..RobotState::default() })?;
            shell.cycle_waits();
            let Some(answer) = shell.wait_tick(&mut answers, tick)? else { return Ok(End::Asked) };
            shell.cycle_goes_on();
            assert_eq!(answer.header.tick, tick);
            if !shell.wait_for_recorder(tick)? {
                return Ok(End::Asked);
            }
            shell.cycle_ends(tick)?;
        }
        if self.0.fract() != 0.0 {
            return Err(Failure::running("half a question is none"));
        }
        Ok(End::Over(Reason::Finished))
    }
}

/// Does nothing in a run of the tests; started by [`Role::start`] it is one of the programs.
#[test]
fn another_process_in_its_role() {
    let (Ok(role), Ok(arguments)) = (std::env::var("NODE_TEST_ROLE"), std::env::var("NODE_TEST_ARGUMENTS")) else {
        return;
    };
    let arguments = std::iter::once("test").chain(arguments.split_whitespace()).map(Into::into).collect::<Vec<_>>();
    let code = match role.as_str() {
        "echo" => node::run::<Echo>(arguments),
        "asker" => node::run::<Asker>(arguments),
        _ => panic!("unknown role {role}"),
    };
    std::process::exit(code.code().into());
}

struct Role(Child);

impl Role {
    fn start(role: &str, arguments: &str) -> Self {
        let child = Command::new(std::env::current_exe().expect("a running program has a path"))
            .args(["--exact", "another_process_in_its_role", "--nocapture"])
            .env("NODE_TEST_ROLE", role)
            .env("NODE_TEST_ARGUMENTS", arguments)
            .env_remove("RUST_LOG")
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the test program can be started again");
        Self(child)
    }

    /// Exit code and what it said on standard output and error.
    fn end(mut self) -> (i32, String) {
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.0.try_wait().expect("it is ours") {
                break status;
            }
            assert!(start.elapsed() < PATIENCE, "it hangs");
            std::thread::sleep(Duration::from_millis(2));
        };
        let mut said = String::new();
        self.0.stdout.take().expect("piped").read_to_string(&mut said).expect("text");
        self.0.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
        (status.code().unwrap_or(-1), said)
    }
}

impl Drop for Role {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

struct Setup {
    name: DomainName,
    folder: tempfile::TempDir,
}

impl Setup {
    fn new(test: &str) -> Self {
        let name = format!("n-{test}-{}", std::process::id()).parse().expect("short and lower-case");
        Self { name, folder: tempfile::tempdir().expect("a temporary folder") }
    }

    fn arguments(&self, text: &str) -> String {
        // Each program has a file of its own: one may still be reading its when the next is written.
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let path: PathBuf = self.folder.path().join(format!("{}.toml", NUMBER.fetch_add(1, Ordering::Relaxed)));
        std::fs::write(&path, text).expect("writable");
        format!("--config {} --domain {}", path.display(), self.name)
    }
}

/// Waits for a state of a process.
fn wait_for_state(domain: &Domain, process: Process, state: State) -> Health {
    wait_for(domain, process, &format!("{state}"), |health| State::from_code(health.state) == Some(state))
}

/// Waits for a process to say something.
fn wait_for(domain: &Domain, process: Process, what: &str, said: impl Fn(&Health) -> bool) -> Health {
    let mut health = domain.subscriber(topic::health(process), Robot::Any, 16).expect("room");
    let start = Instant::now();
    loop {
        while let Some(health) = health.try_next().expect("receiving works") {
            if said(&health) {
                return health;
            }
        }
        assert!(start.elapsed() < PATIENCE, "{process} never said: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn two_programs_run_in_lock_step_and_end_when_asked() {
    let setup = Setup::new("step");
    let _owner = Owner::claim(&setup.name).expect("nobody else owns it");
    let watcher = Domain::join(&setup.name, Process::Launcher, PATIENCE).expect("there is an owner");
    let asker = Role::start("asker", &setup.arguments("gain = 2000.0"));
    let echo = Role::start("echo", &setup.arguments("gain = 1.0"));
    let over = wait_for_state(&watcher, Process::Simulator, State::Stopping);
    assert_eq!((over.cycles, over.header.tick, Reason::from_code(over.reason)), (2000, 1999, Some(Reason::Finished)));
    // Its last answer is there; its report of it may need a moment.
    let echoed = wait_for(&watcher, Process::Estimator, "2000 cycles", |health| health.cycles >= 2000);
    assert_eq!((echoed.cycles, echoed.header.tick, echoed.state), (2000, 1999, State::Running.code()));
    node::terminate(echo.0.id()).expect("it lives");
    node::terminate(asker.0.id()).expect("it lives");
    assert_eq!(echo.end().0, 0);
    assert_eq!(asker.end().0, 0);
}

/// A recorder that says it has stored everything up to a tick.
fn stored(tick: i64, state: State) -> Health {
    Health { recorder: RecorderFigures { stored_tick: tick }, ..Health::new(Process::Recorder, state, Reason::None) }
}

#[test]
fn in_lock_step_nobody_runs_away_from_the_recorder() {
    let setup = Setup::new("recorder");
    let _owner = Owner::claim(&setup.name).expect("nobody else owns it");
    let recorder = Domain::join(&setup.name, Process::Recorder, PATIENCE).expect("there is an owner");
    let mut health = recorder.publisher(topic::health(Process::Recorder)).expect("nobody else publishes");
    let mut states = recorder.subscriber(topic::ROBOT_STATE, Robot::Any, 128).expect("room");
    health.publish(&stored(-1, State::Ready)).expect("memory");
    let _echo = Role::start("echo", &setup.arguments("gain = 1.0"));
    let waits = "--wait-for estimator,recorder";
    let asker = Role::start("asker", &format!("{} {waits}", setup.arguments("gain = 1e9")));
    let mut next_state = |patience| states.wait(patience).expect("receiving works").map(|state| state.header.tick);
    let mut wait_for_tick = |tick| {
        let start = Instant::now();
        // Whoever comes late is served.
        while next_state(Duration::from_millis(20)) != Some(tick) {
            health.serve_late_joiners().expect("serving works");
            assert!(start.elapsed() < PATIENCE, "tick {tick} never came");
        }
        // It waits now: none comes, however long one listens.
        assert_eq!(next_state(Duration::from_millis(200)), None);
        health.publish(&stored(10, State::Running)).expect("memory");
    };
    // 32 ticks it may be ahead; the next one is published already when it waits.
    wait_for_tick(32);
    wait_for_tick(43);
    health.publish(&stored(10, State::Stopping)).expect("memory");
    let (code, said) = asker.end();
    assert_eq!(code, 4, "{said}");
    assert!(said.contains("the recorder died, and without `health/recorder` there is no going on"), "{said}");
}

#[test]
fn a_program_whose_partner_is_killed_stops_and_says_so() {
    let setup = Setup::new("partner");
    let _owner = Owner::claim(&setup.name).expect("nobody else owns it");
    let watcher = Domain::join(&setup.name, Process::Launcher, PATIENCE).expect("there is an owner");
    let echo = Role::start("echo", &setup.arguments("gain = 1.0"));
    let asker = Role::start("asker", &setup.arguments("gain = 1e9"));
    wait_for_state(&watcher, Process::Simulator, State::Running);
    node::kill(asker.0.id()).expect("it lives");
    let (code, said) = echo.end();
    assert_eq!(code, 4, "{said}");
    assert!(said.contains("the simulator died, and without `robot/state` there is no going on"), "{said}");
}

#[test]
fn a_program_whose_partner_fails_stops_and_says_so() {
    let setup = Setup::new("failing");
    let _owner = Owner::claim(&setup.name).expect("nobody else owns it");
    let echo = Role::start("echo", &setup.arguments("gain = 1.0"));
    let asker = Role::start("asker", &setup.arguments("gain = 3.5"));
    let (code, said) = asker.end();
    assert_eq!(code, 1, "{said}");
    assert!(said.contains("half a question is none"), "{said}");
    let (code, said) = echo.end();
    assert_eq!(code, 4, "{said}");
    assert!(said.contains("the simulator died, and without `robot/state` there is no going on"), "{said}");
}

#[test]
fn a_program_whose_partner_has_another_robot_stops_and_says_so() {
    let setup = Setup::new("robots");
    let _owner = Owner::claim(&setup.name).expect("nobody else owns it");
    let simulator = Domain::join(&setup.name, Process::Simulator, PATIENCE).expect("there is an owner");
    let mut states = simulator.publisher(topic::ROBOT_STATE).expect("nobody else publishes");
    let mut answers = simulator.subscriber(topic::SOLE_DEFORMATION, Robot::Any, 4).expect("room");
    let mut state = |robot| {
        let message = RobotState { header: Header::new(0, robot), ..RobotState::default() };
        states.publish(&message).expect("memory");
    };
    let echo = Role::start("echo", &setup.arguments("gain = 1.0"));
    wait_for_state(&simulator, Process::Estimator, State::Ready);
    state(7);
    assert!(answers.wait(PATIENCE).expect("receiving works").is_some());
    state(8);
    let (code, said) = echo.end();
    assert_eq!(code, 2, "{said}");
    assert!(said.contains("`robot/state` is about another robot (fingerprint 0000000000000008, ours is"), "{said}");
    assert!(said.contains("the same robot folder"), "{said}");
}

#[test]
fn a_second_program_of_a_kind_is_refused_with_code_7() {
    let setup = Setup::new("second");
    let _owner = Owner::claim(&setup.name).expect("nobody else owns it");
    let watcher = Domain::observe(&setup.name, PATIENCE).expect("there is an owner");
    let first = Role::start("echo", &setup.arguments("gain = 1.0"));
    wait_for_state(&watcher, Process::Estimator, State::Ready);
    let (code, said) = Role::start("echo", &setup.arguments("gain = 1.0")).end();
    assert_eq!(code, 7, "{said}");
    let expected = format!("a living estimator (process {}) is in domain `{}` already", first.0.id(), setup.name);
    assert!(said.contains(&expected), "{said}");
    node::terminate(first.0.id()).expect("it lives");
    assert_eq!(first.end().0, 0);
}

#[test]
fn a_program_whose_owner_goes_away_stops() {
    let setup = Setup::new("owner");
    let owner = Owner::claim(&setup.name).expect("nobody else owns it");
    let echo = Role::start("echo", &setup.arguments("gain = 1.0"));
    let watcher = Domain::join(&setup.name, Process::Launcher, PATIENCE).expect("there is an owner");
    wait_for_state(&watcher, Process::Estimator, State::Ready);
    drop((watcher, owner));
    let (code, said) = echo.end();
    assert_eq!(code, 3, "{said}");
    assert!(said.contains("went away"), "{said}");
    assert_eq!(setup.name.leftovers(), [] as [PathBuf; 0]);
}

#[test]
fn a_program_without_an_owner_gives_up_with_code_3() {
    let setup = Setup::new("alone");
    let (code, said) = Role::start("echo", &setup.arguments("gain = 1.0")).end();
    assert_eq!(code, 3, "{said}");
    assert!(said.contains("soleus-launch serve --domain"), "{said}");
}

#[test]
fn wrong_configurations_end_with_code_2_and_name_the_key_before_any_owner_is_looked_for() {
    let setup = Setup::new("wrong");
    for (text, expected) in [
        ("gian = 1.0", "`gian`: unknown; did you mean `gain`?"),
        ("gain = \"much\"", "invalid type: string \"much\", expected f64"),
        ("gain = = 1", "not valid TOML"),
        ("", "`gain`: missing"),
        ("gain = -1.0", "gain = -1: must be positive"),
    ] {
        let (code, said) = Role::start("echo", &setup.arguments(text)).end();
        assert_eq!(code, 2, "{said}");
        assert!(said.contains(expected), "{said}");
    }
    let (code, said) = Role::start("echo", "--config /nowhere/x.toml").end();
    assert_eq!(code, 2);
    assert!(said.contains("cannot read /nowhere/x.toml"), "{said}");
    let (code, said) = Role::start("echo", "--frobnicate").end();
    assert_eq!(code, 2);
    assert!(said.contains("--frobnicate"), "{said}");
}

#[test]
fn check_prints_the_effective_configuration_and_ends() {
    let setup = Setup::new("check");
    let (code, said) = Role::start("echo", &format!("{} --set gain=2.5 --check", setup.arguments("gain = 1.0"))).end();
    assert_eq!(code, 0);
    assert!(said.contains("gain = 2.5\n"), "{said}");
}

#[test]
fn version_names_the_commit() {
    let (code, said) = Role::start("echo", "--version").end();
    assert_eq!(code, 0);
    assert!(said.contains(&format!("soleus-estimator {}", node::VERSION)), "{said}");
}

#[test]
fn a_command_of_an_unknown_process_is_not_a_name_to_wait_for() {
    let (code, said) = Role::start("echo", "--config x --wait-for planner,plumber").end();
    assert_eq!(code, 2);
    assert!(said.contains("no process is called so"), "{said}");
}
