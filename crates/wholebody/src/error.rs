use crate::settings::Limit;
use multibody::ModelError;
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
    /// The order of giving way names a kind of limit twice.
    #[error("whole-body settings: `relaxation.order` lists {limit} twice: keep the first")]
    ListedTwice {
        /// The kind.
        limit: Limit,
    },
    /// A setting is outside of what has a meaning: change it as the remedy says.
    #[error("whole-body settings: `{setting}` is {found}, must be {expected}: {remedy}")]
    Setting {
        /// The key as `controller.toml` or `robot.toml` spells it.
        setting: String,
        /// What was found.
        found: f64,
        /// What is allowed.
        expected: String,
        /// What is usual, or where to correct it.
        remedy: &'static str,
    },
}
