//! Everything that must hold before a change is merged.

use crate::metadata::{Metadata, cargo};
use crate::{circles, licenses, rules};
use anyhow::{Context, bail, ensure};
use std::process::Command;

/// All checks, the quick ones first; stops at the first that fails.
pub fn all() -> anyhow::Result<()> {
    run("format", cargo().args(["fmt", "--all", "--check"]))?;
    rules_and_licenses()?;
    spelling()?;
    run("lints", cargo().args(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    run("documentation", cargo().args(["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))?;
    run("tests", cargo().args(["test", "--workspace"]))?;
    // What walks is built otherwise than what is tested.
    run("release", cargo().args(["build", "--workspace", "--bins", "--release"]))
}

/// Dependency rules, circles of modules and licences.
pub fn rules_and_licenses() -> anyhow::Result<()> {
    let metadata = Metadata::read()?;
    let mut violations = rules::violations(&metadata);
    violations.extend(circles::violations(&metadata.root)?);
    violations.extend(licenses::violations(&metadata));
    if violations.is_empty() {
        return Ok(());
    }
    bail!("rules are broken:\n  {}", violations.join("\n  "))
}

/// Spelling, where the checker is installed: the one tool here that does not come with Rust.
fn spelling() -> anyhow::Result<()> {
    match Command::new("typos").arg("--version").output() {
        Ok(found) if found.status.success() => run("spelling", &mut Command::new("typos")),
        _ => {
            eprintln!("== spelling is left out: no `typos` (cargo install typos-cli, or pip install typos)");
            Ok(())
        }
    }
}

fn run(name: &str, command: &mut Command) -> anyhow::Result<()> {
    eprintln!("== {name}");
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{name}: {command:?} failed");
    Ok(())
}
