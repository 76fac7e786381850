//! A stance as in walking: load ramps from 0.05 N to the full weight and back, the ZMP rolls from heel to toe and sways, the
//! horizontal force reaches 0.3 of the vertical. Smooth, with exact derivatives by second-order jets.

use nalgebra::Vector2;
use sole::StanceReference;
use spatial::Vec3;
use std::ops::{Add, Mul};

/// Control period (s).
pub const PERIOD_S: f64 = 0.005;
/// Ticks of the stance.
pub const TICKS: usize = 199;
/// Ticks over which the load comes and goes.
pub const RAMP_TICKS: usize = 40;
/// Vertical load of single support: 39 kg (N).
pub const WEIGHT_N: f64 = 39.0 * 9.81;

/// Value, rate and second rate.
#[derive(Clone, Copy)]
struct Jet([f64; 3]);

impl Jet {
    fn constant(x: f64) -> Self {
        Self([x, 0.0, 0.0])
    }

    fn scaled(self, s: f64) -> Self {
        Self(self.0.map(|x| s * x))
    }

    fn compose(self, value: f64, first: f64, second: f64) -> Self {
        let [_, rate, acceleration] = self.0;
        Self([value, first * rate, second * rate * rate + first * acceleration])
    }

    fn sine(self) -> Self {
        let (s, c) = self.0[0].sin_cos();
        self.compose(s, c, -s)
    }

    /// Quintic from 0 at 0 to 1 at 1 with flat ends, constant outside.
    fn smooth_step(self) -> Self {
        let x = self.0[0].clamp(0.0, 1.0);
        let value = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
        self.compose(value, 30.0 * x * x * (1.0 - x) * (1.0 - x), 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x))
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let ([a, ad, add], [b, bd, bdd]) = (self.0, other.0);
        Self([a * b, ad * b + a * bd, add * b + 2.0 * ad * bd + a * bdd])
    }
}

/// The reference of a tick; `mirror` turns left into right.
pub fn reference(tick: usize, mirror: bool) -> StanceReference {
    let duration = TICKS as f64 * PERIOD_S;
    // The first tick carries about 0.05 N.
    let t = Jet([(tick as f64 + 2.2) * PERIOD_S, 1.0, 0.0]);
    let ramp = RAMP_TICKS as f64 * PERIOD_S;
    let up = t.scaled(1.0 / ramp).smooth_step();
    let down = (Jet::constant(duration + 5.0 * PERIOD_S) + t.scaled(-1.0)).scaled(1.0 / ramp).smooth_step();
    let load = up * down * Jet::constant(WEIGHT_N);
    let progress = t.scaled(1.0 / duration);
    let side = if mirror { -1.0 } else { 1.0 };
    let forward =
        (progress.scaled(std::f64::consts::PI) + Jet::constant(-std::f64::consts::FRAC_PI_2)).sine().scaled(0.25);
    let lateral = (progress.scaled(2.0 * std::f64::consts::PI)).sine().scaled(0.15 * side);
    let zmp_x = (progress + Jet::constant(-0.2)).scaled(1.0 / 0.6).smooth_step().scaled(0.12) + Jet::constant(-0.055);
    let zmp_y = (progress.scaled(3.0)).sine().scaled(0.018 * side);
    let (fx, fy) = (load * forward, load * lateral);
    let force = |i: usize| Vec3::new(fx.0[i], fy.0[i], load.0[i]);
    StanceReference {
        force: force(0),
        force_rate: force(1),
        force_acceleration: force(2),
        zmp: std::array::from_fn(|i| Vector2::new(zmp_x.0[i], zmp_y.0[i])),
    }
}

/// Forty loads of 0.4 to 383 N, the horizontal force to 0.9 of what friction `mu` (but no more than 0.65) holds, the ZMP to 0.78 of the half size.
#[allow(dead_code)]
pub fn scattered_loads(mu: f64) -> Vec<StanceReference> {
    let mut seed = 2024_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as f64 / f64::from(1u32 << 31) * 2.0 - 1.0
    };
    let mut load = || {
        let normal_n = 383.0 * 10f64.powf(-3.0 * random().abs());
        let (part, (sine, cosine)) = (0.9 * random().abs(), (std::f64::consts::PI * random()).sin_cos());
        let horizontal = f64::min(mu, 0.65) * part;
        let force = normal_n * Vec3::new(horizontal * cosine, horizontal * sine, 1.0);
        StanceReference::constant(force, Vector2::new(0.09 * random(), 0.05 * random()))
    };
    (0..40).map(|_| load()).collect()
}
