//! `soleus-inspect dynamics`.

use crate::{example, inspect, number, numbers, shipped};

fn hrp4() -> String {
    shipped("robots/hrp4/hrp4.urdf").display().to_string()
}

#[test]
fn every_term_of_the_shipped_robot_is_there_and_forces_and_accelerations_undo_each_other() {
    let robot = hrp4();
    let question = inspect(&["dynamics", "--robot", &robot, "--example"], "").stdout;
    let answer = inspect(&["dynamics", "--robot", &robot, "--frames", "l_ankle"], &question).json(0);
    let nv = usize::try_from(answer["nv"].as_u64().expect("a number")).expect("small");
    assert_eq!(nv, 6 + answer["joints"].as_array().expect("a list").len());
    let state = &answer["states"][0];
    for (field, rows, columns) in [("M", nv, nv), ("Jcom", 3, nv), ("Ag", 6, nv)] {
        let matrix = state[field].as_array().expect("rows");
        assert!(matrix.len() == rows && matrix.iter().all(|row| numbers(row).len() == columns), "{field}");
    }
    for (field, length) in
        [("nle", nv), ("gravity", nv), ("rnea", nv), ("com", 3), ("com_drift", 3), ("hg", 6), ("hg_drift", 6)]
    {
        assert_eq!(numbers(&state[field]).len(), length, "{field}");
    }
    assert_eq!(state["frames"]["l_ankle"]["J"].as_array().expect("rows").len(), 6);
    // What aba answers to the forces of rnea is the acceleration that went in.
    let mut again: serde_json::Value = serde_json::from_str(&question).expect("JSON");
    again["states"][0]["tau"] = state["rnea"].clone();
    let back = inspect(&["dynamics", "--robot", &robot], &again.to_string()).json(0);
    let (asked, found) = (numbers(&again["states"][0]["a"]), numbers(&back["states"][0]["aba"]));
    let largest = asked.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
    // The inverse is as good as the door itself says, and ten times that.
    let bound = 10.0 * number(&back["states"][0]["aba_error"]).max(f64::EPSILON) * largest;
    for (a, b) in asked.iter().zip(&found) {
        assert!((a - b).abs() <= bound, "{a} {b}, {bound:e}");
    }
}

#[test]
fn the_example_without_a_robot_shows_the_form() {
    assert!(example("dynamics").contains("base_quaternion_xyzw"));
}

#[test]
fn wrong_questions_are_refused() {
    let robot = hrp4();
    let ask = |input: &str| inspect(&["dynamics", "--robot", &robot], input);
    ask("{").assert_refused(&["what this subcommand expects"]);
    ask(r#"{"states": [{"v": [1, 2]}]}"#).assert_refused(&["states[0]", "v: ", "numbers expected, 2 found"]);
    ask(r#"{"states": [{}, {"joint_angles": {"R_KNE_P": 1}}]}"#)
        .assert_refused(&["states[1]", "did you mean `R_KNEE_P`"]);
    ask(r#"{"states": [{"base_quaternion_xyzw": [0, 0, 0, 0]}]}"#).assert_refused(&["not a rotation"]);
    let rushing = format!(r#"{{"states": [{{}}, {{"v": {:?}}}]}}"#, [1e200; 40]);
    ask(&rushing).assert_refused(&["states[1]", "beyond what a number can hold"]);
    ask(r#"{"states": [{"base_quaternion_xyzw": [1e300, 0, 0, 1]}]}"#).assert_refused(&["not a rotation"]);
    ask(r#"{"states": [{"angles": {}}]}"#).assert_refused(&["unknown field `angles`"]);
    inspect(&["dynamics", "--robot", "/nowhere.urdf"], "{}").assert_refused(&["/nowhere.urdf: cannot be read"]);
    inspect(&["dynamics", "--robot", &robot, "--gravity", "0", "0", "nan"], "{}").assert_refused(&["--gravity"]);
    inspect(&["dynamics"], "{}").assert_refused(&["--robot"]);
    inspect(&["dynamics", "--robot", &robot, "--frames", "tail"], "{}").assert_refused(&["tail"]);
    inspect(&["dynamics", "--robot", &robot, "--lock", "R_KNEE_P=bent"], "{}").assert_refused(&["not a number"]);
}
