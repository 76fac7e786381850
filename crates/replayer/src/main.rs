//! Runs one process again from a recording and compares what it says with what it said then.
//!
//! Its exit codes are those of all processes ([`node::ExitCode`]): 1 says that something is different.
#![allow(clippy::print_stdout, reason = "the comparison is what a replay is asked for")]

use clap::{Parser, ValueEnum};
use messages::code::Process;
use node::{ExitCode, LogFormat, Stop};
use recording::Recording;
use replayer::{Comparison, Inputs, Keeper, ReplayError, Replayable, Said, Unpacked, replay, replayed_info};
use scenario::{Config, Setting};
use soles::Store;
use std::error::Error;
use std::path::{Path, PathBuf};

/// How a replay may end.
const CODES: [ExitCode; 6] = [
    ExitCode::Done,
    ExitCode::Failed,
    ExitCode::Configuration,
    ExitCode::Start,
    ExitCode::Recording,
    ExitCode::Interrupted,
];

/// Runs one process again from a recording and compares what it says with what it said then.
#[derive(Debug, Parser)]
#[command(name = "soleus-replayer", version = node::VERSION)]
#[command(after_help = ExitCode::help(&CODES))]
struct Arguments {
    /// The recording.
    #[arg(value_name = "RUN.mcap")]
    recording: PathBuf,

    /// The process to be run again.
    #[arg(long, value_enum)]
    process: Name,

    /// Its configuration, in place of the one it had in the run (which is attached to the recording).
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Change a key of its configuration (may be repeated): tasks.com.weight=2e4.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<Setting>,

    /// Take numbers as equal that differ by at most this part of the larger of their size and 1 (another build, another processor).
    #[arg(long, value_name = "T", default_value_t = 0.0, value_parser = tolerance)]
    tolerance: f64,

    /// Keep what it says as a recording of its own.
    #[arg(long, value_name = "FILE.mcap")]
    out: Option<PathBuf>,

    /// Replace the file of --out if there is one.
    #[arg(long, requires = "out")]
    overwrite: bool,

    /// How diagnostics are written to standard error.
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Name {
    Planner,
    Estimator,
    Controller,
    Simulator,
}

impl From<Name> for Replayable {
    fn from(name: Name) -> Self {
        match name {
            Name::Planner => Self::Planner,
            Name::Estimator => Self::Estimator,
            Name::Controller => Self::Controller,
            Name::Simulator => Self::Simulator,
        }
    }
}

fn tolerance(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is no number"))?;
    if (0.0..1.0).contains(&value) { Ok(value) } else { Err("must be at least 0 and less than 1".to_string()) }
}

fn main() -> std::process::ExitCode {
    let arguments = Arguments::parse();
    node::start_diagnostics(arguments.log_format);
    let exit = match run(&arguments) {
        Ok(comparison) => {
            print!("{}", table(&comparison));
            let exact = arguments.tolerance == 0.0;
            let same = if exact { comparison.identical() } else { comparison.within(arguments.tolerance) };
            if same { ExitCode::Done } else { ExitCode::Failed }
        }
        Err((code, error)) => {
            tracing::error!("{}", node::error_chain(error.as_ref()));
            code
        }
    };
    exit.into()
}

type Stopped = (ExitCode, Box<dyn Error>);

fn run(arguments: &Arguments) -> Result<Comparison, Stopped> {
    let wrong = |error: ReplayError| -> Stopped {
        let asked = matches!(error, ReplayError::Asked);
        (if asked { ExitCode::Interrupted } else { ExitCode::Configuration }, error.into())
    };
    // Asked for by a signal it ends in an orderly way: what it has unpacked goes with it.
    let stop = Stop::on_signals().map_err(|error| -> Stopped { (ExitCode::Start, error.into()) })?;
    let unwritten = |error: recording::WriteError| -> Stopped { (ExitCode::Recording, error.into()) };
    let process = Replayable::from(arguments.process);
    let recording = Recording::open(&arguments.recording).map_err(|error| wrong(error.into()))?;
    tell_of_another_build(&recording).map_err(wrong)?;
    let inputs = Inputs::of(&recording, process.into()).map_err(wrong)?;
    let unpacked = Unpacked::new(&recording).map_err(wrong)?;
    let config = match &arguments.config {
        Some(file) => Config::read(file).map_err(|error| wrong(error.into()))?,
        None => unpacked.config(process.into()).map_err(wrong)?,
    };
    let config = config.with_settings(&arguments.settings);
    let mut keeper = arguments.out.as_ref().map(|path| keep(path, &recording, arguments)).transpose()?;
    let mut store = Store::from_environment();
    let mut hear = |said: Said| {
        if let Some(keeper) = &mut keeper {
            keeper.store(&said);
        }
        if stop.asked() { Err(ReplayError::Asked) } else { Ok(()) }
    };
    let comparison = replay(process, &inputs, &config, &mut store, &mut hear).map_err(wrong);
    match (keeper, &comparison) {
        (Some(keeper), Ok(_)) => {
            let path = keeper.finish().map_err(unwritten)?;
            tracing::info!("what it says is in {}", path.display());
        }
        (Some(keeper), Err(_)) => keeper.discard(),
        (None, _) => {}
    }
    comparison
}

fn keep(path: &Path, recording: &Recording, arguments: &Arguments) -> Result<Keeper, Stopped> {
    let place = |path: &Path| path.canonicalize().ok();
    if place(path).is_some_and(|path| Some(path) == place(&arguments.recording)) {
        let error = format!("--out {}: that is the recording itself; name another file", path.display());
        return Err((ExitCode::Configuration, error.into()));
    }
    let settings: Vec<String> = arguments.settings.iter().map(ToString::to_string).collect();
    let facts = [
        ("of", arguments.recording.display().to_string()),
        ("process", Process::from(Replayable::from(arguments.process)).to_string()),
        ("settings", settings.join(" ")),
        ("version", node::VERSION.to_string()),
    ];
    let info =
        replayed_info(recording, &facts).map_err(|error| -> Stopped { (ExitCode::Configuration, error.into()) })?;
    Keeper::create(path, &info, arguments.overwrite).map_err(|error| -> Stopped { (ExitCode::Start, error.into()) })
}

/// Bits are only promised for the same build on a processor with the same vector instructions.
fn tell_of_another_build(recording: &Recording) -> Result<(), ReplayError> {
    let facts = recording.facts()?;
    for (what, ours) in [("version", node::VERSION.to_string()), ("vector_instructions", node::vector_instructions())] {
        if let Some(then) = facts.get(what).filter(|then| **then != ours) {
            tracing::warn!("recorded with {what} `{then}`, this is `{ours}`: the last digits may differ (--tolerance)");
        }
    }
    Ok(())
}

/// What came of it, for people.
fn table(comparison: &Comparison) -> String {
    use std::fmt::Write;
    let mut text = String::new();
    let mut line = |content: std::fmt::Arguments| writeln!(text, "{content}").expect("a string takes everything");
    for (topic, compared) in &comparison.topics {
        let total = compared.compared + compared.missing + compared.new;
        let same = if compared.identical == total {
            "the same to the bit".to_string()
        } else {
            format!("{} of them the same to the bit", compared.identical)
        };
        line(format_args!("{topic:<18} {total} compared, {same}"));
        if compared.missing + compared.new > 0 {
            line(format_args!("{:18} {} only said then, {} only said now", "", compared.missing, compared.new));
        }
        if let Some(tick) = compared.first_tick {
            line(format_args!("{:18} first different at tick {tick}; largest difference of each field:", ""));
        }
        for field in compared.fields.values() {
            line(format_args!(
                "{:18} {:<48} {:>10.3e} at tick {:<6} then {:.9e}, now {:.9e}",
                "",
                field.number,
                field.amount(),
                field.tick,
                field.then,
                field.now
            ));
        }
    }
    text
}
