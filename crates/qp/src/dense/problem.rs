//! Dense quadratic programs.

use crate::{Residuals, Row};
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// A strictly convex quadratic program with dense data:
///
/// ```text
/// minimise    1/2 xᵀ P x + cᵀ x
/// subject to  A x = b,    l <= C x <= u,    lb <= x <= ub
/// ```
///
/// Infinite entries of `l, u, lb, ub` mean "no bound". Every field may be rewritten between solves as long as the sizes
/// stay: a solver is made for one size. Of P only the lower triangle and the diagonal are read by the active-set solver;
/// [`Problem::residuals`] reads all of it, so keep it symmetric.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// P, n x n, symmetric positive definite.
    pub P: DMatrix<f64>,
    /// c, n.
    pub c: DVector<f64>,
    /// A, rows x n.
    pub A: DMatrix<f64>,
    /// b.
    pub b: DVector<f64>,
    /// C, rows x n.
    pub C: DMatrix<f64>,
    /// l.
    pub l: DVector<f64>,
    /// u.
    pub u: DVector<f64>,
    /// lb, n.
    pub lb: DVector<f64>,
    /// ub, n.
    pub ub: DVector<f64>,
}

/// Number of unknowns and rows of a [`Problem`]; a solver is made for one size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Size {
    /// Unknowns n.
    pub variables: usize,
    /// Rows of A.
    pub equalities: usize,
    /// Rows of C.
    pub inequalities: usize,
}

/// A field of a [`Problem`] cannot be what it is.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum ProblemError {
    /// The sizes of two fields contradict each other: give the named field the expected shape.
    #[error("`{field}` is {found_rows} x {found_columns}, expected {rows} x {columns}")]
    Shape {
        /// Name in the equation of [`Problem`]: P, c, A, b, C, l, u, lb or ub.
        field: &'static str,
        /// Expected rows.
        rows: usize,
        /// Expected columns.
        columns: usize,
        /// Rows found.
        found_rows: usize,
        /// Columns found.
        found_columns: usize,
    },
    /// An entry is not a number, or infinite where only finite numbers have a meaning.
    #[error("`{field}` has the entry {value} at ({row}, {column})")]
    Entry {
        /// Name in the equation of [`Problem`].
        field: &'static str,
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// The value found.
        value: f64,
    },
}

impl Problem {
    /// Minimise ½‖x‖² with rows of zeros that demand nothing: the memory to be filled.
    #[must_use]
    pub fn new(size: Size) -> Self {
        let Size { variables: n, equalities, inequalities } = size;
        Self {
            P: DMatrix::identity(n, n),
            c: DVector::zeros(n),
            A: DMatrix::zeros(equalities, n),
            b: DVector::zeros(equalities),
            C: DMatrix::zeros(inequalities, n),
            l: DVector::from_element(inequalities, f64::NEG_INFINITY),
            u: DVector::from_element(inequalities, f64::INFINITY),
            lb: DVector::from_element(n, f64::NEG_INFINITY),
            ub: DVector::from_element(n, f64::INFINITY),
        }
    }

    /// Number of unknowns and rows, from the vectors c, b, l.
    #[must_use]
    pub fn size(&self) -> Size {
        Size { variables: self.c.len(), equalities: self.b.len(), inequalities: self.l.len() }
    }

    /// Checks shapes and entries: for problems that come from outside; a control step need not pay for it.
    ///
    /// # Errors
    /// [`ProblemError`] names the first field that is wrong, and how.
    pub fn check(&self) -> Result<(), ProblemError> {
        let Size { variables: n, equalities: e, inequalities: m } = self.size();
        let shape = |field, (found_rows, found_columns), rows, columns| {
            if (found_rows, found_columns) == (rows, columns) {
                Ok(())
            } else {
                Err(ProblemError::Shape { field, rows, columns, found_rows, found_columns })
            }
        };
        shape("P", self.P.shape(), n, n)?;
        shape("A", self.A.shape(), e, n)?;
        shape("C", self.C.shape(), m, n)?;
        shape("u", self.u.shape(), m, 1)?;
        shape("lb", self.lb.shape(), n, 1)?;
        shape("ub", self.ub.shape(), n, 1)?;
        let entries = |field, rows: usize, values: &[f64], allowed: fn(f64) -> bool| match values
            .iter()
            .position(|x| !allowed(*x))
        {
            None => Ok(()),
            Some(at) => {
                Err(ProblemError::Entry { field, row: at % rows.max(1), column: at / rows.max(1), value: values[at] })
            }
        };
        entries("P", n, self.P.as_slice(), f64::is_finite)?;
        entries("c", n, self.c.as_slice(), f64::is_finite)?;
        entries("A", e, self.A.as_slice(), f64::is_finite)?;
        entries("b", e, self.b.as_slice(), f64::is_finite)?;
        entries("C", m, self.C.as_slice(), f64::is_finite)?;
        let lower = |x: f64| x < f64::INFINITY;
        let upper = |x: f64| x > f64::NEG_INFINITY;
        entries("l", m, self.l.as_slice(), lower)?;
        entries("u", m, self.u.as_slice(), upper)?;
        entries("lb", n, self.lb.as_slice(), lower)?;
        entries("ub", n, self.ub.as_slice(), upper)
    }

    /// ½ xᵀ P x + cᵀ x.
    #[must_use]
    pub fn objective(&self, x: &DVector<f64>) -> f64 {
        0.5 * x.dot(&(&self.P * x)) + self.c.dot(x)
    }

    /// Largest violation of any row or bound, in the units of the data.
    #[must_use]
    pub fn violation(&self, x: &DVector<f64>) -> f64 {
        let rows = &self.C * x;
        let outside = |value: &DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>| {
            (lower - value).max().max((value - upper).max()) // -inf where there is no side
        };
        let mut largest: f64 = 0.0;
        if !self.b.is_empty() {
            largest = (&self.A * x - &self.b).amax();
        }
        if !rows.is_empty() {
            largest = largest.max(outside(&rows, &self.l, &self.u));
        }
        largest.max(outside(x, &self.lb, &self.ub))
    }

    /// How well a point and its multipliers meet the optimality conditions, computed from the data alone: the definition of
    /// [`QuadraticProgram::residuals`](crate::QuadraticProgram::residuals).
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
        let largest = |v: &DVector<f64>| v.iter().fold(0.0, |s: f64, x| s.max(x.abs()));
        let scale = |terms: &[&DVector<f64>]| terms.iter().map(|t| largest(t)).fold(1.0, f64::max);
        let (Px, Ay, Cy) = (&self.P * x, self.A.tr_mul(y_eq), self.C.tr_mul(y_in));
        let stationarity = largest(&(&Px + &self.c + &Ay + &Cy + y_bound)) / scale(&[&Px, &self.c, &Ay, &Cy, y_bound]);
        let (Ax, Cx) = (&self.A * x, &self.C * x);
        let mut feasibility = largest(&(&Ax - &self.b)) / scale(&[&Ax, &self.b]);
        let mut complementarity: f64 = 0.0;
        let y_scale = scale(&[y_in, y_bound]);
        for (value, lower, upper, y) in [(&Cx, &self.l, &self.u, y_in), (x, &self.lb, &self.ub, y_bound)] {
            let value_scale = scale(&[value]);
            for i in 0..value.len() {
                let (below, above) = (lower[i] - value[i], value[i] - upper[i]);
                feasibility = feasibility.max(below.max(above) / value_scale);
                // The side the multiplier's sign claims to be active; towards an absent side it counts in full.
                let distance = if y[i] > 0.0 { above.abs() } else { below.abs() };
                let product = if distance.is_finite() { distance * y[i].abs() } else { y[i].abs() };
                complementarity = complementarity.max(product / (y_scale * value_scale));
            }
        }
        Residuals { stationarity, feasibility, complementarity }
    }

    /// The program as the JSON that `soleus-inspect qp` reads: matrices as row-major nested lists, `null` = no bound, every
    /// number in as many digits as give it back exactly.
    #[must_use]
    pub fn to_json(&self) -> String {
        let number = |x: f64| if x.is_finite() { format!("{x:?}") } else { "null".to_owned() };
        let list =
            |values: &mut dyn Iterator<Item = f64>| format!("[{}]", values.map(number).collect::<Vec<_>>().join(","));
        let vector = |v: &DVector<f64>| list(&mut v.iter().copied());
        let matrix = |m: &DMatrix<f64>| {
            let rows: Vec<String> = m.row_iter().map(|row| list(&mut row.iter().copied())).collect();
            format!("[{}]", rows.join(","))
        };
        format!(
            "{{\"P\":{},\"c\":{},\"A\":{},\"b\":{},\"C\":{},\"l\":{},\"u\":{},\"lb\":{},\"ub\":{}}}",
            matrix(&self.P),
            vector(&self.c),
            matrix(&self.A),
            vector(&self.b),
            matrix(&self.C),
            vector(&self.l),
            vector(&self.u),
            vector(&self.lb),
            vector(&self.ub),
        )
    }

    /// Value `a x` of one row.
    #[must_use]
    pub fn row_value(&self, row: Row, x: &DVector<f64>) -> f64 {
        match row {
            Row::Equality(i) => self.A.row(i).transpose().dot(x),
            Row::Inequality(i) => self.C.row(i).transpose().dot(x),
            Row::Bound(i) => x[i],
        }
    }
}
