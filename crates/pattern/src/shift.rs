//! What the moving limbs add to the cart-table, known from a rehearsal of the walk.
//!
//! The cart-table knows no angular momentum: the body that follows it makes another ZMP, which lies farther out while a leg swings. A
//! [`ZmpShift`] holds the difference for one phase, as the quintics through values, rates and accelerations at equidistant knots. Adjacent
//! phases share the knot where they meet, so that the whole is twice continuously differentiable.

use crate::Quintic;
use serde::{Deserialize, Serialize};

/// Intervals between knots in a phase. Motions scale with the phase's duration, and so does their distance: 50 ms in 0.4 s, well below the
/// 100 ms in which what a leg adds comes and goes.
pub const SHIFT_INTERVALS: usize = 8;
/// Knots of a phase, its ends included.
pub const SHIFT_KNOTS: usize = SHIFT_INTERVALS + 1;

/// Largest shift (m): more than a foot is long. A body that adds so much walks nothing of what was planned.
const VALUE_MAX_M: f64 = 0.5;

/// The body's own ZMP from the planned one, in one phase; per axis x, y and knot: value (m), rate (m/s), acceleration (m/s^2).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ZmpShift(pub [[[f64; 3]; SHIFT_KNOTS]; 2]);

impl ZmpShift {
    /// Value (m) and first two derivatives of both axes at local time `t` of a phase of duration `duration_s`.
    #[must_use]
    pub fn evaluate(&self, t: f64, duration_s: f64) -> [[f64; 3]; 2] {
        let step_s = duration_s / SHIFT_INTERVALS as f64;
        let interval = ((t / step_s) as usize).min(SHIFT_INTERVALS - 1);
        let since_s = t - interval as f64 * step_s;
        self.0.each_ref().map(|axis| Quintic::hermite(step_s, axis[interval], axis[interval + 1]).derivatives(since_s))
    }

    /// Whether every number is one that a body could make: not beyond [`VALUE_MAX_M`], and changing no faster than within a millisecond.
    pub(crate) fn is_small(&self) -> bool {
        let limits = [VALUE_MAX_M, 1e3 * VALUE_MAX_M, 1e6 * VALUE_MAX_M];
        self.0.iter().flatten().all(|knot| knot.iter().zip(limits).all(|(value, max)| value.abs() <= max))
    }

    /// Every number, in the order of the fields.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        self.0.iter().flatten().flatten().copied()
    }
}
