//! Tracks pattern and ankle poses with the whole body (the paper's section 5, as a process).
//!
//! At every tick: the state of the robot *k*, the deformation of the soles *k* and the pattern at that time make one
//! whole-body quadratic program ([`wholebody`]); its accelerations are integrated twice and become the joint references for
//! tick *k + 1*, published as `robot/command` together with the plan behind them.
//!
//! **Open loop** (the paper's way, default): the program works on its internal state, integrated from its own results, which follows the plan exactly; the
//! measured joints serve to decide when the walk may start and to report how far robot and model are apart. The robot's own
//! stabiliser, which sees the plan in the command and the sensors, closes the loop.
//!
//! **Feedback** (`integration.mode = "feedback"`): before each step the base of the internal state is blended with the one that
//! [`state::observer`] finds from encoders, inertial unit and the estimator's soles, so the centre of mass and torso tasks see what
//! happens to the robot and ask the ground for other wrenches. A sole gives way under them by its compliance, and the standing ankles move
//! with it ([`wholebody::ComplianceFeedForward`]): that is how drives that follow positions push. Feedback *without* that step
//! (`compliance_feed_forward = 0`) turns the feet
//! of a tilting robot back to the plan and takes away the stiffness that holds it up: without a stabiliser it falls. The README has figures.
//!
//! **Stabiliser** (`[stabiliser]`, off by default): robots whose driver has none get theirs here. It sees what is measured a period
//! earlier than a built-in one.
//!
//! **Before the walk** the first deformation gives the start configuration: centre of mass and ankles where pattern and
//! estimator have them at time zero, torso upright and facing where the feet do, nearest to half-sitting. The robot is placed in it; when it has settled
//! ([`state::SettleDetector`]) the controller publishes `walk/start`, once.
//!
//! | what goes wrong | answer |
//! |---|---|
//! | the quadratic program contradicts itself | limits are widened by priority, counted ([`Summary`]) |
//! | no usable solution | joints are brought to rest, the last torques kept; after 10 in a row the posture is held for good |
//! | no deformation for this tick | the last one moved on by its twist and acceleration; after 10 ticks in a row the posture is held, in a walk for good; after 40 the process ends ([`messages::missing`]) |
//! | it is told to stop in a walk | the step under way is completed, then the posture is held on both feet |
//! | feedback: a measurement is not finite, stale, faulty, impossible or far from the internal state | not used: this step starts from the internal state alone (compliance feed-forward goes on); counted, the first one is logged with its reason ([`state::Refused`]) |
//! | the start configuration does not exist | safety stop with the joints that are at their limits |
//! | the robot does not come to stand still | safety stop with the criterion that is not met, its value and its limit |
#![allow(non_snake_case)] // monogram notation, see the style guide

mod balance;
mod convert;
mod feedback;
mod progress;
mod settings;
mod step;
mod summary;

pub use settings::{ControllerError, ControllerSettings, Programs};
pub use step::{CannotWalk, ControllerOutput, ControllerProcess};
pub use summary::{Summary, WidenedLimit, new_joints};
