//! `soleus-inspect robot`.

use crate::inspect;

#[test]
fn the_draft_of_hrp4_is_a_robot_and_is_not_written_twice() {
    let urdf = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/hrp4/hrp4.urdf");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("robots/again");
    let out = out.to_str().expect("UTF-8");
    let answer = inspect(&["robot", urdf, "--out", out], "");
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    assert!(answer.stdout.contains("14 of 34 joints walk"), "{}", answer.stdout);
    let robot = robot::Robot::load(std::path::Path::new(out)).expect("the draft is a robot");
    assert_eq!(robot.description.groups["left_leg"].len(), 6);
    let read = |name: &str| std::fs::read_to_string(format!("{out}/{name}")).expect("it was written");
    let origin = read("ORIGIN.md");
    for note in answer.stdout.lines().filter(|line| line.starts_with("- ")) {
        assert!(origin.contains(note), "{note}");
    }
    assert!(read("walk.toml").contains("gait.body.com_height_m"));
    inspect(&["robot", urdf, "--out", out], "").assert_refused(&["it exists"]);
    inspect(&["robot", "/nowhere.urdf", "--out", "/nowhere"], "").assert_refused(&["/nowhere.urdf"]);
}
