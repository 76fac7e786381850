//! What is refused, and how differences are told. Whole replays are in the system tests, where there are whole runs.

use messages::code::Process;
use messages::{Header, Message, RobotState, topic};
use recording::{Recording, RunInfo, ViewerSettings, Writer};
use replayer::{Inputs, ReplayError, Unpacked};
use tempfile::TempDir;

/// A recording of robot states at some ticks.
fn recording(folder: &TempDir, pace: &str, ticks: &[i64], files: &[(&str, &str)]) -> Recording {
    let counted: Vec<(i64, u64)> = ticks.iter().copied().zip(0..).collect();
    counted_recording(folder, pace, &counted, files)
}

/// The same, each state with the number that its publisher gave it.
fn counted_recording(folder: &TempDir, pace: &str, ticks: &[(i64, u64)], files: &[(&str, &str)]) -> Recording {
    let facts = [("pace".to_string(), pace.to_string())].into();
    let files = files.iter().map(|(name, text)| ((*name).to_string(), text.as_bytes().to_vec())).collect();
    let path = folder.path().join("walk.mcap");
    let mut writer =
        Writer::create_over(&path, &RunInfo { facts, files, ..RunInfo::default() }, ViewerSettings::default())
            .expect("writable");
    for &(tick, sequence) in ticks {
        let mut state = RobotState { header: Header::new(tick, 7), ..RobotState::default() };
        state.header_mut().sequence = sequence;
        writer.record(topic::ROBOT_STATE, &state).expect("writable");
    }
    Recording::open(&writer.finish().expect("writable")).expect("finished")
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn complete_states_are_taken_in_their_order() {
    let folder = folder();
    let inputs = Inputs::of(&recording(&folder, "lock-step", &[-1, 0, 1], &[]), Process::Estimator).expect("complete");
    let ticks: Vec<i64> = inputs.states.iter().map(|state| state.header.tick).collect();
    assert_eq!(ticks, [-1, 0, 1]);
    assert!(inputs.states.at(1).is_some() && inputs.states.at(2).is_none());
}

#[test]
fn what_the_process_needs_and_was_lost_is_named() {
    let folder = folder();
    let lost = recording(&folder, "lock-step", &[-1, 0, 3, 4], &[]);
    let Err(error) = Inputs::of(&lost, Process::Estimator) else { panic!("two states are missing") };
    assert!(matches!(error, ReplayError::Gap { topic: "robot/state", tick: 3, lost: 2 }), "{error}");
    // Lost at the beginning is lost, too.
    let late = recording(&folder, "lock-step", &[5, 6], &[]);
    let Err(error) = Inputs::of(&late, Process::Estimator) else { panic!("the beginning is missing") };
    assert!(matches!(error, ReplayError::Gap { tick: 5, lost: 6, .. }), "{error}");
    // What it only says itself may have gaps: it is compared where it is there.
    let Err(error) = Inputs::of(&lost, Process::Simulator) else { panic!("there are no commands") };
    assert!(matches!(error, ReplayError::Missing { topic: "robot/command", .. }), "{error}");
    let planner = Inputs::of(&lost, Process::Planner).expect("the planner listens to nobody");
    let Err(error) = planner.pattern_for(Process::Planner) else { panic!("there is no pattern") };
    assert!(error.to_string().contains("no `walk/pattern` in the recording"), "{error}");
}

#[test]
fn restarted_processes_and_other_paces_are_refused() {
    let folder = folder();
    let again = recording(&folder, "lock-step", &[-1, 0, 1, 0, 1], &[]);
    let Err(error) = Inputs::of(&again, Process::Estimator) else { panic!("ticks go back") };
    assert!(matches!(error, ReplayError::Restart { tick: 0, .. }), "{error}");
    // It may also go on where it was, counting anew.
    let anew = counted_recording(&folder, "lock-step", &[(-1, 0), (0, 1), (1, 0), (2, 1)], &[]);
    let Err(error) = Inputs::of(&anew, Process::Estimator) else { panic!("counted anew") };
    assert!(matches!(error, ReplayError::Restart { tick: 1, before: 0, .. }), "{error}");
    let Err(error) = Inputs::of(&recording(&folder, "at leisure", &[-1, 0], &[]), Process::Estimator) else {
        panic!("at no pace that is known")
    };
    assert!(error.to_string().contains("`at leisure`"), "{error}");
}

#[test]
fn configuration_robot_and_sole_are_those_of_the_recording() {
    let folder = folder();
    let outside = format!("out-{}", std::process::id());
    let above = format!("../{outside}");
    let elsewhere = "robot = \"/no/such/robot\"\nsole_file = \"/no/such/folder/thick.toml\"\nlambda = 0.5\n";
    let files = [
        ("config/planner.toml", elsewhere),
        ("robot/robot.toml", "x = 1"),
        ("sole/thick.toml", "y = 2"),
        (above.as_str(), ""),
    ];
    let recording = recording(&folder, "lock-step", &[], &files);
    let unpacked = Unpacked::new(&recording).expect("room for small files");
    let config = unpacked.config(Process::Planner).expect("attached");
    let path = |key: &str| std::path::PathBuf::from(config.table()[key].as_str().expect("a path"));
    assert_eq!(std::fs::read_to_string(path("robot").join("robot.toml")).expect("there"), "x = 1");
    assert_eq!(std::fs::read_to_string(path("sole_file")).expect("there"), "y = 2");
    assert_eq!(config.table()["lambda"].as_float(), Some(0.5), "everything else as it was");
    let Err(error) = unpacked.config(Process::Estimator) else { panic!("not attached") };
    assert!(error.to_string().contains("`config/estimator.toml` is not attached"), "{error}");
    // A name that leads out of the folder is not written.
    let above = path("robot").parent().and_then(|root| root.parent()).expect("absolute").join(&outside);
    assert!(!above.exists(), "{}", above.display());
    drop(unpacked);
    assert!(!path("robot").exists(), "the folder goes with the value");
}

#[test]
fn messages_in_another_order_are_the_same_inputs() {
    let folder = folder();
    let sorted = [(2, 3), (-1, 0), (1, 2), (0, 1)];
    let inputs = Inputs::of(&counted_recording(&folder, "lock-step", &sorted, &[]), Process::Estimator);
    let inputs = inputs.expect("complete, in an order of its own");
    let ticks: Vec<i64> = inputs.states.iter().map(|state| state.header.tick).collect();
    assert_eq!(ticks, [-1, 0, 1, 2]);
}

#[test]
fn a_recording_reads_nothing_but_what_it_brings() {
    let shipped = |name: &str| {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4").join(name);
        std::fs::read_to_string(path).expect("it ships")
    };
    // As recorded: with what the planner is told of others in place of the names of their files.
    let planner = include_str!("../../../config/planner.toml")
        .replace("config = \"estimator.toml\"", "robot = \"robot\"")
        .replace("config = \"controller.toml\"", "robot = \"robot\"");
    assert!(!planner.contains("\nconfig = "));
    let (robot, sole, urdf) = (shipped("robot.toml"), shipped("sole.toml"), shipped("hrp4.urdf"));
    let hostile_robot = robot.replace("urdf = \"hrp4.urdf\"", "urdf = \"../../../../../../etc/passwd\"");
    let zero_robot = robot.replace("urdf = \"hrp4.urdf\"", "urdf = \"/dev/zero\"");
    assert!(hostile_robot != robot && zero_robot != robot);
    let block = "box_m = [0.23, 0.13, 0.021]\ncells = [12, 7, 3]";
    let hostile_sole = sole.replace(block, "file = \"../../../../../../etc/passwd\"");
    assert_ne!(hostile_sole, sole);
    for (robot, sole, named) in
        [(&hostile_robot, &sole, "urdf"), (&zero_robot, &sole, "urdf"), (&robot, &hostile_sole, "mesh.file")]
    {
        let folder = folder();
        let files = [
            ("config/planner.toml", planner.as_str()),
            ("robot/robot.toml", robot),
            ("robot/sole.toml", sole),
            ("robot/hrp4.urdf", &urdf),
        ];
        let recording = recording(&folder, "lock-step", &[], &files);
        let unpacked = Unpacked::new(&recording).expect("room");
        let config = unpacked.config(Process::Planner).expect("attached");
        let inputs = Inputs::of(&recording, Process::Planner).expect("lock-step");
        let process = replayer::Replayable::Planner;
        let error = replayer::replay(process, &inputs, &config, &mut soles::Store::none(), &mut |_| Ok(()));
        let message = node::error_chain(&error.expect_err("hostile"));
        assert!(message.contains(named) && message.contains("leads out of the folder"), "{message}");
    }
}

#[test]
fn files_in_folders_are_unpacked_and_none_twice() {
    let folder = folder();
    let files = [("robot/meshes/foot.stl", "x"), ("robot/../../x", ""), ("config/planner.toml", "robot = \"r\"")];
    let unpacked = Unpacked::new(&recording(&folder, "lock-step", &[], &files)).expect("room");
    let config = unpacked.config(Process::Planner).expect("attached");
    let robot = std::path::PathBuf::from(config.table()["robot"].as_str().expect("a path"));
    assert_eq!(std::fs::read_to_string(robot.join("meshes/foot.stl")).expect("there"), "x");
    let twice = [("robot/robot.toml", "x"), ("robot/robot.toml", "y")];
    let error = Unpacked::new(&recording(&folder, "lock-step", &[], &twice)).expect_err("which one?").to_string();
    assert_eq!(error, "`robot/robot.toml` is attached to the recording twice");
}

#[test]
fn folders_of_killed_replays_are_removed_and_no_others() {
    let folder = folder();
    let place = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| place.path().join(name);
    for name in ["soleus-replay-killed", "soleus-replay-works", "soleus-replay-begins", "kept"] {
        std::fs::create_dir(at(name)).expect("writable");
    }
    std::fs::write(at("kept/file"), "mine").expect("writable");
    std::fs::write(at("soleus-replay-killed/in-use"), "").expect("writable");
    let works = std::fs::File::create(at("soleus-replay-works/in-use")).expect("writable");
    works.lock().expect("nobody else has it");
    std::os::unix::fs::symlink(at("kept"), at("soleus-replay-link")).expect("a link");
    let recording = recording(&folder, "lock-step", &[-1, 0], &[("config/estimator.toml", "")]);
    let replayer = std::process::Command::new(env!("CARGO_BIN_EXE_soleus-replayer"))
        .arg(recording.path())
        .args(["--process", "estimator"])
        .env("TMPDIR", place.path())
        .output()
        .expect("it is built");
    assert_eq!(replayer.status.code(), Some(2), "the configuration is empty");
    let mut left: Vec<_> = std::fs::read_dir(place.path()).expect("there").flatten().map(|e| e.file_name()).collect();
    left.sort();
    assert_eq!(left, ["kept", "soleus-replay-begins", "soleus-replay-link", "soleus-replay-works"]);
    assert_eq!(std::fs::read_to_string(at("kept/file")).expect("there"), "mine");
}

#[test]
fn what_is_missed_first_is_something_the_process_listens_to() {
    let folder = folder();
    let empty = recording(&folder, "lock-step", &[], &[]);
    for process in [Process::Estimator, Process::Controller, Process::Simulator] {
        let Err(error) = Inputs::of(&empty, process) else { panic!("nothing there") };
        let ReplayError::Missing { topic: name, .. } = error else { panic!("{error}") };
        let is_input = |row: &messages::topic::Row| row.name == name && row.to.contains(&process);
        assert!(topic::ROWS.iter().any(is_input), "{process} listens to {name}");
    }
}

/// The first quarter of a second of `flat`, recorded in November 2026 by the first version of the messages.
fn first_version() -> Recording {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/walk-v1.mcap");
    Recording::open(&path).expect("it is kept")
}

#[test]
fn recordings_of_the_first_version_are_read() {
    let recording = first_version();
    assert_eq!(recording.facts().expect("ours")["pace"], "lock-step");
    for process in [Process::Planner, Process::Estimator, Process::Controller, Process::Simulator] {
        let inputs = Inputs::of(&recording, process).expect("complete");
        assert!(inputs.pattern_for(process).is_ok());
    }
    let inputs = Inputs::of(&recording, Process::Controller).expect("complete");
    assert_eq!((inputs.states.iter().count(), inputs.commands.iter().count()), (51, 51));
    // As the Python reader of the MCAP project says.
    let state = inputs.states.at(10).expect("of every tick");
    assert_eq!((state.joint_count, state.joint_position_rad[3]), (34, 0.718_446_280_665_328_2));
    let truths = recording.messages(topic::TRUTH_ROBOT).expect("whole");
    assert_eq!((truths.len(), truths[20].header.tick), (50, 20));
    assert_eq!(truths[20].com_position_m[2], 0.789_992_274_799_773_7);
    let healths = recording.messages(topic::health(Process::Simulator)).expect("whole");
    assert!(!healths.is_empty());
}

#[test]
fn recordings_of_the_first_version_are_replayed() {
    let recording = first_version();
    // Keys of configurations come and go: the one that ships today takes the place of that of the run, and the robot
    // is the run's.
    let unpacked = Unpacked::new(&recording).expect("room");
    let of_run = unpacked.config(Process::Estimator).expect("attached");
    let robot = of_run.table()["robot"].as_str().expect("a path").to_string();
    let shipped = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/estimator.toml");
    let setting = format!("robot={robot}").parse().expect("a setting");
    let config = scenario::Config::read(&shipped).expect("it ships").with_settings(&[setting]);
    let inputs = Inputs::of(&recording, Process::Estimator).expect("complete");
    let mut heard = 0;
    let process = replayer::Replayable::Estimator;
    let comparison = replayer::replay(process, &inputs, &config, &mut soles::Store::none(), &mut |_| {
        heard += 1;
        Ok(())
    });
    let comparison = comparison.expect("replayed");
    let compared = &comparison.topics["sole/deformation"];
    assert_eq!((compared.compared, compared.missing, compared.new), (51, 0, 0));
    assert_eq!(heard, 102, "a deformation and a contact for each state");
}
