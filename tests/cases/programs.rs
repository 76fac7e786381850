//! Quadratic programs of a run, solved again.

use crate::alone;
use harness::{Launch, binaries};
use std::fs::File;
use std::process::{Command, Stdio};

#[test]
fn programs_of_chosen_ticks_are_written_and_solved_again_elsewhere() {
    let _alone = alone();
    let run = Launch::short_walk().set("controller.programs.ticks=[50, 300]").finish();
    assert_eq!(run.code(), 0, "{}", run.stderr);
    let folder = run.folder().join("programs");
    let mut written: Vec<_> =
        folder.read_dir().expect("written").map(|entry| entry.expect("readable").path()).collect();
    written.sort();
    assert_eq!(written, [folder.join("tick-300.json"), folder.join("tick-50.json")]);
    for program in written {
        let input = File::open(&program).expect("just written");
        let output = Command::new(binaries().join("soleus-inspect")).arg("qp").stdin(Stdio::from(input)).output();
        let output = output.expect("it can be started");
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && said.contains("\"solved\""), "{said}");
    }
    // By default none is.
    let run = Launch::short_walk().set("planner.gait.walk.swings=1").finish();
    assert!(run.code() == 0 && !run.folder().join("programs").exists(), "{}", run.stderr);
}
