//! What keeps a recording from being replayed.

use messages::PatternRefused;
use messages::code::Process;
use std::error::Error;
use std::path::PathBuf;

/// A recording cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] recording::ReadError),
    /// At which pace it was made is not known: which message a step had is then not in it.
    #[error("recorded at pace `{found}`: runs in `lock-step` and in `real time` can be replayed")]
    Pace {
        /// What the recording says; `?` if nothing.
        found: String,
    },
    /// A topic that the process listens to is not in it.
    #[error("no `{topic}` in the recording: the {process} cannot be run without it")]
    Missing {
        /// Which.
        topic: &'static str,
        /// Who needs it.
        process: Process,
    },
    /// Messages of a topic were lost.
    #[error(
        "`{topic}`: {lost} message(s) before tick {tick} are not in the recording, and were used: record again; in lock-step nothing is lost"
    )]
    Gap {
        /// Which.
        topic: &'static str,
        /// The first message after the gap.
        tick: i64,
        /// How many are missing.
        lost: i64,
    },
    /// The publisher of a topic was started anew in the middle.
    #[error(
        "`{topic}`: its process was restarted between tick {before} and tick {tick}, or two ran at once, which cannot be replayed"
    )]
    Restart {
        /// Which.
        topic: &'static str,
        /// The later message.
        tick: i64,
        /// The one before it.
        before: i64,
    },
    /// A file that belongs to the run was not attached.
    #[error("`{name}` is not attached to the recording: name the process's configuration with --config")]
    NotAttached {
        /// Its name in the recording.
        name: String,
    },
    /// A file is attached twice: which one the run had is not known.
    #[error("`{name}` is attached to the recording twice")]
    AttachedTwice {
        /// Its name in the recording.
        name: String,
    },
    /// It was asked to stop.
    #[error("asked to stop")]
    Asked,
    /// Its files cannot be put where the process reads them.
    #[error("cannot write {}", path.display())]
    Unpack {
        /// Where.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The configuration cannot be read.
    #[error(transparent)]
    Configuration(#[from] scenario::ConfigError),
    /// The process cannot be built from its configuration.
    #[error("the {process} cannot be built")]
    Build {
        /// Which.
        process: Process,
        /// Why.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The recorded messages are of another robot than the process was built for.
    #[error(
        "the recorded messages are of robot {recorded:016x}, the robot of the configuration is {configured:016x}: its folder or sole has changed since"
    )]
    OtherRobot {
        /// Fingerprint in the messages.
        recorded: u64,
        /// Fingerprint of what was built.
        configured: u64,
    },
    /// The pattern of the recording is not taken.
    #[error("the recorded pattern is refused")]
    Pattern(#[from] PatternRefused),
}
