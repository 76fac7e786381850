//! Where the body faces: midway between the headings of the feet.
//!
//! While a foot swings from one heading to another the body turns by half of that with it, from rest to rest along a quintic:
//! heading, rate and acceleration are continuous over the whole walk. Differences of headings are taken the short way round, so that
//! it does not matter how often a walk has gone round in a circle.

use crate::polynomial::Quintic;
use crate::reference::{FootReference, Reference, Scalar};

impl Reference {
    /// Where the body faces: heading (rad) and its derivatives.
    #[must_use]
    pub fn body_heading(&self) -> Scalar {
        let [left, right] = &self.feet;
        match (&left.swing, &right.swing) {
            (None, Some(_)) => while_swinging(right, left, self.t_s),
            (Some(_), None) => while_swinging(left, right, self.t_s),
            _ => at_rest(between(left.ankle_foothold.yaw_rad, right.ankle_foothold.yaw_rad)),
        }
    }
}

fn while_swinging(flying: &FootReference, standing: &FootReference, t_s: f64) -> Scalar {
    let Some(swing) = flying.swing else { return at_rest(standing.ankle_foothold.yaw_rad) };
    let before_rad = between(standing.ankle_foothold.yaw_rad, swing.from_foothold.yaw_rad);
    let turn_rad = 0.5 * short_way(swing.to_foothold.yaw_rad - swing.from_foothold.yaw_rad);
    let turning = Quintic::hermite(swing.t_end_s - swing.t_start_s, [0.0; 3], [turn_rad, 0.0, 0.0]);
    let [turned_rad, rate, acceleration] = turning.derivatives(t_s - swing.t_start_s);
    Scalar { value: before_rad + turned_rad, rate, acceleration }
}

fn at_rest(yaw_rad: f64) -> Scalar {
    Scalar { value: yaw_rad, rate: 0.0, acceleration: 0.0 }
}

/// Midway from one heading to another.
fn between(a_rad: f64, b_rad: f64) -> f64 {
    a_rad + 0.5 * short_way(b_rad - a_rad)
}

/// The same turn, at most half a round.
fn short_way(turn_rad: f64) -> f64 {
    turn_rad.sin().atan2(turn_rad.cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halfway_is_the_short_way_round() {
        assert!((between(3.0, -3.0).abs() - std::f64::consts::PI).abs() < 1e-12);
        assert_eq!(between(0.2, 0.4), 0.2 + 0.5 * short_way(0.2));
    }
}
