//! How well the walk goes, in a few numbers.

use messages::{Plan, Truth};

/// Root mean square and maximum of something since time zero.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spread {
    /// Number of values.
    pub count: u64,
    /// Sum of squares.
    pub squares: f64,
    /// Largest.
    pub max: f64,
}

impl Spread {
    /// One more value.
    pub fn add(&mut self, value: f64) {
        self.count += 1;
        self.squares += value * value;
        self.max = self.max.max(value);
    }

    /// Root mean square; zero without values.
    #[must_use]
    pub fn rms(&self) -> f64 {
        if self.count == 0 { 0.0 } else { (self.squares / self.count as f64).sqrt() }
    }
}

/// Sums over the walk, from time zero to its end or the fall.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Figures {
    /// Horizontal distance of the centre of mass from its plan (m).
    pub com_error_m: Spread,
    /// Distance of the zero-moment point from its plan (m).
    pub zmp_error_m: Spread,
    /// Angle between the base's vertical axis and its plan (rad).
    pub base_tilt_rad: Spread,
    /// How far the middle of the feet has moved along the ground (m).
    pub distance_m: f64,
    /// Commands that did not come in time.
    pub late: u64,
    /// Commands that no robot could follow.
    pub refused: u64,
    /// Control periods in which integration or contact did not reach its tolerance.
    pub unconverged: u64,
    /// Joints at or beyond the limits of their position at any tick: bit *i* is joint *i* of the interface.
    pub joints_at_limit_bits: u64,
    /// Drives at the limit of their torque at any tick.
    pub drives_saturated_bits: u64,
}

impl Figures {
    /// Takes a tick of the walk in: what was planned for it and what was.
    pub(crate) fn observe(&mut self, plan: &Plan, truth: &Truth) {
        let apart = |a: &[f64], b: &[f64]| (a[0] - b[0]).hypot(a[1] - b[1]);
        self.com_error_m.add(apart(&plan.com_position_m, &truth.com_position_m));
        self.zmp_error_m.add(apart(&plan.zmp_m, &truth.zmp_m));
        let axis = |r: &[f64; 9]| [r[2], r[5], r[8]];
        let (wanted, real) = (axis(&plan.base_rotation), axis(&truth.base_rotation));
        let cosine: f64 = (0..3).map(|i| wanted[i] * real[i]).sum();
        self.base_tilt_rad.add(cosine.clamp(-1.0, 1.0).acos());
    }
}
