//! Words for what a check measures: sides, joints, amounts, places.

use gait::{Quantity, Worst};
use pattern::Side;

/// The side of a foot.
pub(crate) fn word(side: Side) -> &'static str {
    match side {
        Side::Left => "left",
        Side::Right => "right",
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
    use pattern::PhaseKind;

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
