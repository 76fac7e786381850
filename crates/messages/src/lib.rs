//! What crosses process borders: messages of fixed layout and the table of topics.
//!
//! Every message is `#[repr(C)]` without hidden padding, of a size that is asserted at compile time, made of `u32`, `u64`,
//! `i64` and `f64` only: no `Option`, no `bool`, no Rust enum, so that any bit pattern is a valid value and programs in other
//! languages can join. Enumerations cross as `u32` codes ([`code`]), absent array elements are zero behind a count. The version
//! of the layout is part of the type's name on the wire (`soleus.RobotStateV1`): changing a field means a new number.
//!
//! Conventions:
//!
//! - SI units and radians; world frame W with z up; feet in the order left, right.
//! - Rotations are matrices, **row-major** `[r00, r01, r02, r10, ..]`, columns are the axes of the body in the frame named.
//! - Six-vectors are linear part first (`[vx, vy, vz, wx, wy, wz]`, `[fx, fy, fz, mx, my, mz]`).
//! - The last part of a field's name is its unit. Six-vectors name both: `wrench_n_nm`, `twist_m_rad_per_s`. Rotations, counts, codes,
//!   shares and residuals are pure numbers and have none.
//! - [`Header::tick`] is the control time: message *k* of every topic belongs to the sample of the robot at tick *k*. State *k*
//!   gives deformation *k* and command *k*; command *k* is applied from tick *k + 1* on, and the drives' ramps reach its references
//!   [`timing::REACHED_TICKS`] after its own tick.
//! - In lock-step every field of every message except those of [`Health`] and [`Header::clock_monotonic_ns`] (zero there) is
//!   reproducible bit for bit; wall-clock measurements therefore live in `Health`.
//!
//! The walking pattern is the one domain type that more than one process receives: its way to and from messages is here
//! ([`write_pattern`], [`read_pattern`]), so that it exists once. Everything else is converted in the `convert.rs` of its process.
//!
//! [`topic`] says which message travels where; `bus` and the recorder are driven by it. This crate depends on iceoryx2 only for
//! the derive that states a type may be placed in shared memory.

pub mod code;
mod header;
mod health;
mod message;
pub mod missing;
mod older;
mod pattern;
mod plain;
mod robot;
mod rotation;
mod sole;
pub mod timing;
pub mod topic;
mod truth;
mod walk;

pub use header::{Fault, Header};
pub use health::{ControllerFigures, Health, LatenessFigures, RecorderFigures, SimulatorFigures, TimingFigures};
pub use message::Message;
pub use older::{Gone, Older};
pub use pattern::{OwnSoles, PatternRefused, read_pattern, write_pattern};
pub use plain::{Field, Plain, Shape};
pub use robot::{Plan, PlanFoot, RobotCommand, RobotState};
pub use rotation::{from_row_major, row_major};
pub use sole::{ContactNodes, FootDeformation, SoleContact, SoleDeformation};
pub use topic::Topic;
pub use truth::Truth;
pub use walk::{PatternFoot, PatternHeader, PatternPhase, WalkOrder, WalkStart};

/// Most joints a robot may have.
pub const MAX_JOINTS: usize = 40;
/// Most contact nodes per foot in [`SoleContact`].
pub const MAX_CONTACT_NODES: usize = 256;
/// Most phases a walking pattern may have; consumers reserve memory for this many at start.
pub const MAX_PHASES: usize = 4096;
/// Control period: one tick, 5 ms (200 Hz).
pub const CONTROL_PERIOD_NS: u64 = 5_000_000;
/// Control period in seconds.
pub const CONTROL_PERIOD_S: f64 = 0.005;
