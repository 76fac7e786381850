//! What is asked of a pattern from elsewhere before anybody evaluates it.
//!
//! A pattern comes out of a file or out of shared memory: whatever it holds, its reader must not end in a panic, in a division by
//! zero or in numbers that are none, and no motor may see a jump. [`WalkPattern::check`] asks for exactly that; whether the
//! walk is a good one is the planner's business.

use crate::{Foothold, PATTERN_VERSION, Phase, PhaseKind, Quintic, Side, Swing, WalkPattern};

/// Smallest and largest value of mass (kg), gravity (m/s^2) and heights (m): beyond any robot and any planet; within, no product
/// of them overflows.
const CONSTANTS: [f64; 2] = [1e-3, 1e6];
/// Smallest and largest duration of a phase or a flight (s). A quintic divides by the fifth power of its duration, the snap of the
/// COM by the fourth.
const DURATIONS_S: [f64; 2] = [1e-6, 1e6];
/// Largest term `a_i T^i` of a polynomial, largest coordinate (m). Terms of a COM's closed form are at most 24 times as large as what
/// they describe.
const LENGTH_MAX_M: f64 = 1e9;
/// Smallest `T^p κ`: the planner's transfers keep it above 1/4. The ZMP of foot 2 divides by it.
const SHARE_MIN: f64 = 1e-3;
/// By how much rounding may make foot 1's share of the load negative.
const SHARE_ROUNDING: f64 = 1e-9;
/// Largest jump of a position where phases meet (m). The planner's are rounding, below 1e-12 m near the origin and 1e-9 m a thousand
/// kilometres away; what a robot could feel begins at a hundred times this.
const JUMP_MAX_M: f64 = 1e-6;
/// Largest jump of a velocity (m/s), for the same reasons.
const JUMP_MAX_M_PER_S: f64 = 1e-6;
/// How often an interval is halved in search of a sign. Polynomials with room to spare need none.
const HALVINGS_MAX: u32 = 32;

/// A pattern that no planner of this version would write. The remedy is the same for all: plan again, with this build.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PatternError {
    /// Written by another version.
    #[error("the pattern has version {found}, this build reads versions 1 to {PATTERN_VERSION}")]
    Version {
        /// What the pattern says.
        found: u32,
    },
    /// There is nothing to walk.
    #[error("the pattern has no phases")]
    Empty,
    /// A constant of the walk is no number, or beyond any robot.
    #[error("{field} = {value} lies outside {min:e} to {max:e}")]
    Constant {
        /// Which.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// A phase does not start where the one before ends, or its duration is none.
    #[error("phase {phase} starts at {start_s} s and lasts {duration_s} s, but the one before ends at {expected_s} s")]
    Time {
        /// Index of the phase.
        phase: usize,
        /// Its start.
        start_s: f64,
        /// Its duration.
        duration_s: f64,
        /// End of the phase before it.
        expected_s: f64,
    },
    /// A coefficient is no number, or describes motions of more than a million kilometres.
    #[error("phase {phase}: the {of} has a coefficient that is no number or far too large")]
    Coefficient {
        /// Index of the phase.
        phase: usize,
        /// Which polynomial, or which place.
        of: &'static str,
    },
    /// The load share of a foot vanishes or exceeds 1 where it must not, or is none of the forms that can be evaluated.
    #[error("phase {phase}: the load share {rule}")]
    LoadShare {
        /// Index of the phase.
        phase: usize,
        /// What is wrong with it.
        rule: &'static str,
    },
    /// What the feet do does not fit the kind of the phase, or what they did before.
    #[error("phase {phase}: the {foot:?} foot {rule}")]
    Foot {
        /// Index of the phase.
        phase: usize,
        /// Which foot.
        foot: Side,
        /// What is wrong with it.
        rule: &'static str,
    },
    /// A flight has no duration or does not last as long as the single support it belongs to.
    #[error(
        "phase {phase}, {start_s} s to {end_s} s: the {foot:?} foot flies from {t_start_s} s to {t_end_s} s, which must be the whole single support"
    )]
    Flight {
        /// Index of the phase.
        phase: usize,
        /// Which foot.
        foot: Side,
        /// Start of the phase.
        start_s: f64,
        /// End of the phase.
        end_s: f64,
        /// Take-off.
        t_start_s: f64,
        /// Landing.
        t_end_s: f64,
    },
    /// A quantity jumps where two phases meet.
    #[error("the {of} jumps by {found:e} at the start of phase {phase}, at most {limit:e} is possible")]
    Jump {
        /// Index of the later phase.
        phase: usize,
        /// Which quantity, with its unit.
        of: &'static str,
        /// The largest component of the jump.
        found: f64,
        /// What rounding may do.
        limit: f64,
    },
}

impl WalkPattern {
    /// Whether the pattern can be followed: [`evaluate`](Self::evaluate) gives finite numbers at all times, no load share is
    /// divided by that vanishes, flights last as long as their single supports, feet stay where they are until they fly, COM and
    /// ZMP do not jump. To be called once on data from elsewhere; allocates nothing.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<(), PatternError> {
        if !(1..=PATTERN_VERSION).contains(&self.version) {
            return Err(PatternError::Version { found: self.version });
        }
        self.check_constants()?;
        if self.phases.is_empty() {
            return Err(PatternError::Empty);
        }
        let mut expected_s = 0.0;
        for (i, phase) in self.phases.iter().enumerate() {
            let Phase { start_s, duration_s, .. } = *phase;
            let in_order = meet(start_s, expected_s) && is_duration(duration_s);
            if !in_order {
                return Err(PatternError::Time { phase: i, start_s, duration_s, expected_s });
            }
            expected_s = phase.end_s();
            check_coefficients(i, phase)?;
            check_share(i, phase)?;
            check_feet(i, phase)?;
            if i > 0 {
                check_stances(i, &self.phases[i - 1], phase)?;
                self.check_joint(i)?;
            }
        }
        Ok(())
    }

    fn check_constants(&self) -> Result<(), PatternError> {
        let [[left_x, left_y], [right_x, right_y]] = self.ankle_in_sole_m;
        let [min, max] = CONSTANTS;
        for (field, value, min) in [
            ("mass_kg", self.mass_kg, min),
            ("gravity_m_per_s2", self.gravity_m_per_s2, min),
            ("com_height_m", self.com_height_m, min),
            ("ankle_height_m", self.ankle_height_m, 0.0),
            ("ankle_in_sole_m[0][0]", left_x, -max),
            ("ankle_in_sole_m[0][1]", left_y, -max),
            ("ankle_in_sole_m[1][0]", right_x, -max),
            ("ankle_in_sole_m[1][1]", right_y, -max),
        ] {
            if !(min..=max).contains(&value) {
                return Err(PatternError::Constant { field, value, min, max });
            }
        }
        Ok(())
    }

    /// COM and ZMP where phase `i` begins.
    fn check_joint(&self, i: usize) -> Result<(), PatternError> {
        let (before, after) = (self.evaluate_phase(i - 1, f64::INFINITY), self.evaluate_phase(i, 0.0));
        for (of, jump, limit) in [
            ("COM (m)", after.com.position - before.com.position, JUMP_MAX_M),
            ("velocity of the COM (m/s)", after.com.velocity - before.com.velocity, JUMP_MAX_M_PER_S),
            ("ZMP (m)", after.zmp.position - before.zmp.position, JUMP_MAX_M),
            ("shift of the ZMP (m)", after.zmp_shift.position - before.zmp_shift.position, JUMP_MAX_M),
            ("rate of that shift (m/s)", after.zmp_shift.velocity - before.zmp_shift.velocity, JUMP_MAX_M_PER_S),
        ] {
            let found = jump.amax();
            let smooth = found <= limit;
            if !smooth {
                return Err(PatternError::Jump { phase: i, of, found, limit });
            }
        }
        Ok(())
    }
}

fn is_duration(duration_s: f64) -> bool {
    (DURATIONS_S[0]..=DURATIONS_S[1]).contains(&duration_s)
}

/// Whether two times are the same. Times are running sums of durations: they agree up to rounding of the sum.
fn meet(a_s: f64, b_s: f64) -> bool {
    (a_s - b_s).abs() <= f64::EPSILON * (1.0 + b_s.abs()) * 4.0
}

fn is_length(value: f64) -> bool {
    value.abs() <= LENGTH_MAX_M
}

fn check_coefficients(index: usize, phase: &Phase) -> Result<(), PatternError> {
    let T = phase.duration_s;
    let fits = |quintic: &Quintic, power: u32| {
        let scale = T.powi(power as i32);
        quintic.0.iter().enumerate().all(|(i, a)| is_length(a * T.powi(i as i32) * scale))
    };
    let power = phase.load.cancelled_power;
    if ![0, 3].contains(&power) {
        return Err(PatternError::LoadShare { phase: index, rule: "is divided by another power of time than 0 or 3" });
    }
    let com = |c: &crate::ComSolution| fits(&c.polynomial, 0) && is_length(c.decaying) && is_length(c.growing);
    let foothold = |f: &Foothold| is_length(f.x_m) && is_length(f.y_m) && is_length(f.yaw_rad);
    let flight = |s: &Swing| foothold(&s.from_foothold) && (0.0..=LENGTH_MAX_M).contains(&s.apex_m);
    let places =
        (phase.feet.iter()).all(|foot| foothold(&foot.ankle_foothold) && foot.swing.as_ref().is_none_or(flight));
    for (of, fits) in [
        ("ZMP", phase.zmp.iter().all(|q| fits(q, 0))),
        ("ZMP of foot 1", phase.zmp_1.iter().all(|q| fits(q, 0))),
        ("COM", phase.com.iter().all(com)),
        ("distance between ZMPs", phase.load.excess.iter().all(|q| fits(q, power))),
        ("load share", fits(&phase.load.share, power)),
        ("shift of the ZMP", phase.zmp_shift.is_small()),
        ("foothold or swing of a foot", places),
    ] {
        if !fits {
            return Err(PatternError::Coefficient { phase: index, of });
        }
    }
    Ok(())
}

fn check_share(index: usize, phase: &Phase) -> Result<(), PatternError> {
    let load = &phase.load;
    let refuse = |rule| Err(PatternError::LoadShare { phase: index, rule });
    if phase.kind == PhaseKind::SingleSupport {
        let alone = *load == crate::Load::single_support();
        return if alone { Ok(()) } else { refuse("is not all on the foot that stands") };
    }
    let power = load.cancelled_power as usize;
    let quintics = [&load.share, &load.excess[0], &load.excess[1]];
    if power > 0 && quintics.iter().any(|quintic| quintic.0[3..].iter().any(|a| *a != 0.0)) {
        return refuse("is no quintic divided by the cube of time");
    }
    // In s = t/T: share = s^p * scaled(s).
    let T = phase.duration_s;
    let scaled: [f64; 6] = std::array::from_fn(|i| load.share.0[i] * T.powi((i + power) as i32));
    if !stays_above(power_to_bernstein(scaled), SHARE_MIN, HALVINGS_MAX) {
        return refuse("of the foot that takes the load vanishes");
    }
    let mut rest = [0.0; 6];
    rest[0] = 1.0;
    for (i, a) in scaled.into_iter().take(6 - power).enumerate() {
        rest[i + power] -= a;
    }
    if !stays_above(power_to_bernstein(rest), -SHARE_ROUNDING, HALVINGS_MAX) {
        return refuse("of the foot that gives the load is negative");
    }
    Ok(())
}

/// Coefficients over the Bernstein basis of degree 5 on 0..1: a polynomial lies between the smallest and the largest of them.
fn power_to_bernstein(a: [f64; 6]) -> [f64; 6] {
    const CHOOSE_5: [f64; 6] = [1.0, 5.0, 10.0, 10.0, 5.0, 1.0];
    std::array::from_fn(|j| {
        let mut choose_j = 1.0; // j over i
        let mut sum = 0.0;
        for (i, a) in a.iter().enumerate().take(j + 1) {
            sum += choose_j / CHOOSE_5[i] * a;
            choose_j *= (j - i) as f64 / (i + 1) as f64;
        }
        sum
    })
}

/// Whether the polynomial is at least `floor` on all of 0..1: not at samples, everywhere. One that touches the floor without
/// its coefficients saying so counts as below it.
fn stays_above(bernstein: [f64; 6], floor: f64, halvings: u32) -> bool {
    if bernstein.iter().all(|b| *b >= floor) {
        return true;
    }
    let ends_above = bernstein[0] >= floor && bernstein[5] >= floor;
    if !ends_above || halvings == 0 {
        return false;
    }
    // De Casteljau at the middle: the first column belongs to the left half, the last row to the right one.
    let (mut left, mut right) = (bernstein, bernstein);
    for (level, first) in left.iter_mut().enumerate().skip(1) {
        for i in 0..6 - level {
            right[i] = 0.5 * (right[i] + right[i + 1]);
        }
        *first = right[0];
    }
    stays_above(left, floor, halvings - 1) && stays_above(right, floor, halvings - 1)
}

fn check_feet(index: usize, phase: &Phase) -> Result<(), PatternError> {
    let (start_s, end_s) = (phase.start_s, phase.end_s());
    for (side, foot) in Side::BOTH.into_iter().zip(&phase.feet) {
        let refuse = |rule| Err(PatternError::Foot { phase: index, foot: side, rule });
        let flies = phase.kind == PhaseKind::SingleSupport && side == phase.foot_1;
        match foot.swing {
            None if flies => return refuse("carries no load in single support, but has no flight"),
            Some(_) if !flies => return refuse("flies where it must stand"),
            None => {
                let known = foot.contact_since_s <= start_s || meet(foot.contact_since_s, start_s);
                if !known {
                    return refuse("stands before its contact begins");
                }
            }
            Some(Swing { t_start_s, t_end_s, .. }) => {
                let covers = (t_start_s <= start_s || meet(t_start_s, start_s))
                    && (t_end_s >= end_s || meet(t_end_s, end_s))
                    && is_duration(t_end_s - t_start_s);
                if !covers {
                    return Err(PatternError::Flight { phase: index, foot: side, start_s, end_s, t_start_s, t_end_s });
                }
                if !foot.contact_since_s.is_finite() {
                    return refuse("has no time of contact");
                }
            }
        }
    }
    Ok(())
}

/// Feet stay where they are until they take off, and land where they said. The numbers are copies of each other: equal to the bit.
fn check_stances(index: usize, before: &Phase, phase: &Phase) -> Result<(), PatternError> {
    for (side, (was, is)) in Side::BOTH.into_iter().zip(before.feet.iter().zip(&phase.feet)) {
        let refuse = |rule| Err(PatternError::Foot { phase: index, foot: side, rule });
        match (was.swing, is.swing) {
            (None, Some(swing)) if swing.from_foothold != was.ankle_foothold => {
                return refuse("does not take off where it stood");
            }
            (None, Some(swing)) if !meet(swing.t_start_s, phase.start_s) => {
                return refuse("took off before its single support");
            }
            (None, Some(_)) => {}
            (Some(swing), None) if !meet(swing.t_end_s, phase.start_s) => {
                return refuse("lands when it already stands");
            }
            (Some(a), Some(b)) if a != b => return refuse("changes its flight in the air"),
            _ if was.ankle_foothold != is.ankle_foothold => return refuse("changes its foothold"),
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_is_seen_below_its_floor_between_any_samples() {
        // (s - c)^2 + depth dips around c; floor 0.
        for c in [0.03, 0.31, 0.5, 0.777] {
            for (depth, above) in [(1e-6, true), (-1e-6, false)] {
                let bernstein = power_to_bernstein([c * c + depth, -2.0 * c, 1.0, 0.0, 0.0, 0.0]);
                assert_eq!(stays_above(bernstein, 0.0, HALVINGS_MAX), above, "{c} {depth}");
            }
        }
        assert!(!stays_above([f64::NAN; 6], 0.0, HALVINGS_MAX));
    }

    #[test]
    fn bernstein_coefficients_end_at_the_ends_and_a_straight_line_keeps_its_slope() {
        let b = power_to_bernstein([1.0, -2.0, 0.5, 3.0, -1.0, 0.25]);
        assert!((b[0] - 1.0).abs() < 1e-15 && (b[5] - 1.75).abs() < 1e-14);
        let line = power_to_bernstein([1.0, 5.0, 0.0, 0.0, 0.0, 0.0]);
        for (i, b) in line.into_iter().enumerate() {
            assert!((b - 1.0 - i as f64).abs() < 1e-14);
        }
    }
}
