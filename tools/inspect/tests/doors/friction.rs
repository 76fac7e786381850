//! `soleus-inspect friction`.

use crate::{example, inspect, number, numbers};

fn ask(input: &str) -> crate::Answer {
    inspect(&["friction"], input)
}

/// One contact, 0.1 mm deep in ground of 10 kN/m, pushed sideways by `sideways` metres without friction.
fn one(sideways: f64, more: &str) -> String {
    format!(r#"{{"W": [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]], "q": [{sideways}, 0, -1e-4], "mu": [0.5]{more}}}"#)
}

#[test]
fn the_example_is_solved_by_every_solver() {
    let problem: serde_json::Value = serde_json::from_str(&example("friction")).expect("JSON");
    for solver in ["auto", "gauss-seidel", "newton", "proximal"] {
        let mut problem = problem.clone();
        problem["solver"] = solver.into();
        let answer = ask(&problem.to_string()).json(0);
        assert_eq!((&answer["status"], &answer["states"]), (&"solved".into(), &serde_json::json!(["slip", "stick"])));
        assert!(number(&answer["residual"]) <= 1e-10, "{solver}");
        for field in ["delta", "residual_n", "worst_contact", "iterations", "time_us"] {
            assert!(!answer[field].is_null(), "{solver}: {field}");
        }
    }
}

#[test]
fn one_contact_opens_sticks_and_slides_as_on_paper() {
    let state = |sideways: f64| {
        let answer = ask(&one(sideways, "")).json(0);
        (answer["states"][0].clone(), numbers(&answer["F"]))
    };
    let (stick, force) = state(0.2e-4);
    assert_eq!(stick, "stick");
    assert!((force[0] + 0.2).abs() < 1e-7 && (force[2] - 1.0).abs() < 1e-7, "{force:?}");
    let (slide, force) = state(2e-4);
    assert_eq!(slide, "slip");
    assert!((force[0] + 0.5).abs() < 1e-7 && (force[2] - 1.0).abs() < 1e-7, "{force:?}");
    let answer = ask(&one(0.0, "").replace("-1e-4]", "1e-4]")).json(0);
    assert_eq!((&answer["states"][0], numbers(&answer["F"])), (&"open".into(), vec![0.0; 3]));
}

#[test]
fn what_cannot_be_solved_ends_with_exit_code_1_and_a_status() {
    // More digits than a number has.
    let answer = ask(&example("friction").replace("1e-10", "1e-30")).json(1);
    assert_eq!(answer["status"], "iteration-limit", "{answer}");
    assert!(number(&answer["residual"]) > 1e-30);
}

#[test]
fn wrong_questions_are_refused() {
    for (input, words) in [
        ("{", &["what this subcommand expects"][..]),
        (r#"{"W": [[1]], "q": [1]}"#, &["missing field `mu`"]),
        (&one(0.0, r#", "tolerence": 1"#), &["unknown field `tolerence`"]),
        (&one(0.0, r#", "tolerance": 0"#), &["tolerance: a positive number expected, 0 found"]),
        (&one(0.0, r#", "solver": "magic""#), &["unknown variant `magic`", "gauss-seidel"]),
        (&one(0.0, "").replace("[0.5]", "[0.5, 0.5]"), &["q: 6 numbers expected, 3 found"]),
        (&one(0.0, "").replace("[0.5]", "[-0.5]"), &["friction"]),
        (&one(0.0, "").replace("[[1e-4, 0, 0]", "[[1e-4, 0]"), &["W: row 1 has 3 entries, row 0 has 2"]),
        (&one(0.0, "").replace("[[1e-4, 0, 0]", "[[1e-4, 1, 0]"), &["symmetric"]),
        (&one(0.0, "").replace("1e-4", "0"), &["no force moves it"]),
    ] {
        ask(input).assert_refused(words);
    }
}
