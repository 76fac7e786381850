//! What may go wrong.

use crate::record::Broken;
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
    /// There is something of this name. Remedy: another name, or ask for it to be replaced.
    #[error("{} exists and is not replaced: choose another name, move it away, or ask for `overwrite`", path.display())]
    Exists {
        /// Which.
        path: PathBuf,
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
    /// There is nothing in it.
    #[error("{} is empty: nothing was recorded", path.display())]
    Empty {
        /// Which.
        path: PathBuf,
    },
    /// It is of another format.
    #[error("{} is no MCAP file (it begins with `{begin}`): is it a recording?", path.display())]
    Foreign {
        /// Which.
        path: PathBuf,
        /// Its first bytes.
        begin: String,
    },
    /// It was not finished. Remedy: recover it.
    #[error(
        "{} is no finished recording: its recorder still works, was killed, or the file was cut short; what is whole is \
         saved by `soleus-inspect recording --recover {}`", path.display(), path.display()
    )]
    Unfinished {
        /// Which.
        path: PathBuf,
    },
    /// It is damaged.
    #[error("{} is damaged at byte {at}", path.display())]
    Broken {
        /// Which.
        path: PathBuf,
        /// Where the damaged record begins.
        at: u64,
        /// What is wrong.
        source: Broken,
    },
    /// It says nothing about a run. Remedy: filters of MCAP files have options that keep metadata and attachments.
    #[error(
        "{} was written by `{library}` and says nothing about a run of Soleus (it lacks the metadata `soleus`): a recording of \
         another program, or one that a filter has left without metadata and attachments", path.display()
    )]
    NotOurs {
        /// Which.
        path: PathBuf,
        /// Who says to have written it.
        library: String,
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
        index: u64,
    },
    /// Its messages are many times larger than the file.
    #[error(
        "{}: its messages would take more than {}, many times the file's size", path.display(),
        files::size_text(*max_bytes)
    )]
    TooMuch {
        /// The file.
        path: PathBuf,
        /// What they may take.
        max_bytes: u64,
    },
    /// See there.
    #[error(transparent)]
    Schema(#[from] SchemaError),
}

/// An unfinished recording cannot be finished.
#[derive(Debug, Error)]
pub enum RecoverError {
    /// It is still being written.
    #[error("{} is still being written: stop its recorder first", path.display())]
    UnderWay {
        /// Which.
        path: PathBuf,
    },
    /// It cannot be read.
    #[error(transparent)]
    Unreadable(#[from] ReadError),
    /// The finished one cannot be written.
    #[error(transparent)]
    Unwritten(#[from] WriteError),
}
