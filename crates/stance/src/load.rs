//! What a foot is told to carry: the plan, and its part of what the body adds.
//!
//! The pattern's ZMP is the cart-table's. The body that walks it makes another one, by [`Reference::zmp_shift`]. Each foot's own ZMP is
//! moved by that shift times a smooth weight of its load, so that the feet together carry what the body really makes:
//!
//! ```text
//! z_foot = z_planned + w(k) s        w: 0 up to from_share, 1 from full_share on, a quintic between
//! ```
//!
//! `k` is the foot's share of the weight, `s` the shift. A foot that comes or goes carries little: there the ZMP of the whole says nothing
//! about its own, and near its edge it would fold. The force is the plan's.

use pattern::{FootReference, Planar, Reference, Scalar};
use serde::Deserialize;
use sole::StanceReference;

/// Section `[body_zmp]`: from which load on a foot's ZMP is moved by what the body adds.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BodyZmpSettings {
    /// Share of the weight up to which a foot's ZMP is the plan's.
    pub from_share: f64,
    /// Share from which on it is moved by the whole shift.
    pub full_share: f64,
}

impl Default for BodyZmpSettings {
    fn default() -> Self {
        // 60 and 250 N of HRP-4's 383 N: below, the ankle accelerations that a foot's landing causes are larger than what it is told.
        Self { from_share: 0.157, full_share: 0.65 }
    }
}

impl BodyZmpSettings {
    /// The weight at a share of the load, with its time derivatives.
    fn weight(&self, share: &Scalar) -> Scalar {
        let width = self.full_share - self.from_share;
        let u = ((share.value - self.from_share) / width).clamp(0.0, 1.0);
        let slope = 30.0 * u * u * (1.0 - u) * (1.0 - u) / width;
        let bend = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (width * width);
        Scalar {
            value: u * u * u * (10.0 - 15.0 * u + 6.0 * u * u),
            rate: slope * share.rate,
            acceleration: bend * share.rate * share.rate + slope * share.acceleration,
        }
    }

    /// Where a foot's ZMP is told to be.
    pub(crate) fn zmp(&self, reference: &Reference, foot: &FootReference) -> Planar {
        let (w, s, z) = (self.weight(&foot.share), &reference.zmp_shift, &foot.zmp);
        Planar {
            position: z.position + w.value * s.position,
            velocity: z.velocity + w.value * s.velocity + w.rate * s.position,
            acceleration: z.acceleration
                + w.value * s.acceleration
                + 2.0 * w.rate * s.velocity
                + w.acceleration * s.position,
        }
    }
}

/// A foot's load as its sole takes it.
pub(crate) fn stance_reference(foot: &FootReference, zmp: &Planar) -> StanceReference {
    StanceReference {
        force: foot.force,
        force_rate: foot.force_rate,
        force_acceleration: foot.force_acceleration,
        zmp: [zmp.position, zmp.velocity, zmp.acceleration],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_grows_from_nothing_to_one_with_its_derivatives() {
        let settings = BodyZmpSettings::default();
        let at = |t: f64| {
            let share = Scalar { value: t * t, rate: 2.0 * t, acceleration: 2.0 };
            settings.weight(&share)
        };
        assert_eq!(at(0.15_f64.sqrt()), Scalar::default());
        assert_eq!(at(0.66_f64.sqrt()), Scalar { value: 1.0, rate: 0.0, acceleration: 0.0 });
        // Central differences: their error is the square of the step, rounding over it far below.
        let step = 1e-4;
        for t in [0.45, 0.6, 0.75] {
            let (before, now, after) = (at(t - step), at(t), at(t + step));
            assert!(((after.value - before.value) / (2.0 * step) - now.rate).abs() < 1e-5, "{t}");
            assert!(((after.rate - before.rate) / (2.0 * step) - now.acceleration).abs() < 1e-3, "{t}");
        }
    }
}
