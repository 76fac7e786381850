//! Why there is no plan.

use crate::label::RowLabel;
use pattern::Side;
use qp::Status;
use ranges::OutOfRange;

/// Polynomials of one walk: 3300 swings. Time and memory grow with them in proportion (3 s, 0.3 GB with 11 samples each).
pub const PHASES_MAX: usize = 10_000;
/// Polynomials times samples: a thousand swings with 41 samples are a quarter of it. At this limit 4 s, 0.7 GB.
pub const SAMPLES_MAX: usize = 500_000;

/// Why there is no plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GaitError {
    /// A setting lies outside its range, or does not fit another one.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// The walk has more polynomials than can be planned in one go: plan it in parts, or more coarsely.
    #[error(
        "the walk has {phases} polynomials with {samples} samples each: at most {} polynomials and {} samples in all are planned in one go",
        PHASES_MAX,
        SAMPLES_MAX
    )]
    TooLarge {
        /// Polynomial pieces.
        phases: usize,
        /// Samples of each.
        samples: u32,
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

fn list(conflict: &[RowLabel]) -> String {
    const SHOWN: usize = 4;
    let mut text = conflict.iter().take(SHOWN).map(ToString::to_string).collect::<Vec<_>>().join("; ");
    if conflict.len() > SHOWN {
        text += &format!("; and {} more", conflict.len() - SHOWN);
    }
    text
}
