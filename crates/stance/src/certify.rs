//! Whether the soles can carry a walk: every stance, tick by tick, before anybody walks it.
//!
//! The ZMP inside the rectangle is not enough: near an edge a soft sole tilts and may fold before the ZMP gets there, and what a
//! sole can carry depends on the history of its contact. So [`WalkOnSoles`] is asked for every tick, as the estimator will.

use crate::{Outcome, WalkOnSoles};
use pattern::Side;
use sole::Status;

/// The largest value of something and where it occurs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Largest {
    /// The value.
    pub value: f64,
    /// Walk time (s).
    pub time_s: f64,
    /// Which foot.
    pub foot: Side,
}

impl Largest {
    fn nothing() -> Self {
        Self { value: 0.0, time_s: 0.0, foot: Side::Left }
    }

    fn see(&mut self, value: f64, time_s: f64, foot: Side) {
        if value > self.value {
            *self = Self { value, time_s, foot };
        }
    }
}

/// What the soles say of a walk that they can carry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carried {
    /// Stances' ticks solved, of both feet.
    pub ticks: usize,
    /// Angle between the sole and the ground (rad).
    pub tilt_rad: Largest,
    /// Mean compression, a part of the thickness.
    pub compression: Largest,
}

/// The first tick that a sole cannot carry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NotCarried {
    /// Walk time (s).
    pub time_s: f64,
    /// Which foot.
    pub foot: Side,
    /// What its sole says.
    pub status: Status,
}

/// Walks through every tick. On rigid soles nothing is solved, and nothing refused.
///
/// # Errors
/// [`NotCarried`] at the first tick whose load a sole cannot carry.
pub fn certify(walk: &mut WalkOnSoles) -> Result<Carried, NotCarried> {
    let mut carried = Carried { ticks: 0, tilt_rad: Largest::nothing(), compression: Largest::nothing() };
    for tick in 0..=walk.last_tick() {
        let time_s = walk.time_s(tick);
        for (foot, estimate) in Side::BOTH.into_iter().zip(walk.at_tick(tick, &[])) {
            match estimate.outcome {
                Outcome::Geometric => {}
                Outcome::Held(status) => return Err(NotCarried { time_s, foot, status }),
                Outcome::Solved => {
                    carried.ticks += 1;
                    let tilt_rad = estimate.sole.rotation[(2, 2)].clamp(-1.0, 1.0).acos();
                    carried.tilt_rad.see(tilt_rad, time_s, foot);
                    carried.compression.see(estimate.compression, time_s, foot);
                }
            }
        }
    }
    Ok(carried)
}
