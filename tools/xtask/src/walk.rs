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
    let mut build = cargo();
    build.args(["build", "--release", "--bins"]);
    build.args(PACKAGES.iter().flat_map(|package| ["--package", package]));
    let status = build.status().context("cannot run cargo")?;
    ensure!(status.success(), "the build failed");
    let (scenario, options) = match arguments.split_first() {
        Some((first, rest)) if !first.as_encoded_bytes().starts_with(b"-") => {
            (scenario_file(&metadata.root, first), rest)
        }
        _ => (scenario_file(&metadata.root, OsStr::new("flat")), arguments),
    };
    let launcher = metadata.target.join("release/soleus-launch");
    let mut command = Command::new(&launcher);
    if std::env::var_os("SOLEUS_CACHE").is_none() {
        // Condensed soles belong to a build, and go with `cargo clean`.
        command.env("SOLEUS_CACHE", metadata.target.join("soles"));
    }
    // Replaces this process, so that Ctrl-C and the exit code are the launcher's own.
    let error = command.arg(scenario).args(options).exec();
    Err(error).with_context(|| format!("cannot start {}", launcher.display()))
}

/// A path, or the name of a scenario that ships.
fn scenario_file(root: &Path, named: &OsStr) -> PathBuf {
    let shipped = root.join("config/scenarios").join(named).with_extension("toml");
    if Path::new(named).is_file() || !shipped.is_file() { PathBuf::from(named) } else { shipped }
}
