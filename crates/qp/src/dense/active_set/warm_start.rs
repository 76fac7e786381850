//! The beginning of a solve: the rows that must hold and those of the guess are taken up at once, without a search.

use super::{ActiveSet, Held, SUSPICIOUS_FRACTION};
use crate::dense::Problem;
use crate::dense::kernels::dot;

impl ActiveSet {
    /// Bounds of the guess that can be held count as held from here on: they decide on the order of the unknowns.
    pub(super) fn mark_bounds_of_guess(&mut self, problem: &Problem) {
        let first = self.size.equalities + self.size.inequalities;
        for k in 0..self.guess.len() {
            let Held { row, sign } = self.guess[k];
            if row >= first && self.limit(problem, self.guess[k]).is_finite() {
                self.is_held[row] = true;
                self.u[row - first] = sign; // multipliers come later
            }
        }
    }

    /// Bounds first, from the last unknown on, where they cost least; then what must hold; then the rest of the guess.
    pub(super) fn take_up_equalities_and_guess(&mut self, problem: &Problem) {
        let first = self.size.equalities + self.size.inequalities;
        for position in (0..self.size.variables).rev() {
            let unknown = self.order.unknown(position);
            if self.is_held[first + unknown] {
                self.cholesky.inverse_column(position, &mut self.d);
                self.basis.push_unit(&self.d, position);
                self.held.push(Held { row: first + unknown, sign: self.u[unknown] });
            }
        }
        for row in 0..self.size.equalities {
            if !self.append(problem, Held { row, sign: 0.0 }) {
                self.postponed.push(row);
            }
        }
        for k in 0..self.guess.len() {
            let held = self.guess[k];
            // A side without a limit, or a row named twice, is a wrong guess.
            if self.limit(problem, held).is_finite() && !self.is_held[held.row] {
                self.append(problem, held);
            }
        }
    }

    /// Appends a row to the basis unless it depends on the rows there, to half of the digits.
    fn append(&mut self, problem: &Problem, held: Held) -> bool {
        if self.held.len() == self.size.variables {
            return false;
        }
        self.gather(problem, held.row);
        self.cholesky.solve_lower(&mut self.d);
        self.z.copy_from_slice(&self.d);
        let norm = self.basis.split(&mut self.z, &mut self.h);
        // A remainder that is not a number must not enter.
        if norm.is_nan() || norm <= SUSPICIOUS_FRACTION * dot(&self.d, &self.d).sqrt() {
            return false;
        }
        self.basis.push(&self.z, norm, &self.h);
        self.held.push(held);
        self.is_held[held.row] = true;
        true
    }

    /// Point and multipliers for the rows taken up, after leaving out those whose multipliers have the wrong sign.
    pub(super) fn settle(&mut self, problem: &Problem) {
        self.y.copy_from_slice(&self.y0);
        self.place_x();
        self.evaluate(problem, true);
        for k in 0..self.held.len() {
            self.w[k] = self.limit(problem, self.held[k]) - self.value(self.held[k].row);
        }
        self.basis.solve_lower(&mut self.w);
        loop {
            let q = self.held.len();
            self.u[..q].copy_from_slice(&self.w[..q]);
            self.basis.solve_upper(&mut self.u);
            let mut worst = None;
            let mut least = 0.0;
            for (k, (held, u)) in self.held.iter().zip(&self.u).enumerate() {
                let signed = held.sign * u * self.norms[held.row];
                if signed < least {
                    least = signed;
                    worst = Some(k);
                }
            }
            let Some(k) = worst else { break };
            let w = &mut self.w;
            self.basis.remove(k, |i, c, s| (w[i], w[i + 1]) = (c * w[i] + s * w[i + 1], c * w[i + 1] - s * w[i]));
            let left = self.held.remove(k);
            self.is_held[left.row] = false;
            self.iterations += 1;
        }
        self.y.copy_from_slice(&self.y0);
        self.basis.combine(&self.w, &mut self.y);
    }
}
