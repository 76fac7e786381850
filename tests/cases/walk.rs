//! A short walk from beginning to end.

use crate::alone;
use harness::Launch;
use messages::topic;
use recording::Recording;

#[test]
fn a_short_walk_is_walked_and_recorded_without_gaps_and_leaves_nothing() {
    let _alone = alone();
    let run = Launch::short_walk().finish();
    assert_eq!(run.code(), 0, "{}\n{}", run.stdout, run.stderr);
    for expected in [
        "distance",
        "fallen                 no",
        "COM, real to planned",
        "ZMP, real to planned",
        "solved, 0 relaxed, 0 held",
        "tick, controller",
        "speed",
    ] {
        assert!(run.stdout.contains(expected), "no `{expected}` in\n{}", run.stdout);
    }
    run.assert_nothing_left();
    let folder = run.folder();
    let figures = std::fs::read_to_string(folder.join("figures.json")).expect("every launch writes it");
    let figures: report::WalkFigures = serde_json::from_str(&figures).expect("figures");
    assert_eq!((figures.verdict, figures.fallen), (report::Verdict::Walked, Some(false)), "{}", figures.verdict_reason);
    assert!(figures.distance_m.expect("truth") > 0.9 * figures.planned_distance_m.expect("a pattern"), "{figures:?}");
    assert!(run.stdout.starts_with(&report::table(&figures)), "{}\n{}", report::table(&figures), run.stdout);
    let page = std::fs::metadata(folder.join("report.html")).expect("every launch makes a page").len();
    assert!((500_000..1_000_000).contains(&page), "{page} bytes");

    let recording = Recording::open(&run.recording()).expect("finished");
    assert_eq!(report::figures(&recording).expect("readable"), figures, "whoever computes them");
    let states = recording.messages(topic::ROBOT_STATE).expect("whole");
    let commands = recording.messages(topic::ROBOT_COMMAND).expect("whole");
    let deformations = recording.messages(topic::SOLE_DEFORMATION).expect("whole");
    let truths = recording.messages(topic::TRUTH_ROBOT).expect("whole");
    let ticks: Vec<i64> = truths.iter().map(|truth| truth.header.tick).collect();
    assert_eq!(ticks, (0..ticks.len() as i64).collect::<Vec<_>>(), "every tick from the first on");
    // Each state, also the last, at which the walk is over, is answered by one deformation and one command of its tick.
    for (state, (deformation, command)) in states.iter().zip(deformations.iter().zip(&commands)) {
        assert_eq!(state.header.tick, deformation.header.tick);
        assert_eq!(state.header.tick, command.header.tick);
    }
    assert_eq!((states.len(), deformations.len()), (commands.len(), commands.len()));
    let starts = recording.messages(topic::WALK_START).expect("whole");
    let patterns = recording.patterns().expect("whole");
    assert_eq!((starts.len(), patterns.len()), (1, 1));
    assert_eq!(starts[0].pattern_hash, patterns[0].0.pattern_hash);
    assert!(
        truths.last().expect("there are some").walk_time_s >= patterns[0].0.duration_s,
        "to the end of the pattern"
    );

    let files: Vec<String> = recording.files().expect("whole").into_iter().map(|(name, _)| name).collect();
    for expected in ["config/planner.toml", "config/scenario.toml", "robot/robot.toml", "robot/sole.toml"] {
        assert!(files.contains(&expected.to_string()), "{files:?}");
    }
    assert_eq!(recording.facts().expect("whole")["pace"], "lock-step");
    let survey = recording.survey().expect("whole");
    for viewers in ["/tf", "/joint_states", "/scene"] {
        assert!(survey.topics[viewers].messages > 100, "{viewers}");
    }
}
