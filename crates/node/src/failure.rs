//! Why a process ends before its time.

use crate::exit::ExitCode;
use messages::code::{Process, Reason};
use std::error::Error;
use std::path::{Path, PathBuf};

/// A process cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The configuration cannot be read.
    #[error(transparent)]
    Configuration(#[from] scenario::ConfigError),
    /// The configuration can be read, but nothing can be built from it; the source says why.
    #[error("the configuration {}cannot be used", file.as_ref().map(|file| format!("{} ", file.display())).unwrap_or_default())]
    Unusable {
        /// The file, once it is known.
        file: Option<PathBuf>,
        /// What is wrong.
        source: Box<dyn Error + Send + Sync>,
    },
    /// There is no domain to belong to.
    #[error(transparent)]
    Join(#[from] bus::JoinError),
    /// A topic cannot be published or subscribed to.
    #[error(transparent)]
    Port(#[from] bus::PortError),
    /// The owner of the domain went away.
    #[error("the owner of domain `{domain}` went away")]
    OwnerGone {
        /// The domain.
        domain: String,
    },
    /// Publishing failed.
    #[error(transparent)]
    Publish(#[from] bus::PublishError),
    /// Receiving failed.
    #[error(transparent)]
    Receive(#[from] bus::ReceiveError),
    /// Something else failed while running; the source says what.
    #[error("cannot go on")]
    Running(#[source] Box<dyn Error + Send + Sync>),
    /// Somebody needed has died.
    #[error("the {process} died, and without `{topic}` there is no going on")]
    PeerDied {
        /// Who.
        process: Process,
        /// What was awaited from it.
        topic: &'static str,
    },
    /// Going on would not be safe.
    #[error("safety stop: {reason}")]
    SafetyStop {
        /// Why.
        reason: Reason,
        /// What exactly.
        source: Box<dyn Error + Send + Sync>,
    },
    /// What shall be kept cannot be stored: the disk is full or fails.
    #[error("storage failed")]
    Storage(#[source] Box<dyn Error + Send + Sync>),
    /// The system does not grant what running by the clock needs, and that was demanded.
    #[error("--require-real-time: {}", refused.join("; "))]
    Rights {
        /// What was refused, and what to grant.
        refused: Vec<String>,
    },
    /// Too many deadlines were missed.
    #[error("{misses} deadlines in a row were missed")]
    Deadline {
        /// How many.
        misses: u64,
    },
}

impl Failure {
    /// The configuration was read, but nothing can be built from it.
    pub fn unusable(source: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Unusable { file: None, source: source.into() }
    }

    /// The same, with the file in which the configuration stands.
    pub(crate) fn in_file(self, path: &Path) -> Self {
        match self {
            Self::Unusable { file: None, source } => Self::Unusable { file: Some(path.to_path_buf()), source },
            other => other,
        }
    }

    /// Something failed while running.
    pub fn running(source: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Running(source.into())
    }

    /// Going on would not be safe.
    pub fn safety(reason: Reason, source: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::SafetyStop { reason, source: source.into() }
    }

    /// The process's exit code.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Configuration(_) | Self::Unusable { .. } | Self::Receive(bus::ReceiveError::OtherRobot { .. }) => {
                ExitCode::Configuration
            }
            Self::Publish(_) | Self::Receive(_) | Self::Running(_) => ExitCode::Failed,
            Self::Join(bus::JoinError::Occupied { .. }) => ExitCode::Occupied,
            Self::Join(_) | Self::Port(_) | Self::OwnerGone { .. } | Self::Rights { .. } => ExitCode::Start,
            Self::SafetyStop { reason: Reason::NotSettled, .. } => ExitCode::NotSettled,
            Self::PeerDied { .. } | Self::SafetyStop { .. } => ExitCode::SafetyStop,
            Self::Deadline { .. } => ExitCode::Deadlines,
            Self::Storage(_) => ExitCode::Recording,
        }
    }

    /// What health says about it.
    pub fn reason(&self) -> Reason {
        match self {
            Self::SafetyStop { reason, .. } => *reason,
            Self::PeerDied { .. } => Reason::InputMissing,
            Self::Receive(bus::ReceiveError::OtherRobot { .. }) => Reason::OtherRobot,
            Self::Deadline { .. } => Reason::Deadline,
            Self::Storage(_) => Reason::Storage,
            _ => Reason::None,
        }
    }

    /// The failure and what caused it, as one sentence.
    pub fn chain(&self) -> String {
        error_chain(self)
    }
}

/// An error and what caused it, as one sentence.
pub fn error_chain(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        // Some errors say their source's words in their own message; once is enough.
        let words = cause.to_string();
        if !text.contains(&words) {
            text = format!("{text}: {words}");
        }
        source = cause.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exit_codes_and_reasons_are_those_of_the_table() {
        let died = Failure::PeerDied { process: Process::Simulator, topic: "robot/state" };
        let no_owner = bus::JoinError::NoOwner { domain: "d".to_string(), waited: std::time::Duration::from_secs(5) };
        let (domain, id) = ("d".to_string(), "4711".to_string());
        let occupied = bus::JoinError::Occupied { domain, process: Process::Controller, id };
        let no_key = "x".parse::<scenario::Setting>().expect_err("no setting");
        for (failure, code, reason) in [
            (Failure::running("a disk"), ExitCode::Failed, Reason::None),
            (
                Failure::Publish(bus::PublishError::PatternTooLong { found: 2, limit: 1 }),
                ExitCode::Failed,
                Reason::None,
            ),
            (Failure::Receive(bus::ReceiveError::Wait { topic: "t" }), ExitCode::Failed, Reason::None),
            (Failure::unusable(no_key), ExitCode::Configuration, Reason::None),
            (
                Failure::Receive(bus::ReceiveError::OtherRobot { topic: "t", expected: 7, found: 8 }),
                ExitCode::Configuration,
                Reason::OtherRobot,
            ),
            (Failure::Join(no_owner), ExitCode::Start, Reason::None),
            (Failure::Join(occupied), ExitCode::Occupied, Reason::None),
            (Failure::OwnerGone { domain: "d".to_string() }, ExitCode::Start, Reason::None),
            (Failure::Rights { refused: vec!["a core".to_string()] }, ExitCode::Start, Reason::None),
            (died, ExitCode::SafetyStop, Reason::InputMissing),
            (Failure::safety(Reason::SolverFailed, "again"), ExitCode::SafetyStop, Reason::SolverFailed),
            (Failure::Deadline { misses: 9 }, ExitCode::Deadlines, Reason::Deadline),
            (Failure::safety(Reason::NotSettled, "moves"), ExitCode::NotSettled, Reason::NotSettled),
            (Failure::Storage("full".into()), ExitCode::Recording, Reason::Storage),
        ] {
            assert_eq!((failure.exit_code(), failure.reason()), (code, reason), "{failure}");
        }
    }

    #[test]
    fn causes_are_told_once() {
        let cause = Failure::safety(Reason::Infeasible, "too far");
        assert_eq!(Failure::running(cause).chain(), "cannot go on: safety stop: infeasible: too far");
        let refused = std::io::Error::other("cannot go on at all");
        assert_eq!(Failure::running(refused).chain(), "cannot go on: cannot go on at all");
        let same = std::io::Error::other("go on");
        assert_eq!(Failure::running(same).chain(), "cannot go on", "its words are there already");
    }

    #[test]
    fn what_cannot_be_used_names_its_file_once_it_is_known() {
        let failure = Failure::unusable("gain = -1");
        assert_eq!(failure.chain(), "the configuration cannot be used: gain = -1");
        let failure = failure.in_file(Path::new("a.toml")).in_file(Path::new("b.toml"));
        assert_eq!(failure.chain(), "the configuration a.toml cannot be used: gain = -1");
    }
}
