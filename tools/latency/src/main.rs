//! `soleus-latency`: walks by the clock, beside a thread per core that does nothing but wake up, and judges lateness against it.
//!
//! A shared machine stalls for milliseconds, and a test that ignored it would fail or pass by the neighbours' weather. So every round is
//! paired with reference threads ([`lateness::reference`]): what stalled them is excused, counted and shown; a round in which the machine
//! could not have done it is invalid and repeated; a machine on which that goes on is unusable, which is neither pass nor fail (77).
//! Criteria that were not measured enough say so and are not judged.
//!
//! *Not here*: the walk in lock-step under dropped messages (A6) and killed processes (A11); they need no clock and are tests.

mod campaign;
mod criteria;
mod hlog;
mod levels;
mod load;
mod machine;
mod page;
mod threads;
mod ticks;
mod wakes;
mod walk;

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// The machine cannot show anything: too noisy, or without the rights. As `ctest` and `meson` have it: skipped.
pub const UNUSABLE: u8 = 77;

#[derive(Debug, Parser)]
#[command(name = "soleus-latency", version = node::VERSION, about = "Lateness by the clock, judged against the machine.")]
#[command(
    after_help = "Exit codes: 0 no criterion is missed; 1 one is; 2 arguments or files; 77 the machine is unusable."
)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// The latency campaign: rounds of walking, a table of verdicts, raw histograms, a page.
    Campaign(Campaign),
    /// Speed against error by the clock: one walk per level of soles, patches and friction cone, one table.
    Levels(Levels),
}

/// What a campaign consists of.
#[derive(Debug, Clone, Args)]
pub struct Campaign {
    /// Valid rounds; ratios are judged from 6 on.
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub rounds: u32,
    /// Seconds of walking per round.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(5..=7200))]
    pub seconds: u32,
    /// What runs beside it: nothing of ours, or a busy program per core and one that shovels memory.
    #[arg(long, value_enum, default_value_t = load::Load::None)]
    pub load: load::Load,
    /// Judge absolute times, as on a prepared control PC; without it everything is relative to the reference threads.
    #[arg(long)]
    pub absolute: bool,
    /// Walks of each scenario for the errors (A7).
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=20))]
    pub walks: u32,
    /// The control experiment (A13) is left out: no walk without SCHED_FIFO.
    #[arg(long)]
    pub no_control: bool,
    /// Change a key of a process's configuration (may be repeated), as soleus-launch has it.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<scenario::Setting>,
    /// Folder of the results.
    #[arg(long, value_name = "DIR", default_value = "target/latency")]
    pub out: PathBuf,
    /// Take binaries of any profile: to try the command itself. Times of such a build mean nothing.
    #[arg(long)]
    pub any_build: bool,
}

/// What the table of levels consists of.
#[derive(Debug, Clone, Args)]
pub struct Levels {
    /// Walks of each level; the table has the medians, misses are added.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=20))]
    pub walks: u32,
    /// Swings of each walk.
    #[arg(long, default_value_t = 11, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub swings: u32,
    /// Folder of the results.
    #[arg(long, value_name = "DIR", default_value = "target/levels")]
    pub out: PathBuf,
    /// Take binaries of any profile: to try the command itself.
    #[arg(long)]
    pub any_build: bool,
}

fn main() -> ExitCode {
    let (outcome, any_build) = match Arguments::parse().task {
        Task::Campaign(wanted) => {
            (refuse_debug(wanted.any_build).and_then(|()| campaign::run(&wanted)), wanted.any_build)
        }
        Task::Levels(wanted) => (refuse_debug(wanted.any_build).and_then(|()| levels::run(&wanted)), wanted.any_build),
    };
    if any_build {
        eprintln!("soleus-latency: --any-build: times of this build mean nothing");
    }
    match outcome {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            eprintln!("soleus-latency: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// Numbers of a build that checks itself would be believed.
fn refuse_debug(any_build: bool) -> anyhow::Result<()> {
    anyhow::ensure!(
        any_build || !cfg!(debug_assertions),
        "this is no release build: `cargo xtask latency` makes one (--any-build takes this one, and its times mean nothing)"
    );
    Ok(())
}

/// A line of progress.
pub fn progress(line: &str) {
    eprintln!("== {line}");
}
