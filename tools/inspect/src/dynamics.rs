//! `soleus-inspect dynamics`: the whole of `multibody` for any URDF.

use crate::door::Outcome;
use std::path::PathBuf;

/// What to compute.
#[derive(clap::Args)]
pub struct Arguments {
    /// URDF of the robot.
    #[arg(long)]
    robot: PathBuf,
}

/// Reads states, writes terms.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    anyhow::bail!("{}: the dynamics library is not connected yet", arguments.robot.display())
}
