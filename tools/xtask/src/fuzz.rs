//! `cargo xtask fuzz`.

use crate::metadata::cargo;
use anyhow::{Context, ensure};

/// Packages with tests of damaged files, the test, and one in how many of the cases it takes: a question to soleus-inspect starts a
/// process.
const TESTS: [(&str, &str, u64); 5] = [
    ("scenario", "damage", 1),
    ("robot", "damage", 1),
    ("multibody", "damage", 1),
    ("recording", "damage", 1),
    ("soleus-inspect", "doors", 20),
];

/// Damages every kind of file that is read so many times, in the same ways whenever it is run.
pub fn fuzz(cases: u64) -> anyhow::Result<()> {
    for (package, test, share) in TESTS {
        let mut command = cargo();
        command.args([
            "test",
            "--package",
            package,
            "--test",
            test,
            "damage",
            "--",
            "--nocapture",
            "--test-threads",
            "1",
        ]);
        command.env("DAMAGED_FILES", (cases / share).to_string());
        let status = command.status().context("cannot run cargo")?;
        ensure!(status.success(), "{package}: see above; the seed of the case makes the same file again");
    }
    Ok(())
}
