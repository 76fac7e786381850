//! One phase of the walk: its polynomials, and the closed form of the centre of mass.

use crate::{Foothold, Quintic, Side, ZmpShift};
use serde::{Deserialize, Serialize};

/// Which part of the walk a phase belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PhaseKind {
    /// Double support before the first step: load goes from both feet to foot 2.
    Start,
    /// Foot 1 is in the air, foot 2 carries everything.
    SingleSupport,
    /// Load goes from foot 1 to foot 2, which has just landed.
    DoubleSupport,
    /// Double support after the last step: load goes from foot 1 to both.
    Stop,
}

/// One polynomial piece of the walk: the letters of the crate's documentation as numbers. Arrays of two are the axes x, y
/// unless they are called `feet`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Phase {
    /// Start in walk time (s); it ends where the next one starts.
    pub start_s: f64,
    /// `T` (s).
    pub duration_s: f64,
    /// Part of the walk.
    pub kind: PhaseKind,
    /// The swing, counted from 1, that this phase carries out (single support), prepares (start, double support) or follows
    /// (stop).
    pub step: u32,
    /// Foot 1: in the air (single support), about to leave (start, double support), or the one that stood last (stop).
    pub foot_1: Side,
    /// `a_i` of the ZMP (m s^-i).
    pub zmp: [Quintic; 2],
    /// `A_i, V, W` of the COM.
    pub com: [ComSolution; 2],
    /// `k` and what belongs to it.
    pub load: Load,
    /// `x_1`: ZMP of foot 1 (m s^-i); zero in single support.
    pub zmp_1: [Quintic; 2],
    /// The body's own ZMP, from the planned one; patterns of version 1 have none.
    #[serde(default)]
    pub zmp_shift: ZmpShift,
    /// What each foot does, left and right.
    pub feet: [FootPhase; 2],
}

impl Phase {
    /// End in walk time (s).
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.start_s + self.duration_s
    }
}

/// The COM of one phase and axis: a solution of (8), `x'' = w^2 (x - x_Z)`, for a quintic ZMP.
///
/// On phases with `w T >= 1`, as in (9): `x(t) = V exp(-w t) + W exp(-w (T - t)) + sum A_i t^i`.
///
/// On shorter ones that form cancels: `A_0` contains `24 a_4/w^4`, kilometres where the ZMP crosses between the feet in 0.05 s,
/// and `V, W` take them back. There the same solution is written from its start, `x(t) = sum Q_i t^i + V R_6(w t) + W R_7(w t)`,
/// with the Taylor coefficients `Q_i` of the motion itself and the remainders `R_n(s) = s^n/n! + s^(n+2)/(n+2)! + ..` of cosh
/// and sinh: every term is as small as what it describes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComSolution {
    /// `A_i`; on short phases `Q_i` (m s^-i).
    pub polynomial: Quintic,
    /// `V` (m): factor of the exponential that decays from the start; on short phases of the even remainder.
    pub decaying: f64,
    /// `W` (m): factor of the exponential that grows towards the end; on short phases of the odd remainder.
    pub growing: f64,
}

/// Whether a phase is written from its start. The same product of the same numbers decides when a solution is made and when it
/// is evaluated.
fn is_short(duration_s: f64, omega: f64) -> bool {
    omega * duration_s < 1.0
}

impl ComSolution {
    /// The solution for a ZMP polynomial that starts at `start` and ends at `end` (m).
    #[must_use]
    pub fn through(zmp: &Quintic, duration_s: f64, omega: f64, start: f64, end: f64) -> Self {
        if is_short(duration_s, omega) {
            let at_rest = Self::from_start(zmp, omega, start, 0.0);
            let [missed, ..] = at_rest.derivatives(duration_s, duration_s, omega);
            let velocity = (end - missed) * omega / (omega * duration_s).sinh();
            return Self::from_start(zmp, omega, start, velocity);
        }
        // (9), unrolled from above: A_i = a_i + (i+1)(i+2) A_{i+2}/w^2. Then V and W from [1 e; e 1], e = exp(-w T).
        let mut A = zmp.0;
        for i in (0..4).rev() {
            A[i] += ((i + 1) * (i + 2)) as f64 * A[i + 2] / (omega * omega);
        }
        let polynomial = Quintic(A);
        let decay = (-omega * duration_s).exp();
        let (at_start, at_end) = (start - A[0], end - polynomial.derivatives::<1>(duration_s)[0]);
        let determinant = -(-2.0 * omega * duration_s).exp_m1();
        Self {
            polynomial,
            decaying: (at_start - decay * at_end) / determinant,
            growing: (at_end - decay * at_start) / determinant,
        }
    }

    /// The short form from position and velocity at the start: (8) gives the second derivative from the value, and so on up.
    fn from_start(zmp: &Quintic, omega: f64, position: f64, velocity: f64) -> Self {
        let w2 = omega * omega;
        let mut Q = [position, velocity, 0.0, 0.0, 0.0, 0.0];
        for i in 0..4 {
            Q[i + 2] = w2 * (Q[i] - zmp.0[i]) / ((i + 1) * (i + 2)) as f64;
        }
        Self {
            polynomial: Quintic(Q),
            decaying: 24.0 * (Q[4] - zmp.0[4]) / (w2 * w2),
            growing: 120.0 * (Q[5] - zmp.0[5]) / (w2 * w2 * omega),
        }
    }

    /// Position and its first four derivatives at local time `t` of a phase of duration `duration_s`.
    #[must_use]
    pub fn derivatives(&self, t: f64, duration_s: f64, omega: f64) -> [f64; 5] {
        let mut out = self.polynomial.derivatives::<5>(t);
        // The two homogeneous parts and their derivatives, over powers of omega.
        let parts: [[f64; 2]; 5] = if is_short(duration_s, omega) {
            let R = remainders(omega * t);
            std::array::from_fn(|order| [R[6 - order], R[7 - order]])
        } else {
            let (decaying, growing) = ((-omega * t).exp(), (-omega * (duration_s - t)).exp());
            std::array::from_fn(|order| [if order % 2 == 0 { decaying } else { -decaying }, growing])
        };
        let mut power = 1.0;
        for (value, [even, odd]) in out.iter_mut().zip(parts) {
            *value += power * (self.decaying * even + self.growing * odd);
            power *= omega;
        }
        out
    }
}

/// `R_n(s)`, n = 2..7, for `0 <= s < 1`: positive terms only, R_0 and R_1 are not needed.
fn remainders(s: f64) -> [f64; 8] {
    let mut R = [0.0; 8];
    let powers: [f64; 8] = std::array::from_fn(|n| s.powi(n as i32));
    let series = |n: usize, factorial: f64| {
        // Six terms: the seventh is below 1e-17 of the first.
        let (mut term, mut sum) = (powers[n] / factorial, 0.0);
        for k in 0..6 {
            sum += term;
            let next = (n + 2 * k) as f64;
            term *= powers[2] / ((next + 1.0) * (next + 2.0));
        }
        sum
    };
    (R[6], R[7]) = (series(6, 720.0), series(7, 5040.0));
    for (n, factorial) in [(5, 120.0), (4, 24.0), (3, 6.0), (2, 2.0)] {
        R[n] = powers[n] / factorial + R[n + 2];
    }
    R
}

/// Load share `k = t^p κ(t)` of foot 2, and `(x_1 - x_Z)/t^p`, with the same `p`: 3 where foot 2 lands at the start of the
/// phase, else 0. Then `x_2 = x_1 - excess/κ` has no singularity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// `p`: 0 or 3.
    pub cancelled_power: u32,
    /// `κ` (s^-p-i); the constant 1 in single support.
    pub share: Quintic,
    /// `(x_1 - x_Z)/t^p`, per axis (m s^-p-i).
    pub excess: [Quintic; 2],
}

impl Load {
    /// Foot 2 carries everything.
    #[must_use]
    pub fn single_support() -> Self {
        Self { cancelled_power: 0, share: Quintic::constant(1.0), excess: [Quintic::default(); 2] }
    }

    /// `k` and its first two derivatives.
    #[must_use]
    pub fn share_of_foot_2(&self, t: f64) -> [f64; 3] {
        let [k, k1, k2] = self.share.derivatives::<3>(t);
        if self.cancelled_power == 0 {
            return [k, k1, k2];
        }
        let (t2, t3) = (t * t, t * t * t);
        [t3 * k, t3 * k1 + 3.0 * t2 * k, t3 * k2 + 6.0 * t2 * k1 + 6.0 * t * k]
    }

    /// `(x_1 - x_2) = excess/κ` of one axis and its first two derivatives.
    #[must_use]
    pub fn lead_of_foot_1(&self, axis: usize, t: f64) -> [f64; 3] {
        let [k, k1, k2] = self.share.derivatives::<3>(t);
        let [e, e1, e2] = self.excess[axis].derivatives::<3>(t);
        let r = e / k;
        let r1 = (e1 - r * k1) / k;
        let r2 = (e2 - 2.0 * r1 * k1 - r * k2) / k;
        [r, r1, r2]
    }
}

/// What one foot does during a phase.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FootPhase {
    /// Under the ankle: where it stands, or where it will land.
    pub ankle_foothold: Foothold,
    /// Walk time (s) at which it came, or will come, into contact there; 0 for the stance before the first step.
    pub contact_since_s: f64,
    /// Present while the foot is in the air.
    pub swing: Option<Swing>,
}

/// One flight of a foot, over all phases of its single support.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Swing {
    /// Under the ankle: where it left.
    pub from_foothold: Foothold,
    /// Walk time of take-off (s).
    pub t_start_s: f64,
    /// Walk time of landing (s).
    pub t_end_s: f64,
    /// Height of the highest point above the higher of the two ends (m).
    pub apex_m: f64,
}
