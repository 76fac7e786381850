//! Bounds on joint accelerations such that position and velocity limits can be kept for ever.
//!
//! A joint may only be as fast as it can still stop before its limit with the deceleration b it can count on. With e the room
//! left to the limit,
//!
//! ```text
//! v <= s(e) = sqrt(2 b (e - e₁/2))   beyond e₁ = b dt²
//!             e / dt                 nearer: the room then shrinks to a third in every period
//! ```
//!
//! An acceleration a held for one period dt leads to `e' = e - v dt - a dt²/2`, `v' = v + a dt`; requiring `v' <= s(e')` gives a
//! bound on a which, from any state that keeps it, is at least -b: braking is always allowed, so the bounds of both sides
//! never contradict each other because of dt (Del Prete, *Joint position and velocity bounds in discrete-time
//! acceleration/torque control of robot arms*, RA-L 2018, whose idea this is).
//!
//! **Why the straight part.** With the square root alone the last stretch would be taken in one period, `v' = 2 e/dt - v`: a
//! joint pressed against its limit would arrive with v and leave with -v, and so on for ever, within its limit and chattering.
//! The straight part is the tangent of the root at e₁, so nowhere more than b is needed.

/// Limits of one joint, as the constraint uses them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Lowest position (rad).
    pub lower: f64,
    /// Highest position (rad).
    pub upper: f64,
    /// Largest speed (rad/s).
    pub velocity: f64,
    /// Largest torque (N m).
    pub torque: f64,
    /// Largest torque of the motor (N m): never passed, even when limits have to give way.
    pub motor_torque: f64,
    /// Deceleration to count on (rad/s²).
    pub braking: f64,
    /// Largest acceleration (rad/s²).
    pub acceleration: f64,
}

impl JointLimits {
    /// `(lowest, highest)` acceleration for the next period; never contradictory.
    #[must_use]
    pub fn acceleration_bounds(&self, q: f64, v: f64, dt_s: f64) -> (f64, f64) {
        let upper = highest(self.upper - q, v, self, dt_s);
        let lower = -highest(q - self.lower, -v, self, dt_s);
        if lower <= upper {
            (lower, upper)
        } else {
            // Outside of what can be kept (a jump of the state, or a range too narrow to stop in): go between.
            let middle = (0.5 * (lower + upper)).clamp(-self.acceleration, self.acceleration);
            (middle, middle)
        }
    }
}

/// Highest acceleration when the limit is `room` ahead and the joint approaches it with speed v.
fn highest(room: f64, v: f64, limits: &JointLimits, dt: f64) -> f64 {
    let b = limits.braking;
    let by_speed = (limits.velocity - v) / dt;
    let by_room = if room.is_infinite() {
        f64::INFINITY
    } else {
        // The straight part: w = v' with w = e'/dt and e' = room - (v + w) dt/2.
        let straight = (room / dt - 0.5 * v) / 1.5;
        let near = b * dt * dt;
        let speed = if straight * dt <= near {
            straight
        } else {
            // w² + b dt w + b (v dt - 2 room + near) = 0.
            let half = 0.5 * b * dt;
            (half * half + b * (2.0 * room - near - v * dt)).sqrt() - half
        };
        (speed - v) / dt
    };
    // A state that cannot be kept is left as fast as braking allows, not faster.
    by_speed.min(by_room).clamp(-b.max(0.0), limits.acceleration)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: JointLimits = JointLimits {
        lower: -0.4,
        upper: 0.7,
        velocity: 3.0,
        torque: 1.0,
        motor_torque: 1.0,
        braking: 50.0,
        acceleration: 1000.0,
    };

    /// Rounding of a few thousand additions.
    const ROUNDING: f64 = 1e-9;

    #[test]
    fn a_joint_driven_against_its_limits_keeps_them_at_every_period() {
        for dt in [1e-3, 2e-3, 5e-3, 1e-2, 2e-2] {
            for wanted in [1000.0, -1000.0] {
                let (mut q, mut v) = (0.1, 0.0);
                for step in 0..(3.0 / dt) as usize {
                    let (low, high) = LIMITS.acceleration_bounds(q, v, dt);
                    assert!(low <= high, "dt {dt} step {step}");
                    let a: f64 = if step % 400 < 300 { wanted } else { -wanted };
                    let a = a.clamp(low, high);
                    q += v * dt + 0.5 * a * dt * dt;
                    v += a * dt;
                    let range = LIMITS.lower - ROUNDING..=LIMITS.upper + ROUNDING;
                    assert!(range.contains(&q), "dt {dt}: q {q}");
                    assert!(v.abs() <= LIMITS.velocity + ROUNDING, "dt {dt}: v {v}");
                }
            }
        }
    }

    #[test]
    fn a_joint_pressed_against_its_limit_comes_to_rest_there() {
        for dt in [1e-3, 5e-3, 2e-2] {
            let (mut q, mut v) = (0.1, 0.0);
            let mut turns = 0;
            for _ in 0..(3.0 / dt) as usize {
                let (_, high) = LIMITS.acceleration_bounds(q, v, dt);
                q += v * dt + 0.5 * high * dt * dt;
                let before = v;
                v += high * dt;
                turns += usize::from(before > ROUNDING && v < -ROUNDING);
            }
            assert_eq!(turns, 0, "dt {dt}");
            assert!((LIMITS.upper - q).abs() < 1e-6 && v.abs() < ROUNDING, "dt {dt}: {q} rad, {v} rad/s");
        }
    }

    #[test]
    fn braking_is_always_allowed_from_a_state_that_was_kept() {
        for dt in [1e-3, 5e-3, 2e-2] {
            let (mut q, mut v) = (0.0, 0.0);
            for step in 0..2000 {
                let (low, high) = LIMITS.acceleration_bounds(q, v, dt);
                assert!(high >= -LIMITS.braking - ROUNDING && low <= LIMITS.braking + ROUNDING);
                let a = if (step / 37) % 2 == 0 { high } else { low };
                q += v * dt + 0.5 * a * dt * dt;
                v += a * dt;
            }
        }
    }

    #[test]
    fn outside_of_the_limits_the_joint_comes_back_gently() {
        let (mut q, mut v) = (0.9, 2.0);
        for _ in 0..2000 {
            let (low, high) = LIMITS.acceleration_bounds(q, v, 5e-3);
            assert!(low <= high);
            let a = 0.0_f64.clamp(low, high);
            assert!(a >= -LIMITS.braking - ROUNDING);
            q += v * 5e-3 + 0.5 * a * 2.5e-5;
            v += a * 5e-3;
        }
        assert!(q <= LIMITS.upper + 1e-6, "{q}");
    }
}
