//! Foam that follows its load late.
//!
//! A Kelvin-Voigt sole carries `K (u + T u')`: the force of the displacement `u` and of its rate, with one time constant `T` for all its
//! stiffness. A load whose elastic answer is `e(t)` is therefore carried by the displacement that follows it,
//!
//! ```text
//! T u' + u = e        u' = (e - u)/T        u'' = (e' - u')/T
//! ```
//!
//! Displacement means the ankle's pose against the flat foot: position and rotation vector. What touches the ground is taken from the
//! elastic answer: that foam also leaves the ground late is not modelled.
//!
//! **The time that is left.** A drive reaches a reference one period after its tick, for it is led there over the period. That much of the
//! lateness is there anyway: [`Viscosity::new`] takes it off.

use pattern::AnkleState;
use spatial::{Transform, Twist, Vec3, so3};

/// The displacement of one foot, over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Viscosity {
    time_s: f64,
    period_s: f64,
    /// Elastic answer of the tick before, and the displacement that follows it; none before the first tick of a stance.
    last: Option<(Displacement, Displacement)>,
}

/// A pose against the flat foot: position (m), rotation vector (rad), world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Displacement {
    linear: Vec3,
    angular: Vec3,
}

impl Displacement {
    fn zero() -> Self {
        Self { linear: Vec3::zeros(), angular: Vec3::zeros() }
    }

    fn map(self, other: Self, f: impl Fn(Vec3, Vec3) -> Vec3) -> Self {
        Self { linear: f(self.linear, other.linear), angular: f(self.angular, other.angular) }
    }
}

impl Viscosity {
    /// A foam with this time constant (s), on drives that are led to a reference over one period.
    pub(crate) fn new(viscosity_time_s: f64, period_s: f64) -> Self {
        Self { time_s: (viscosity_time_s - period_s).max(0.0), period_s, last: None }
    }

    /// The foot has just landed: nothing is displaced yet.
    pub(crate) fn begin(&mut self) {
        self.last = None;
    }

    /// One tick: where the ankle is when the elastic answer is `elastic`, and `flat` the foot without load.
    pub(crate) fn follow(&mut self, elastic: &AnkleState, flat: &Transform) -> AnkleState {
        if self.time_s == 0.0 {
            return *elastic;
        }
        let (T, h) = (self.time_s, self.period_s);
        let e = Displacement {
            linear: elastic.pose.translation - flat.translation,
            angular: so3::log(&(elastic.pose.rotation * flat.rotation.transpose())),
        };
        let e_rate = Displacement {
            linear: elastic.twist.linear,
            angular: so3::left_jacobian_inverse(&e.angular) * elastic.twist.angular,
        };
        let (e_last, u_last) = self.last.unwrap_or((Displacement::zero(), Displacement::zero()));
        // Exact for an elastic answer that is straight from tick to tick.
        let decay = (-h / T).exp();
        let slope = e.map(e_last, |now, before| (now - before) / h);
        let rest = u_last.map(e_last, |u, e| u - e).map(slope, |lag, slope| decay * (lag + T * slope));
        let u = e.map(slope, |e, slope| e - T * slope).map(rest, |steady, rest| steady + rest);
        self.last = Some((e, u));
        let rate = e.map(u, |e, u| (e - u) / T);
        let acceleration = e_rate.map(rate, |e, u| (e - u) / T);
        let (spin, turn) = angular_motion(&u.angular, &rate.angular, &acceleration.angular);
        AnkleState {
            pose: Transform::new(so3::exp(&u.angular) * flat.rotation, flat.translation + u.linear),
            twist: Twist { linear: rate.linear, angular: spin },
            acceleration: Twist { linear: acceleration.linear, angular: turn },
        }
    }
}

/// Angular velocity and acceleration from a rotation vector and its two derivatives. The acceleration is a series up to the fourth power of
/// the angle (5 degrees: 1e-7 of it).
fn angular_motion(p: &Vec3, v: &Vec3, a: &Vec3) -> (Vec3, Vec3) {
    let turn = a + 0.5 * p.cross(a) + (v.cross(&p.cross(v)) + p.cross(&p.cross(a))) / 6.0;
    (so3::left_jacobian(p) * v, turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.005;

    fn at_rest(pose: Transform) -> AnkleState {
        AnkleState::at_rest(pose)
    }

    fn flat() -> Transform {
        Transform::new(so3::about_z(0.4), Vec3::new(1.0, -0.1, 0.103))
    }

    /// Sunk and tilted.
    fn pressed(part: f64) -> Transform {
        let turn = so3::exp(&(part * Vec3::new(0.05, -0.03, 0.01)));
        Transform::new(turn * flat().rotation, flat().translation + part * Vec3::new(1e-4, 2e-4, -1e-3))
    }

    #[test]
    fn a_load_that_comes_at_once_is_followed_exponentially() {
        let mut foot = Viscosity::new(0.02 + PERIOD_S, PERIOD_S);
        let elastic = at_rest(pressed(1.0));
        foot.follow(&elastic, &flat());
        let behind = |state: &AnkleState| state.pose.translation.z - pressed(1.0).translation.z;
        let mut before = behind(&foot.follow(&elastic, &flat()));
        for _ in 0..20 {
            let now = behind(&foot.follow(&elastic, &flat()));
            assert!((now / before - (-PERIOD_S / 0.02_f64).exp()).abs() < 1e-9, "{now} after {before}");
            before = now;
        }
    }

    #[test]
    fn velocity_and_acceleration_are_those_of_the_pose() {
        let mut foot = Viscosity::new(0.025, PERIOD_S);
        let (mut states, mut time_s) = (Vec::new(), 0.0_f64);
        // One turn in a second: differences over 10 ms err by the square of 2 pi / 100.
        while time_s < 1.0 {
            let w = std::f64::consts::TAU;
            let (s, c) = (w * time_s).sin_cos();
            let (part, rate) = (0.5 - 0.5 * c, 0.5 * w * s);
            let p = part * Vec3::new(0.05, -0.03, 0.01);
            let elastic = AnkleState {
                pose: pressed(part),
                twist: Twist {
                    linear: rate * Vec3::new(1e-4, 2e-4, -1e-3),
                    // A rotation about one axis: its vector's rate is the angular velocity.
                    angular: rate * p / part.max(1e-12),
                },
                acceleration: Twist::zero(),
            };
            states.push(foot.follow(&elastic, &flat()));
            time_s += PERIOD_S;
        }
        for three in states[20..].windows(3) {
            let [before, now, after] = three else { unreachable!("windows of three") };
            let speed = (after.pose.translation - before.pose.translation) / (2.0 * PERIOD_S);
            assert!((speed - now.twist.linear).norm() < 2e-3 * 3e-3, "{speed} {}", now.twist.linear);
            let spin = so3::log(&(after.pose.rotation * before.pose.rotation.transpose())) / (2.0 * PERIOD_S);
            assert!((spin - now.twist.angular).norm() < 2e-3 * 0.19, "{spin} {}", now.twist.angular);
            let bend = (after.twist.linear - before.twist.linear) / (2.0 * PERIOD_S);
            assert!((bend - now.acceleration.linear).norm() < 1e-2 * 0.02, "{bend} {}", now.acceleration.linear);
            let turn = (after.twist.angular - before.twist.angular) / (2.0 * PERIOD_S);
            assert!((turn - now.acceleration.angular).norm() < 1e-2 * 1.2, "{turn} {}", now.acceleration.angular);
        }
    }

    #[test]
    fn foam_no_slower_than_the_drives_is_elastic() {
        let elastic = at_rest(pressed(1.0));
        for time_s in [0.0, PERIOD_S] {
            assert_eq!(Viscosity::new(time_s, PERIOD_S).follow(&elastic, &flat()), elastic);
        }
    }
}
