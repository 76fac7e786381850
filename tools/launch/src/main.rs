//! Starts, supervises and stops the processes of a scenario.
//!
//! | exit code | meaning |
//! |---|---|
//! | 0 | the walk was walked to its end, or `serve` was asked to stop |
//! | 1 | the robot fell, or something failed while running |
//! | 2 | arguments, scenario or configuration are wrong, or processes are configured for different robots |
//! | 3 | could not start: the domain is in use, a binary is missing, a process died before the walk |
//! | 4 | a process made a safety stop or was killed |
//! | 5 | a process missed its deadlines |
//! | 6 | the robot did not settle: it did not stand still enough to walk, and the message says what was in the way |
//! | 10 | the walk came to its end, but its zero-moment point was farther from the plan than `report.zmp_error_max_m` |
//! | 130 | interrupted (Ctrl-C) |
#![allow(clippy::print_stdout, reason = "the summary is what a launch is asked for")]

mod conclusion;
mod folder;
mod heard;
mod process;
mod progress;
mod run;

use bus::{Contract, DomainName, Owner};
use clap::{Args, Parser, Subcommand};
use node::{LogFormat, Stop};
use scenario::Setting;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Starts, supervises and stops the processes of a scenario.
#[derive(Debug, Parser)]
#[command(name = "soleus-launch", version = node::VERSION, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(
    after_help = "Exit codes: 0 walked to the end; 1 fallen, or failed while running; 2 arguments or configuration wrong; \
3 could not start; 4 safety stop, or a process was killed; 5 deadlines missed; 6 the robot did not settle; 10 walked, but off its plan; 130 interrupted."
)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,

    #[command(flatten)]
    launch: Launch,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Print where a domain is, who lives in it, and how a process in any language takes a place in it (TOML).
    Domain {
        /// The domain.
        #[arg(long, value_name = "NAME", default_value = "default")]
        domain: DomainName,
    },
    /// Own the shared memory of a domain, for processes that are started one by one.
    Serve {
        /// The domain.
        #[arg(long, value_name = "NAME", default_value = "default")]
        domain: DomainName,
        /// How diagnostics are written.
        #[arg(long, value_enum, default_value_t = LogFormat::Text)]
        log_format: LogFormat,
    },
}

#[derive(Debug, Args)]
struct Launch {
    /// Scenario file.
    #[arg(value_name = "SCENARIO", required = true)]
    scenario: Option<PathBuf>,

    /// Change a key of a process's configuration (may be repeated): planner.gait.cost.lambda=0.8.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<Setting>,

    /// Run by the clock instead of in lock-step.
    #[arg(long)]
    real_time: bool,

    /// Folder of the run, in place of `runs/TIME-SCENARIO`; there must be nothing in it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Let the run replace what a former one left in the folder of --out.
    #[arg(long, requires = "out")]
    overwrite: bool,

    /// Make no page (`report.html`) of the run.
    #[arg(long)]
    no_report: bool,

    /// Domain to run in; a new one by default.
    #[arg(long, value_name = "NAME")]
    domain: Option<DomainName>,

    /// How diagnostics are written to standard error and to the run's logs.
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
}

/// A launch did not lead to a finished walk.
#[derive(Debug)]
pub struct Ending {
    /// The launcher's exit code.
    pub code: u8,
    /// What happened, and where to look.
    pub reason: String,
}

impl Ending {
    fn new(code: u8, reason: impl std::fmt::Display) -> Self {
        Self { code, reason: reason.to_string() }
    }

    /// With what caused it, as one sentence.
    fn with_causes(code: u8, error: impl Into<anyhow::Error>) -> Self {
        Self { code, reason: format!("{:#}", error.into()) }
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    node::keep_files_private();
    let result = match arguments.command {
        Some(Command::Domain { domain }) => {
            node::say(&Contract::of(&domain).to_string()).map_err(|error| Ending::with_causes(1, error))
        }
        Some(Command::Serve { domain, log_format }) => {
            node::start_diagnostics(log_format);
            serve(&domain)
        }
        None => {
            node::start_diagnostics(arguments.launch.log_format);
            run::launch(&arguments.launch)
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(ending) => {
            tracing::error!("{}", ending.reason);
            ExitCode::from(ending.code)
        }
    }
}

fn serve(domain: &DomainName) -> Result<(), Ending> {
    let stop = Stop::on_signals().map_err(|error| Ending::with_causes(3, error))?;
    let owner = Owner::claim(domain).map_err(|error| Ending::with_causes(3, error))?;
    let runtime = bus::runtime_folder();
    tracing::info!("serving domain `{domain}`, runtime folder {}, until asked to stop", runtime.display());
    let mut reaped = Instant::now();
    while !stop.asked() {
        std::thread::sleep(Duration::from_millis(50));
        if reaped.elapsed() > run::REAPING {
            reaped = Instant::now();
            owner.reap_dead();
        }
    }
    Ok(())
}
