//! The arguments all processes share.

use crate::exit::ExitCode;
use bus::DomainName;
use clap::{Parser, ValueEnum};
use messages::code::Process;
use scenario::Setting;
use std::path::PathBuf;

/// How a process may end; the others are the launcher's.
const CODES: [ExitCode; 9] = [
    ExitCode::Done,
    ExitCode::Failed,
    ExitCode::Configuration,
    ExitCode::Start,
    ExitCode::SafetyStop,
    ExitCode::Deadlines,
    ExitCode::NotSettled,
    ExitCode::Occupied,
    ExitCode::Bug,
];

/// What is said on the command line of a process.
#[derive(Debug, Clone, Parser)]
#[command(version = crate::VERSION, after_help = ExitCode::help(&CODES))]
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

    /// End where the system refuses policy, core or locked memory that the configuration asks for ([real_time]); else that is a warning.
    #[arg(long, requires = "real_time")]
    pub require_real_time: bool,

    /// In lock-step, let simulated time pass at most so many times as fast as real time (simulator): 1.0 to watch a walk.
    #[arg(long, value_name = "FACTOR", conflicts_with = "real_time", value_parser = pace)]
    pub pace: Option<f64>,

    /// By the clock, walk off as soon as the robot stands still (controller, simulator). Without it the robot stands until it is told to
    /// walk: `soleus-inspect start --domain NAME`. In lock-step it always walks.
    #[arg(long)]
    pub walk: bool,

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

/// A pace at which lock-step may be watched.
///
/// # Errors
/// If it is none, and what one is.
pub fn pace(text: &str) -> Result<f64, String> {
    let pace: f64 = text.parse().map_err(|_| format!("`{text}` is no number"))?;
    let is_pace = (0.01..=100.0).contains(&pace);
    is_pace.then_some(pace).ok_or_else(|| "must be from 0.01 to 100 times real time".to_string())
}

fn process(word: &str) -> Result<Process, String> {
    let known = || Process::ALL.iter().map(|process| process.word()).collect::<Vec<_>>().join(", ");
    Process::ALL
        .iter()
        .find(|process| process.word() == word)
        .copied()
        .ok_or_else(|| format!("no process is called so; there are {}", known()))
}
