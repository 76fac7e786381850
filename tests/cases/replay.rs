//! Each process of a recorded walk, run again from the recording alone.

use crate::alone;
use harness::{Launch, replay};
use std::path::Path;

#[test]
fn every_process_of_a_walk_says_the_same_again_to_the_bit_and_with_other_settings_something_else() {
    let _alone = alone();
    let run = Launch::short_walk().finish();
    assert_eq!(run.code(), 0, "{}\n{}", run.stdout, run.stderr);
    let recording = run.recording();
    // Only the recording: nothing else of the run is there any more.
    std::fs::remove_dir_all(run.folder().join("config")).expect("it is ours");
    for (process, topics) in [
        ("planner", &["walk/pattern"][..]),
        ("estimator", &["sole/contact", "sole/deformation"]),
        ("controller", &["robot/command", "walk/start"]),
        ("simulator", &["robot/state", "truth/robot"]),
    ] {
        let (code, stdout, stderr) = replay(&recording, process, &[]);
        assert_eq!(code, Some(0), "{process}: {stdout}\n{stderr}");
        let said: Vec<&str> = stdout.lines().map(|line| line.split_whitespace().next().expect("a topic")).collect();
        assert_eq!(said, topics, "{process}: {stdout}");
        assert!(stdout.lines().all(|line| line.ends_with("the same to the bit")), "{process}: {stdout}");
    }

    let kept = run.folder().join("replay.mcap");
    let kept_text = kept.to_str().expect("a temporary folder has a plain name");
    let settings = ["--set", "tasks.com.weight=5e3", "--out", kept_text];
    let (code, stdout, stderr) = replay(&recording, "controller", &settings);
    assert_eq!(code, Some(1), "{stdout}\n{stderr}");
    assert!(stdout.contains("joint_position_reference_rad["), "the fields that differ: {stdout}");
    let said = |path: &Path| {
        let recording = recording::Recording::open(path).expect("finished");
        (recording.messages(messages::topic::ROBOT_COMMAND).expect("whole"), recording.facts().expect("whole"))
    };
    let ((then, _), (now, facts)) = (said(&recording), said(&kept));
    assert_eq!(then.len(), now.len());
    assert!(then != now, "what was said anew was kept, not what was said then");
    assert_eq!(facts["replay settings"], "tasks.com.weight=5000.0");
    assert_eq!(facts["vector_instructions"], node::vector_instructions(), "what bits depend on is in every recording");

    let unborn = run.folder().join("unborn.mcap");
    let misspelt = ["--set", "tasks.com.weigth=5e3", "--out", unborn.to_str().expect("a plain name")];
    let (code, _, stderr) = replay(&recording, "controller", &misspelt);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("did you mean `weight`"), "{stderr}");
    let files = std::fs::read_dir(run.folder()).expect("it is there").flatten().map(|file| file.file_name());
    assert!(!files.into_iter().any(|file| file.to_string_lossy().contains("unborn")), "nothing half-written stays");
    let (code, _, stderr) = replay(&recording, "controller", &["--out", recording.to_str().expect("a plain name")]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("that is the recording itself"), "{stderr}");
    let (code, _, stderr) = replay(&run.folder().join("no.mcap"), "controller", &[]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("no.mcap"), "{stderr}");
}
