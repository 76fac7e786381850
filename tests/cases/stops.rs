//! Walks that do not come to their end.

use crate::alone;
use harness::{Launch, Running, assert_replays, eventually, is_alive};
use messages::topic;
use recording::{Recording, recover};

/// A walk after which the robot stands for longer than any test, recorded as it goes.
fn long_walk() -> Running {
    let mut running =
        Launch::short_walk().set("simulator.run.after_walk_s=1e5").set("recorder.flush_period_s=0.05").start();
    running.wait_until_walking();
    running
}

#[test]
fn ctrl_c_ends_everything_and_the_recording_is_whole() {
    let _alone = alone();
    let running = long_walk();
    let children = running.children();
    assert_eq!(children.len(), 5, "{children:?}");
    node::interrupt(running.id()).expect("it lives");
    let run = running.finish();
    assert_eq!(run.code(), 130, "{}", run.stderr);
    assert!(children.iter().all(|(_, id)| !is_alive(*id)), "{children:?}");
    run.assert_nothing_left();
    let recording = Recording::open(&run.recording()).expect("finished");
    assert!(recording.messages(topic::ROBOT_COMMAND).expect("whole").len() > 100);
    // Wherever it was broken off, what is there can be looked into.
    ["estimator", "controller", "simulator"].iter().for_each(|process| assert_replays(&run.recording(), process));
}

#[test]
fn a_killed_process_is_named_and_the_others_stop() {
    let _alone = alone();
    let running = long_walk();
    node::kill(running.wait_for_child("soleus-controller")).expect("it lives");
    let run = running.finish();
    assert_eq!(run.code(), 4, "{}", run.stderr);
    assert!(run.stderr.contains("the controller was killed by signal 9"), "{}", run.stderr);
    run.assert_nothing_left();
    Recording::open(&run.recording()).expect("finished");
}

#[test]
fn a_killed_recorder_leaves_a_recording_that_can_be_recovered() {
    let _alone = alone();
    let running = long_walk();
    node::kill(running.wait_for_child("soleus-recorder")).expect("it lives");
    let run = running.finish();
    assert_eq!(run.code(), 4, "{}", run.stderr);
    run.assert_nothing_left();
    let recovered = recover(&run.folder()).expect("writable");
    assert_eq!(recovered.len(), 1);
    assert!(recovered[0].messages > 0);
    assert_replays(&run.recording(), "controller");
}

#[test]
fn a_killed_launcher_takes_its_processes_along_and_nothing_is_left() {
    let _alone = alone();
    let running = long_walk();
    let children = running.children();
    node::kill(running.id()).expect("it lives");
    let run = running.finish();
    eventually("all processes end", || children.iter().all(|(_, id)| !is_alive(*id)));
    run.assert_nothing_left();
    Recording::open(&run.recording()).expect("the recorder was asked to stop and finished");
}

#[test]
fn a_robot_that_does_not_settle_ends_with_what_was_in_the_way() {
    let _alone = alone();
    let run = Launch::short_walk().set("simulator.plant.sensors.foot_force_bias_n=[[0, 0, 60], [0, 0, 0]]").finish();
    assert_eq!(run.code(), 6, "{}", run.stderr);
    for said in ["the controller ended with code 6", "did not settle", "settle.load_share_error_max allows 2.500e-2"] {
        assert!(run.stderr.contains(said), "no `{said}` in\n{}", run.stderr);
    }
    assert!(run.stdout.contains("walked                 0.00 of"), "{}", run.stdout);
    run.assert_nothing_left();
    Recording::open(&run.recording()).expect("finished");
}

#[test]
fn a_robot_that_falls_ends_with_code_1_and_when_and_why() {
    let _alone = alone();
    let push = r#"[{ link = "torso", point_in_link_m = [0.0, 0.0, 0.1], force_n = [0.0, 400.0, 0.0], start_s = 0.5, duration_s = 0.2 }]"#;
    let run = Launch::short_walk().set(&format!("simulator.plant.pushes={push}")).finish();
    assert_eq!(run.code(), 1, "{}\n{}", run.stdout, run.stderr);
    assert!(run.stderr.contains("the robot fell after "), "{}", run.stderr);
    assert!(run.stdout.contains("fallen                 yes, "), "{}", run.stdout);
    run.assert_nothing_left();
    let recording = Recording::open(&run.recording()).expect("finished");
    let truths = recording.messages(topic::TRUTH_ROBOT).expect("whole");
    assert_eq!(truths.last().map(|truth| truth.fallen), Some(1), "the fall is the last that is recorded");
    assert_replays(&run.recording(), "simulator");
}
