//! What a solver says about a problem, whichever solver it is.

use nalgebra::DVector;

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// All tolerances are met.
    Solved,
    /// A point was found, but the backend stopped at its reduced tolerances (Clarabel's: 5e-5 and 1e-4 in its own
    /// scaling), because it got no farther or its limit of iterations came first. It may be as good as any or off in
    /// the fourth digit: judge by [`Report::residuals`], which are computed from the problem and not taken from the
    /// backend.
    SolvedInaccurately,
    /// No point satisfies the constraints; the multipliers are a certificate.
    Infeasible,
    /// The objective falls without bound along `x`.
    Unbounded,
    /// `P` is not positive semidefinite: [`Report::negative_curvature`] says by how much. Nothing was solved.
    NotConvex,
    /// The limit of iterations was reached first.
    IterationLimit,
    /// The limit of time was reached first.
    TimeLimit,
    /// The backend broke down numerically.
    NumericalFailure,
}

impl Status {
    /// Whether `x` may be used, its residuals permitting.
    #[must_use]
    pub fn has_solution(self) -> bool {
        matches!(self, Self::Solved | Self::SolvedInaccurately)
    }
}

/// Karush-Kuhn-Tucker residuals of the problem as given (not as a backend scaled it), each relative to the size of the
/// terms that should cancel, `max(1, largest term)`. Infinite where point or multipliers are not finite: maxima would
/// pass over a NaN.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Residuals {
    /// `|P x + c + A' y_eq + C' y_in + y_bound|`, largest component.
    pub stationarity: f64,
    /// Largest violation of an equality, inequality or bound.
    pub feasibility: f64,
    /// Largest product of a multiplier with the distance to its side.
    pub complementarity: f64,
}

impl Residuals {
    /// Of what is no point: as far off as can be.
    pub(crate) const NONE: Self =
        Self { stationarity: f64::INFINITY, feasibility: f64::INFINITY, complementarity: f64::INFINITY };

    /// The largest of the three.
    #[must_use]
    pub fn max(&self) -> f64 {
        self.stationarity.max(self.feasibility).max(self.complementarity)
    }
}

/// One constraint, by the array it stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Row {
    /// Row of `A`.
    Equality(usize),
    /// Row of `C`.
    Inequality(usize),
    /// Bound of a variable.
    Bound(usize),
}

/// A constraint that takes part in an infeasibility.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conflict {
    /// Which.
    pub row: Row,
    /// Its share of the certificate, signed as a multiplier (positive: the upper side), the largest of all being 1.
    pub weight: f64,
}

/// Result of one solve. Vectors keep their memory when a solver writes into an old report.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// How it ended.
    pub status: Status,
    /// Solution (n).
    pub x: DVector<f64>,
    /// Multipliers of `A x = b` (p).
    pub y_eq: DVector<f64>,
    /// Multipliers of `l <= C x <= u` (m), positive at the upper side.
    pub y_in: DVector<f64>,
    /// Multipliers of `lb <= x <= ub` (n), positive at the upper side.
    pub y_bound: DVector<f64>,
    /// `1/2 x' P x + c' x`.
    pub objective: f64,
    /// Optimality, recomputed from the problem.
    pub residuals: Residuals,
    /// Iterations of the method.
    pub iterations: u32,
    /// After [`Status::NotConvex`]: the least eigenvalue of `P`, or some `v' P v / v' v` that is lower; of a sparse `P`
    /// of more than 800 unknowns the worst pivot of `D P D`, scaled to largest entries of 1.
    pub negative_curvature: Option<f64>,
}

impl Report {
    /// Memory for a problem of `n` variables, `p` equalities, `m` inequalities.
    #[must_use]
    pub fn with_sizes(n: usize, p: usize, m: usize) -> Self {
        Self {
            status: Status::NumericalFailure,
            x: DVector::zeros(n),
            y_eq: DVector::zeros(p),
            y_in: DVector::zeros(m),
            y_bound: DVector::zeros(n),
            objective: f64::NAN,
            residuals: Residuals { stationarity: f64::NAN, feasibility: f64::NAN, complementarity: f64::NAN },
            iterations: 0,
            negative_curvature: None,
        }
    }

    /// The constraints that contradict each other, heaviest first: those whose multiplier in the certificate is at
    /// least `fraction` of the largest. Empty unless the status is [`Status::Infeasible`].
    #[must_use]
    pub fn conflict(&self, fraction: f64) -> Vec<Conflict> {
        if self.status != Status::Infeasible {
            return Vec::new();
        }
        let rows = (self.y_eq.iter().enumerate().map(|(i, y)| (Row::Equality(i), *y)))
            .chain(self.y_in.iter().enumerate().map(|(i, y)| (Row::Inequality(i), *y)))
            .chain(self.y_bound.iter().enumerate().map(|(i, y)| (Row::Bound(i), *y)));
        let largest = self.y_eq.amax().max(self.y_in.amax()).max(self.y_bound.amax());
        let mut conflict: Vec<_> = rows
            .filter(|(_, y)| largest > 0.0 && y.abs() >= fraction * largest)
            .map(|(row, y)| Conflict { row, weight: y / largest })
            .collect();
        conflict.sort_by(|a, b| b.weight.abs().total_cmp(&a.weight.abs()));
        conflict
    }
}
