//! Walks that do not come to their end.

use crate::alone;
use harness::{Launch, Running, assert_replays, eventually, is_alive};
use messages::topic;
use recording::{Recording, recover_file};
use std::path::Path;
use std::process::Command;

/// A walk after which the robot stands for longer than any test, recorded as it goes.
fn long_walk() -> Running {
    let mut running =
        Launch::short_walk().set("simulator.run.after_walk_s=8e4").set("recorder.flush_period_s=0.05").start();
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
fn a_walk_that_is_published_goes_on_without_its_planner() {
    let _alone = alone();
    let mut running = Launch::short_walk().start();
    running.wait_until_walking();
    node::kill(running.wait_for_child("soleus-planner")).expect("it lives");
    let run = running.finish();
    // To the end, and the planner's end is told as it would be otherwise.
    assert_eq!(run.code(), 4, "{}", run.stderr);
    for said in ["the planner was killed by signal 9", "the walk that it has published goes on"] {
        assert!(run.stderr.contains(said), "no `{said}` in {}", run.stderr);
    }
    assert!(run.stdout.contains("verdict                walked"), "{}", run.stdout);
    run.assert_nothing_left();
    assert_replays(&run.recording(), "controller");
}

#[test]
fn a_killed_recorder_leaves_a_recording_that_can_be_recovered() {
    let _alone = alone();
    let running = long_walk();
    node::kill(running.wait_for_child("soleus-recorder")).expect("it lives");
    let run = running.finish();
    assert_eq!(run.code(), 9, "{}", run.stderr);
    assert!(run.stderr.contains("the recorder was killed by signal 9"), "{}", run.stderr);
    assert!(run.stdout.contains("recording              broken off\n"), "{}", run.stdout);
    run.assert_nothing_left();
    // The next run there is refused, unless it may replace what is there; what was killed is not lost even then.
    let run = Launch::short_walk().again(run, &[]).finish();
    assert_eq!(run.code(), 2, "{}", run.stderr);
    assert!(run.stderr.contains("there is something in it") && run.stderr.contains("--overwrite"), "{}", run.stderr);
    assert!(run.partial_recording().exists());
    let run = Launch::short_walk().set("planner.gait.walk.swings=1").again(run, &["--overwrite"]).finish();
    assert_eq!(run.code(), 0, "{}", run.stderr);
    let said = run.stderr.lines().find_map(|line| line.split_once("recovered ")).expect("on the terminal").1;
    let (count, path) = said.split_once(" messages of ").expect("how many");
    let path = Path::new(path.split_once(" as ").expect("as what").1);
    assert!(count.parse::<u64>().expect("a number") > 100);
    assert!(!run.partial_recording().exists() && path != run.recording());
    assert_replays(path, "controller");
    Recording::open(&run.recording()).expect("that of the second run");
}

#[test]
fn a_full_disk_breaks_a_recording_off_and_that_is_told() {
    let _alone = alone();
    let running = Launch::short_walk().set("recorder.flush_period_s=0.05").start();
    let recorder = running.wait_for_child("soleus-recorder");
    eventually("the recording is begun", || running.partial_recording().exists());
    // As if the disk were full: no file of this process may have more than a megabyte.
    let limited = Command::new("prlimit").args(["--pid", &recorder.to_string(), "--fsize=1000000"]).status();
    assert!(limited.expect("util-linux").success());
    let run = running.finish();
    assert_eq!(run.code(), 9, "{}\n{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("recording              broken off\n"), "{}", run.stdout);
    assert!(run.stderr.contains("the recording is not whole: broken off"), "{}", run.stderr);
    let log = std::fs::read_to_string(run.folder().join("logs/recorder.log")).expect("it has one");
    assert!(log.contains("the recording broke off") && log.contains("messages are safe"), "{log}");
    assert!(!run.recording().exists(), "it is not called finished");
    let recovered = recover_file(&run.partial_recording()).expect("readable");
    assert!(recovered.messages > 100, "{recovered:?}");
    assert_replays(&recovered.path, "estimator");
    run.assert_nothing_left();
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
fn a_walk_off_its_plan_ends_with_code_10_and_by_how_much() {
    let _alone = alone();
    // No ZMP follows its plan to a hundredth of a millimetre.
    let run = Launch::short_walk().set("report.zmp_error_max_m=1e-5").finish();
    assert_eq!(run.code(), 10, "{}\n{}", run.stdout, run.stderr);
    assert!(
        run.stdout.contains("verdict                walked, but off its plan: the ZMP was up to "),
        "{}",
        run.stdout
    );
    run.assert_nothing_left();
    // Judged by what is recorded with it, also later.
    let figures = report::figures(&Recording::open(&run.recording()).expect("finished")).expect("readable");
    assert_eq!((figures.verdict, figures.zmp_error_allowed_m), (report::Verdict::OffPlan, 1e-5));
    let refused = Launch::short_walk().set("report.zmp_error_max_m=1e9").finish();
    assert_eq!(refused.code(), 2, "{}", refused.stderr);
    assert!(
        refused.stderr.contains("`report.zmp_error_max_m` is 1e9, must be more than 0 and at most 1"),
        "{}",
        refused.stderr
    );
}

#[test]
fn a_robot_that_falls_ends_with_code_1_and_when_and_why() {
    let _alone = alone();
    let push = r#"[{ link = "torso", point_in_link_m = [0.0, 0.0, 0.1], force_n = [0.0, 400.0, 0.0], start_s = 0.5, duration_s = 0.2 }]"#;
    let run = Launch::short_walk().set(&format!("simulator.plant.pushes={push}")).finish();
    assert_eq!(run.code(), 1, "{}\n{}", run.stdout, run.stderr);
    assert!(run.stderr.contains("the robot fell: ") && run.stderr.contains(" s into the walk"), "{}", run.stderr);
    assert!(run.stdout.contains("fallen                 yes, "), "{}", run.stdout);
    run.assert_nothing_left();
    let recording = Recording::open(&run.recording()).expect("finished");
    let truths = recording.messages(topic::TRUTH_ROBOT).expect("whole");
    assert_eq!(truths.last().map(|truth| truth.fallen), Some(1), "the fall is the last that is recorded");
    assert_replays(&run.recording(), "simulator");
}
