//! Messages to and from MCAP files.
//!
//! A recording holds, chunked, indexed and zstd-compressed:
//!
//! - **the exact messages** of every topic, under the topic's name with a `/` in front (`/robot/state`), as protobuf after
//!   `proto/soleus.proto`: every number comes back bit for bit, so that any process can be run again against the recording;
//! - **the same for viewers**: `/tf` (`foxglove.FrameTransforms`), `/joint_states` (`foxglove.JointStates`: the joints of
//!   the messages, and those that follow them by `<mimic>`), `/scene` (`foxglove.SceneUpdate`), made from the truth by
//!   [`Viewer`];
//! - metadata `soleus` (version, commit, host, pace, ..) and attachments (effective configuration, the robot's files).
//!
//! Log time is the control time: tick x 5 ms, from zero, so that a recording of a run in lock-step is the same however fast it
//! ran. The producer's clock, if it had one, is in each message's header.
//!
//! A file under way is called `NAME.mcap.partial`; [`Writer::flush`] makes everything so far readable, [`Writer::finish`] writes
//! the index and gives the file its name. [`recover`] does that for what a killed process left.
//!
//! The schema is *written*, not derived from the messages: a derived one would silently break old files. Encoding is driven by
//! two descriptions, the [`messages::Shape`] of a message and the compiled schema, joined by field names once at start.

mod decode;
mod encode;
mod error;
mod plan;
mod reader;
mod recover;
mod viewer;
mod wire;
mod writer;

pub use error::{ReadError, SchemaError, WriteError};
pub use reader::{Recorded, Recording};
pub use recover::{Recovered, recover};
pub use viewer::{Follower, Viewer, ViewerSettings};
pub use writer::{RunInfo, Writer};

/// Ending of a file under way.
pub const PARTIAL: &str = "partial";

/// Log time of a tick; what happened before tick 0 is at 0.
pub fn log_time_ns(tick: i64) -> u64 {
    u64::try_from(tick).unwrap_or(0).saturating_mul(messages::CONTROL_PERIOD_NS)
}
