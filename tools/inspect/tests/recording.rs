//! `soleus-inspect recording`.

use messages::{Header, RobotState, topic};
use recording::{RunInfo, ViewerSettings, Writer};
use std::path::Path;
use std::process::{Command, Output};

fn inspect(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_soleus-inspect")).arg("recording").args(arguments).output().expect("it is built")
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("text")
}

/// A recording of two joints in which the state of tick 3 is missing.
fn writer(path: &Path) -> Writer {
    let facts = [("pace", "lock-step"), ("started_utc", "2026-11-21T21:45:12Z")];
    let facts = facts.map(|(key, value)| (key.to_string(), value.to_string())).into();
    let files = vec![("robot/robot.toml".to_string(), b"joints = [\"HIP\", \"KNEE\"]".to_vec())];
    let mut writer = Writer::create(path, &RunInfo { facts, files, ..RunInfo::default() }, ViewerSettings::default())
        .expect("writable");
    for tick in [0, 1, 2, 4] {
        let mut state = RobotState { header: Header::new(tick, 7), joint_count: 2, ..RobotState::default() };
        state.header.sequence = tick as u64;
        state.joint_position_rad[1] = 0.25;
        state.accelerometer_m_per_s2 = [0.0, -0.5, 9.81];
        writer.record(topic::ROBOT_STATE, &state).expect("room");
    }
    writer
}

#[test]
fn a_recording_says_what_is_in_it_and_what_is_missing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    writer(&path).finish().expect("room");
    let output = inspect(&[path.to_str().expect("plain")]);
    let said = text(&output.stdout);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let state = said.lines().find(|line| line.starts_with("/robot/state ")).expect("its line");
    for word in ["4", "150.0", "0.020", "0.010 s at 0.010", "soleus.RobotStateV"] {
        assert!(state.contains(word), "{word}: {state}");
    }
    assert!(said.contains("/robot/state: 1 messages are not in it"), "{said}");
    assert!(said.contains("pace                   lock-step"), "{said}");
}

#[test]
fn a_topic_is_a_table_with_named_columns() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    writer(&path).finish().expect("room");
    let path = path.to_str().expect("plain");
    let output = inspect(&[path, "--csv", "/robot/state"]);
    let mut lines = text(&output.stdout).lines();
    let names: Vec<&str> = lines.next().expect("a head").split(',').collect();
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|number| number.parse().expect("a number")).collect()).collect();
    assert_eq!(rows.len(), 4);
    let at = |row: usize, name: &str| rows[row][names.iter().position(|n| *n == name).expect(name)];
    assert_eq!((at(3, "header.tick"), at(0, "joint_position_rad.KNEE")), (4.0, 0.25));
    assert_eq!(at(1, "accelerometer_m_per_s2.z"), 9.81);
    assert!(rows.iter().all(|row| row.len() == names.len()));
    let output = inspect(&[path, "--csv", "robot/states"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("there are walk/start, walk/order, robot/state"), "{}", text(&output.stderr));
}

#[test]
fn unfinished_recordings_are_finished_on_demand() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let elsewhere = tempfile::tempdir().expect("a temporary folder");
    let mut written = writer(&elsewhere.path().join("walk.mcap"));
    written.flush().expect("room");
    let partial = folder.path().join("walk.mcap.partial");
    std::fs::copy(elsewhere.path().join("walk.mcap.partial"), &partial).expect("there");
    let partial = partial.to_str().expect("plain");
    let output = inspect(&[partial]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains(&format!("--recover {partial}")), "{}", text(&output.stderr));
    let output = inspect(&["--recover", partial]);
    let said = text(&output.stdout);
    assert!(said.starts_with("recovered 4 messages as ") && said.ends_with("walk-20261121T214512Z.mcap\n"), "{said}");
    let path = said.trim_end().rsplit(' ').next().expect("a path");
    assert!(inspect(&[path]).status.success());
}
