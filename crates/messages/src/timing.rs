//! Which tick a value belongs to.
//!
//! ```text
//! tick              k                     k + 1                      k + 2
//! robot             state k               state k + 1                state k + 2
//! estimator         deformation k
//! controller        command k: references and plan for k + 1
//! drives            apply command k - 1,  apply command k: a ramp    have reached the references
//!                   reach those of k - 2  from what they have        of command k
//! ```
//!
//! So what the robot does at tick `k + 2` ([`REACHED_TICKS`]) is what command `k` planned for `k + 1`: the robot is one tick behind the
//! plan ([`DRIVES_BEHIND_TICKS`]). Whoever compares it with the plan takes the plan of the tick before.

use crate::{CONTROL_PERIOD_S, WalkStart};

/// Ticks from a command to when the drives have reached its references: one to be sent, one to be driven.
pub const REACHED_TICKS: i64 = 2;

/// Ticks by which the robot is behind the plan: the drives' ramp.
pub const DRIVES_BEHIND_TICKS: usize = 1;

/// By the clock: how long after the tick's time the deformation of the tick is waited for (ns), so until when it has to be out. It comes
/// after some 0.2 ms; a step and its way to the robot take less than what is then left of the period.
pub const DEFORMATION_WAIT_NS: u64 = 1_500_000;

/// Walk time (s) before anybody knows when time zero is: negative, which is before the walk.
pub const BEFORE_START_S: f64 = -CONTROL_PERIOD_S;

impl WalkStart {
    /// Walk time at a tick (s); negative before time zero.
    #[must_use]
    pub fn walk_time_s(&self, tick: i64) -> f64 {
        (tick - self.tick_zero) as f64 * CONTROL_PERIOD_S
    }
}

/// Walk time at a tick (s), whether time zero is known or not.
#[must_use]
pub fn walk_time_s(start: Option<&WalkStart>, tick: i64) -> f64 {
    start.map_or(BEFORE_START_S, |start| start.walk_time_s(tick))
}
