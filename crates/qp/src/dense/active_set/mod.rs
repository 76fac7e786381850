//! Dual active-set method in the space where the Hessian is the identity.
//!
//! With `P = L Lᵀ` and `y = Lᵀ x` the objective is ½‖y - y₀‖², `y₀ = -L⁻¹ c`, and a row `a x` becomes `d y` with `d =
//! L⁻¹ a`: the solution is the point of a polyhedron nearest to y₀. The method keeps a set of rows that hold with
//! equality and whose multipliers have the right sign, so that its point is optimal for those rows (Goldfarb and Idnani
//! call it an S-pair); it takes up violated rows one at a time until none is left. To look at all rows costs as much as
//! to take one up: those found violated together are taken up one after the other, the most violated first, as far as
//! they still are. The gradients of the held rows are kept as a thin QR factorisation D = Q R, in which a row comes or
//! goes with `O(n q)` operations.
//!
//! | step | formula |
//! |---|---|
//! | direction in y | `z = d - Q Qᵀ d` |
//! | direction in the multipliers | `r = R⁻¹ Qᵀ d` |
//! | full step, the row then holds | `t = violation / ‖z‖²` |
//! | partial step, a multiplier reaches zero first | `t = min uₖ / rₖ`; that row leaves |
//! | z = 0 and nothing leaves | the row contradicts the held ones with weights r: infeasible |
//!
//! **Warm start.** Rows held by the last solution are taken up at once, without the search; those whose multipliers
//! come out with the wrong sign leave again. Whatever remains is an S-pair, so any guess is safe, good or bad. Bounds
//! of the guess come first, and their unknowns last in the factorisation of P: they then need neither projections nor
//! long columns of Q. A foot that is about to leave the ground rests all its forces at zero, up to 64 of them, and
//! costs hardly more than any other. Of these the ones with the smallest multipliers, which will leave first, are taken
//! up last: what comes after has to be turned when a row leaves.
//!
//! **Degeneracy.** The objective rises with every full step, so no set of rows can return, except by rounding. Sets are
//! therefore remembered as hashes; when one returns, the tolerance is raised tenfold, and the status says so.
//!
//! **Semidefinite P.** Where a pivot of the factorisation is rounding, a sequence of strictly convex programs takes its
//! place (proximal points): a minimiser if there is one, the direction in which the objective falls for ever if not.
//! Where P has a negative eigenvalue, [`Status::NotConvex`](crate::Status::NotConvex).
//!
//! **Accuracy.** When no row is violated, the residuals are computed from the data, and the point and its multipliers
//! are improved with the factors at hand (iterative refinement) as long as that helps.

mod contradiction;
mod flat;
mod refinement;
mod returning;
mod rows;
mod violation;
mod warm_start;

use super::basis::Basis;
use super::cholesky::{Cholesky, Indefinite};
use super::kernels::{axpy, combine, dot};
use super::order::Order;
use super::{Active, Outcome, Problem, Side, Size, Solver};
use crate::{Conflict, Row, Status};
use flat::Flat;
use returning::HISTORY;
use rows::{label, lengths_of_rows, name};
use violation::{Tolerance, Violated};

/// Limits of [`ActiveSet`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActiveSetSettings {
    /// Violation of a row that is accepted beyond rounding, in the unit of the row. Useful: 1e-12 to 1e-8.
    pub feasibility_tolerance: f64,
    /// Changes of the active set after which the solver gives up.
    pub iterations_max: usize,
}

impl Default for ActiveSetSettings {
    fn default() -> Self {
        Self { feasibility_tolerance: 1e-11, iterations_max: 1000 }
    }
}

/// Below this part of its length a remainder `z` is computed anew from the data before it is believed.
const SUSPICIOUS_FRACTION: f64 = 1e-6;
/// Multiple of the unit roundoff times |a||x| below which the sign of a row's violation means nothing.
const ROUNDOFFS: f64 = 32.0;
/// How often rows that were tolerated are looked at again.
const REVIVALS_MAX: usize = 8;
/// Most corrections per solve.
const REFINEMENTS_MAX: usize = 3;
/// Largest relative violation of a solution that is called inaccurate and not a failure.
const INACCURATE: f64 = 1e-6;
/// A row that is held, in the order of the columns of the basis.
#[derive(Debug, Clone, Copy)]
struct Held {
    row: usize,
    /// +1 at the lower side, -1 at the upper side, 0 for an equality, whose multiplier may have any sign.
    sign: f64,
}

/// The solver: see the module's documentation. Allocates when made, not when solving, unless P is not positive
/// definite.
#[derive(Debug, Clone)]
pub struct ActiveSet {
    size: Size,
    settings: ActiveSetSettings,
    order: Order,
    cholesky: Cholesky,
    basis: Basis,
    held: Vec<Held>,
    /// Multipliers of the held rows: `y - y₀ = D u`.
    u: Vec<f64>,
    is_held: Vec<bool>,
    /// Rows that follow from the held ones and are violated by rounding only.
    is_tolerated: Vec<bool>,
    /// Equalities that depend on the others: taken up only if violated.
    postponed: Vec<usize>,
    guess: Vec<Held>,
    /// Size of each bound's multiplier at the last solution; 0 where none was.
    bound_multipliers: Vec<f64>,
    /// Rows found violated together that have not been taken up yet, the most violated last.
    pending: Vec<Violated>,
    /// ‖a‖ per row of A and C; bounds have 1.
    norms: Vec<f64>,
    /// a x per row of A and C.
    values: Vec<f64>,
    y0: Vec<f64>,
    y: Vec<f64>,
    x: Vec<f64>,
    d: Vec<f64>,
    z: Vec<f64>,
    h: Vec<f64>,
    r: Vec<f64>,
    w: Vec<f64>,
    gradient: Vec<f64>,
    history: [u64; HISTORY],
    loosening: f64,
    iterations: usize,
    /// Memory for a program whose P is only semidefinite, allocated when the first one comes.
    flat: Option<Box<Flat>>,
    outcome: Outcome,
}

/// How far a search has come.
struct Search {
    /// Corrections of the present point, and the smallest defect before the last.
    refinements: usize,
    best_defect: f64,
    /// How often tolerated rows were looked at again.
    revivals: usize,
    /// The next row was found violated at the present point.
    is_just_found: bool,
}

impl Search {
    fn new() -> Self {
        Self { refinements: 0, best_defect: f64::INFINITY, revivals: 0, is_just_found: false }
    }

    /// The point is another one.
    fn begin_anew(&mut self) {
        self.refinements = 0;
        self.best_defect = f64::INFINITY;
    }
}

/// How taking up a row ended.
enum Taken {
    Held,
    /// Not violated any more.
    Met,
    Contradiction,
    OutOfIterations,
}

impl ActiveSet {
    /// Memory for programs of one size.
    #[must_use]
    pub fn new(size: Size, settings: ActiveSetSettings) -> Self {
        let n = size.variables;
        let rows = size.equalities + size.inequalities;
        let vector = || vec![0.0; n];
        Self {
            size,
            settings,
            order: Order::natural(n),
            cholesky: Cholesky::new(n),
            basis: Basis::new(n),
            held: Vec::with_capacity(n),
            u: vector(),
            is_held: vec![false; rows + n],
            is_tolerated: vec![false; rows + n],
            postponed: Vec::with_capacity(size.equalities),
            guess: Vec::with_capacity(n),
            bound_multipliers: vector(),
            pending: Vec::with_capacity(rows + n),
            norms: vec![1.0; rows + n],
            values: vec![0.0; rows],
            y0: vector(),
            y: vector(),
            x: vector(),
            d: vector(),
            z: vector(),
            h: vector(),
            r: vector(),
            w: vector(),
            gradient: vector(),
            history: [0; HISTORY],
            loosening: 1.0,
            iterations: 0,
            flat: None,
            outcome: Outcome::new(size),
        }
    }

    /// The limits it was made with.
    #[must_use]
    pub fn settings(&self) -> &ActiveSetSettings {
        &self.settings
    }

    /// Solves a strictly convex program.
    ///
    /// # Errors
    /// P is not positive definite, to rounding.
    fn solve_strictly_convex(&mut self, problem: &Problem) -> Result<Status, Indefinite> {
        assert_eq!(problem.size(), self.size, "the program must have the size the solver was made for");
        self.clear();
        self.factorise(problem)?;
        if let Some(status) = self.measure_rows(problem) {
            return Ok(status);
        }
        self.place_unconstrained(problem);
        self.take_up_equalities_and_guess(problem);
        self.settle(problem);
        let mut search = Search::new();
        loop {
            if let Some(ended) = self.find_optimal_set(problem, &mut search) {
                return Ok(ended);
            }
            if let Some(ended) = self.examine(problem, &mut search) {
                return Ok(ended);
            }
        }
    }

    /// Takes up violated rows until none is left. Returns how the solve ended, if it did on the way.
    fn find_optimal_set(&mut self, problem: &Problem, search: &mut Search) -> Option<Status> {
        loop {
            if self.pending.is_empty() {
                self.locate(problem, search.refinements == 0);
                self.find_violated(problem, Tolerance::Loosened);
                search.is_just_found = true;
            }
            let violated = self.pending.pop()?;
            match self.take_up(problem, violated, search.is_just_found) {
                Taken::Met => {}
                Taken::Held => {
                    search.is_just_found = false;
                    search.begin_anew();
                    self.notice_return();
                }
                Taken::Contradiction if self.is_proven(problem, violated) => {
                    self.describe_contradiction(problem, violated);
                    self.judge(problem);
                    return Some(Status::Infeasible);
                }
                Taken::Contradiction => {
                    // The row follows from those held, to rounding: it holds when they do.
                    self.is_tolerated[violated.row] = true;
                    self.pending.clear();
                    self.settle(problem);
                    search.begin_anew();
                }
                Taken::OutOfIterations => {
                    // A step on the way to the row may have been left half-way; what leaves for that is no step.
                    let iterations = self.iterations;
                    self.settle(problem);
                    self.iterations = iterations;
                    self.place_x();
                    self.judge(problem);
                    return Some(Status::IterationLimit);
                }
            }
        }
    }

    /// Judges the point where no row is violated. Returns how the solve ended; else improves the point, or looks at
    /// tolerated rows again.
    fn examine(&mut self, problem: &Problem, search: &mut Search) -> Option<Status> {
        let defect = self.judge(problem);
        if !defect.is_finite() {
            return Some(Status::NumericalFailure);
        }
        // A tolerance that was raised on the way does not matter if the point is good in the end.
        self.find_violated(problem, Tolerance::Strict);
        let is_strict = self.pending.is_empty();
        self.pending.clear();
        let cannot_improve = search.refinements == REFINEMENTS_MAX || defect > 0.5 * search.best_defect;
        if is_strict && (defect <= 1.0 || cannot_improve) {
            return Some(Status::Solved);
        }
        if !cannot_improve {
            search.best_defect = defect;
            self.refine(problem);
            search.refinements += 1;
            return None;
        }
        if search.revivals < REVIVALS_MAX && self.is_tolerated.contains(&true) {
            // A row that followed from others need not do so any more: look at all of them again.
            search.revivals += 1;
            self.is_tolerated.fill(false);
            search.begin_anew();
            return None;
        }
        let is_near = self.outcome.report.residuals.feasibility <= INACCURATE;
        Some(if is_near { Status::SolvedInaccurately } else { Status::NumericalFailure })
    }

    fn clear(&mut self) {
        self.held.clear();
        self.basis.clear();
        self.postponed.clear();
        self.pending.clear();
        self.is_held.fill(false);
        self.is_tolerated.fill(false);
        self.history.fill(0);
        self.loosening = 1.0;
        self.iterations = 0;
    }

    /// P = L Lᵀ, bounds of the guess last.
    fn factorise(&mut self, problem: &Problem) -> Result<(), Indefinite> {
        self.mark_bounds_of_guess(problem);
        let (is_held, first) = (&self.is_held, self.size.equalities + self.size.inequalities);
        let multipliers = &self.bound_multipliers;
        self.order.arrange(&problem.P, |unknown| is_held[first + unknown].then(|| multipliers[unknown]));
        self.cholesky.factorise(&problem.P, &self.order)
    }

    /// Measures the rows and finds sides that exclude each other. Returns how the solve ends where they do, or are no
    /// numbers.
    fn measure_rows(&mut self, problem: &Problem) -> Option<Status> {
        let Size { variables: n, equalities: e, inequalities: m } = self.size;
        let (equalities, inequalities) = self.norms[..e + m].split_at_mut(e);
        lengths_of_rows(problem.A.as_slice(), n, equalities);
        lengths_of_rows(problem.C.as_slice(), n, inequalities);
        if !self.norms.iter().all(|x| x.is_finite()) {
            return Some(Status::NumericalFailure);
        }
        for row in e..e + m + n {
            let (lower, upper) = self.sides(problem, row);
            if lower <= upper {
                continue;
            }
            if lower.is_nan() || upper.is_nan() {
                return Some(Status::NumericalFailure);
            }
            let row = name(self.size, row);
            let contradiction = &mut self.outcome.contradiction;
            contradiction.rows.push(Conflict { row, weight: -1.0 });
            contradiction.rows.push(Conflict { row, weight: 1.0 });
            contradiction.unmet = Some(row);
            contradiction.amount = lower - upper;
            return Some(Status::Infeasible);
        }
        None
    }

    /// y₀ = -L⁻¹ c.
    fn place_unconstrained(&mut self, problem: &Problem) {
        self.order.arranged(problem.c.iter().map(|c| -c), &mut self.y0);
        self.cholesky.solve_lower(&mut self.y0);
    }

    /// x from y, and all rows at x. After a refinement x is already the better of the two.
    fn locate(&mut self, problem: &Problem, from_y: bool) {
        if from_y {
            self.place_x();
        }
        self.evaluate(problem, !self.postponed.is_empty());
    }

    /// x of y. Overwrites `z`.
    fn place_x(&mut self) {
        self.z.copy_from_slice(&self.y);
        self.cholesky.solve_upper(&mut self.z);
        self.order.restored(&self.z, &mut self.x);
    }

    fn evaluate(&mut self, problem: &Problem, with_equalities: bool) {
        let Size { equalities: e, inequalities: m, .. } = self.size;
        let (equalities, inequalities) = self.values.split_at_mut(e);
        if with_equalities {
            equalities.fill(0.0);
            combine(problem.A.as_slice(), e, 0, &self.x, equalities);
        }
        inequalities.fill(0.0);
        combine(problem.C.as_slice(), m, 0, &self.x, inequalities);
    }

    /// One outer iteration of Goldfarb and Idnani: moves until the violated row holds, leaving rows behind on the way.
    /// A row that was just found is taken up even if it is met here, where the point is measured otherwise and rounding
    /// may hide what was found: else it would be found for ever.
    fn take_up(&mut self, problem: &Problem, violated: Violated, is_just_found: bool) -> Taken {
        let Violated { row, sign, tolerance, .. } = violated;
        let entering = Held { row, sign };
        let limit = self.limit(problem, entering);
        self.gather(problem, row);
        self.cholesky.solve_lower(&mut self.d);
        if !is_just_found && sign * (limit - dot(&self.d, &self.y)) <= tolerance {
            return Taken::Met;
        }
        if self.iterations >= self.settings.iterations_max {
            return Taken::OutOfIterations;
        }
        let length = dot(&self.d, &self.d).sqrt();
        self.z.copy_from_slice(&self.d);
        let mut norm = self.basis.split(&mut self.z, &mut self.h);
        let mut multiplier = 0.0;
        loop {
            let q = self.held.len();
            self.r[..q].copy_from_slice(&self.h[..q]);
            self.basis.solve_upper(&mut self.r);
            let mut depends = q == self.size.variables;
            if !depends && norm <= SUSPICIOUS_FRACTION * length {
                (norm, depends) = self.sharpen(problem, row);
            }
            let violation = sign * (limit - dot(&self.d, &self.y));
            let full = if depends { f64::INFINITY } else { (violation / (norm * norm)).max(0.0) };
            let (partial, leaving) = self.first_to_leave(sign);
            let step = full.min(partial);
            if step == f64::INFINITY {
                return Taken::Contradiction;
            }
            for (u, r) in self.u[..q].iter_mut().zip(&self.r) {
                *u -= step * sign * r;
            }
            multiplier += step * sign;
            if !depends {
                axpy(step * sign, &self.z, &mut self.y);
            }
            self.iterations += 1;
            if full <= partial {
                self.basis.push(&self.z, norm, &self.h);
                self.held.push(entering);
                self.is_held[row] = true;
                self.u[q] = multiplier;
                return Taken::Held;
            }
            let h = &mut self.h;
            let freed = self
                .basis
                .remove(leaving, |i, c, s| (h[i], h[i + 1]) = (c * h[i] + s * h[i + 1], c * h[i + 1] - s * h[i]));
            // What the basis no longer covers of d belongs to the remainder.
            axpy(self.h[q - 1], freed, &mut self.z);
            norm = dot(&self.z, &self.z).sqrt();
            self.u.copy_within(leaving + 1..q, leaving);
            let left = self.held.remove(leaving);
            self.is_held[left.row] = false;
            if self.iterations >= self.settings.iterations_max {
                return Taken::OutOfIterations;
            }
        }
    }

    /// Step at which the first multiplier of an inequality reaches zero, and which one.
    fn first_to_leave(&self, sign: f64) -> (f64, usize) {
        let (mut step, mut leaving) = (f64::INFINITY, 0);
        for (k, held) in self.held.iter().enumerate() {
            let rate = held.sign * sign * self.r[k];
            if rate > 0.0 {
                let reach = (held.sign * self.u[k]).max(0.0) / rate;
                if reach < step {
                    (step, leaving) = (reach, k);
                }
            }
        }
        (step, leaving)
    }

    /// Keeps what was held as the guess for the next solve, and names it in the report.
    fn remember(&mut self) {
        self.guess.clear();
        self.bound_multipliers.fill(0.0);
        let first = self.size.equalities + self.size.inequalities;
        for (held, u) in self.held.iter().zip(&self.u) {
            if held.sign != 0.0 {
                self.outcome.active.push(label(self.size, *held));
                if held.row >= self.size.equalities {
                    self.guess.push(*held);
                }
            }
            if held.row >= first {
                self.bound_multipliers[held.row - first] = u.abs();
            }
        }
    }
}

impl Solver for ActiveSet {
    fn solve(&mut self, problem: &Problem) -> &Outcome {
        self.outcome.clear();
        let status = match self.solve_strictly_convex(problem) {
            Ok(status) => status,
            Err(stop) => self.solve_flat(problem, stop),
        };
        self.outcome.report.status = status;
        self.outcome.report.iterations = self.iterations as u32;
        if status == Status::Infeasible {
            self.write_certificate();
        }
        self.outcome.active.clear();
        self.remember();
        &self.outcome
    }

    fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    fn guess(&mut self, active: &[Active]) {
        self.guess.clear();
        self.bound_multipliers.fill(0.0);
        for Active { row, side } in active {
            let row = match *row {
                Row::Inequality(i) if i < self.size.inequalities => self.size.equalities + i,
                Row::Bound(i) if i < self.size.variables => self.size.equalities + self.size.inequalities + i,
                _ => continue, // equalities are always taken up, others do not exist
            };
            let sign = match side {
                Side::Lower => 1.0,
                Side::Upper => -1.0,
                Side::Both => continue,
            };
            if self.guess.len() < self.guess.capacity() {
                self.guess.push(Held { row, sign });
            }
        }
    }

    fn forget(&mut self) {
        self.guess.clear();
    }
}

#[cfg(test)]
mod tests;
