//! The problem and its judge.

use crate::definite::is_semi_definite;
use crate::{SingleContact, natural_map};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use thiserror::Error;

/// `delta = W F + q` with friction coefficients; see the crate.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactProblem {
    delassus: DMatrix<f64>,
    free: DVector<f64>,
    mu: Vec<f64>,
    /// The contacts one by one; none when a block is only semi-definite, which has no solution of its own for every
    /// displacement.
    pub(crate) contacts: Option<Vec<SingleContact>>,
    pub(crate) rho: Vec<f64>,
}

/// Why numbers are not a contact problem.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ProblemError {
    /// `W` must be 3n x 3n and `q` 3n long for n friction coefficients.
    #[error(
        "{contacts} friction coefficients, but W is {rows} x {columns} and q has {free} entries: 3n x 3n and 3n expected"
    )]
    Size {
        /// Number of friction coefficients.
        contacts: usize,
        /// Rows of `W`.
        rows: usize,
        /// Columns of `W`.
        columns: usize,
        /// Length of `q`.
        free: usize,
    },
    /// NaN or infinite entry.
    #[error("{what} has an entry that is not finite at {row}")]
    NotFinite {
        /// `W`, `q` or `mu`.
        what: &'static str,
        /// Row of the first one.
        row: usize,
    },
    /// `W` differs from its transpose by more than rounding. Whoever knows that only rounding of a file is to blame
    /// averages it himself.
    #[error("W is not symmetric: entries ({row}, {column}) and its mirror differ by {difference:e}")]
    NotSymmetric {
        /// Row of the worst pair.
        row: usize,
        /// Column of the worst pair.
        column: usize,
        /// Their difference.
        difference: f64,
    },
    /// A friction coefficient is negative.
    #[error("friction coefficient {mu} of contact {contact} is negative")]
    NegativeFriction {
        /// The contact.
        contact: usize,
        /// Its coefficient.
        mu: f64,
    },
    /// A diagonal block of `W` is zero: no force moves that contact.
    #[error("the 3 x 3 block of contact {contact} is zero: no force moves it; leave it out")]
    ImmovableContact {
        /// The contact.
        contact: usize,
    },
    /// A diagonal block of `W` has a negative eigenvalue: pushing that contact would draw it nearer.
    #[error("the 3 x 3 block of contact {contact} has the negative eigenvalue {eigenvalue:e}")]
    NegativeBlock {
        /// The contact.
        contact: usize,
        /// The eigenvalue (m/N).
        eigenvalue: f64,
    },
    /// Every block is sound, `W` as a whole has a negative eigenvalue: some forces would draw their own contacts
    /// nearer. No body moves so.
    #[error("W is not positive semi-definite: its smallest eigenvalue is {eigenvalue:e}")]
    Indefinite {
        /// The smallest eigenvalue (m/N).
        eigenvalue: f64,
    },
}

/// Violation of the contact laws, `r = F - P_K(F - rho (delta + mu |delta_t| n))`, as a force and as a displacement.
/// Either alone can hide what the other shows: a force of 1e9 N makes a gap violated by a metre small, and a stiff
/// contact the reverse.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Residual {
    /// `|r|` over all contacts (N).
    pub absolute_n: f64,
    /// The larger of [`Residual::force`] and [`Residual::gap`]: what a tolerance is compared with.
    pub relative: f64,
    /// `|r|/|F|`; `|r|/|rho q|` when `F = 0`.
    pub force: f64,
    /// `|r/rho|/|q|`.
    pub gap: f64,
    /// Largest penetration, `max -delta_n`, 0 where there is none (m).
    pub penetration_m: f64,
    /// Contact with the largest share.
    pub worst_contact: usize,
}

/// Part of the largest entry by which `W` may differ from its transpose: what summing in another order leaves, and no
/// more.
const ASYMMETRY_MAX: f64 = 1e-9;
/// A diagonal block is negative beyond rounding when its smallest eigenvalue is below this part of its largest, times
/// -1.
const ROUNDING: f64 = 1e-12;

impl ContactProblem {
    /// Checks and prepares. An asymmetry of rounding size is averaged away.
    ///
    /// # Errors
    /// [`ProblemError`].
    pub fn new(delassus: DMatrix<f64>, free: DVector<f64>, mu: Vec<f64>) -> Result<Self, ProblemError> {
        let problem = Self::of_model(delassus, free, mu)?;
        if !is_semi_definite(&problem.delassus) {
            let eigenvalue = problem.delassus.symmetric_eigenvalues().min();
            return Err(ProblemError::Indefinite { eigenvalue });
        }
        Ok(problem)
    }

    /// The same without looking at the definiteness of `W` as a whole, which costs as much as solving: for a `W` that
    /// is a condensed stiffness or `J M^-1 J'`, and semi-definite for that reason.
    ///
    /// # Errors
    /// [`ProblemError`], but never [`ProblemError::Indefinite`].
    pub fn of_model(delassus: DMatrix<f64>, free: DVector<f64>, mu: Vec<f64>) -> Result<Self, ProblemError> {
        let n = mu.len();
        let (rows, columns) = delassus.shape();
        if (rows, columns, free.len()) != (3 * n, 3 * n, 3 * n) {
            return Err(ProblemError::Size { contacts: n, rows, columns, free: free.len() });
        }
        if let Some(at) = delassus.iter().position(|x| !x.is_finite()) {
            return Err(ProblemError::NotFinite { what: "W", row: at % rows });
        }
        if let Some(row) = free.iter().position(|x| !x.is_finite()) {
            return Err(ProblemError::NotFinite { what: "q", row });
        }
        if let Some(row) = mu.iter().position(|x| !x.is_finite()) {
            return Err(ProblemError::NotFinite { what: "mu", row });
        }
        if let Some(contact) = mu.iter().position(|x| *x < 0.0) {
            return Err(ProblemError::NegativeFriction { contact, mu: mu[contact] });
        }
        let largest = delassus.amax();
        let mut symmetric = delassus;
        for column in 0..columns {
            for row in 0..column {
                let (a, b) = (symmetric[(row, column)], symmetric[(column, row)]);
                if (a - b).abs() > ASYMMETRY_MAX * largest {
                    return Err(ProblemError::NotSymmetric { row, column, difference: (a - b).abs() });
                }
                symmetric[(row, column)] = 0.5 * (a + b);
                symmetric[(column, row)] = 0.5 * (a + b);
            }
        }
        let mut contacts = Some(Vec::with_capacity(n));
        let mut rho = Vec::with_capacity(n);
        for contact in 0..n {
            let block: Matrix3<f64> = symmetric.fixed_view::<3, 3>(3 * contact, 3 * contact).into_owned();
            match (SingleContact::new(&block, mu[contact]), &mut contacts) {
                (Some(prepared), Some(contacts)) => contacts.push(prepared),
                (Some(_), None) => {}
                (None, _) => {
                    semi_definite(contact, &block)?;
                    contacts = None;
                }
            }
            rho.push(3.0 / block.trace());
        }
        Ok(Self { delassus: symmetric, free, mu, contacts, rho })
    }

    /// Number of contacts.
    #[must_use]
    pub fn contact_count(&self) -> usize {
        self.mu.len()
    }

    /// `W`.
    #[must_use]
    pub fn delassus(&self) -> &DMatrix<f64> {
        &self.delassus
    }

    /// `q`.
    #[must_use]
    pub fn free(&self) -> &DVector<f64> {
        &self.free
    }

    /// Friction coefficients.
    #[must_use]
    pub fn mu(&self) -> &[f64] {
        &self.mu
    }

    /// `W F + q`.
    #[must_use]
    pub fn displacement(&self, force: &DVector<f64>) -> DVector<f64> {
        let mut delta = self.free.clone();
        self.displacement_into(force.as_slice(), delta.as_mut_slice());
        delta
    }

    pub(crate) fn displacement_into(&self, force: &[f64], delta: &mut [f64]) {
        let rows = self.free.len();
        delta.copy_from_slice(self.free.as_slice());
        let w = self.delassus.as_slice();
        for contact in 0..self.mu.len() {
            let [x, y, z] = [force[3 * contact], force[3 * contact + 1], force[3 * contact + 2]];
            if x != 0.0 || y != 0.0 || z != 0.0 {
                let c = &w[3 * contact * rows..];
                crate::dense::add_three(delta, &c[..rows], &c[rows..2 * rows], &c[2 * rows..3 * rows], x, y, z);
            }
        }
    }

    /// Judges a force.
    #[must_use]
    pub fn residual(&self, force: &DVector<f64>) -> Residual {
        let delta = self.displacement(force);
        self.residual_at(force.as_slice(), delta.as_slice())
    }

    pub(crate) fn residual_at(&self, force: &[f64], delta: &[f64]) -> Residual {
        let at = |v: &[f64], i: usize| Vector3::new(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
        let (mut sum, mut load, mut free, mut worst, mut worst_contact) = (0.0, 0.0, 0.0, 0.0, 0);
        let (mut way, mut free_way, mut penetration_m) = (0.0, 0.0, 0.0_f64);
        for contact in 0..self.mu.len() {
            let (f, d, q) = (at(force, contact), at(delta, contact), at(self.free.as_slice(), contact));
            let rho = self.rho[contact];
            let r = natural_map(self.mu[contact], rho, &f, &d).norm_squared();
            sum += r;
            way += r / (rho * rho);
            load += f.norm_squared();
            free += (rho * q).norm_squared();
            free_way += q.norm_squared();
            penetration_m = penetration_m.max(-d.z);
            if r > worst {
                (worst, worst_contact) = (r, contact);
            }
        }
        let ratio = |part: f64, whole: f64| if part > 0.0 { (part / whole).sqrt() } else { 0.0 };
        let force = ratio(sum, if load > 0.0 { load } else { free });
        // Without any q no force is the answer, and every other one is judged as a force.
        let gap = if free_way > 0.0 { ratio(way, free_way) } else { 0.0 };
        // `max` would pass over what is no number.
        let relative = if force.is_nan() || gap.is_nan() { f64::INFINITY } else { force.max(gap) };
        Residual { absolute_n: sum.sqrt(), relative, force, gap, penetration_m, worst_contact }
    }
}

fn semi_definite(contact: usize, block: &Matrix3<f64>) -> Result<(), ProblemError> {
    let eigenvalues = block.symmetric_eigenvalues();
    let (eigenvalue, largest) = (eigenvalues.min(), eigenvalues.max());
    if eigenvalue < -ROUNDING * largest.abs() {
        return Err(ProblemError::NegativeBlock { contact, eigenvalue });
    }
    if largest <= 0.0 { Err(ProblemError::ImmovableContact { contact }) } else { Ok(()) }
}
