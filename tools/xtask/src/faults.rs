//! `cargo xtask faults`: the system test of the same name, with as many walks as are asked for.

use crate::metadata::cargo;
use anyhow::{Context, ensure};

/// The test that walks; without settings it does nothing.
const TEST: &str = "faults::no_fault_hangs_is_unnamed_or_loses_a_recording";

/// Runs the campaign.
pub fn campaign(walks: u64, seed: u64) -> anyhow::Result<()> {
    let mut test = cargo();
    test.args(["test", "--package", "system", "--test", "system", "--", "--exact", TEST, "--nocapture"]);
    test.env("SOLEUS_FAULT_WALKS", walks.to_string()).env("SOLEUS_FAULT_SEED", seed.to_string());
    let status = test.status().context("cannot run cargo")?;
    ensure!(status.success(), "the campaign found something: see above");
    Ok(())
}
