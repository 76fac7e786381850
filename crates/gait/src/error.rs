use crate::constraint::RowLabel;
use pattern::Side;
use qp::Status;

/// Why there is no plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GaitError {
    /// A setting lies outside its range.
    #[error("{field} = {}: {remedy}", short(*.value))]
    Setting {
        /// Table and key.
        field: &'static str,
        /// What was found.
        value: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A list of durations has neither no element nor one per phase.
    #[error("{field} has {found} numbers for {expected} phases: give all of them or none")]
    Durations {
        /// Table and key.
        field: &'static str,
        /// Length of the list.
        found: usize,
        /// Number of phases.
        expected: usize,
    },
    /// The walk has more polynomials than can be planned in one go: plan it in parts, or more coarsely.
    #[error(
        "the walk has {phases} polynomials with {samples} samples each: at most {} polynomials and {} samples in all are planned in one go",
        crate::PHASES_MAX,
        crate::SAMPLES_MAX
    )]
    TooLarge {
        /// Polynomial pieces.
        phases: usize,
        /// Samples of each.
        samples: u32,
    },
    /// The margin leaves no place for the ZMP: reduce it below half of the sole's smaller side.
    #[error(
        "limits.zmp_margin_m = {margin_m} m empties the support polygon, whose smaller half-size is {half_size_m} m"
    )]
    EmptyPolygon {
        /// The margin.
        margin_m: f64,
        /// Half of the smaller side of the sole.
        half_size_m: f64,
    },
    /// The margin excludes the point under the ankle, where the feet's ZMPs are at start and stop: reduce it, or move the sole.
    #[error(
        "limits.zmp_margin_m = {margin_m} m excludes the ankle, which stands only {room_m:.6} m from the edge of the sole"
    )]
    AnkleOutsidePolygon {
        /// The margin.
        margin_m: f64,
        /// Distance of the ankle from the nearest edge.
        room_m: f64,
    },
    /// Two landings of the same foot follow each other: alternate them.
    #[error("step {step} moves the {foot:?} foot, which has just landed: feet must alternate")]
    SameFootTwice {
        /// Counted from 1.
        step: u32,
        /// The foot.
        foot: Side,
    },
    /// One of the last two landings is free: prescribe it, the walk ends on it.
    #[error("step {step} of {steps} is free, but the final stance (the last two landings) must be prescribed")]
    FreeFinalStance {
        /// Counted from 1.
        step: u32,
        /// N.
        steps: u32,
    },
    /// A prescribed landing breaks a rule of 3.5: move it or widen the limit.
    #[error("step {step}: the {foot:?} foot's {rule} would be {found_m:.6} m, but must be {} {limit_m:.6} m", if *.at_least { "at least" } else { "at most" })]
    Step {
        /// Counted from 1; 0 is the initial stance.
        step: u32,
        /// The foot that lands.
        foot: Side,
        /// What is measured.
        rule: &'static str,
        /// Its value.
        found_m: f64,
        /// Its bound.
        limit_m: f64,
        /// Whether the bound is a lower one.
        at_least: bool,
    },
    /// No motion satisfies all constraints. Those named cannot hold together: relax or lengthen where they say.
    #[error(
        "no motion satisfies all constraints; these conflict by at least {least_violation_m:.2e} m: {}",
        list(conflict)
    )]
    Infeasible {
        /// The rows that carry the certificate, heaviest first.
        conflict: Vec<RowLabel>,
        /// However the unknowns are chosen, some row is violated by at least this (m).
        least_violation_m: f64,
    },
    /// The solver did not finish. Report it with the configuration: every feasible problem should be solved.
    #[error("the solver stopped with {status:?} after {iterations} iterations, largest KKT residual {residual:.1e}")]
    NotSolved {
        /// How it ended.
        status: Status,
        /// After how many iterations.
        iterations: u32,
        /// How far from optimal.
        residual: f64,
    },
}

/// Without three hundred zeros.
fn short(value: f64) -> String {
    let readable = value == 0.0 || (1e-6..1e12).contains(&value.abs());
    if readable { value.to_string() } else { format!("{value:e}") }
}

fn list(conflict: &[RowLabel]) -> String {
    const SHOWN: usize = 4;
    let mut text = conflict.iter().take(SHOWN).map(ToString::to_string).collect::<Vec<_>>().join("; ");
    if conflict.len() > SHOWN {
        text += &format!("; and {} more", conflict.len() - SHOWN);
    }
    text
}
