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
    #[error("whole-body settings: `collision.pairs` names the unknown capsule `{name}`")]
    UnknownCapsule {
        /// The name.
        name: String,
    },
    /// A setting is outside of what has a meaning.
    #[error("whole-body settings: `{setting}` is {found}, must be {expected}")]
    Setting {
        /// Path of the setting.
        setting: &'static str,
        /// What was found.
        found: f64,
        /// What is allowed.
        expected: &'static str,
    },
}
