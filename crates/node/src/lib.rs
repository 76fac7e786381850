//! The shell of a process: arguments, configuration, domain, pace, health, shutdown.
//!
//! A process is a library whose `step` turns messages into messages, and a `main.rs` that says with a [`Program`] what is built
//! and in which order messages are waited for and published. [`main`] does the rest, the same for all processes:
//!
//! ```text
//! soleus-NAME --config FILE [--set KEY=VALUE]... [--domain NAME] [--check] [--real-time [--require-real-time] [--walk]]
//!     [--wait-for P,Q] [--log-format F]
//! ```
//!
//! # Exit codes
//!
//! [`ExitCode`] is the table; `docs/reliability.md` prints it.
//!
//! # Pace
//!
//! *Lock-step*: whoever needs a message waits for it; time is the tick. [`Shell::wait`] sleeps until woken, and looks every 100 ms whether
//! it was asked to stop, every half a second whether the owner of the domain lives and whether the one it waits for has died. *Real time*:
//! the one who owns the [`Grid`] sleeps until absolute times; the others are woken by its state, and wait for what else they need until a
//! deadline counted from that state's stamp ([`Shell::wait_tick_until`]). Nobody waits for ever.
//!
//! ```no_run
//! use messages::{RobotState, SoleDeformation, topic, code::Process};
//! use node::{End, Failure, Program, Shell};
//!
//! struct Echo(f64);
//!
//! #[derive(serde::Deserialize)]
//! #[serde(deny_unknown_fields)]
//! struct Settings { gain: f64 }
//!
//! impl Program for Echo {
//!     const PROCESS: Process = Process::Estimator;
//!     const ABOUT: &'static str = "Answers each state.";
//!     type Settings = Settings;
//!
//!     fn build(settings: Settings) -> Result<Self, Failure> {
//!         Ok(Self(settings.gain))
//!     }
//!     fn robot_fingerprint(&self) -> Option<u64> {
//!         Some(7)
//!     }
//!     fn run(&mut self, shell: &mut Shell) -> Result<End, Failure> {
//!         let mut states = shell.subscriber(topic::ROBOT_STATE, 4)?;
//!         let mut answers = shell.publisher(topic::SOLE_DEFORMATION)?;
//!         shell.ready()?;
//!         while let Some(state) = shell.wait(&mut states)? {
//!             shell.cycle_starts();
//!             let answer = SoleDeformation { header: state.header, walk_time_s: self.0, ..Default::default() };
//!             answers.publish(&answer)?;
//!             shell.cycle_ends(state.header.tick)?;
//!         }
//!         Ok(End::Asked)
//!     }
//! }
//!
//! fn main() -> std::process::ExitCode {
//!     node::main::<Echo>()
//! }
//! ```

mod arguments;
mod diagnostics;
mod exit;
mod failure;
mod grid;
mod processor;
mod program;
mod real_time;
mod rights;
mod shell;
mod stop;
mod system;
mod teller;
mod timing;

pub use arguments::{Arguments, LogFormat, pace};
pub use diagnostics::start_diagnostics;
pub use exit::ExitCode;
pub use failure::{Failure, error_chain};
pub use grid::{Grid, Pace, believed_stamp_ns};
pub use processor::vector_instructions;
pub use program::{End, Program, main, run};
pub use real_time::clock_monotonic_ns;
pub use rights::Rights;
pub use shell::Shell;
pub use stop::{START_PATIENCE, Stop};
pub use system::{die_with_parent, interrupt, kill, pause, resume, sleep_until_ns, terminate};

/// Version and commit of this build, as `--version` prints them and logs record them.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("SOLEUS_COMMIT"), ")");

/// What this process makes from now on is its user's alone: files 0600, folders 0700.
pub fn keep_files_private() {
    rustix::process::umask(rustix::fs::Mode::RWXG | rustix::fs::Mode::RWXO);
}

/// Writes a result to standard output. Who no longer listens has what he wanted (`soleus-launch .. | head -3`); that is no error.
///
/// # Errors
/// If it cannot be written for another reason: a full disk, for instance.
pub fn say(text: &str) -> std::io::Result<()> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        said => said,
    }
}
