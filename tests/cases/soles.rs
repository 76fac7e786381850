//! Another sole, and soles that are kept between runs.

use crate::alone;
use crate::same_numbers::assert_same;
use harness::{Finished, Launch, binaries, root};
use messages::{Message, Topic, topic};
use recording::Recording;
use std::path::Path;
use std::process::Command;

fn on_the_rounded_sole() -> Launch {
    Launch::of(root().join("config/scenarios/rounded-sole.toml")).set("planner.gait.walk.swings=2")
}

/// Asserts that two runs said the same on a topic, to the bit.
fn assert_same_on<T: Message>(one: &Recording, other: &Recording, topic: Topic<T>) {
    let [one, other] = [one, other].map(|recording| recording.messages(topic).expect("whole"));
    assert!(one.len() > 500, "a walk, not an empty comparison");
    assert_same(topic.name(), &one, &other);
}

fn assert_same_walk(one: &Finished, other: &Finished) {
    let [one, other] = [one, other].map(|run| {
        assert_eq!(run.code(), 0, "{}", run.stderr);
        Recording::open(&run.recording()).expect("finished")
    });
    assert_same_on(&one, &other, topic::SOLE_DEFORMATION);
    assert_same_on(&one, &other, topic::ROBOT_COMMAND);
    assert_same_on(&one, &other, topic::TRUTH_ROBOT);
}

/// Asserts that estimator and simulator say in their logs how they came by their soles.
fn assert_both_said(run: &Finished, expected: &str) {
    for process in ["estimator", "simulator"] {
        let log = std::fs::read_to_string(run.folder().join(format!("logs/{process}.log"))).expect("a log");
        assert!(log.contains(expected), "no `{expected}` in the {process}'s log:\n{log}");
    }
}

fn entries(folder: &Path) -> usize {
    std::fs::read_dir(folder).map_or(0, Iterator::count)
}

#[test]
fn a_walk_on_a_gmsh_sole_is_the_same_with_condensed_and_with_kept_soles() {
    let _alone = alone();
    let cache = tempfile::tempdir().expect("a temporary folder");
    let folder = cache.path().join("soles");
    let without = on_the_rounded_sole().finish();
    assert_both_said(&without, "sole condensed in ");
    let first = on_the_rounded_sole().cache(&folder).finish();
    assert_both_said(&first, "sole condensed in ");
    assert_eq!(entries(&folder), 2, "one of the estimator, one of the simulator");
    let second = on_the_rounded_sole().cache(&folder).finish();
    assert_both_said(&second, "sole read from cache in ");
    assert_eq!(entries(&folder), 2);
    assert_same_walk(&without, &first);
    assert_same_walk(&without, &second);
    // The recording can be understood without this machine.
    let text = std::fs::read(second.recording()).expect("finished");
    let attached = |name: &[u8]| text.windows(name.len()).any(|window| window == name);
    assert!(attached(b"robot/sole-rounded.toml") && attached(b"robot/sole-rounded.msh"));
}

#[test]
fn checking_a_configuration_keeps_nothing() {
    let cache = tempfile::tempdir().expect("a temporary folder");
    for process in ["estimator", "simulator"] {
        let checked = Command::new(binaries().join(format!("soleus-{process}")))
            .arg("--config")
            .arg(root().join(format!("config/{process}.toml")))
            .arg("--check")
            .env("SOLEUS_CACHE", cache.path())
            .env_remove("RUST_LOG")
            .output()
            .expect("it can be started");
        let said = String::from_utf8_lossy(&checked.stderr);
        assert!(checked.status.success() && said.contains("sole condensed in "), "{said}");
    }
    assert_eq!(entries(cache.path()), 0);
}
