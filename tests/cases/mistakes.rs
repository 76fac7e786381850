//! Every kind of mistake a person can make ends with a clear message, an exit code, and nothing left.

use crate::alone;
use harness::{Finished, Launch, root};
use std::path::Path;

fn assert_refused(run: &Finished, code: i32, expected: &[&str]) {
    assert_eq!(run.code(), code, "{}", run.stderr);
    for expected in expected {
        assert!(run.stderr.contains(expected), "no `{expected}` in\n{}", run.stderr);
    }
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    run.assert_nothing_left();
}

#[test]
fn a_missing_scenario_is_named() {
    let _alone = alone();
    assert_refused(&Launch::of("/nowhere/walk.toml").finish(), 2, &["cannot read /nowhere/walk.toml"]);
}

#[test]
fn unknown_keys_and_wrong_types_name_key_and_remedy() {
    let _alone = alone();
    let refused = Launch::short_walk().set("planner.gait.cost.lamda=0.5").finish();
    assert_refused(&refused, 2, &["`gait.cost.lamda`", "did you mean `lambda`?"]);
    let refused = Launch::short_walk().set("planner.gait.cost.lambda=much").finish();
    assert_refused(&refused, 2, &["`gait.cost.lambda`", "expected f64"]);
    let refused = Launch::short_walk().set("plnner.x=1").finish();
    assert_refused(&refused, 2, &["`plnner.x`: unknown; did you mean `planner`?"]);
}

/// The robot's folder with one file changed.
fn robot_with(file: &str, change: impl Fn(String) -> String) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    copy(&root().join("robots/hrp4"), folder.path());
    let path = folder.path().join(file);
    let text = std::fs::read_to_string(&path).expect("the robot has it");
    std::fs::write(&path, change(text)).expect("writable");
    folder
}

fn copy(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).expect("readable") {
        let entry = entry.expect("readable");
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            std::fs::create_dir(&target).expect("writable");
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).expect("writable");
        }
    }
}

#[test]
fn a_broken_robot_is_named_with_file_and_place() {
    let _alone = alone();
    let refused = Launch::short_walk().set("robot=/nowhere/hrp5").finish();
    assert_refused(&refused, 2, &["/nowhere/hrp5"]);
    let robot = robot_with("hrp4.urdf", |urdf| urdf.replacen("<link", "<lnk", 1));
    let refused = Launch::short_walk().set(&format!("robot={}", robot.path().display())).finish();
    assert_refused(&refused, 2, &["the configuration ", ".toml cannot be used", "hrp4.urdf"]);
    let robot = robot_with("sole.toml", |sole| sole.replace("young_modulus_pa", "young_modulus"));
    let refused = Launch::short_walk().set(&format!("robot={}", robot.path().display())).finish();
    assert_refused(&refused, 2, &["sole.toml", "young_modulus"]);
}

#[test]
fn processes_on_different_soles_do_not_walk() {
    let _alone = alone();
    let thick = robot_with("sole.toml", |sole| sole.replace("0.103]", "0.112]"));
    let file = thick.path().join("sole.toml");
    for process in ["estimator", "controller"] {
        let refused = Launch::short_walk().set(&format!("{process}.sole_file={}", file.display())).finish();
        // The planner, which is told what these are told, says so first.
        let file = file.display().to_string();
        let key = format!("{process}.sole_file");
        assert_refused(&refused, 2, &["planner", &key, &file, "give all processes the same"]);
    }
}

#[test]
fn processes_of_different_robots_do_not_walk() {
    let _alone = alone();
    let other = robot_with("hrp4.urdf", |urdf| format!("{urdf}<!-- another -->\n"));
    for process in ["estimator", "controller", "simulator"] {
        let refused = Launch::short_walk().set(&format!("{process}.robot={}", other.path().display())).finish();
        // The planner is told what estimator and controller are told; the simulator is met on a topic.
        let (who, what) = match process {
            "simulator" => ("another robot", "give all processes the same robot folder"),
            _ => ("planner", "give all processes the same"),
        };
        assert_refused(&refused, 2, &[who, what]);
    }
}

#[test]
fn an_infeasible_gait_is_refused_before_anything_moves() {
    let _alone = alone();
    let refused = Launch::short_walk().set("planner.gait.walk.step_length_m=2.0").finish();
    assert_refused(&refused, 2, &["the planner", "planner.toml cannot be used", "gait: step ", "at most 0.3"]);
}

#[test]
fn a_number_that_cannot_be_is_named_with_its_file_and_full_key() {
    let _alone = alone();
    for (setting, said) in [
        ("planner.gait.body.mass_kg=-39.0", ["planner.toml cannot be used", "`gait.body.mass_kg` is -39"]),
        ("planner.gait.body.mass_kg=nan", ["planner.toml cannot be used", "`gait.body.mass_kg` is NaN"]),
        ("controller.tasks.com.weight=nan", ["cannot be used: controller", "`tasks.com.weight` is NaN"]),
        ("simulator.plant.step.step_s=-0.001", ["simulator.toml cannot be used", "plant.step.step_s"]),
    ] {
        assert_refused(&Launch::short_walk().set(setting).finish(), 2, &said);
    }
}

#[test]
fn a_mesh_that_is_none_is_named() {
    let _alone = alone();
    let block = "box_m = [0.23, 0.13, 0.021]\ncells = [12, 7, 3]";
    let robot = robot_with("sole.toml", |sole| sole.replace(block, "file = \"foot.msh\""));
    let setting = format!("robot={}", robot.path().display());
    assert_refused(&Launch::short_walk().set(&setting).finish(), 2, &["cannot be used", "foot.msh"]);
    std::fs::write(robot.path().join("foot.msh"), "$MeshFormat\nof another kind\n").expect("writable");
    assert_refused(&Launch::short_walk().set(&setting).finish(), 2, &["cannot be used", "foot.msh"]);
}
