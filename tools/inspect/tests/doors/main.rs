//! The doors as another tool uses them: JSON on stdin, JSON on stdout, exit code 0 only when all was solved, 2 and the reason on stderr
//! when the question is wrong.

mod damage;
mod dynamics;
mod friction;
mod qp;
mod robot;
mod sole;

use serde_json::Value;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// What the program said.
struct Answer {
    code: i32,
    stdout: String,
    stderr: String,
}

impl Answer {
    /// The JSON on stdout, with the exit code of a question that could be asked.
    fn json(&self, code: i32) -> Value {
        assert_eq!(self.code, code, "{}", self.stderr);
        serde_json::from_str(&self.stdout).expect("one JSON document")
    }

    /// Nothing but the reason, in one sentence, and exit code 2.
    fn assert_refused(&self, words: &[&str]) {
        assert_eq!(self.code, 2, "{words:?} is wrong, but the answer was {:.300}", self.stdout);
        assert_eq!(self.stdout, "", "{words:?}");
        for word in words {
            assert!(self.stderr.contains(word), "no `{word}` in: {}", self.stderr);
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
    }
}

fn inspect(arguments: &[&str], input: &str) -> Answer {
    let mut child = Command::new(env!("CARGO_BIN_EXE_soleus-inspect"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    // A program that refuses its arguments does not read.
    let _ = child.stdin.take().expect("piped").write_all(input.as_bytes());
    let output = child.wait_with_output().expect("the program ends");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Answer { code: output.status.code().expect("no signal"), stdout: text(output.stdout), stderr: text(output.stderr) }
}

/// The input that a door offers to start from.
fn example(door: &str) -> String {
    let answer = inspect(&[door, "--example"], "");
    assert_eq!(answer.code, 0, "{}", answer.stderr);
    answer.stdout
}

/// A file of the repository.
fn shipped(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..").join(file)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap_or_else(|| panic!("{value} is no list")).iter().map(number).collect()
}
