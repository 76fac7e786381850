//! The bus between real processes: this test program starts itself again in other roles.

use bus::{Domain, DomainName, JoinError, MemoryError, Owner, OwnerError, PublishError, Robot};
use messages::code::Process;
use messages::{Header, Health, PatternHeader, PatternPhase, RobotState, topic};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Far longer than anything here takes, even on a busy machine; only a hanging test meets it.
const PATIENCE: Duration = Duration::from_secs(120);

/// A domain of its own for each test.
fn domain(test: &str) -> DomainName {
    format!("b-{test}-{}", std::process::id()).parse().expect("short and lower-case")
}

/// This program again, in another role; killed when dropped.
struct Role(Child);

impl Role {
    fn start(role: &str, domain: &DomainName) -> Self {
        let mut child = Command::new(std::env::current_exe().expect("a running program has a path"))
            .args(["--exact", "another_process_in_its_role", "--nocapture"])
            .env("BUS_TEST_ROLE", role)
            .env("BUS_TEST_DOMAIN", domain.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the test program can be started again");
        // The test harness prints lines of its own before ours.
        let mut lines = BufReader::new(child.stdout.as_mut().expect("piped"));
        let mut line = String::new();
        while !line.ends_with("in role\n") {
            line.clear();
            assert_ne!(lines.read_line(&mut line).expect("readable"), 0, "role {role} ended before it began");
        }
        Self(child)
    }

    fn kill(mut self) {
        self.0.kill().expect("it is ours");
        self.0.wait().expect("it is ours");
    }

    /// Lets it end by itself.
    fn finish(mut self) {
        drop(self.0.stdin.take());
        assert!(self.0.wait().expect("it is ours").success());
    }
}

impl Drop for Role {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Does nothing in a run of the tests; started by [`Role::start`] it plays its role until its standard input closes.
#[test]
fn another_process_in_its_role() {
    let (Ok(role), Ok(name)) = (std::env::var("BUS_TEST_ROLE"), std::env::var("BUS_TEST_DOMAIN")) else { return };
    let name: DomainName = name.parse().expect("the parent chose it");
    let until_stdin_closes = || std::io::stdin().read_to_end(&mut Vec::new()).expect("readable");
    let in_role = || {
        let mut out = std::io::stdout();
        out.write_all(b"in role\n").and_then(|()| out.flush()).expect("the parent listens");
    };
    match role.as_str() {
        "told" => {
            let mut out = std::io::stdout();
            let said = match Owner::claim(&name) {
                Ok(_) => "claimed".to_string(),
                Err(error) => error.to_string(),
            };
            writeln!(out, "told: {said}").and_then(|()| out.flush()).expect("the parent listens");
        }
        "owner" => {
            let _owner = Owner::claim(&name).expect("nobody else owns it");
            in_role();
            until_stdin_closes();
        }
        "states at 1 kHz" => {
            let domain = Domain::join(&name, Process::Simulator, PATIENCE).expect("there is an owner");
            let mut publisher = domain.publisher(topic::ROBOT_STATE).expect("nobody else publishes");
            in_role();
            for tick in 0.. {
                let state = RobotState { header: Header::new(tick, 7), joint_count: 3, ..RobotState::default() };
                publisher.publish(&state).expect("there is memory");
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        "answers" => {
            let domain = Domain::join(&name, Process::Estimator, PATIENCE).expect("there is an owner");
            let mut states = domain.subscriber(topic::ROBOT_STATE, Robot::Only(7), 4).expect("room");
            let mut answers = domain.publisher(topic::SOLE_DEFORMATION).expect("nobody else publishes");
            in_role();
            while let Some(state) = states.wait(PATIENCE).expect("receiving works") {
                let mut answer = messages::SoleDeformation { header: state.header, ..Default::default() };
                answer.walk_time_s = state.joint_position_rad[0] + 1.0;
                answers.publish(&answer).expect("there is memory");
            }
        }
        "pattern" => {
            let domain = Domain::join(&name, Process::Planner, PATIENCE).expect("there is an owner");
            let mut publisher = domain.pattern_publisher(3).expect("nobody else publishes");
            let header = PatternHeader { header: Header::new(0, 7), mass_kg: 39.0, ..PatternHeader::default() };
            publisher.publish(&header, &[PatternPhase { step: 5, ..Default::default() }; 3]).expect("fits");
            let mut health = domain.publisher(topic::health(Process::Planner)).expect("nobody else publishes");
            health.publish(&Health { process: 1, ..Health::default() }).expect("there is memory");
            in_role();
            loop {
                std::thread::sleep(Duration::from_millis(1));
                publisher.serve_late_joiners().expect("serving works");
                health.serve_late_joiners().expect("serving works");
            }
        }
        _ => panic!("unknown role {role}"),
    }
}

/// Waits for a condition.
fn eventually(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < PATIENCE, "in vain: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn question_and_answer_between_two_processes_lose_nothing_and_keep_their_order() {
    let name = domain("answer");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let domain = Domain::join(&name, Process::Simulator, PATIENCE).expect("there is an owner");
    let mut states = domain.publisher(topic::ROBOT_STATE).expect("nobody else publishes");
    let mut answers = domain.subscriber(topic::SOLE_DEFORMATION, Robot::Only(7), 4).expect("room");
    let role = Role::start("answers", &name);
    let rounds = 500;
    for tick in 0..rounds {
        let mut state = RobotState { header: Header::new(tick, 7), ..RobotState::default() };
        state.joint_position_rad[0] = 0.1 * tick as f64;
        states.publish(&state).expect("there is memory");
        let answer = answers.wait(PATIENCE).expect("receiving works").expect("an answer");
        assert_eq!(answer.header.tick, tick);
        assert_eq!(answer.walk_time_s.to_bits(), (0.1 * tick as f64 + 1.0).to_bits());
    }
    assert_eq!(answers.counts(), bus::Counts { taken: rounds as u64, ..Default::default() });
    role.kill();
}

#[test]
fn who_comes_late_gets_what_is_kept() {
    let name = domain("late");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let _role = Role::start("pattern", &name);
    let domain = Domain::join(&name, Process::Estimator, PATIENCE).expect("there is an owner");
    let mut patterns = domain.pattern_subscriber(Robot::Only(7), 3).expect("room");
    let pattern = patterns.wait(PATIENCE).expect("intact").expect("kept");
    assert_eq!(pattern.phases, [PatternPhase { step: 5, ..Default::default() }; 3]);
    assert_eq!((pattern.header.phase_count, pattern.header.mass_kg), (3, 39.0));
    let mut health = domain.subscriber(topic::health(Process::Planner), Robot::Any, 1).expect("room");
    assert_eq!(health.wait(PATIENCE).expect("receiving works").expect("kept").process, 1);
}

#[test]
fn a_pattern_longer_than_there_is_memory_for_is_refused() {
    let name = domain("long");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let domain = Domain::join(&name, Process::Planner, PATIENCE).expect("there is an owner");
    let mut publisher = domain.pattern_publisher(3).expect("nobody else publishes");
    let mut short = domain.pattern_subscriber(Robot::Any, 2).expect("room");
    let phases = [PatternPhase::default(); 4];
    let refused = publisher.publish(&PatternHeader::default(), &phases);
    assert!(matches!(refused, Err(PublishError::PatternTooLong { found: 4, limit: 3 })));
    publisher.publish(&PatternHeader::default(), &phases[..3]).expect("fits");
    assert!(domain.pattern_publisher(usize::MAX).is_ok(), "no more is asked for than the most there may be");
    let refused = short.wait(PATIENCE);
    assert!(matches!(refused, Err(bus::ReceiveError::PatternTooLong { found: 3, limit: 2 })), "{refused:?}");
}

#[test]
fn patterns_are_counted_as_messages_are() {
    let name = domain("patterns");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let domain = Domain::join(&name, Process::Planner, PATIENCE).expect("there is an owner");
    let mut publisher = domain.pattern_publisher(3).expect("nobody else publishes");
    let mut subscriber = domain.pattern_subscriber(Robot::Only(7), 3).expect("room");
    let mut publish = |robot| {
        let header = PatternHeader { header: Header::new(0, robot), ..PatternHeader::default() };
        publisher.publish(&header, &[PatternPhase::default()]).expect("fits");
    };
    publish(7);
    assert!(subscriber.latest().expect("intact").is_some());
    // Only the newest is kept.
    publish(7);
    publish(7);
    publish(7);
    let pattern = subscriber.latest().expect("intact").expect("the newest");
    assert_eq!((pattern.header.header.sequence, pattern.phases.len()), (3, 1));
    publish(8);
    assert_eq!(subscriber.latest().expect("intact"), None);
    assert_eq!(subscriber.counts(), bus::Counts { taken: 2, lost: 2, refused: 1, ..Default::default() });
}

#[test]
fn folder_and_memory_of_a_domain_are_its_users_alone() {
    use std::os::unix::fs::PermissionsExt;
    let name = domain("private");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let _role = Role::start("pattern", &name);
    let domain = Domain::join(&name, Process::Estimator, PATIENCE).expect("there is an owner");
    let mut patterns = domain.pattern_subscriber(Robot::Only(7), 3).expect("room");
    patterns.wait(PATIENCE).expect("intact").expect("kept");
    let mode = |path: &Path| path.symlink_metadata().map(|metadata| metadata.permissions().mode() & 0o777);
    assert_eq!(mode(&bus::runtime_folder()).expect("a domain is there"), 0o700);
    let in_memory: Vec<_> = name.leftovers().into_iter().filter(|path| path.starts_with("/dev/shm")).collect();
    assert!(in_memory.iter().any(|path| path.display().to_string().contains("global_mgmt")), "{in_memory:?}");
    for path in in_memory {
        // What goes meanwhile, nobody can open.
        assert_eq!(mode(&path).unwrap_or(0) & 0o077, 0, "{}", path.display());
    }
}

/// What one is told who claims a domain in a runtime folder.
fn told(name: &DomainName, runtime: &Path) -> String {
    let output = Command::new(std::env::current_exe().expect("a running program has a path"))
        .args(["--exact", "another_process_in_its_role", "--nocapture"])
        .env("BUS_TEST_ROLE", "told")
        .env("BUS_TEST_DOMAIN", name.to_string())
        .env(bus::RUNTIME_VARIABLE, runtime)
        .output()
        .expect("the test program can be started again");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let told = said.lines().find_map(|line| Some(line.split_once("told: ")?.1.to_string()));
    told.unwrap_or_else(|| panic!("it said nothing: {said}"))
}

#[test]
fn what_others_prepared_is_neither_used_nor_followed() {
    use std::os::unix::fs::{PermissionsExt, chown, symlink};
    let (place, home) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
    let precious = home.path().join("work/precious");
    std::fs::create_dir(home.path().join("work")).expect("writable");
    std::fs::write(&precious, "text").expect("writable");
    let name = domain("f");
    let runtime = place.path().join("r");
    let private = |mode| std::fs::set_permissions(&runtime, std::fs::Permissions::from_mode(mode)).expect("ours");
    // What is to be wiped, in all the places in which a domain of that name, or another one, would be.
    let prepare = || {
        std::fs::create_dir(&runtime).expect("writable");
        for link in [name.to_string(), "abandoned".to_string()] {
            symlink(home.path().join("work"), runtime.join(link)).expect("writable");
        }
        std::fs::create_dir(runtime.join("other")).expect("writable");
        symlink(home.path().join("work"), runtime.join("other/nodes")).expect("writable");
    };
    prepare();
    private(0o777);
    assert!(told(&name, &runtime).contains("has mode 0777"));
    assert!(runtime.join("other/nodes").is_symlink(), "nothing was touched");
    private(0o700);
    if runtime.metadata().is_ok() && chown(&runtime, Some(1), None).is_ok() {
        assert!(told(&name, &runtime).contains("belongs to user 1"));
        assert!(runtime.join("other/nodes").is_symlink(), "nothing was touched");
        chown(&runtime, Some(0), None).expect("we are root");
    } else {
        eprintln!("SKIPPED: only root can make a folder of another user");
    }
    let link = place.path().join("link");
    symlink(&runtime, &link).expect("writable");
    assert!(told(&name, &link).contains("is a symbolic link"));
    // Ours, but with links in it: they go, and what they lead to stays.
    assert_eq!(told(&name, &runtime), "claimed");
    assert_eq!(runtime.read_dir().expect("ours").count(), 0);
    assert_eq!(std::fs::read_to_string(&precious).expect("untouched"), "text");
}

#[test]
fn a_path_too_long_for_sockets_is_refused_by_name() {
    let name: DomainName = "a-name-that-is-as-long-as-allowed".get(..32).expect("long").parse().expect("a name");
    let refused = Owner::claim(&name).err().expect("too long").to_string();
    let joining = Domain::join(&name, Process::Planner, Duration::ZERO).err().expect("too long").to_string();
    for said in ["a-name-that-is-as-long-as-allowe", " bytes, and the system allows 107", "shorter --domain"] {
        assert!(refused.contains(said) && joining.contains(said), "no `{said}` in {refused}");
    }
}

#[test]
fn a_file_in_the_way_is_named_and_left_alone() {
    let name = domain("way");
    let path = PathBuf::from(format!("/dev/shm/{}in-the-way", name.prefix()));
    std::os::unix::fs::symlink("/etc/hostname", &path).expect("writable");
    let refused = Owner::claim(&name).err().map(|error| error.to_string());
    let is_there = path.is_symlink();
    std::fs::remove_file(&path).expect("ours");
    let refused = refused.expect("it is in the way");
    assert!(is_there && refused.contains(&path.display().to_string()) && refused.contains("rm "), "{refused}");
}

#[test]
fn memory_cut_to_nothing_keeps_nobody_waiting() {
    let name = domain("cut");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let management = name.leftovers().into_iter().find(|path| path.display().to_string().contains("global_mgmt"));
    std::fs::File::options().write(true).open(management.expect("there")).expect("ours").set_len(0).expect("ours");
    let refused = Domain::join(&name, Process::Planner, PATIENCE).err().expect("it is broken");
    assert!(matches!(refused, JoinError::Memory(MemoryError::Truncated { .. })), "{refused}");
}

#[test]
fn a_second_process_of_a_kind_is_refused_while_the_first_lives() {
    let name = domain("kind");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let role = Role::start("states at 1 kHz", &name);
    let Err(JoinError::Occupied { process: Process::Simulator, id, .. }) =
        Domain::join(&name, Process::Simulator, PATIENCE)
    else {
        panic!("there are two")
    };
    assert_eq!(id, role.0.id().to_string());
    assert!(name.living().contains(&(Some(Process::Simulator), id)));
    Domain::observe(&name, PATIENCE).expect("looking on takes nobody's place");
    Domain::join(&name, Process::Planner, PATIENCE).expect("another kind");
    role.kill();
    Domain::join(&name, Process::Simulator, PATIENCE).expect("the first is dead");
}

#[test]
fn the_contract_lets_a_foreign_process_take_its_place() {
    let name = domain("contract");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let text = bus::Contract::of(&name).to_string();
    let line = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = ")).expect("there");
    assert_eq!(line("owner"), format!("\"{}\"", std::process::id()));
    assert_eq!(line("prefix"), format!("\"{}\"", name.prefix()));
    // As the text says: open, lock, compare, write.
    let path = PathBuf::from(line("controller").trim_matches('"'));
    let mut file =
        std::fs::File::options().read(true).write(true).create(true).truncate(false).open(&path).expect("ours");
    file.try_lock().expect("nobody has it");
    writeln!(file, "4711").expect("ours");
    let refused = Domain::join(&name, Process::Controller, PATIENCE).err().expect("a foreign one lives").to_string();
    assert!(refused.contains("a living controller (process 4711) is in domain"), "{refused}");
    // It dies.
    let watcher = Domain::join(&name, Process::Estimator, PATIENCE).expect("there is an owner");
    drop(file);
    assert_eq!(watcher.dead_processes(), [Process::Controller]);
    Domain::join(&name, Process::Controller, PATIENCE).expect("its place is free");
}

#[test]
fn a_second_publisher_is_heard_when_the_first_is_dead() {
    let name = domain("two");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let domain = Domain::join(&name, Process::Estimator, PATIENCE).expect("there is an owner");
    let mut states = domain.subscriber(topic::ROBOT_STATE, Robot::Any, 128).expect("room");
    let role = Role::start("states at 1 kHz", &name);
    states.wait(PATIENCE).expect("receiving works").expect("a state");
    // One that has no business there.
    let mut second = domain.publisher(topic::ROBOT_STATE).expect("iceoryx2 has room for two");
    let wrong = RobotState { header: Header::new(-7, 7), ..RobotState::default() };
    let start = Instant::now();
    while states.counts().strangers < 10 {
        second.publish(&wrong).expect("memory");
        while let Some(state) = states.try_next().expect("receiving works") {
            assert_ne!(state.header.tick, -7, "the first lives");
        }
        assert!(start.elapsed() < PATIENCE, "never heard");
    }
    role.kill();
    eventually("the second is heard", || {
        second.publish(&wrong).expect("memory");
        states.latest().expect("receiving works").is_some_and(|state| state.header.tick == -7)
    });
}

#[test]
fn a_killed_publisher_is_noticed_and_can_be_started_again() {
    let name = domain("killed");
    let owner = Owner::claim(&name).expect("nobody else owns it");
    let domain = Domain::join(&name, Process::Estimator, PATIENCE).expect("there is an owner");
    let mut states = domain.subscriber(topic::ROBOT_STATE, Robot::Only(7), 128).expect("room");
    for round in 0..3 {
        let role = Role::start("states at 1 kHz", &name);
        let first = states.wait(PATIENCE).expect("receiving works").expect("a state");
        assert_eq!(first.joint_count, 3);
        assert_eq!(states.counts().restarts, round, "each publisher counts from zero");
        assert_eq!(domain.dead_processes(), [], "it lives");
        role.kill();
        assert_eq!(domain.dead_processes(), [Process::Simulator]);
        // Whoever frees what it held does not make us forget it.
        owner.reap_dead();
        assert_eq!(domain.dead_processes(), [Process::Simulator]);
        let later = Domain::join(&name, Process::Planner, PATIENCE).expect("there is an owner");
        assert_eq!(later.dead_processes(), [], "whoever comes later is not told of what was before");
        while states.try_next().expect("receiving works").is_some() {}
    }
}

#[test]
fn a_killed_owner_is_noticed_and_the_next_one_wipes_what_it_left() {
    let name = domain("heir");
    let role = Role::start("owner", &name);
    let domain = Domain::join(&name, Process::Estimator, PATIENCE).expect("there is an owner");
    assert!(domain.owner_is_alive());
    let Err(OwnerError::InUse { owner, .. }) = Owner::claim(&name) else { panic!("it has an owner") };
    assert_eq!(owner, role.0.id().to_string());
    role.kill();
    assert!(!domain.owner_is_alive());
    let heir = Owner::claim(&name).expect("the lock went with the dead");
    assert!(!domain.owner_is_alive(), "the heir is not the owner we knew");
    let ours = Domain::join(&name, Process::Planner, PATIENCE).expect("there is an owner");
    ours.publisher(topic::WALK_START).expect("the new services work");
    drop((ours, domain, heir));
    assert_eq!(name.leftovers(), [] as [PathBuf; 0]);
}

#[test]
fn what_a_killed_owner_left_is_removed_and_living_domains_are_left_alone() {
    let (dead, living) = (domain("dead"), domain("living"));
    let _owner = Owner::claim(&living).expect("nobody else owns it");
    Role::start("owner", &dead).kill();
    // Whoever claims a domain removes the dead ones; what another test is removing at this moment is left to it.
    let _other = Owner::claim(&domain("claimed")).expect("nobody else owns it");
    eventually("the dead domain is removed", || dead.leftovers().is_empty());
    Role::start("owner", &dead).kill();
    bus::remove_abandoned(&dead);
    assert_eq!(dead.leftovers(), [] as [PathBuf; 0]);
    bus::remove_abandoned(&living);
    let domain = Domain::join(&living, Process::Planner, PATIENCE).expect("it still has its owner");
    domain.publisher(topic::WALK_START).expect("it still works");
}

#[test]
fn an_owner_that_ends_leaves_nothing_even_while_others_were_there() {
    let name = domain("end");
    let role = Role::start("owner", &name);
    let other = Role::start("pattern", &name);
    assert!(!name.leftovers().is_empty());
    role.finish();
    other.kill();
    assert_eq!(name.leftovers(), [] as [PathBuf; 0]);
}

#[test]
fn without_an_owner_joining_fails_and_names_the_command() {
    let name = domain("nobody");
    let Err(error) = Domain::join(&name, Process::Estimator, Duration::from_millis(30)) else {
        panic!("nobody owns it")
    };
    assert!(matches!(error, JoinError::NoOwner { .. }));
    assert!(error.to_string().contains(&format!("soleus-launch serve --domain {name}")), "{error}");
}

#[test]
fn who_ends_in_order_is_not_dead_and_who_ends_badly_is() {
    let name = domain("badly");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let domain = Domain::join(&name, Process::Estimator, PATIENCE).expect("there is an owner");
    drop(Domain::join(&name, Process::Simulator, PATIENCE).expect("there is an owner"));
    assert_eq!(domain.dead_processes(), []);
    let failing = Domain::join(&name, Process::Controller, PATIENCE).expect("there is an owner");
    failing.ends_badly();
    assert_eq!(domain.dead_processes(), [], "it has not ended");
    drop(failing);
    assert_eq!(domain.dead_processes(), [Process::Controller]);
    let _again = Domain::join(&name, Process::Controller, PATIENCE).expect("there is an owner");
    assert_eq!(domain.dead_processes(), [], "another one took its place");
}

#[test]
fn two_domains_do_not_see_each_other() {
    let names = [domain("one"), domain("two")];
    let _owners = names.each_ref().map(|name| Owner::claim(name).expect("nobody else owns it"));
    let domains =
        names.each_ref().map(|name| Domain::join(name, Process::Simulator, PATIENCE).expect("it has an owner"));
    let mut publishers = domains.each_ref().map(|domain| domain.publisher(topic::ROBOT_STATE).expect("room"));
    let mut subscribers =
        domains.each_ref().map(|domain| domain.subscriber(topic::ROBOT_STATE, Robot::Any, 8).expect("room"));
    for (index, publisher) in publishers.iter_mut().enumerate() {
        publisher.publish(&RobotState { header: Header::new(index as i64, 7), ..Default::default() }).expect("memory");
    }
    for (index, subscriber) in subscribers.iter_mut().enumerate() {
        assert_eq!(subscriber.try_next().expect("receiving works").expect("its own").header.tick, index as i64);
        assert_eq!(subscriber.try_next().expect("receiving works"), None);
    }
}

#[test]
fn lost_messages_and_those_of_other_robots_are_counted() {
    let name = domain("counts");
    let _owner = Owner::claim(&name).expect("nobody else owns it");
    let domain = Domain::join(&name, Process::Simulator, PATIENCE).expect("there is an owner");
    let mut publisher = domain.publisher(topic::ROBOT_STATE).expect("nobody else publishes");
    let mut subscriber = domain.subscriber(topic::ROBOT_STATE, Robot::Only(7), 2).expect("room");
    let state = |tick| RobotState { header: Header::new(tick, 7), ..RobotState::default() };
    publisher.publish(&state(0)).expect("memory");
    assert!(subscriber.latest().expect("receiving works").is_some());
    // Nobody takes these ten; the buffer keeps the last two.
    for tick in 1..=10 {
        publisher.publish(&state(tick)).expect("memory");
    }
    publisher.publish(&RobotState { header: Header::new(11, 8), ..RobotState::default() }).expect("memory");
    assert_eq!(subscriber.try_next().expect("receiving works").expect("kept").header.tick, 10);
    assert_eq!(subscriber.try_next().expect("receiving works"), None);
    assert_eq!(subscriber.counts(), bus::Counts { taken: 2, lost: 9, refused: 1, ..Default::default() });
}

#[test]
fn names_that_would_leave_the_domain_are_refused() {
    for name in ["", "a_b", "A", "../x", "a/b", "a b", &"x".repeat(33)] {
        assert!(name.parse::<DomainName>().is_err(), "{name}");
    }
    assert!("hrp4-2".parse::<DomainName>().is_ok());
}
