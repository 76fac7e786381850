//! What differs from process to process, and the main function they share.

use crate::arguments::Arguments;
use crate::exit::ExitCode;
use crate::failure::Failure;
use crate::shell::Shell;
use clap::{CommandFactory, FromArgMatches};
use lateness::RightsSettings;
use messages::CONTROL_PERIOD_NS;
use messages::code::{Process, Reason, State};
use scenario::Config;
use serde::de::DeserializeOwned;
use std::ffi::OsString;

/// One process.
pub trait Program: Sized {
    /// Which.
    const PROCESS: Process;
    /// What it does, in one sentence.
    const ABOUT: &'static str;
    /// What its configuration file holds.
    type Settings: DeserializeOwned;
    /// From a tick's time, until when the answer must be out (ns): later, nobody uses it.
    const ANSWER_DEADLINE_NS: u64 = CONTROL_PERIOD_NS;

    /// Builds everything that needs no other process. `--check` ends after it.
    ///
    /// # Errors
    /// [`Failure::unusable`] with the reason.
    fn build(settings: Self::Settings) -> Result<Self, Failure>;

    /// What it asks of the system with `--real-time`: section `[real_time]` of its configuration.
    fn rights(_settings: &Self::Settings) -> RightsSettings {
        RightsSettings::default()
    }

    /// Fingerprint of the robot, whose messages alone are taken; `None`: any robot's.
    fn robot_fingerprint(&self) -> Option<u64>;

    /// What it models, one part a line, for `--check`: a person sees what a scene is made of without running it.
    fn models(&self) -> Vec<String> {
        Vec::new()
    }

    /// Works until the work is done or it is asked to stop.
    ///
    /// # Errors
    /// Whatever keeps it from going on.
    fn run(&mut self, shell: &mut Shell) -> Result<End, Failure>;
}

/// How the work ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// It was asked to stop.
    Asked,
    /// The walk is over, and how; the process stays until it is asked to stop, so that all hear of it.
    Over(Reason),
}

/// The main function of a process.
pub fn main<P: Program>() -> std::process::ExitCode {
    run::<P>(std::env::args_os()).into()
}

/// The main function with given arguments (the first is the program's name); returns how it ended.
pub fn run<P: Program>(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let name = format!("soleus-{}", P::PROCESS.word());
    let command = Arguments::command().name(name.clone()).bin_name(name).about(P::ABOUT);
    let arguments = command.try_get_matches_from(arguments).and_then(|matches| Arguments::from_arg_matches(&matches));
    let arguments = match arguments {
        Ok(arguments) => arguments,
        Err(answer) => {
            // Help, version or what is wrong; where it cannot be written nobody is there to read it.
            let _ = answer.print();
            return if answer.use_stderr() { ExitCode::Configuration } else { ExitCode::Done };
        }
    };
    crate::keep_files_private();
    crate::start_diagnostics(arguments.log_format);
    match run_with::<P>(&arguments) {
        Ok(()) => {
            crate::diagnostics::flush();
            ExitCode::Done
        }
        Err(failure) => {
            tracing::error!("{}: {}", P::PROCESS, failure.chain());
            crate::diagnostics::flush();
            failure.exit_code()
        }
    }
}

fn run_with<P: Program>(arguments: &Arguments) -> Result<(), Failure> {
    let config = Config::read(&arguments.config)?.with_settings(&arguments.settings);
    let settings: P::Settings = config.parse()?;
    let rights = P::rights(&settings);
    let checked = rights.check().map_err(Failure::unusable).and_then(|()| P::build(settings));
    let mut program = checked.map_err(|failure| failure.in_file(&arguments.config))?;
    if arguments.check {
        let models: String = program.models().iter().map(|model| format!("# {model}\n")).collect();
        return crate::say(&format!("{models}{}", config.effective_text())).map_err(Failure::running);
    }
    let opened = Shell::open(P::PROCESS, program.robot_fingerprint(), arguments, &rights, P::ANSWER_DEADLINE_NS);
    // Who came as the owner left may have made what nobody else knows of.
    let mut shell = opened.inspect_err(|_| bus::remove_abandoned(&arguments.domain))?;
    let end = program.run(&mut shell);
    let result = match end {
        Ok(End::Asked) => shell.announce(State::Stopping, Reason::Asked),
        Ok(End::Over(reason)) => shell.linger(reason),
        Err(failure) => {
            // The failure itself is what the caller must hear of, not that it could not be announced.
            let _ = shell.announce(State::Stopping, failure.reason());
            Err(failure)
        }
    };
    if result.is_err() {
        shell.domain().ends_badly();
    }
    drop((program, shell));
    bus::remove_abandoned(&arguments.domain);
    result
}
