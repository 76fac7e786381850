//! What a dense solver answers.

use super::Size;
use crate::{Conflict, Report, Row};

/// Which side of a two-sided row is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// `l` or `lb`.
    Lower,
    /// `u` or `ub`.
    Upper,
    /// Both: an equality.
    Both,
}

/// A row that holds with equality at the solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Active {
    /// The row.
    pub row: Row,
    /// The side that holds.
    pub side: Side,
}

/// Rows that exclude each other, and by how much.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Contradiction {
    /// The rows, heaviest first; empty when there is no contradiction. Their gradients, times the weights, sum to zero.
    pub rows: Vec<Conflict>,
    /// The row that cannot be met while all others of them hold.
    pub unmet: Option<Row>,
    /// By how much it is violated then, in its own unit: relaxing it by this much, and no less, removes this
    /// contradiction. Another row `i` does the same when it is relaxed by `amount |weight of unmet| / |weight i|`.
    pub amount: f64,
}

impl Contradiction {
    /// However the unknowns are chosen: with the equalities met, some inequality or bound among [`Contradiction::rows`]
    /// is violated by at least this much. Where equalities alone contradict each other, some equality is.
    #[must_use]
    pub fn least_violation(&self) -> f64 {
        let weights = |of_sides: bool| {
            let is_side = |row: &Row| !matches!(row, Row::Equality(_));
            self.rows.iter().filter(|c| is_side(&c.row) == of_sides).map(|c| c.weight.abs()).sum::<f64>()
        };
        let unmet = self.rows.iter().find(|c| Some(c.row) == self.unmet).map_or(0.0, |c| c.weight.abs());
        let total = if weights(true) > 0.0 { weights(true) } else { weights(false) };
        if total > 0.0 { self.amount * unmet / total } else { 0.0 }
    }
}

impl Contradiction {
    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.unmet = None;
        self.amount = 0.0;
    }
}

/// What a dense solve found. All memory is allocated when the solver is made.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Status, point, multipliers, residuals. After [`Status::IterationLimit`](crate::Status::IterationLimit) the point
    /// minimises over the rows taken up so far; after [`Status::Infeasible`](crate::Status::Infeasible) likewise, and
    /// the multipliers are the certificate.
    pub report: Report,
    /// Largest violation of any row or bound, in the units of the data (the residuals of the report are relative).
    pub violation: f64,
    /// The inequality rows and bounds that hold with equality (active set; empty for Clarabel).
    pub active: Vec<Active>,
    /// Which rows exclude each other, after [`Status::Infeasible`](crate::Status::Infeasible). The active set names the
    /// row that it could not take up; the interior point the heaviest row of the contradiction that all others depend
    /// on most.
    pub contradiction: Contradiction,
}

impl Outcome {
    pub(super) fn new(size: Size) -> Self {
        Self {
            report: Report::with_sizes(size.variables, size.equalities, size.inequalities),
            violation: f64::NAN,
            active: Vec::with_capacity(size.variables),
            contradiction: Contradiction { rows: Vec::with_capacity(size.variables + 2), ..Contradiction::default() },
        }
    }

    pub(super) fn clear(&mut self) {
        let report = &mut self.report;
        report.x.fill(0.0);
        report.y_eq.fill(0.0);
        report.y_in.fill(0.0);
        report.y_bound.fill(0.0);
        report.objective = f64::NAN;
        report.residuals =
            crate::Residuals { stationarity: f64::NAN, feasibility: f64::NAN, complementarity: f64::NAN };
        report.iterations = 0;
        report.negative_curvature = None;
        self.violation = f64::NAN;
        self.active.clear();
        self.contradiction.clear();
    }
}
