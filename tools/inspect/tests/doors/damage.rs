//! Damaged questions: an answer or an error, never a panic, within bounded memory and time.
//!
//! `DAMAGED_FILES=1000 cargo test -p soleus-inspect --test doors damage -- --nocapture` is the long form.

use super::example;
use std::io::Write;
use std::process::{Command, Stdio};

/// Damages the example of a door and asks.
fn damage(door: &str, arguments: &[&str]) {
    let whole = example(door);
    let words = ["null", "[]", "{}", "true", "-1", "1e999", "\"x\"", "[[", "]]", "}"];
    mutation::campaign(door, 20, whole.as_bytes(), &words, |bytes| {
        // What takes more than these seconds of processor time or bytes of address space is ended by a signal.
        let mut child = Command::new("prlimit")
            .args([
                &format!("--cpu={}", mutation::CASE_MAX_S),
                "--as=2000000000",
                env!("CARGO_BIN_EXE_soleus-inspect"),
                door,
            ])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        // A program that refuses its arguments does not read.
        let _ = child.stdin.take().expect("piped").write_all(bytes);
        let output = child.wait_with_output().expect("the program ends");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(matches!(output.status.code(), Some(0..=2)), "{:?}: {said}", output.status);
        assert!(!said.contains("panicked"), "{said}");
    });
}

#[test]
fn damaged_friction_problems_are_answered() {
    damage("friction", &[]);
}

#[test]
fn damaged_quadratic_programs_are_answered() {
    damage("qp", &[]);
}

#[test]
fn damaged_loads_of_soles_are_answered() {
    damage("sole", &[]);
}

#[test]
fn damaged_states_are_answered() {
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/hrp4/hrp4.urdf");
    damage("dynamics", &["--robot", robot]);
}
