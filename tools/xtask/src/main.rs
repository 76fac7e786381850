//! All checks and chores.
//!
//! `cargo xtask check` is what must pass before anything is merged, the same locally and in CI; `cargo walk` is what a newcomer
//! types first.

mod check;
mod circles;
mod dist;
mod faults;
mod fuzz;
mod latency;
mod licenses;
mod metadata;
mod readme;
mod rules;
mod target_cpu;
mod walk;
mod walks;

use clap::{Parser, Subcommand};
use std::ffi::OsString;

#[derive(Debug, Parser)]
#[command(name = "xtask", about = "All checks and chores.")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Format, dependency rules, licences, spelling, lints, documentation, tests, release build.
    Check,
    /// Dependency rules and licences only.
    Rules,
    /// Damage every kind of file that is read, many times: errors, never panics, within bounded memory and time.
    Fuzz {
        /// Damaged files of each kind.
        #[arg(long, default_value_t = 20_000)]
        cases: u64,
    },
    /// The fault campaign: short walks, each with one fault of a control PC at a random instant.
    Faults {
        /// How many walks.
        #[arg(long, default_value_t = 500)]
        walks: u64,
        /// Where the random instants begin; a failure prints the one to repeat it with `--walks 1`.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Lateness by the clock, judged against what the machine can do: `--rounds 6 --seconds 30 --load none|stress --absolute` (in release;
    /// `-- --help` has all options). Ends with 77 where the machine is unusable.
    Latency {
        /// Options of `soleus-latency campaign`.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Speed against error by the clock: a walk per level of soles, patches and friction cone, one table (in release).
    Levels {
        /// Options of `soleus-latency levels`.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Pack what somebody needs who has no Rust: an archive and, where dpkg-deb is there, a Debian package, in target/dist.
    Dist(dist::Arguments),
    /// Compare choices of `target-cpu` on the benchmarks of the hot paths.
    TargetCpu,
    /// Build everything in release and walk a scenario: `cargo walk SCENARIO OPTIONS`, both optional; the options are soleus-launch's.
    Walk {
        /// A scenario file or the name of one in config/scenarios, then options of soleus-launch.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Walk the lists in docs/walks and write their tables into docs/walks.md: some minutes each.
    Walks {
        /// Names of lists; all without any.
        names: Vec<String>,
    },
}

fn main() -> anyhow::Result<()> {
    match Arguments::parse().task {
        Task::Check => check::all(),
        Task::Rules => check::rules_and_licenses(),
        Task::Faults { walks, seed } => faults::campaign(walks, seed),
        Task::Fuzz { cases } => fuzz::fuzz(cases),
        Task::Latency { arguments } => latency::measure("campaign", &arguments),
        Task::Levels { arguments } => latency::measure("levels", &arguments),
        Task::Dist(arguments) => dist::dist(&arguments),
        Task::TargetCpu => target_cpu::compare(),
        Task::Walk { arguments } => walk::walk(&arguments),
        Task::Walks { names } => walks::walks(&names),
    }
}
