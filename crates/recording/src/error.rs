//! What may go wrong.

use std::path::PathBuf;
use thiserror::Error;

/// Messages and written schema do not fit together: a mistake in this build, found by its tests.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum SchemaError {
    /// The schema lacks a message.
    #[error("proto/soleus.proto has no message `{message}`")]
    NoMessage {
        /// Which.
        message: String,
    },
    /// The schema lacks a field.
    #[error("proto/soleus.proto has no field `{message}.{field}`")]
    NoField {
        /// Of which message.
        message: String,
        /// Which.
        field: String,
    },
    /// A field has another type in the schema.
    #[error("`{message}.{field}` has another type in proto/soleus.proto")]
    OtherType {
        /// Of which message.
        message: String,
        /// Which.
        field: String,
    },
    /// The schema has a field that the message lacks.
    #[error("`{message}.{field}` is in proto/soleus.proto only")]
    Unused {
        /// Of which message.
        message: String,
        /// Which.
        field: String,
    },
}

/// A recording cannot be written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The file cannot be made or renamed.
    #[error("cannot write {}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Writing failed: disk full?
    #[error("cannot write to the recording (is the disk full?)")]
    Mcap(#[from] mcap::McapError),
    /// See there.
    #[error(transparent)]
    Schema(#[from] SchemaError),
}

/// A recording cannot be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The file cannot be read.
    #[error("cannot read {}: check the path", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is no MCAP file, or one that was not finished: `recover` it.
    #[error("{} is no finished recording", path.display())]
    Mcap {
        /// Which.
        path: PathBuf,
        /// What is wrong.
        source: mcap::McapError,
    },
    /// It has messages of a version this build does not know.
    #[error("{} has `{topic}` as {found}, this build knows {expected}", path.display())]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// Schema in the file.
        found: String,
        /// Ours.
        expected: &'static str,
    },
    /// A message is damaged.
    #[error("{}: message {index} of `{topic}` is damaged", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// Which of the topic, from zero.
        index: usize,
    },
    /// See there.
    #[error(transparent)]
    Schema(#[from] SchemaError),
}
