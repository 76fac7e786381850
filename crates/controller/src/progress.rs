//! How far the controller has come.

use messages::{SoleDeformation, WalkStart};
use pattern::WalkPattern;
use state::InternalState;

/// A pattern, and the hash by which messages name it.
pub(crate) struct Planned {
    pub hash: u64,
    pub pattern: WalkPattern,
}

/// What there is to go by. A step leads from one to the next; a new pattern leads back to [`Planned`](Self::Planned) until the walk has a
/// start, and is not used from then on.
pub(crate) enum Progress {
    /// No pattern has come. Nothing is said.
    Waiting,
    /// A pattern has come, but no deformation of the soles for it: where the walk begins is not known. Nothing is said.
    Planned(Planned),
    /// The internal state stands where the walk begins, or walks. Every tick has a command.
    Tracking(Box<Tracking>),
}

/// All that a tick goes by once there are a pattern and soles.
pub(crate) struct Tracking {
    pub planned: Planned,
    /// What the step starts from.
    pub internal: InternalState,
    /// The last one that was usable.
    pub deformation: SoleDeformation,
    /// What stands in for that of this tick: itself, or where it has moved to.
    pub used: SoleDeformation,
    /// Time zero, once the robot has stood still for long enough.
    pub start: Option<WalkStart>,
}

impl Progress {
    /// The pattern, once there is one.
    pub fn planned(&self) -> Option<&Planned> {
        match self {
            Self::Waiting => None,
            Self::Planned(planned) => Some(planned),
            Self::Tracking(tracking) => Some(&tracking.planned),
        }
    }

    /// Whether another pattern may still be taken.
    pub fn has_start(&self) -> bool {
        matches!(self, Self::Tracking(tracking) if tracking.start.is_some())
    }
}
