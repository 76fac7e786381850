//! Recordings survive being killed, and are their owners' alone.

use crate::samples::{bytes, info, random, settings};
use messages::{Header, Plain, RobotState, topic};
use recording::{Recording, Recovered, Writer, recover, recover_file};
use std::path::Path;

#[test]
fn what_a_killed_recorder_left_is_recovered_up_to_the_last_flush() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
    let state = |tick| RobotState { header: Header::new(tick, 7), ..random(tick as u64) };
    for tick in 0..500 {
        writer.record(topic::ROBOT_STATE, &state(tick)).expect("room");
    }
    writer.flush().expect("room");
    for tick in 500..600 {
        writer.record(topic::ROBOT_STATE, &state(tick)).expect("room");
    }
    // What a kill would leave on the disk now.
    let killed = tempfile::tempdir().expect("a temporary folder");
    std::fs::copy(folder.path().join("walk.mcap.partial"), killed.path().join("walk.mcap.partial")).expect("there");
    assert!(Recording::open(&killed.path().join("walk.mcap.partial")).is_err(), "it is not finished");

    let [recovered] = &recover(killed.path()).expect("readable").recovered[..] else { panic!("one was left") };
    let Recovered { path, from, messages } = recovered;
    // The robot's description is one, too.
    assert_eq!((from, *messages), (&killed.path().join("walk.mcap.partial"), 501));
    let name = path.file_name().expect("it has one").to_string_lossy();
    assert_eq!(name, "walk-20261121T214512Z.mcap", "called after its begin");
    assert_eq!(std::fs::read_dir(killed.path()).expect("readable").count(), 1, "nothing else is left");
    assert_eq!(mode(path), 0o600);
    let recording = Recording::open(path).expect("finished now");
    let states = recording.messages(topic::ROBOT_STATE).expect("whole");
    assert_eq!(states.len(), 500);
    assert_eq!(bytes(&states[499]), bytes(&state(499)));
    assert_eq!(recording.files().expect("whole"), info().files);
    assert_eq!(recording.facts().expect("whole")["commit"], "abc");
    assert_eq!(recover(killed.path()).expect("nothing to do").recovered, []);
}

fn mode(path: &Path) -> u32 {
    std::os::unix::fs::PermissionsExt::mode(&path.metadata().expect("it is there").permissions()) & 0o777
}

#[test]
fn recordings_are_their_owners_and_replace_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("walk.mcap");
    let writer = Writer::create(&path, &info(), settings()).expect("nothing is there");
    assert_eq!(mode(&folder.path().join("walk.mcap.partial")), 0o600);
    let refused = || Writer::create_over(&path, &info(), settings()).err().expect("one is under way").to_string();
    assert!(refused().contains("walk.mcap.partial exists and is not replaced"), "{}", refused());
    writer.finish().expect("room");
    let refused = Writer::create(&path, &info(), settings()).err().expect("it is there").to_string();
    assert!(refused.contains("walk.mcap exists and is not replaced"), "{refused}");
    let before = std::fs::read(&path).expect("readable");
    // Something that comes while it is under way is not replaced, either.
    let other = folder.path().join("other.mcap");
    let writer = Writer::create(&other, &info(), settings()).expect("nothing is there");
    std::fs::write(&other, "mine").expect("writable");
    assert!(writer.finish().is_err());
    assert_eq!(std::fs::read(&other).expect("readable"), b"mine");
    let mut writer = Writer::create_over(&path, &info(), settings()).expect("asked for");
    writer.record(topic::ROBOT_STATE, &RobotState::ZERO).expect("room");
    assert_eq!(std::fs::read(&path).expect("readable"), before, "not before it is finished");
    writer.finish().expect("room");
    assert_ne!(std::fs::read(&path).expect("readable"), before);
}

#[test]
fn recovering_leaves_alone_what_is_none_of_its_business() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let partial = |name: &str| folder.path().join(format!("{name}.partial"));
    // A download of some browser, a recording of nothing, and one that is under way.
    for name in ["film.mp4", "film.mcap"] {
        std::fs::write(partial(name), "not ours").expect("writable");
    }
    std::fs::write(partial("nothing.mcap"), "").expect("writable");
    let mut writer = Writer::create(&folder.path().join("now.mcap"), &info(), settings()).expect("writable");
    writer.flush().expect("room");
    let recovery = recover(folder.path()).expect("readable");
    assert!(recovery.recovered.is_empty() && recovery.left.is_empty(), "{recovery:?}");
    for name in ["film.mp4", "film.mcap"] {
        assert_eq!(std::fs::read(partial(name)).expect("still there"), b"not ours");
    }
    assert!(!partial("nothing.mcap").exists());
    let message = recover_file(&partial("now.mcap")).expect_err("under way").to_string();
    assert!(message.ends_with("is still being written: stop its recorder first"), "{message}");
    writer.finish().expect("nobody took it away");
    assert_eq!(mode(&folder.path().join("now.mcap")), 0o600);
}

#[test]
fn recorders_that_are_killed_again_and_again_lose_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let killed = folder.path().join("walk.mcap.partial");
    for count in 1..=3 {
        let elsewhere = tempfile::tempdir().expect("a temporary folder");
        let path = elsewhere.path().join("walk.mcap");
        let mut writer = Writer::create(&path, &info(), settings()).expect("writable");
        (0..count).for_each(|_| writer.record(topic::ROBOT_STATE, &RobotState::ZERO).expect("room"));
        writer.flush().expect("room");
        std::fs::copy(elsewhere.path().join("walk.mcap.partial"), &killed).expect("there");
        recover(folder.path()).expect("readable");
    }
    let mut found: Vec<_> = std::fs::read_dir(folder.path()).expect("readable").flatten().map(|f| f.path()).collect();
    found.sort();
    let states = |path: &std::path::PathBuf| Recording::open(path).expect("finished").messages(topic::ROBOT_STATE);
    let mut counts: Vec<usize> = found.iter().map(|path| states(path).expect("whole").len()).collect();
    counts.sort_unstable();
    assert_eq!(counts, [1, 2, 3], "{found:?}");
}
