//! `cargo xtask latency` and `cargo xtask levels`: build everything in release, then become the tool that measures.

use crate::metadata::Metadata;
use crate::walk;
use anyhow::Context;
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::Command;

/// What the measurements need beside a walk's programs.
const PACKAGES: [&str; 2] = ["soleus-latency", "soleus-replayer"];

/// Runs a task of `soleus-latency`; does not come back.
pub fn measure(task: &str, arguments: &[OsString]) -> anyhow::Result<()> {
    let metadata = Metadata::read()?;
    walk::build(&PACKAGES)?;
    let tool = metadata.target.join("release/soleus-latency");
    // Replaces this process, so that the exit code is its own: 77 must stay 77.
    let error = walk::with_cache(Command::new(&tool), &metadata).arg(task).args(arguments).exec();
    Err(error).with_context(|| format!("cannot start {}", tool.display()))
}
