//! The loop across processes and in one thread, twice.

use crate::alone;
use closed_loop::ClosedLoop;
use harness::{Launch, root};
use messages::{Message, Topic, topic};
use recording::Recording;
use scenario::Scenario;

/// What must not depend on how often the bus counted: everything but the sequence number.
fn bits<T: Message>(message: &T) -> Vec<u8> {
    let mut message = *message;
    message.header_mut().sequence = 0;
    let mut bytes = Vec::new();
    message.write_bytes(&mut bytes);
    bytes
}

/// Asserts that two series of messages are the same but for their sequence numbers; names the first number that differs.
pub fn assert_same<T: Message>(what: &str, one: &[T], other: &[T]) {
    for (one, other) in one.iter().zip(other) {
        if bits(one) == bits(other) {
            continue;
        }
        let mut numbers = Vec::new();
        one.for_each_number("", &mut |name, value| numbers.push((name.to_string(), value)));
        let mut index = 0;
        other.for_each_number("", &mut |name, value| {
            let (_, expected) = &numbers[index];
            index += 1;
            assert!(
                name == "header.sequence" || value.to_bits() == expected.to_bits(),
                "{what}, tick {}: {name} = {expected:e} and {value:e}",
                one.header().tick
            );
        });
    }
    assert_eq!(one.len(), other.len(), "{what}: as many messages");
}

#[test]
fn processes_and_one_thread_say_the_same_to_the_bit_and_processes_do_so_twice() {
    let _alone = alone();
    let runs = [Launch::short_walk().finish(), Launch::short_walk().finish()];
    let recordings = runs.each_ref().map(|run| Recording::open(&run.recording()).expect("finished"));

    fn same<T: Message>(recordings: &[Recording; 2], topic: Topic<T>) -> Vec<T> {
        let [one, other] = recordings.each_ref().map(|recording| recording.messages(topic).expect("whole"));
        assert_same(&format!("twice, {}", topic.name()), &one, &other);
        one
    }
    let states = same(&recordings, topic::ROBOT_STATE);
    let deformations = same(&recordings, topic::SOLE_DEFORMATION);
    let commands = same(&recordings, topic::ROBOT_COMMAND);
    let truths = same(&recordings, topic::TRUTH_ROBOT);
    let starts = same(&recordings, topic::WALK_START);
    drop(recordings);

    let settings = ["planner.gait.walk.swings=2".parse().expect("a setting")];
    let scenario = Scenario::load(&root().join("config/scenarios/flat.toml"), &settings).expect("correct");
    let mut closed_loop = ClosedLoop::new(&scenario).expect("everything can be built");
    let mut ticks = Vec::new();
    while let Some(tick) = closed_loop.step().expect("it goes on") {
        ticks.push(tick);
    }
    // The processes also say what they think at tick -1, while the robot is being placed.
    let from = |tick: i64| usize::try_from(tick + 1).expect("not before -1");
    let first = from(ticks[0].state.header.tick);
    let answered = first..first + ticks.len();
    let column = |what: &str| format!("one thread, {what}");
    assert_same(&column("state"), &ticks.iter().map(|tick| tick.state).collect::<Vec<_>>(), &states[answered.clone()]);
    assert_same(&column("truth"), &ticks.iter().map(|tick| tick.truth).collect::<Vec<_>>(), &truths[..ticks.len()]);
    let there = ticks.iter().map(|tick| tick.deformation).collect::<Vec<_>>();
    assert_same(&column("deformation"), &there, &deformations[answered.clone()]);
    assert_same(&column("command"), &ticks.iter().map(|tick| tick.command).collect::<Vec<_>>(), &commands[answered]);
    let started: Vec<_> = ticks.iter().filter_map(|tick| tick.start).collect();
    assert_same(&column("start"), &started, &starts);
    assert!(ticks.len() > 500, "a walk, not an empty comparison: {} ticks", ticks.len());
}
