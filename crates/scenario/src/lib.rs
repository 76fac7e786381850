//! Configuration as people write it: typed TOML in layers, and scenarios that combine it.
//!
//! A process has one configuration file (`config/planner.toml`) in which every key and its default is documented. A **scenario**
//! names the files and changes single keys; `--set planner.gait.cost.lambda=0.8` changes single keys once more. The layers are merged
//! table by table, then read into the process's settings. A table in braces is a value, and replaces the whole table of that name, in a
//! scenario as on the command line: `--set 'planner.gait.walk={ kind = "in_place", swings = 4, turn_per_swing_rad = 0.2 }'`. Everything wrong is an error that names file, line, key, what was
//! expected and what to do; unknown keys are errors and the nearest known one is suggested. The settings' types must deny unknown
//! fields (`#[serde(deny_unknown_fields)]`).
//!
//! ```toml
//! # A scenario. Paths are relative to the file in which they stand.
//! robot = "../../robots/hrp4"
//! sole_file = "../../soles/thick.toml"   # optional: another sole than the robot folder's own
//!
//! [planner]
//! config = "../planner.toml"     # the base; everything else in this table replaces its keys
//! gait.cost.lambda = 0.8         # this key alone
//! gait.walk = { kind = "in_place", swings = 4, turn_per_swing_rad = 0.2 }   # the whole table
//!
//! [recorder]
//! config = "../recorder.toml"
//! on = false                     # this process is not started
//! ```
//!
//! A process that must know what another one is told has a table with that one's name. In the process's own file the table names the
//! other's file (`[estimator] config = "estimator.toml"`); in a scenario it holds what the scenario tells the other.
//!
//! Keys called `robot` or ending in `_file` or `_folder` hold paths; relative ones are made absolute against the folder of the
//! file in which they stand (on the command line: the working directory), so that the merged configuration can be stored anywhere.
//!
//! This crate knows nothing of processes at work: `closed_loop` reads the same scenarios and runs them in one thread.

mod config;
mod error;
mod locate;
mod retired;
mod scenario;
mod setting;

pub use config::{Config, load};
pub use error::{ConfigError, Origin, Problem};
pub use scenario::{PROCESSES, Scenario};
pub use setting::{Setting, SettingError};
/// A table of keys: what a [`Config`] is merged into.
pub use toml::Table;
