//! The figures of recordings, as a table or as JSON.

use crate::door::Outcome;
use clap::Args;
use recording::Recording;
use std::path::PathBuf;

/// Recordings.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The recordings.
    #[arg(value_name = "RUN.mcap", required = true)]
    recordings: Vec<PathBuf>,
    /// As JSON, a line per recording.
    #[arg(long)]
    json: bool,
}

/// Prints the figures.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut outcome = Outcome::Solved;
    for path in &arguments.recordings {
        let figures = ::report::figures(&Recording::open(path)?)?;
        if arguments.json {
            println!("{}", serde_json::to_string(&figures)?);
        } else {
            if arguments.recordings.len() > 1 {
                println!("{}", path.display());
            }
            print!("{}", ::report::table(&figures));
        }
        if !figures.verdict.is_good() {
            outcome = Outcome::NotSolved;
        }
    }
    Ok(outcome)
}
