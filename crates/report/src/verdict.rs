//! Whether a walk was what was planned.

use serde::{Deserialize, Serialize};

/// How a walk is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The plan then valid was walked to its end, and the real zero-moment point stayed near enough to the planned one.
    Walked,
    /// The plan was played to its end without a fall, but the zero-moment point was farther from it than allowed: the robot was
    /// elsewhere than it was thought to be.
    OffPlan,
    /// The robot fell.
    Fell,
    /// The walk was not begun, or ended before its plan did.
    EndedEarly,
    /// The plan was played to its end, but nothing says what the robot really did: a recording without truth.
    Unjudged,
}

impl Verdict {
    /// A word for people.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Walked => "walked to the end",
            Self::OffPlan => "walked, but off its plan",
            Self::Fell => "fell",
            Self::EndedEarly => "ended early",
            Self::Unjudged => "played to the end; no truth to judge by",
        }
    }

    /// Whether it is what was wanted, as far as one can know.
    #[must_use]
    pub fn is_good(self) -> bool {
        matches!(self, Self::Walked | Self::Unjudged)
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.word())
    }
}
