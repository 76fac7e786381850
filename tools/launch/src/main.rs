//! Starts, supervises and stops the processes of a scenario. [`node::ExitCode`] says how that may end.

mod conclusion;
mod folder;
mod heard;
mod process;
mod progress;
mod recorded;
mod run;
mod watchdog;

use bus::{Contract, DomainName, Owner, OwnerError};
use clap::{Args, Parser, Subcommand};
use node::{ExitCode, LogFormat, START_PATIENCE, Stop};
use scenario::Setting;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Starts, supervises and stops the processes of a scenario.
#[derive(Debug, Parser)]
#[command(name = "soleus-launch", version = node::VERSION, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = ExitCode::help(&ExitCode::ALL))]
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

    /// End where the system refuses policy, core or locked memory that a process asks for ([real_time] of its configuration).
    #[arg(long, requires = "real_time")]
    require_real_time: bool,

    /// In lock-step, walk at most so many times as fast as real time: 1.0 to watch.
    #[arg(long, value_name = "FACTOR", conflicts_with = "real_time", value_parser = node::pace)]
    pace: Option<f64>,

    /// Folder of the run, in place of `runs/TIME-SCENARIO`; there must be nothing in it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Let the run replace what a former one left in the folder of --out.
    #[arg(long, requires = "out")]
    overwrite: bool,

    /// Make no page (`report.html`) of the run.
    #[arg(long)]
    no_report: bool,

    /// Seconds of silence after which a process counts as hung, and the launch ends. Every process speaks ten times a second.
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = hung_after)]
    hung_after: Duration,

    /// Domain to run in; a new one by default.
    #[arg(long, value_name = "NAME")]
    domain: Option<DomainName>,

    /// How diagnostics are written to standard error and to the run's logs.
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
}

fn hung_after(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("`{text}` is no number"))?;
    let is_silence = (1.0..=3600.0).contains(&seconds);
    is_silence.then(|| Duration::from_secs_f64(seconds)).ok_or_else(|| "must be from 1 to 3600 seconds".to_string())
}

/// A launch did not lead to a finished walk.
#[derive(Debug)]
pub struct Ending {
    /// The launcher's exit code.
    pub code: ExitCode,
    /// What happened, and where to look.
    pub reason: String,
}

impl Ending {
    fn new(code: ExitCode, reason: impl std::fmt::Display) -> Self {
        Self { code, reason: reason.to_string() }
    }

    /// With what caused it, as one sentence.
    fn with_causes(code: ExitCode, error: impl Into<anyhow::Error>) -> Self {
        Self { code, reason: format!("{:#}", error.into()) }
    }
}

fn main() -> std::process::ExitCode {
    let arguments = Arguments::parse();
    node::keep_files_private();
    let result = match arguments.command {
        Some(Command::Domain { domain }) => {
            node::say(&Contract::of(&domain).to_string()).map_err(|error| Ending::with_causes(ExitCode::Failed, error))
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
        Ok(()) => ExitCode::Done.into(),
        Err(ending) => {
            tracing::error!("{}", ending.reason);
            ending.code.into()
        }
    }
}

/// Takes a domain into possession; `asked` is how we end if asked to stop meanwhile.
fn claim(domain: &DomainName, stop: &Stop, asked: ExitCode) -> Result<Owner, Ending> {
    let claiming = format!("taking domain `{domain}` into possession");
    let claimed = stop.bound(&claiming, START_PATIENCE, asked, || Owner::claim(domain));
    claimed.map_err(|error| match error {
        OwnerError::InUse { .. } => Ending::with_causes(ExitCode::Occupied, error),
        _ => Ending::with_causes(ExitCode::Start, error),
    })
}

fn serve(domain: &DomainName) -> Result<(), Ending> {
    let stop = Stop::on_signals().map_err(|error| Ending::with_causes(ExitCode::Start, error))?;
    let owner = claim(domain, &stop, ExitCode::Done)?;
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
