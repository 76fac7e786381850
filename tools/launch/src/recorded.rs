//! Whether the recording of a launch is whole.

use crate::Ending;
use crate::process::Supervised;
use messages::code::{Process, Reason};
use messages::{Health, code};
use node::ExitCode;

/// What became of the recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recorded {
    /// Nobody was asked to record.
    Not,
    /// All is in it.
    Complete,
    /// So many messages are missing in it.
    Lost(u64),
    /// Its end is missing.
    BrokenOff,
}

impl Recorded {
    /// By how the recorder ended, and what it said last.
    pub fn of(children: &mut [Supervised], last: Option<&Health>) -> Self {
        let Some(recorder) = children.iter_mut().find(|child| child.process == Process::Recorder) else {
            return Self::Not;
        };
        let in_order = recorder.ended().is_some_and(|status| status.success());
        let failed = last.is_some_and(|health| code::Reason::from_code(health.reason) == Some(Reason::Storage));
        match last.map_or(0, |health| health.lost) {
            _ if !in_order || failed => Self::BrokenOff,
            0 => Self::Complete,
            lost => Self::Lost(lost),
        }
    }

    /// What a recording that is not whole means for a launch that is well otherwise. By the clock the recorder may lose messages rather
    /// than delay anybody.
    pub fn ending(self, real_time: bool) -> Option<Ending> {
        let broken = match self {
            Self::BrokenOff => true,
            Self::Lost(_) => !real_time,
            Self::Complete | Self::Not => false,
        };
        broken.then(|| {
            Ending::new(ExitCode::Recording, format!("the recording is not whole: {self} (see the recorder's log)"))
        })
    }
}

impl std::fmt::Display for Recorded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Not => f.write_str("none"),
            Self::Complete => f.write_str("complete"),
            Self::Lost(count) => write!(f, "{count} messages lost"),
            Self::BrokenOff => f.write_str("broken off"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_whole_recording_is_a_good_end() {
        for (recorded, real_time, bad) in [
            (Recorded::Complete, false, false),
            (Recorded::Not, false, false),
            (Recorded::Lost(3), false, true),
            (Recorded::Lost(3), true, false),
            (Recorded::BrokenOff, true, true),
        ] {
            let ending = recorded.ending(real_time);
            assert_eq!(ending.is_some(), bad, "{recorded}");
            assert!(ending.is_none_or(|ending| ending.code == ExitCode::Recording));
        }
        assert_eq!(Recorded::Lost(3).to_string(), "3 messages lost");
    }
}
