use crate::{Foothold, Quintic, Side};
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

/// Coefficients of `x(t) = V exp(-w t) + W exp(-w (T - t)) + sum A_i t^i`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComSolution {
    /// `A_i` (m s^-i).
    pub polynomial: Quintic,
    /// `V` (m), of the part that decays.
    pub decaying: f64,
    /// `W` (m), of the part that grows, seen from the phase's end.
    pub growing: f64,
}

impl ComSolution {
    /// The solution of (8) for a ZMP polynomial that starts at `start` and ends at `end` (m). `A_i = a_i + (i+1)(i+2)
    /// A_{i+2}/w^2`, which unrolls to (9); then `V` and `W` from two equations whose matrix `[1 e; e 1]`, `e = exp(-w T)`, is
    /// well conditioned unless `w T` is tiny.
    #[must_use]
    pub fn through(zmp: &Quintic, duration_s: f64, omega: f64, start: f64, end: f64) -> Self {
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

    /// Position and its first four derivatives at local time `t` of a phase of duration `duration_s`.
    #[must_use]
    pub fn derivatives(&self, t: f64, duration_s: f64, omega: f64) -> [f64; 5] {
        let mut out = self.polynomial.derivatives::<5>(t);
        let decaying = self.decaying * (-omega * t).exp();
        let growing = self.growing * (-omega * (duration_s - t)).exp();
        let (mut power, mut sign) = (1.0, 1.0);
        for value in &mut out {
            *value += power * (growing + sign * decaying);
            power *= omega;
            sign = -sign;
        }
        out
    }
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
