//! What a row of the problem says, for people.

use pattern::{PhaseKind, Side};
use std::fmt;

/// Which ZMP a row keeps in its polygon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZmpOf {
    /// The robot's, in single support.
    Robot,
    /// Foot 1's, in double support.
    Foot1,
    /// Foot 2's, in double support.
    Foot2,
}

/// What a row says, for people.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowLabel {
    /// A ZMP inside the shrunk sole.
    Zmp {
        /// Whose.
        of: ZmpOf,
        /// Index of the phase.
        phase: usize,
        /// Part of the walk.
        kind: PhaseKind,
        /// The swing that the phase carries out, prepares or follows.
        step: u32,
        /// The foot whose sole it is.
        foot: Side,
        /// Walk time (s).
        time_s: f64,
        /// 0: along the foot, 1: across.
        direction: usize,
    },
    /// Distance along the stance foot.
    StepLength {
        /// Landing.
        step: u32,
    },
    /// Distance between inner edges.
    FeetGap {
        /// Landing.
        step: u32,
    },
    /// Distance across the stance foot.
    StepWidth {
        /// Landing.
        step: u32,
    },
    /// The COM's velocity does not jump; at both ends it is zero.
    ComVelocity {
        /// Walk time (s).
        time_s: f64,
    },
}

impl fmt::Display for RowLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Zmp { of, phase, kind, step, foot, time_s, direction } => {
                let whose = match of {
                    ZmpOf::Robot => "ZMP",
                    ZmpOf::Foot1 => "ZMP of foot 1",
                    ZmpOf::Foot2 => "ZMP of foot 2",
                };
                let direction = if *direction == 0 { "along" } else { "across" };
                write!(
                    f,
                    "{whose} {direction} the {foot:?} sole at {time_s:.3} s (step {step}, {kind:?}, phase {phase})"
                )
            }
            Self::StepLength { step } => write!(f, "length of step {step}"),
            Self::FeetGap { step } => write!(f, "gap between the feet at step {step}"),
            Self::StepWidth { step } => write!(f, "width of step {step}"),
            Self::ComVelocity { time_s } => write!(f, "COM velocity at {time_s:.3} s"),
        }
    }
}
