//! The arguments all processes share.

use bus::DomainName;
use clap::{Parser, ValueEnum};
use messages::code::Process;
use scenario::Setting;
use std::path::PathBuf;

/// What is said on the command line of a process.
#[derive(Debug, Clone, Parser)]
#[command(version = crate::VERSION, after_help = "Exit codes: 0 done; 1 failed while running; 2 arguments or configuration \
wrong, or not of the robot of the others; 3 could not start (no owner of the domain, see soleus-launch serve); 4 safety stop; 5 deadlines missed; 6 the robot did not \
settle.")]
pub struct Arguments {
    /// Configuration file.
    #[arg(long, value_name = "FILE")]
    pub config: PathBuf,

    /// Change a key of the configuration (may be repeated).
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<Setting>,

    /// The system to belong to: two domains on one host do not see each other.
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub domain: DomainName,

    /// Read and check the configuration, print the effective one and exit.
    #[arg(long)]
    pub check: bool,

    /// Run by the clock instead of in lock-step.
    #[arg(long)]
    pub real_time: bool,

    /// The processes that must be ready before this one begins (simulator), in place of those it needs at least.
    #[arg(long, value_name = "PROCESS", value_delimiter = ',', value_parser = process)]
    pub wait_for: Vec<Process>,

    /// How diagnostics are written to standard error; RUST_LOG chooses which.
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    pub log_format: LogFormat,
}

/// How diagnostics are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// A line of text each.
    Text,
    /// A JSON object per line.
    Json,
}

fn process(word: &str) -> Result<Process, String> {
    let known = || Process::ALL.iter().map(|process| process.word()).collect::<Vec<_>>().join(", ");
    Process::ALL
        .iter()
        .find(|process| process.word() == word)
        .copied()
        .ok_or_else(|| format!("no process is called so; there are {}", known()))
}
