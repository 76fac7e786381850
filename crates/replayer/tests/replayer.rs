//! What is refused, and how differences are told. Whole replays are in the system tests, where there are whole runs.

use messages::code::Process;
use messages::{Header, Message, RobotState, topic};
use recording::{Recording, RunInfo, ViewerSettings, Writer};
use replayer::{Inputs, ReplayError, Unpacked};
use tempfile::TempDir;

/// A recording of robot states at some ticks.
fn recording(folder: &TempDir, pace: &str, ticks: &[i64], files: &[(&str, &str)]) -> Recording {
    let facts = [("pace".to_string(), pace.to_string())].into();
    let files = files.iter().map(|(name, text)| ((*name).to_string(), text.as_bytes().to_vec())).collect();
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &RunInfo { facts, files }, ViewerSettings::default()).expect("writable");
    for (sequence, &tick) in ticks.iter().enumerate() {
        let mut state = RobotState { header: Header::new(tick, 7), ..RobotState::default() };
        state.header_mut().sequence = sequence as u64;
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
    assert!(matches!(error, ReplayError::Restart { tick: 0, before: 1, .. }), "{error}");
    let Err(error) = Inputs::of(&recording(&folder, "real time", &[-1, 0], &[]), Process::Estimator) else {
        panic!("not in lock-step")
    };
    assert!(error.to_string().contains("`real time`"), "{error}");
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
