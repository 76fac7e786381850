//! Messages to and from MCAP files.
//!
//! A recording holds, chunked, indexed and zstd-compressed:
//!
//! - **the exact messages** of every topic, under the topic's name with a `/` in front (`/robot/state`), as protobuf
//!   after `proto/soleus.proto`: every number comes back bit for bit, so that any process can be run again against
//!   the recording;
//! - **the same for viewers**, made from the truth by [`Viewer`]: `/robot_description` (`std_msgs/msg/String`: the
//!   URDF), `/tf` (`foxglove.FrameTransforms`: every link), `/joint_states` (`sensor_msgs/msg/JointState`: the joints
//!   of the messages, and those that follow them by `<mimic>`), `/scene` and `/scene/contact`
//!   (`foxglove.SceneUpdate`), `/log` (`foxglove.Log`: what happens);
//! - metadata `soleus` (version, commit, host, begin, scenario, settings, pace, ..) and `soleus.result` (how it
//!   ended), and attachments (effective configuration, the robot's files).
//!
//! Log time is the control time in lock-step: tick x 5 ms, from zero, so that a recording is the same however fast it
//! ran. In real time it is universal time. What belongs to no tick (a process that waits) is where the recording has
//! come to.
//!
//! A file under way is called `NAME.mcap.partial`; [`Writer::flush`] makes everything so far readable,
//! [`Writer::finish`] writes the index and gives the file its name. [`recover`] does that for what a killed process
//! left.
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use messages::{Header, RobotState, topic};
//! use recording::{Recording, RunInfo, ViewerSettings, Writer};
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("walk.mcap");
//! let mut writer = Writer::create(&path, &RunInfo::default(), ViewerSettings::default())?;
//! for tick in 0..3 {
//!     writer.record(topic::ROBOT_STATE, &RobotState { header: Header::new(tick, 7), ..RobotState::default() })?;
//! }
//! let path = writer.finish()?;
//! let states = Recording::open(&path)?.messages(topic::ROBOT_STATE)?;
//! assert_eq!(states.iter().map(|state| state.header.tick).collect::<Vec<_>>(), [0, 1, 2]);
//! # Ok(())
//! # }
//! ```
//!
//! The schema is *written*, not derived from the messages: a derived one would silently break old files. Encoding is
//! driven by two descriptions, the [`messages::Shape`] of a message and the compiled schema, joined by field names
//! once at start.

mod chunk;
mod columns;
mod decode;
mod encode;
mod error;
mod events;
mod live;
mod older;
mod plan;
mod reader;
mod record;
mod recover;
mod ros;
mod source;
mod survey;
mod viewer;
mod wire;
mod writer;

pub use columns::{Labels, columns, labels};
pub use error::{ReadError, RecoverError, SchemaError, WriteError};
pub use live::{CONTACT, Encoder, JOINT_STATES, LOG, ROBOT_DESCRIPTION, SCENE, TRANSFORMS, ViewerTopic};
pub use reader::{Entry, Recording};
pub use record::Broken;
pub use recover::{Recovered, Recovery, recover, recover_file};
pub use survey::{Survey, Surveyed};
pub use viewer::{Follower, Link, Viewer, ViewerSettings};
pub use writer::{RunInfo, Writer};

/// Ending of a file under way.
pub const PARTIAL: &str = "partial";

/// Log time of a tick; what happened before tick 0 is at 0.
pub fn log_time_ns(tick: i64) -> u64 {
    u64::try_from(tick).unwrap_or(0).saturating_mul(messages::CONTROL_PERIOD_NS)
}
