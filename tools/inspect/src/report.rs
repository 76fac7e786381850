//! The page of a recording, and of two at once.

use crate::door::Outcome;
use ::report::{LogLine, Page, PageSettings};
use anyhow::Context;
use clap::Args;
use messages::code::Process;
use recording::Recording;
use std::path::{Path, PathBuf};

/// One recording.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The recording.
    #[arg(value_name = "RUN.mcap")]
    recording: PathBuf,
    #[command(flatten)]
    output: Output,
}

/// Two recordings.
#[derive(Debug, Args)]
pub struct CompareArguments {
    /// The first recording, A.
    #[arg(value_name = "A.mcap")]
    first: PathBuf,
    /// The second recording, B: dotted in the figures, a shadow in the replay.
    #[arg(value_name = "B.mcap")]
    second: PathBuf,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, Args)]
struct Output {
    /// The page [default: report.html beside the first recording, compare.html for two]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Show the walk from this walk time on (s).
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Show the walk until this walk time (s).
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    to: Option<f64>,
}

impl Output {
    fn settings(&self) -> PageSettings {
        PageSettings { from_s: self.from, to_s: self.to }
    }

    /// Writes the page; says where it is and how the walks are judged.
    fn write(&self, page: &Page, beside: &Path, name: &str) -> anyhow::Result<Outcome> {
        let path = self.output.clone().unwrap_or_else(|| beside.with_file_name(name));
        std::fs::write(&path, &page.html).with_context(|| format!("cannot write {}", path.display()))?;
        for figures in &page.figures {
            println!("{}: {}", figures.verdict, figures.verdict_reason);
        }
        println!("{}", path.display());
        Ok(Outcome::Solved)
    }
}

/// Makes the page of a recording.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let recording = Recording::open(&arguments.recording)?;
    let logs = logs_beside(&arguments.recording);
    let page = ::report::page(&recording, &name(&arguments.recording), &logs, &arguments.output.settings())?;
    arguments.output.write(&page, &arguments.recording, "report.html")
}

/// Makes the page of two recordings.
pub fn compare(arguments: &CompareArguments) -> anyhow::Result<Outcome> {
    let (first, second) = (Recording::open(&arguments.first)?, Recording::open(&arguments.second)?);
    let names = [name(&arguments.first), name(&arguments.second)];
    let pair = [(&first, names[0].as_str()), (&second, names[1].as_str())];
    let page = ::report::compare(pair, &arguments.output.settings())?;
    arguments.output.write(&page, &arguments.first, "compare.html")
}

/// What the processes of a run said, if the recording still lies in the run's folder.
fn logs_beside(recording: &Path) -> Vec<LogLine> {
    let log = |process: &Process| {
        let path = recording.with_file_name("logs").join(format!("{process}.log"));
        // A log that cannot be read is one that is not there: the page is of the recording.
        let text = std::fs::read(path).unwrap_or_default();
        ::report::log_lines(process.word(), &String::from_utf8_lossy(&text))
    };
    Process::ALL.iter().flat_map(log).collect()
}

/// What a recording is called: the run's folder, else the file.
fn name(path: &Path) -> String {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let folder = absolute.parent().and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
    let file = absolute.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    match (folder, file.as_str()) {
        (Some(folder), "walk") => folder,
        _ => file,
    }
}
