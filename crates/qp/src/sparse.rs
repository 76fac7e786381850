//! Sparse problems: matrices by compressed columns, assembled from triplets.

use crate::{Report, Residuals};
use nalgebra::DVector;

/// Share of a certificate below which a multiplier is what the solver's tolerance leaves.
const CERTIFICATE_NOISE: f64 = 1e-7;

/// Entries `(row, column, value)` in any order; entries at the same place add up.
#[derive(Debug, Clone, Default)]
pub struct Triplets {
    entries: Vec<(usize, usize, f64)>,
}

impl Triplets {
    /// No entries, room for `capacity` of them.
    #[must_use]
    pub fn with_capacity(capacity: usize) -> Self {
        Self { entries: Vec::with_capacity(capacity) }
    }

    /// Adds `value` at (`row`, `column`).
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        self.entries.push((row, column, value));
    }

    /// Compressed columns; explicit zeros are kept, so that the pattern does not depend on the values.
    ///
    /// Two counting sorts (by row, then by column): the time is linear in entries, rows and columns.
    ///
    /// # Panics
    /// If an entry lies outside `rows` x `columns`.
    #[must_use]
    pub fn into_matrix(self, rows: usize, columns: usize) -> SparseMatrix {
        let by_row = counting_sort(&self.entries, rows, |e| e.0);
        let by_column = counting_sort(&by_row, columns, |e| e.1);
        let mut matrix = SparseMatrix {
            rows,
            columns,
            column_starts: vec![0; columns + 1],
            row_indices: Vec::with_capacity(by_column.len()),
            values: Vec::with_capacity(by_column.len()),
        };
        let mut previous = None;
        for (row, column, value) in by_column {
            if previous == Some((row, column)) {
                *matrix.values.last_mut().expect("an entry was pushed before") += value;
            } else {
                matrix.row_indices.push(row);
                matrix.values.push(value);
                matrix.column_starts[column + 1] += 1;
                previous = Some((row, column));
            }
        }
        for j in 0..columns {
            matrix.column_starts[j + 1] += matrix.column_starts[j];
        }
        matrix
    }
}

fn counting_sort(
    entries: &[(usize, usize, f64)],
    keys: usize,
    key: impl Fn(&(usize, usize, f64)) -> usize,
) -> Vec<(usize, usize, f64)> {
    let mut starts = vec![0; keys + 1];
    for entry in entries {
        assert!(key(entry) < keys, "entry {entry:?} outside a dimension of {keys}");
        starts[key(entry) + 1] += 1;
    }
    for k in 0..keys {
        starts[k + 1] += starts[k];
    }
    let mut sorted = vec![(0, 0, 0.0); entries.len()];
    for entry in entries {
        let slot = &mut starts[key(entry)];
        sorted[*slot] = *entry;
        *slot += 1;
    }
    sorted
}

/// Matrix by compressed columns, row indices ascending within a column.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseMatrix {
    rows: usize,
    columns: usize,
    column_starts: Vec<usize>,
    row_indices: Vec<usize>,
    values: Vec<f64>,
}

impl SparseMatrix {
    /// All zero.
    #[must_use]
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Triplets::default().into_matrix(rows, columns)
    }

    /// From a dense matrix, zeros left out.
    #[must_use]
    pub fn from_dense(dense: &nalgebra::DMatrix<f64>) -> Self {
        let mut triplets = Triplets::default();
        for j in 0..dense.ncols() {
            for i in 0..dense.nrows() {
                if dense[(i, j)] != 0.0 {
                    triplets.add(i, j, dense[(i, j)]);
                }
            }
        }
        triplets.into_matrix(dense.nrows(), dense.ncols())
    }

    /// As a dense matrix.
    #[must_use]
    pub fn to_dense(&self) -> nalgebra::DMatrix<f64> {
        let mut dense = nalgebra::DMatrix::zeros(self.rows, self.columns);
        for (i, j, value) in self.iter() {
            dense[(i, j)] = value;
        }
        dense
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Stored entries.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Stored entries `(row, column, value)`, column by column.
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.columns).flat_map(move |j| {
            (self.column_starts[j]..self.column_starts[j + 1]).map(move |k| (self.row_indices[k], j, self.values[k]))
        })
    }

    /// `M x`.
    ///
    /// # Panics
    /// If `x` has the wrong length.
    #[must_use]
    pub fn product(&self, x: &DVector<f64>) -> DVector<f64> {
        assert_eq!(x.len(), self.columns);
        let mut out = DVector::zeros(self.rows);
        for (i, j, value) in self.iter() {
            out[i] += value * x[j];
        }
        out
    }

    /// `M' y`.
    ///
    /// # Panics
    /// If `y` has the wrong length.
    #[must_use]
    pub fn transposed_product(&self, y: &DVector<f64>) -> DVector<f64> {
        assert_eq!(y.len(), self.rows);
        let mut out = DVector::zeros(self.columns);
        for (i, j, value) in self.iter() {
            out[j] += value * y[i];
        }
        out
    }
}

/// A problem whose numbers do not fit together.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// An array has another size than the number of variables or rows asks for.
    #[error("{array} is {found} where {expected} is needed")]
    Shape {
        /// Name of the array, as in the crate's documentation.
        array: &'static str,
        /// Its size.
        found: usize,
        /// The size that fits.
        expected: usize,
    },
    /// A number is NaN, or infinite where only finite numbers make sense.
    #[error("{array}[{index}] = {value} is not a number a problem can be made of")]
    NotFinite {
        /// Name of the array.
        array: &'static str,
        /// Position in it.
        index: usize,
        /// What stands there.
        value: f64,
    },
    /// A lower side lies above its upper side: empty before any solving.
    #[error("{lower_array}[{index}] = {lower} lies above {upper_array}[{index}] = {upper}")]
    Crossed {
        /// Name of the array of lower sides.
        lower_array: &'static str,
        /// Name of the array of upper sides.
        upper_array: &'static str,
        /// Row or variable.
        index: usize,
        /// Lower side.
        lower: f64,
        /// Upper side.
        upper: f64,
    },
}

/// The problem of the crate's documentation with sparse `P` (both triangles stored), `A`, `C`.
#[derive(Debug, Clone, PartialEq)]
pub struct QuadraticProgram {
    /// Hessian, n x n, both triangles.
    pub P: SparseMatrix,
    /// Linear cost (n).
    pub c: DVector<f64>,
    /// Equality rows, p x n.
    pub A: SparseMatrix,
    /// Equality right-hand sides (p).
    pub b: DVector<f64>,
    /// Inequality rows, m x n.
    pub C: SparseMatrix,
    /// Lower sides (m), minus infinity = none.
    pub l: DVector<f64>,
    /// Upper sides (m), infinity = none.
    pub u: DVector<f64>,
    /// Lower bounds (n), minus infinity = none.
    pub lb: DVector<f64>,
    /// Upper bounds (n), infinity = none.
    pub ub: DVector<f64>,
}

impl QuadraticProgram {
    /// An unconstrained problem; constraints are set as fields.
    #[must_use]
    pub fn unconstrained(P: SparseMatrix, c: DVector<f64>) -> Self {
        let n = c.len();
        Self {
            P,
            c,
            A: SparseMatrix::zeros(0, n),
            b: DVector::zeros(0),
            C: SparseMatrix::zeros(0, n),
            l: DVector::zeros(0),
            u: DVector::zeros(0),
            lb: DVector::repeat(n, f64::NEG_INFINITY),
            ub: DVector::repeat(n, f64::INFINITY),
        }
    }

    /// Number of variables n.
    #[must_use]
    pub fn variables(&self) -> usize {
        self.c.len()
    }

    /// Shapes agree, numbers are finite where they must be, no sides are crossed.
    ///
    /// # Errors
    /// The first thing that does not fit.
    pub fn check(&self) -> Result<(), ProblemError> {
        let (n, p, m) = (self.c.len(), self.b.len(), self.l.len());
        for (array, found, expected) in [
            ("rows of P", self.P.rows, n),
            ("columns of P", self.P.columns, n),
            ("rows of A", self.A.rows, p),
            ("columns of A", self.A.columns, n),
            ("rows of C", self.C.rows, m),
            ("columns of C", self.C.columns, n),
            ("length of u", self.u.len(), m),
            ("length of lb", self.lb.len(), n),
            ("length of ub", self.ub.len(), n),
        ] {
            if found != expected {
                return Err(ProblemError::Shape { array, found, expected });
            }
        }
        for (array, values, infinite_allowed) in [
            ("P", self.P.values.as_slice(), false),
            ("A", self.A.values.as_slice(), false),
            ("C", self.C.values.as_slice(), false),
            ("c", self.c.as_slice(), false),
            ("b", self.b.as_slice(), false),
            ("l", self.l.as_slice(), true),
            ("u", self.u.as_slice(), true),
            ("lb", self.lb.as_slice(), true),
            ("ub", self.ub.as_slice(), true),
        ] {
            for (index, &value) in values.iter().enumerate() {
                if value.is_nan() || (!infinite_allowed && value.is_infinite()) {
                    return Err(ProblemError::NotFinite { array, index, value });
                }
            }
        }
        for (lower_array, upper_array, lower, upper) in [("l", "u", &self.l, &self.u), ("lb", "ub", &self.lb, &self.ub)]
        {
            for (index, (&lower, &upper)) in lower.iter().zip(upper).enumerate() {
                if lower > upper || lower == f64::INFINITY || upper == f64::NEG_INFINITY {
                    return Err(ProblemError::Crossed { lower_array, upper_array, index, lower, upper });
                }
            }
        }
        Ok(())
    }

    /// `1/2 x' P x + c' x`.
    #[must_use]
    pub fn objective(&self, x: &DVector<f64>) -> f64 {
        0.5 * x.dot(&self.P.product(x)) + self.c.dot(x)
    }

    /// Optimality of a point with its multipliers, see [`Residuals`].
    #[must_use]
    pub fn residuals(
        &self,
        x: &DVector<f64>,
        y_eq: &DVector<f64>,
        y_in: &DVector<f64>,
        y_bound: &DVector<f64>,
    ) -> Residuals {
        if ![x, y_eq, y_in, y_bound].into_iter().flatten().all(|entry| entry.is_finite()) {
            return Residuals::NONE;
        }
        let scale = |terms: &[&DVector<f64>]| terms.iter().map(|t| t.amax()).fold(1.0, f64::max);
        let (Px, Ay, Cy) = (self.P.product(x), self.A.transposed_product(y_eq), self.C.transposed_product(y_in));
        let stationarity = (&Px + &self.c + &Ay + &Cy + y_bound).amax() / scale(&[&Px, &self.c, &Ay, &Cy, y_bound]);

        let (Ax, Cx) = (self.A.product(x), self.C.product(x));
        let mut feasibility = (&Ax - &self.b).amax() / scale(&[&Ax, &self.b]);
        let mut complementarity = 0.0_f64;
        let y_scale = scale(&[y_in, y_bound]);
        for (value, lower, upper, y) in [(&Cx, &self.l, &self.u, y_in), (x, &self.lb, &self.ub, y_bound)] {
            let value_scale = scale(&[value]);
            for i in 0..value.len() {
                let below = lower[i] - value[i];
                let above = value[i] - upper[i];
                feasibility = feasibility.max(below.max(above) / value_scale);
                // The side the multiplier's sign claims to be active; a multiplier towards an absent side counts in
                // full.
                let distance = if y[i] > 0.0 { above.abs() } else { below.abs() };
                let product = if distance.is_finite() { distance * y[i].abs() } else { y[i].abs() };
                complementarity = complementarity.max(product / (y_scale * value_scale));
            }
        }
        Residuals { stationarity, feasibility, complementarity }
    }

    /// Of an infeasible problem: however `x` is chosen, with the equalities met some inequality or bound is violated by
    /// at least this much. From the certificate `A' y_eq + C' y_in + y_bound = 0`: the sum of all `|y| * violation` is
    /// at least minus the support value `b' y_eq + sum (y > 0: u y, y < 0: l y)`. Where the equalities alone contradict
    /// each other: some equality is violated by at least this much.
    #[must_use]
    pub fn least_violation(&self, report: &Report) -> f64 {
        let side = |y: f64, lower: f64, upper: f64| match y {
            y if y > 0.0 && upper.is_finite() => upper * y,
            y if y < 0.0 && lower.is_finite() => lower * y,
            _ => 0.0,
        };
        let sum = |y: &DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>| {
            y.iter().zip(lower).zip(upper).map(|((y, l), u)| side(*y, *l, *u)).sum::<f64>()
        };
        let support =
            self.b.dot(&report.y_eq) + sum(&report.y_in, &self.l, &self.u) + sum(&report.y_bound, &self.lb, &self.ub);
        let size = |y: &DVector<f64>| y.iter().map(|y| y.abs()).sum::<f64>();
        let (sides, equalities) = (size(&report.y_in) + size(&report.y_bound), size(&report.y_eq));
        // A certificate of equalities alone leans on the sides by rounding only.
        let total = if sides > CERTIFICATE_NOISE * equalities { sides } else { equalities };
        if total > 0.0 { (-support / total).max(0.0) } else { 0.0 }
    }
}
