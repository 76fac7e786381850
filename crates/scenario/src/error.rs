//! What may be wrong with a configuration.

use std::fmt;
use std::path::PathBuf;

/// Where a key comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// A file, and the line if known.
    File {
        /// Which.
        path: PathBuf,
        /// Line, counted from one.
        line: Option<usize>,
    },
    /// `--set`.
    CommandLine,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { path, line: Some(line) } => write!(f, "{}:{line}", path.display()),
            Self::File { path, line: None } => write!(f, "{}", path.display()),
            Self::CommandLine => f.write_str("command line (--set)"),
        }
    }
}

/// What is wrong with a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Problem {
    /// Nothing has this name.
    Unknown {
        /// The known name most like it.
        nearest: Option<String>,
        /// All known names.
        known: Vec<String>,
    },
    /// It was a name once.
    Retired {
        /// What has become of it, and what to do.
        advice: &'static str,
    },
    /// It must be there and is not.
    Missing,
    /// Its value is not what it should be.
    Invalid {
        /// What was found and what was expected.
        reason: String,
    },
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { nearest: Some(nearest), .. } => write!(f, "unknown; did you mean `{nearest}`?"),
            Self::Unknown { nearest: None, known } if known.is_empty() => write!(f, "unknown; no key is allowed here"),
            Self::Unknown { nearest: None, known } => write!(f, "unknown; known here: {}", known.join(", ")),
            Self::Retired { advice } => write!(f, "no longer a key: {advice}"),
            Self::Missing => write!(f, "missing; the configuration that ships documents it, copy it from there"),
            Self::Invalid { reason } => f.write_str(reason),
        }
    }
}

/// A configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read {}{}: check the path", path.display(), wanted_by.as_ref().map(|by| format!(" (named in {by})")).unwrap_or_default())]
    Read {
        /// Which.
        path: PathBuf,
        /// Where it is named, if in another file.
        wanted_by: Option<Origin>,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no TOML.
    #[error("{origin}: not valid TOML: {reason}")]
    Syntax {
        /// Where.
        origin: Origin,
        /// What the parser says.
        reason: String,
    },
    /// A key is wrong.
    #[error("{origin}: `{key}`: {problem}")]
    Key {
        /// Where it comes from.
        origin: Origin,
        /// Which.
        key: String,
        /// What is wrong with it.
        problem: Problem,
    },
}
