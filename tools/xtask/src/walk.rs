//! `cargo walk`.

use crate::metadata::{Metadata, cargo};
use anyhow::{Context, ensure};
use std::ffi::{OsStr, OsString};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a walk needs.
const PACKAGES: [&str; 6] =
    ["soleus-launch", "soleus-planner", "soleus-estimator", "soleus-controller", "soleus-simulator", "soleus-recorder"];

/// Builds the binaries in release and becomes the launcher of a scenario.
pub fn walk(arguments: &[OsString]) -> anyhow::Result<()> {
    let metadata = Metadata::read()?;
    build(&[])?;
    let (scenario, options) = match arguments.split_first() {
        Some((first, rest)) if !first.as_encoded_bytes().starts_with(b"-") => {
            (scenario_file(&metadata.root, first), rest)
        }
        _ => (scenario_file(&metadata.root, OsStr::new("flat")), arguments),
    };
    let launcher = metadata.target.join("release/soleus-launch");
    // Replaces this process, so that Ctrl-C and the exit code are the launcher's own.
    let error = with_cache(Command::new(&launcher), &metadata).arg(scenario).args(options).exec();
    Err(error).with_context(|| format!("cannot start {}", launcher.display()))
}

/// Builds what a walk needs, and more packages, in release.
pub fn build(more: &[&str]) -> anyhow::Result<()> {
    let mut build = cargo();
    build.args(["build", "--release", "--bins"]);
    build.args(PACKAGES.iter().chain(more).flat_map(|package| ["--package", package]));
    let status = build.status().context("cannot run cargo")?;
    ensure!(status.success(), "the build failed");
    Ok(())
}

/// With condensed soles kept beside the build: they belong to it, and go with `cargo clean`.
pub fn with_cache(mut command: Command, metadata: &Metadata) -> Command {
    if std::env::var_os("SOLEUS_CACHE").is_none() {
        command.env("SOLEUS_CACHE", metadata.target.join("soles"));
    }
    command
}

/// A path, or the name of a scenario that ships.
fn scenario_file(root: &Path, named: &OsStr) -> PathBuf {
    let shipped = root.join("config/scenarios").join(named).with_extension("toml");
    if Path::new(named).is_file() || !shipped.is_file() { PathBuf::from(named) } else { shipped }
}
