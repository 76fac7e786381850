//! The controller's feedback, as processes.

use crate::alone;
use crate::same_numbers::assert_same;
use closed_loop::ClosedLoop;
use harness::{Launch, root};
use messages::code::Process;
use messages::topic;
use recording::Recording;
use scenario::Scenario;
use std::collections::BTreeMap;

#[test]
fn feedback_across_processes_is_that_of_one_thread_to_the_bit_and_health_and_summary_say_what_it_saw() {
    let _alone = alone();
    let path = root().join("config/scenarios/feedback.toml");
    let settings = ["planner.gait.walk.swings=1"];
    let run = settings.iter().fold(Launch::of(&path), |launch, setting| launch.set(setting)).finish();
    assert_eq!(run.code(), 0, "{}\n{}", run.stdout, run.stderr);

    let settings = settings.map(|setting| setting.parse().expect("a setting"));
    let scenario = Scenario::load(&path, &settings).expect("correct");
    let mut closed_loop = ClosedLoop::new(&scenario).expect("everything can be built");
    let (mut expected, mut seen) = (Vec::new(), BTreeMap::new());
    while let Some(tick) = closed_loop.step().expect("it goes on") {
        let summary = closed_loop.controller().summary();
        let values = [
            summary.base_distance_m,
            summary.base_distance_rad,
            summary.feet_disagreement_m,
            summary.measurements_refused as f64,
        ];
        seen.insert(tick.state.header.tick, values);
        expected.push(tick.command);
    }
    let recording = Recording::open(&run.recording()).expect("finished");
    let commands = recording.messages(topic::ROBOT_COMMAND).expect("whole");
    // The processes also say what they think at tick -1, and at the last state.
    let first = commands.iter().position(|command| command.header.tick == 0).expect("tick 0");
    assert_same("command", &expected, &commands[first..first + expected.len()]);
    let health = recording.messages(topic::health(Process::Controller)).expect("whole");
    let (mut compared, mut told) = (0, [0.0_f64; 4]);
    for message in &health {
        if let Some(values) = seen.get(&message.header.tick).filter(|_| message.cycles > 0) {
            let said = &message.controller;
            let said = [
                said.base_distance_m,
                said.base_distance_rad,
                said.feet_disagreement_m,
                said.measurements_refused as f64,
            ];
            assert_eq!(&said, values, "tick {}", message.header.tick);
            compared += 1;
            told = std::array::from_fn(|i| told[i].max(values[i]));
        }
    }
    assert!(compared > 100 && told[..3].iter().all(|value| *value > 0.0), "{compared} compared: {told:?}");
    assert!(run.stdout.contains("feedback") && run.stdout.contains("measurements not used"), "{}", run.stdout);
}
