//! Inequalities: ZMPs inside the soles, footsteps that legs and shins allow.

use crate::label::RowLabel;
use crate::layout::Stand;
use crate::{GaitError, GaitSettings};
use pattern::Side;

/// The sole as seen from the ankle, in the axes of the foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outline {
    /// Rear and front edge (m).
    pub x: [f64; 2],
    /// Right and left edge (m).
    pub y: [f64; 2],
}

impl Outline {
    /// The rectangle of a foot, shrunk by `margin_m` on each side.
    pub fn new(settings: &GaitSettings, side: Side, margin_m: f64) -> Self {
        let sole = &settings.sole;
        let [ankle_x, ankle_y] = [sole.left_ankle_in_sole_m()[0], side.sign() * sole.left_ankle_in_sole_m()[1]];
        let (length, width) = (sole.length_m() / 2.0 - margin_m, sole.width_m() / 2.0 - margin_m);
        Self { x: [-length - ankle_x, length - ankle_x], y: [-width - ankle_y, width - ankle_y] }
    }

    /// Distance of the inner edge from the ankle (m), towards the other foot.
    pub fn inner(&self, side: Side) -> f64 {
        match side {
            Side::Left => -self.y[0],
            Side::Right => self.y[1],
        }
    }
}

/// `lower <= direction . (p_landing - p_stance) <= upper`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepRule {
    /// What it is about.
    pub label: RowLabel,
    /// Words for it.
    pub rule: &'static str,
    /// Unit vector.
    pub direction: [f64; 2],
    /// Lower side (m).
    pub lower: f64,
    /// Upper side (m).
    pub upper: f64,
    /// Added to the measured value when it is told to people (m): from ankle distance to gap.
    pub offset: f64,
}

/// The rules of one landing beside the stance foot, linear because both headings are given.
///
/// Gap: every corner of the landing foot's inner edge keeps its distance from the stance foot's inner edge (as an infinite
/// line), and every corner of the stance foot's from the landing foot's.
pub fn step_rules(landing: &Stand, stance: &Stand, settings: &GaitSettings) -> [StepRule; 4] {
    let (limits, step) = (&settings.limits, landing.step);
    let sigma = landing.side.sign();
    let axes = |yaw: f64| {
        let (sin, cos) = yaw.sin_cos();
        ([cos, sin], [-sin, cos])
    };
    let ((e1, e2), (l1, l2)) = (axes(stance.guess.yaw_rad), axes(landing.guess.yaw_rad));
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    // How far the corners of one foot's inner edge reach towards the other foot: soles mirror each other, so it is the same seen from
    // either.
    let sole = Outline::new(settings, landing.side, 0.0);
    let inner = sole.inner(landing.side);
    let (sin, cos) = (dot(e2, l1), dot(e1, l1));
    let reach = sole.x.into_iter().map(|x| inner * cos - sigma * x * sin).fold(f64::NEG_INFINITY, f64::max);
    let gap = |across: [f64; 2]| StepRule {
        label: RowLabel::FeetGap { step },
        rule: "gap to the other foot",
        direction: across.map(|c| sigma * c),
        lower: limits.feet_gap_min_m + inner + reach,
        upper: f64::INFINITY,
        offset: -inner - reach,
    };
    [
        StepRule {
            label: RowLabel::StepLength { step },
            rule: "distance along the stance foot",
            direction: e1,
            lower: -limits.step_length_max_m,
            upper: limits.step_length_max_m,
            offset: 0.0,
        },
        StepRule {
            label: RowLabel::StepWidth { step },
            rule: "distance across the stance foot",
            direction: e2.map(|c| sigma * c),
            lower: f64::NEG_INFINITY,
            upper: limits.step_width_max_m,
            offset: 0.0,
        },
        gap(e2),
        gap(l2),
    ]
}

/// Whether two prescribed stands keep the rules.
///
/// # Errors
/// The first rule that is broken, with both numbers. Rounding of the footholds' coordinates is forgiven.
pub fn check_prescribed(landing: &Stand, stance: &Stand, settings: &GaitSettings) -> Result<(), GaitError> {
    let (a, b) = (landing.guess.position(), stance.guess.position());
    let rounding = 8.0 * f64::EPSILON * (1.0 + a.amax().max(b.amax()));
    for rule in step_rules(landing, stance, settings) {
        let value = rule.direction[0] * (a.x - b.x) + rule.direction[1] * (a.y - b.y);
        let error = |found: f64, limit: f64, at_least: bool| GaitError::Step {
            step: landing.step,
            foot: landing.side,
            rule: rule.rule,
            found_m: found + rule.offset,
            limit_m: limit + rule.offset,
            at_least,
        };
        if value > rule.upper + rounding {
            return Err(error(value, rule.upper, false));
        }
        if value < rule.lower - rounding {
            // Backwards: distances are told as positive numbers.
            return Err(if rule.upper == -rule.lower {
                error(-value, rule.upper, false)
            } else {
                error(value, rule.lower, true)
            });
        }
    }
    Ok(())
}
