//! How a process ends: the one table of exit codes.

/// The exit codes of all processes and of the launcher. What `--help` and the documents say of them, and which of several endings is
/// the cause of the others, follows from this table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ExitCode {
    /// It did what it was asked to, or was asked to stop.
    Done,
    /// What it was asked for did not come about.
    Failed,
    /// It cannot be done as it was asked for.
    Configuration,
    /// It could not begin.
    Start,
    /// Going on would not have been safe.
    SafetyStop,
    /// It was too late too often.
    Deadlines,
    /// The robot did not stand still.
    NotSettled,
    /// Another one of its kind lives.
    Occupied,
    /// It, or one that it looks after, said nothing any more.
    Hung,
    /// The recording is not whole.
    Recording,
    /// The walk came to its end, but it is not the one that was planned.
    NotWalked,
    /// It broke down.
    Bug,
    /// Somebody pressed Ctrl-C.
    Interrupted,
}

impl ExitCode {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 13] = [
        Self::Done,
        Self::Failed,
        Self::Configuration,
        Self::Start,
        Self::SafetyStop,
        Self::Deadlines,
        Self::NotSettled,
        Self::Occupied,
        Self::Hung,
        Self::Recording,
        Self::NotWalked,
        Self::Bug,
        Self::Interrupted,
    ];

    /// The number that the system is told.
    pub const fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::Configuration => 2,
            Self::Start => 3,
            Self::SafetyStop => 4,
            Self::Deadlines => 5,
            Self::NotSettled => 6,
            Self::Occupied => 7,
            Self::Hung => 8,
            Self::Recording => 9,
            Self::NotWalked => 10,
            // As the language has it.
            Self::Bug => 101,
            // As shells have it: 128 and the number of SIGINT.
            Self::Interrupted => 130,
        }
    }

    /// The meaning of a number, if it has one here.
    pub fn from_code(code: i32) -> Option<Self> {
        Self::ALL.into_iter().find(|exit| i32::from(exit.code()) == code)
    }

    /// How far an ending is from what went wrong first, among several of one launch: that with the smallest rank is the cause.
    pub const fn rank(self) -> u8 {
        match self {
            Self::Configuration | Self::Occupied => 0,
            Self::Failed
            | Self::Bug
            | Self::Deadlines
            | Self::NotSettled
            | Self::Hung
            | Self::Recording
            | Self::NotWalked => 1,
            Self::Start => 2,
            Self::SafetyStop => 3,
            // The rest is not the cause of anything.
            Self::Interrupted | Self::Done => 4,
        }
    }

    /// The table in one paragraph, for `--help`.
    pub fn help(codes: &[Self]) -> String {
        let codes: Vec<String> = codes.iter().map(|exit| format!("{} {exit}", exit.code())).collect();
        format!("Exit codes: {}.", codes.join("; "))
    }
}

impl std::fmt::Display for ExitCode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Done => "done, or asked to stop",
            Self::Failed => "failed: the robot fell, a replay differs, or a file or shared memory failed while running",
            Self::Configuration => "arguments, scenario or configuration wrong, or not of the robot of the others",
            Self::Start => "could not start: no owner of the domain (soleus-launch serve), no memory, no permission",
            Self::SafetyStop => "safety stop: an input stayed away, a solver failed too often, a process was killed",
            Self::Deadlines => "behind: deadlines missed too often",
            Self::NotSettled => "the robot did not settle: it did not stand still enough to walk",
            Self::Occupied => "a living process of its kind is in the domain already",
            Self::Hung => "hung: a process said nothing for longer than it may",
            Self::Recording => "the recording is not whole: broken off, or messages lost",
            Self::NotWalked => "not walked: the end was reached, but not as planned",
            Self::Bug => "a bug (panic)",
            Self::Interrupted => "interrupted (Ctrl-C)",
        })
    }
}

impl From<ExitCode> for std::process::ExitCode {
    fn from(exit: ExitCode) -> Self {
        Self::from(exit.code())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_meanings_are_one_to_one() {
        for exit in ExitCode::ALL {
            assert_eq!(ExitCode::from_code(exit.code().into()), Some(exit));
        }
        assert!(ExitCode::ALL.is_sorted_by(|one, next| one.code() < next.code()));
        assert_eq!(ExitCode::from_code(11), None);
    }

    #[test]
    fn the_documents_have_this_table() {
        let documents = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reliability.md");
        let text = std::fs::read_to_string(documents).expect("it ships");
        let row = |exit: ExitCode| format!("| {} | {exit} |\n", exit.code());
        let table: String = ExitCode::ALL.into_iter().map(row).collect();
        assert!(text.contains(&table), "docs/reliability.md lacks\n{table}");
    }
}
