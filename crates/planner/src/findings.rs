//! What the check on the fine grid found, in words: said with every plan that is published, not only with those that are refused.

use crate::PlannerOutput;
use crate::check::{JOINTS, word};
use gait::{Quantity, Worst};

impl PlannerOutput {
    /// Largest violation of a constraint, friction demand and ZMP margin, the tightest leg: one line each, every number with its
    /// phase, step and time.
    #[must_use]
    pub fn findings(&self) -> Vec<String> {
        let worst = |quantity: Quantity| self.check.worst.iter().find(|worst| worst.quantity == quantity);
        let mut lines = Vec::new();
        if let Some(w) = self.check.largest_violation() {
            let how =
                if w.value > 0.0 { "largest violation of a constraint" } else { "every constraint is kept, nearest" };
            lines.push(format!("{how}: {} {}", amount(w), place(w)));
        }
        if let (Some(friction), Some(margin)) = (worst(Quantity::FrictionDemand), worst(Quantity::NegativeZmpMargin)) {
            lines.push(format!(
                "friction demand: {:.3} of {:.3} {}; smallest ZMP margin to the sole's edge: {:.2} mm, {} foot, {}",
                friction.value,
                self.friction_available,
                place(friction),
                -1e3 * margin.value,
                margin.foot.map_or("loaded", word),
                place(margin)
            ));
        }
        if let Some(reach) = &self.check.reach {
            let ((extension_m, extension_s, leg), (room_rad, room_s, joint_leg, joint)) =
                (reach.extension, reach.joint);
            lines.push(format!(
                "tightest leg: the {} one could be {:.1} mm longer at {extension_s:.3} s; the {} of the {} leg has {:.1} degrees \
                 to its limit at {room_s:.3} s",
                word(leg),
                1e3 * extension_m,
                JOINTS[joint],
                word(joint_leg),
                room_rad.to_degrees()
            ));
        }
        let rms_mm = [0, 1].map(|axis| {
            let shift_m = self.rehearsal.zmp_shift_m(axis);
            1e3 * (shift_m.iter().map(|shift| shift * shift).sum::<f64>() / shift_m.len() as f64).sqrt()
        });
        let [travel, speed, torque] = &self.rooms;
        lines.push(format!(
            "rehearsed: the body's own ZMP is {:.1} mm forward and {:.1} mm sideways (rms) from the planned one; least room: {travel}, {speed}, \
             {torque}",
            rms_mm[0], rms_mm[1]
        ));
        lines
    }
}

/// "0.220 mm outside the ZMP's margin of the left foot"
pub(crate) fn amount(worst: &Worst) -> String {
    let by_mm = 1e3 * worst.value.abs();
    let beyond = worst.value > 0.0 || worst.value.is_nan();
    let foot = worst.foot.map_or("loaded", word);
    let (inside, outside, what) = match worst.quantity {
        Quantity::StepTooLong => ("below", "above", "the largest step length of"),
        Quantity::StepTooWide => ("below", "above", "the largest step width of"),
        Quantity::FeetTooClose => ("farther than", "nearer than", "the smallest gap to the other foot allows, of"),
        _ => ("inside", "outside", "the ZMP's margin of"),
    };
    format!("{by_mm:.3} mm {} {what} the {foot} foot", if beyond { outside } else { inside })
}

/// "at 3.210 s (step 3, SingleSupport, phase 7)"
pub(crate) fn place(worst: &Worst) -> String {
    let Worst { time_s, step, kind, phase, .. } = worst;
    format!("at {time_s:.3} s (step {step}, {kind:?}, phase {phase})")
}

#[cfg(test)]
mod tests {
    use super::*;
    use pattern::{PhaseKind, Side};

    #[test]
    fn every_constraint_is_told_with_the_right_word_on_either_side() {
        let told = |quantity: Quantity, value: f64| {
            let foot = Some(Side::Right);
            amount(&Worst { quantity, value, phase: 7, kind: PhaseKind::SingleSupport, step: 3, time_s: 3.21, foot })
        };
        for (quantity, kept, broken) in [
            (Quantity::StepTooLong, "below the largest step length", "above the largest step length"),
            (Quantity::StepTooWide, "below the largest step width", "above the largest step width"),
            (Quantity::FeetTooClose, "farther than the smallest gap", "nearer than the smallest gap"),
            (Quantity::ZmpOutsidePolygon, "inside the ZMP's margin", "outside the ZMP's margin"),
        ] {
            for (value, number, word) in
                [(-1.5e-3, "1.500 mm ", kept), (2e-3, "2.000 mm ", broken), (f64::NAN, "NaN", broken)]
            {
                let words = told(quantity, value);
                assert!(words.starts_with(number) && words.contains(word), "{words}");
                assert!(words.ends_with("the right foot"), "{words}");
            }
        }
    }
}
