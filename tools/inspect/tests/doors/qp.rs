//! `soleus-inspect qp`.

use crate::{example, inspect, number, numbers};

#[test]
fn the_example_is_solved_by_both_solvers_and_both_agree() {
    let solve = |backend: &str| inspect(&["qp", "--backend", backend], &example("qp")).json(0);
    let (ours, theirs) = (solve("active-set"), solve("clarabel"));
    assert_eq!(ours.as_array().expect("a list for a list").len(), 2);
    for k in 0..2 {
        assert_eq!(ours[k]["status"], "solved");
        for field in ["y_eq", "y_in", "y_bound", "residuals", "active", "iterations", "backend", "time_us"] {
            assert!(!ours[k][field].is_null(), "{field}");
        }
        for (a, b) in numbers(&ours[k]["x"]).iter().zip(numbers(&theirs[k]["x"])) {
            assert!((a - b).abs() < 1e-6, "{k}: {a} {b}");
        }
        // x = (0, 1) by hand: 1/2 + c_2.
        assert!((number(&ours[k]["objective"]) + 2.5).abs() < 1e-12, "{}", ours[k]["objective"]);
    }
}

#[test]
fn a_single_program_has_a_single_answer_and_null_is_no_bound() {
    let answer = inspect(&["qp"], r#"{"P": [[2]], "c": [-4], "lb": [null], "ub": [1]}"#).json(0);
    assert_eq!(numbers(&answer["x"]), [1.0]);
    assert_eq!(answer["active"], serde_json::json!([{"row": "bound", "index": 0, "side": "upper"}]));
    assert!((number(&answer["y_bound"][0]) - 2.0).abs() < 1e-12, "{answer}");
}

#[test]
fn contradictions_end_with_exit_code_1_and_are_named() {
    let program = r#"{"P": [[1]], "c": [0], "C": [[1]], "l": [2], "u": [null], "ub": [1]}"#;
    let answer = inspect(&["qp", "--backend", "active-set"], program).json(1);
    assert_eq!(answer["status"], "infeasible");
    assert!((number(&answer["contradiction"]["amount"]) - 1.0).abs() < 1e-12, "{answer}");
    let answer = inspect(&["qp"], r#"{"P": [[0]], "c": [-1]}"#).json(1);
    assert_eq!(answer["status"], "unbounded", "{answer}");
}

#[test]
fn wrong_questions_are_refused() {
    let ask = |input: &str| inspect(&["qp"], input);
    ask("[").assert_refused(&["what this subcommand expects"]);
    ask(r#"{"P": [[1, 0], [0, 1]], "c": [0, 1], "lb": [0]}"#).assert_refused(&["lb: 2 numbers expected, 1 found"]);
    ask(r#"{"P": [[1, 0]], "c": [0]}"#).assert_refused(&["P: 1 rows of 2 entries"]);
    ask(r#"{"P": [[1]], "c": [0], "Q": []}"#).assert_refused(&["what this subcommand expects"]);
    for tolerance in ["nan", "0", "inf"] {
        inspect(&["qp", "--tolerance", tolerance], &example("qp")).assert_refused(&["--tolerance", "must be positive"]);
    }
    inspect(&["qp", "--backend", "magic"], "").assert_refused(&["magic", "active-set", "clarabel"]);
}
