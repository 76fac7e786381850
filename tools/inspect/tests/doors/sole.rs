//! `soleus-inspect sole`.

use crate::{Answer, example, inspect, number, numbers, shipped};
use serde_json::{Value, json};

/// HRP-4's sole on fewer elements, with one line changed.
struct Sole {
    folder: tempfile::TempDir,
    file: String,
}

fn sole(from: &str, to: &str) -> Sole {
    let text = std::fs::read_to_string(shipped("robots/hrp4/sole.toml")).expect("it ships");
    let text = text.replace("cells = [12, 7, 3]", "cells = [6, 4, 2]");
    assert!(text.contains(from), "sole.toml has no {from}");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sole.toml");
    std::fs::write(&file, text.replace(from, to)).expect("a file");
    Sole { file: file.display().to_string(), folder }
}

impl Sole {
    fn ask(&self, more: &[&str], input: &str) -> Answer {
        inspect(&[&["sole", "--sole", &self.file][..], more].concat(), input)
    }

    fn ticks(&self, more: &[&str], ticks: &Value, code: i32) -> Vec<Value> {
        let answer = self.ask(more, &json!({ "ticks": ticks }).to_string()).json(code);
        let out = answer["ticks"].as_array().expect("a list").clone();
        assert_eq!(out.len(), ticks.as_array().expect("a list").len(), "one output per tick");
        out
    }
}

fn shipped_sole() -> Sole {
    sole("", "")
}

fn load(force: [f64; 3], zmp: [f64; 2]) -> Value {
    json!({ "force": force, "zmp": zmp })
}

/// Upright, so deep in the ground.
fn pose(depth: f64) -> Value {
    json!({ "pose": { "position": [0.0, 0.0, -depth], "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]] } })
}

fn statuses(ticks: &[Value]) -> Vec<&str> {
    ticks.iter().map(|tick| tick["status"].as_str().expect("a status")).collect()
}

#[test]
fn the_example_is_solved_and_every_field_is_there() {
    let answer = shipped_sole().ask(&[], &example("sole")).json(0);
    let sole = &answer["sole"];
    assert_eq!((&sole["nodes"], &sole["tetrahedra"], &sole["contact_points"]), (&json!(105), &json!(288), &json!(35)));
    assert!(number(&sole["compliance_condition"]) > 1.0 && number(&sole["build_time_s"]) > 0.0);
    let input: Value = serde_json::from_str(&example("sole")).expect("JSON");
    for (tick, asked) in
        answer["ticks"].as_array().expect("a list").iter().zip(input["ticks"].as_array().expect("a list"))
    {
        assert_eq!((&tick["status"], &tick["detail"]), (&json!("converged"), &json!("solved")));
        for (name, digits) in [("force", 1e-6), ("zmp", 1e-9)] {
            for (a, b) in numbers(&tick[name]).iter().zip(numbers(&asked[name])) {
                assert!((a - b).abs() < digits, "{name}: {a} {b}");
            }
        }
        for field in ["node_positions", "node_forces", "node_states"] {
            assert_eq!(tick[field].as_array().map(Vec::len), Some(35), "{field}");
        }
        assert!(number(&tick["residual"]) <= 1e-10 && number(&tick["law_violation_n"]) < 1e-6);
        assert_eq!((numbers(&tick["velocity"]).len(), numbers(&tick["acceleration"]).len()), (6, 6));
        assert_eq!(tick["tangent"].as_array().map(Vec::len), Some(6));
        assert!(tick["moment_z"].is_number() && tick["iterations"].is_number() && tick["time_us"].is_number());
        assert_eq!(numbers(&tick["ankle"]["roll_pitch_yaw"]), numbers(&tick["pose"]["roll_pitch_yaw"]));
    }
}

#[test]
fn poses_of_an_output_are_an_input_that_gives_the_forces_back() {
    let sole = shipped_sole();
    let forced = sole.ticks(&[], &json!([load([5.0, 0.0, 383.0], [0.02, 0.005])]), 0);
    let posed = sole.ticks(&[], &json!([{ "pose": forced[0]["pose"] }]), 0);
    assert_eq!(statuses(&posed), ["solved"]);
    // The first tick's references turn with the foot in one case and lie below the pose in the other: the vertical load is the same to
    // what friction makes of that.
    assert!((number(&posed[0]["force"][2]) / 383.0 - 1.0).abs() < 0.01, "{}", posed[0]["force"]);
    assert!(posed[0]["velocity"].is_null() && posed[0]["law_violation_n"].is_null());
}

#[test]
fn every_tick_has_its_output_in_the_air_too() {
    let sole = shipped_sole();
    let (stand, lift) = (load([0.0, 0.0, 300.0], [0.0, 0.0]), json!({ "lift_off": true }));
    let ticks = sole.ticks(&[], &json!([lift, stand, lift, stand]), 0);
    assert_eq!(statuses(&ticks), ["in-air", "converged", "in-air", "converged"]);
    assert_eq!(ticks[2]["pose"], ticks[1]["pose"], "the take-off pose");
    assert_eq!(ticks[3]["pose"], ticks[1]["pose"], "landed anew");
    assert_eq!(numbers(&ticks[2]["force"]), [0.0; 3]);

    let ticks = sole.ticks(&[], &json!([pose(0.0005), lift, pose(0.0005), pose(-0.001)]), 0);
    assert_eq!(statuses(&ticks), ["solved", "in-air", "solved", "no-contact"]);
    assert_eq!(ticks[1]["detail"], "the foot is in the air");
    assert_eq!((&ticks[1]["pose"], numbers(&ticks[1]["force"])), (&ticks[0]["pose"], vec![0.0; 3]));
    assert_eq!(ticks[2]["force"], ticks[0]["force"], "no history across the flight");
    sole.ask(&[], &json!({ "ticks": [lift, pose(0.0)] }).to_string())
        .assert_refused(&["ticks[0]", "before the first pose"]);
}

#[test]
fn what_cannot_be_carried_is_said_in_words_and_by_the_exit_code() {
    let sole = shipped_sole();
    let zmp = [0.0, 0.0];
    let ticks = sole.ticks(
        &[],
        &json!([
            load([0.0, 0.0, -3.0], zmp),
            load([0.0, 300.0, 383.0], zmp),
            load([0.0, 0.0, 383.0], [0.13, 0.0]),
            load([0.0, 0.0, 383.0], [0.114, 0.0]),
            load([0.0, 0.0, 1e155], zmp),
            load([0.0, 0.0, 1e300], zmp),
        ]),
        1,
    );
    for (tick, (status, words)) in ticks.iter().zip([
        ("no-load", "the vertical force is -3 N"),
        ("outside-friction-cone", "the horizontal force is 300.000 N, friction allows 246.460 N"),
        ("zmp-outside-sole", "the ZMP lies 15.000 mm outside the sole"),
        ("fold", "no pose carries this load"),
        ("invalid-input", "larger than any that a foot meets"),
        ("invalid-input", "larger than any that a foot meets"),
    ]) {
        assert_eq!(tick["status"], status, "{}", tick["detail"]);
        assert!(tick["detail"].as_str().is_some_and(|detail| detail.contains(words)), "{}", tick["detail"]);
    }
    let heavy = sole.ticks(&[], &json!([load([0.0, 0.0, 2000.0], zmp)]), 0);
    assert_eq!(statuses(&heavy), ["doubtful-compression"]);
    assert!(
        heavy[0]["detail"].as_str().is_some_and(|detail| detail.contains("% of the thickness")),
        "{}",
        heavy[0]["detail"]
    );
    let deep = sole.ticks(&[], &json!([pose(1e155)]), 1);
    assert_eq!(statuses(&deep), ["invalid-input"]);
    let smooth = self::sole("friction = 0.65", "friction = 0.0");
    assert_eq!(statuses(&smooth.ticks(&[], &json!([load([0.0, 0.0, 300.0], zmp)]), 1)), ["indeterminate"]);
}

#[test]
fn wrong_sequences_are_refused_with_the_tick() {
    let sole = shipped_sole();
    let refused = |input: &Value, words: &[&str]| sole.ask(&[], &input.to_string()).assert_refused(words);
    let stand = load([0.0, 0.0, 300.0], [0.0, 0.0]);
    let posed =
        |rotation: Value| json!({ "ticks": [pose(0.0), { "pose": { "position": [0, 0, 0], "rotation": rotation } }] });
    sole.ask(&[], "{").assert_refused(&["what this subcommand expects"]);
    refused(&json!({}), &["missing field `ticks`"]);
    refused(&json!({ "ticks": [{ "force": [0, 0, 1], "zpm": [0, 0] }] }), &["unknown field `zpm`"]);
    refused(&json!({ "ticks": [stand, {}] }), &["ticks[1]", "force and zmp, or pose, or lift_off expected"]);
    refused(&json!({ "ticks": [{ "force": [0, 0, 1] }] }), &["ticks[0]", "force and zmp"]);
    refused(&json!({ "ticks": [stand, pose(0.0)] }), &["may not be mixed"]);
    refused(&json!({ "ticks": [pose(0.0), { "zmp_rate": [0, 0] }] }), &["may not be mixed"]);
    let mut both = stand.clone();
    both["lift_off"] = json!(true);
    refused(&json!({ "ticks": [stand, both] }), &["ticks[1]", "lift_off beside a load or a pose"]);
    let mut both = pose(0.0);
    both["lift_off"] = json!(true);
    refused(&json!({ "ticks": [both] }), &["ticks[0]", "lift_off beside a load or a pose"]);
    let first = json!({ "position_xy": [0, 0], "yaw": 0.1 });
    refused(&json!({ "first_tick": first, "ticks": [pose(0.0)] }), &["first_tick", "pose-driven"]);
    refused(&posed(json!([[1, 0, 0], [0, 1, 0], [0, 0, -1]])), &["ticks[1]", "a reflection"]);
    refused(&posed(json!([[1, 0, 0], [0, 1.1, 0], [0, 0, 1]])), &["ticks[1]", "not orthonormal"]);
    let mut unknown = pose(0.0);
    unknown["pose"]["yaw"] = json!(1.0);
    refused(&json!({ "ticks": [unknown] }), &["unknown field `yaw`"]);
    let mut angles = pose(0.0);
    angles["pose"]["roll_pitch_yaw"] = json!([0.0, 0.0, 0.3]);
    refused(&json!({ "ticks": [angles] }), &["ticks[0]", "roll_pitch_yaw"]);
}

#[test]
fn wrong_arguments_are_refused() {
    let sole = shipped_sole();
    let refused = |arguments: &[&str], words: &[&str]| sole.ask(arguments, &example("sole")).assert_refused(words);
    refused(&["--level", "fine"], &["unknown variant `fine`", "quadratic-fem"]);
    refused(&["--friction-use-max", "nan"], &["--friction-use-max", "at most 1"]);
    refused(&["--friction-use-max", "1.01"], &["--friction-use-max", "at most 1"]);
    refused(&["--tolerance", "0"], &["--tolerance", "a positive number expected"]);
    refused(&["--tolerance", "inf"], &["--tolerance", "a positive number expected"]);
    refused(&["--period=-0.005"], &["--period", "a positive number expected"]);
    refused(&["--viscosity", "nan"], &["--viscosity", "zero or a positive number expected"]);
    refused(&["--level", "patches", "--grid", "0", "5"], &["cells"]);
    refused(&["--level", "winkler", "--grid", "100000", "100000"], &["contact points, at most"]);
    refused(&["--mesh", "/nowhere.msh"], &["/nowhere.msh: cannot be read"]);
    inspect(&["sole"], "").assert_refused(&["--sole"]);
    inspect(&["sole", "--sole", "/nowhere.toml"], "").assert_refused(&["/nowhere.toml: cannot be read"]);
}

#[test]
fn every_level_of_a_sole_s_file_is_one_of_this_door() {
    let sole = shipped_sole();
    for level in ["rigid", "lumped", "winkler", "fem", "quadratic-fem", "patches", "quadratic-patches"] {
        let ours = sole.ask(&["--level", level, "--grid", "4", "3"], &example("sole")).json(0);
        let file = self::sole("level = \"fem\"", &format!("level = \"{level}\""));
        let same = file.ask(&["--grid", "4", "3"], &example("sole")).json(0);
        assert_eq!(ours["ticks"][2]["pose"], same["ticks"][2]["pose"], "{level}");
    }
}

#[test]
fn soles_in_other_units_or_beyond_any_memory_are_refused() {
    let refused =
        |from: &str, to: &str, words: &[&str]| sole(from, to).ask(&[], &example("sole")).assert_refused(words);
    refused("[0.23, 0.13, 0.021]", "[230, 130, 21]", &["sole.toml", "230 m long", "another unit"]);
    refused("[0.23, 0.13, 0.021]", "[23, 13, 2.1]", &["sole.toml", "23 m long"]);
    refused("[-0.015, -0.011, 0.103]", "[-15, -11, 103]", &["foot.ankle_in_sole_m = -15", "millimetres"]);
    refused("0.32e6", "0.32", &["young_modulus_pa = 0.32", "MPa"]);
    refused("[6, 4, 2]", "[4000, 4000, 4000]", &["384000000000 tetrahedra"]);
    refused("[6, 4, 2]", "[100, 80, 1]", &["8181 contact points, at most"]);
}

#[test]
fn what_is_wrong_with_a_mesh_is_said_once_with_the_numbers_of_the_file() {
    let sole = shipped_sole();
    let file = sole.folder.path().join("foot.msh");
    let text = std::fs::read_to_string(shipped("robots/hrp4/sole-rounded.msh")).expect("it ships");
    // Two corners of the last tetrahedron change places.
    let last =
        text.lines().rfind(|line| line.split(' ').filter(|word| !word.is_empty()).count() >= 5).expect("an element");
    let mut words: Vec<&str> = last.split_ascii_whitespace().collect();
    let element = words[0];
    let corner = words.len() - 1;
    words.swap(corner, corner - 1);
    std::fs::write(&file, text.replace(last, &words.join(" "))).expect("a file");
    let answer = sole.ask(&["--mesh", &file.display().to_string()], &example("sole"));
    answer.assert_refused(&["foot.msh", "inverted or flat", &format!("(in the file: element {element};")]);
    assert_eq!(answer.stderr.matches("inverted or flat").count(), 1, "{}", answer.stderr);
    assert!(!answer.stderr.contains("Some(") && !answer.stderr.contains("None"), "{}", answer.stderr);
}

/// The points of a picture.
fn points(text: &str) -> Vec<Vec<f64>> {
    let mut lines = text.lines().skip_while(|line| !line.starts_with("POINTS"));
    let count: usize = lines.next().expect("points").split(' ').nth(1).expect("a count").parse().expect("a number");
    let numbers = lines.flat_map(str::split_ascii_whitespace).take(3 * count);
    let numbers: Vec<f64> = numbers.map(|word| word.parse().expect("a number")).collect();
    numbers.chunks_exact(3).map(<[f64]>::to_vec).collect()
}

#[test]
fn the_picture_has_the_contact_nodes_of_the_last_tick_and_other_levels_have_none() {
    let sole = shipped_sole();
    let target = sole.folder.path().join("sole.vtk");
    let vtk = ["--vtk", &target.display().to_string()];
    for mirrored in [&[][..], &["--mirrored"]] {
        let answer = sole.ask(&[&vtk[..], mirrored].concat(), &example("sole")).json(0);
        let points = points(&std::fs::read_to_string(&target).expect("a picture"));
        // A block's contact nodes are its first ones.
        for (i, position) in answer["ticks"][2]["node_positions"].as_array().expect("a list").iter().enumerate() {
            let position = numbers(position);
            for axis in 0..3 {
                assert!((points[i][axis] - position[axis]).abs() < 1e-9, "node {i}: {:?} for {position:?}", points[i]);
            }
        }
        std::fs::remove_file(&target).expect("it was written");
    }
    sole.ask(&vtk, r#"{ "ticks": [] }"#).assert_refused(&["--vtk", "no tick"]);
    // Both have as many contact points as the mesh.
    for level in [&["--level", "quadratic-fem"][..], &["--level", "winkler", "--grid", "6", "4"], &["--level", "rigid"]]
    {
        sole.ask(&[&vtk[..], level].concat(), &example("sole")).assert_refused(&["--vtk", "fem"]);
        assert!(!target.exists(), "{level:?}");
    }
}
