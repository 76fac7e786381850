//! Why there is no whole-body step.

use multibody::ModelError;
use ranges::OutOfRange;
use thiserror::Error;

/// Model and settings do not fit together.
#[derive(Debug, Error)]
pub enum WholeBodyError {
    /// A name in the settings is not in the model (or its joint is locked): correct the settings.
    #[error("whole-body settings: {0}")]
    Unknown(#[from] ModelError),
    /// The controller needs a floating base.
    #[error("whole-body control needs a model with a floating base")]
    FixedBase,
    /// A collision pair names a capsule that is not in the list.
    #[error(
        "whole-body settings: `collision_pairs` names the unknown capsule `{name}`: add the capsule or remove the pair"
    )]
    UnknownCapsule {
        /// The name.
        name: String,
    },
    /// A collision pair names one capsule twice: its distance from itself means nothing.
    #[error("whole-body settings: `collision_pairs` pairs the capsule `{name}` with itself: remove the pair")]
    PairOfOne {
        /// The name.
        name: String,
    },
    /// A setting is outside of what has a meaning, or does not fit another one.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
}
