//! Thin QR factorisation of the active constraints, updated column by column.

use super::kernels::{axpy, combine, dot, project};

/// A projection that keeps less than this part of a vector is repeated once: afterwards the remainder is orthogonal to the
/// basis to working precision ("twice is enough", Kahan and Parlett; criterion of Daniel, Gragg, Kaufman, Stewart 1976). At
/// a tenth, one digit of orthogonality is given up at most, which the refinement of the solution does not notice, and most
/// rows are projected once.
const KEPT_FRACTION: f64 = 0.1;

/// `D = Q R`: the columns of D are the gradients of the active constraints in `y = Lᵀ x`, Q has orthonormal columns.
///
/// The first columns of Q may be unit vectors, of bounds taken up in the right order ([`Order`](super::order::Order)): they are
/// not stored, and a projection on them is a look at one component.
#[derive(Debug, Clone)]
pub struct Basis {
    n: usize,
    len: usize,
    /// Components of the leading unit vectors.
    units: Vec<usize>,
    /// Q by columns.
    q: Vec<f64>,
    /// R by rows, upper triangular.
    r: Vec<f64>,
    correction: Vec<f64>,
}

impl Basis {
    pub fn new(n: usize) -> Self {
        Self {
            n,
            len: 0,
            units: Vec::with_capacity(n),
            q: vec![0.0; n * n],
            r: vec![0.0; n * n],
            correction: vec![0.0; n],
        }
    }

    pub fn clear(&mut self) {
        self.len = 0;
        self.units.clear();
    }

    /// Appends a column that has no component beyond those of the unit vectors there, except at `component`. Only while all
    /// columns are unit vectors.
    pub fn push_unit(&mut self, d: &[f64], component: usize) {
        let (n, k) = (self.n, self.len);
        debug_assert!(k == self.units.len() && d[component] > 0.0);
        for (i, unit) in self.units.iter().enumerate() {
            self.r[i * n + k] = d[*unit];
        }
        self.r[k * n + k] = d[component];
        self.units.push(component);
        self.len += 1;
    }

    /// Splits d: `h = Qᵀ d`, `z = d - Q h`. In: `z` holds d. Returns ‖z‖.
    pub fn split(&mut self, z: &mut [f64], h: &mut [f64]) -> f64 {
        let (n, len) = (self.n, self.len);
        let units = self.units.len();
        let (on_units, h) = h[..len].split_at_mut(units);
        for (unit, h) in self.units.iter().zip(on_units) {
            *h = std::mem::take(&mut z[*unit]);
        }
        let q = &self.q[units * n..];
        let before = dot(z, z).sqrt();
        project(q, n, 0, z, h);
        for x in h.iter_mut() {
            *x = -*x;
        }
        combine(q, n, 0, h, z);
        for x in h.iter_mut() {
            *x = -*x;
        }
        let mut after = dot(z, z).sqrt();
        if after < KEPT_FRACTION * before {
            let again = &mut self.correction[..len - units];
            project(q, n, 0, z, again);
            for (sum, x) in h.iter_mut().zip(again.iter_mut()) {
                *sum += *x;
                *x = -*x;
            }
            combine(q, n, 0, again, z);
            after = dot(z, z).sqrt();
        }
        after
    }

    /// Appends the column `d = Q h + z`; `z` is orthogonal to Q and not zero.
    pub fn push(&mut self, z: &[f64], norm: f64, h: &[f64]) {
        let (n, k) = (self.n, self.len);
        debug_assert!(k < n && norm > 0.0);
        let inverse = 1.0 / norm;
        for (q, z) in self.q[k * n..(k + 1) * n].iter_mut().zip(z) {
            *q = z * inverse;
        }
        for (i, h) in h[..k].iter().enumerate() {
            self.r[i * n + k] = *h;
        }
        self.r[k * n + k] = norm;
        self.len += 1;
    }

    /// Removes column `k` of D. The last column of the rotated Q leaves the basis and is returned; `rotate(i, c, s)` is told
    /// each rotation of components i and i+1, so that the caller can turn his own coordinates in Q.
    pub fn remove(&mut self, k: usize, mut rotate: impl FnMut(usize, f64, f64)) -> &[f64] {
        let (n, len) = (self.n, self.len);
        debug_assert!(k < len);
        // Those that are turned cease to be unit vectors.
        for i in k..self.units.len() {
            let column = &mut self.q[i * n..(i + 1) * n];
            column.fill(0.0);
            column[self.units[i]] = 1.0;
        }
        self.units.truncate(k);
        for i in 0..len {
            let from = i.max(k + 1);
            self.r.copy_within(i * n + from..i * n + len, i * n + from - 1);
        }
        for i in k..len - 1 {
            let (a, b) = (self.r[i * n + i], self.r[(i + 1) * n + i]);
            let radius = a.hypot(b);
            let (c, s) = if radius == 0.0 { (1.0, 0.0) } else { (a / radius, b / radius) };
            let (upper, lower) = self.r.split_at_mut((i + 1) * n);
            turn(c, s, &mut upper[i * n + i..i * n + len - 1], &mut lower[i..len - 1]);
            let (left, right) = self.q.split_at_mut((i + 1) * n);
            turn(c, s, &mut left[i * n..], &mut right[..n]);
            rotate(i, c, s);
        }
        self.len -= 1;
        &self.q[(len - 1) * n..len * n]
    }

    /// `x <- R⁻¹ x`.
    pub fn solve_upper(&self, x: &mut [f64]) {
        let n = self.n;
        for i in (0..self.len).rev() {
            let row = &self.r[i * n..i * n + self.len];
            x[i] = (x[i] - dot(&row[i + 1..], &x[i + 1..self.len])) / row[i];
        }
    }

    /// `x <- R⁻ᵀ x`.
    pub fn solve_lower(&self, x: &mut [f64]) {
        let n = self.n;
        for i in 0..self.len {
            let row = &self.r[i * n..i * n + self.len];
            x[i] /= row[i];
            let (done, rest) = x.split_at_mut(i + 1);
            axpy(-done[i], &row[i + 1..], &mut rest[..self.len - i - 1]);
        }
    }

    /// `y += Q w`.
    pub fn combine(&self, w: &[f64], y: &mut [f64]) {
        let units = self.units.len();
        for (unit, w) in self.units.iter().zip(w) {
            y[*unit] += w;
        }
        combine(&self.q[units * self.n..], self.n, 0, &w[units..self.len], y);
    }

    /// `out = Qᵀ y`.
    pub fn project(&self, y: &[f64], out: &mut [f64]) {
        let units = self.units.len();
        for (unit, out) in self.units.iter().zip(out.iter_mut()) {
            *out = y[*unit];
        }
        project(&self.q[units * self.n..], self.n, 0, y, &mut out[units..self.len]);
    }
}

/// `[a; b] <- [c s; -s c] [a; b]`, element by element.
fn turn(c: f64, s: f64, a: &mut [f64], b: &mut [f64]) {
    for (a, b) in a.iter_mut().zip(b) {
        (*a, *b) = (c * *a + s * *b, c * *b - s * *a);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(n: usize, k: usize) -> Vec<f64> {
        (0..n).map(|i| (((i + 2) * (k + 3) * 37) % 23) as f64 - 11.0).collect()
    }

    fn unit(n: usize, i: usize) -> Vec<f64> {
        (0..n).map(|k| f64::from(k == i)).collect()
    }

    fn reproduces(basis: &Basis, columns: &[Vec<f64>]) {
        let n = basis.n;
        for (k, d) in columns.iter().enumerate() {
            let coefficients: Vec<f64> =
                (0..basis.len).map(|i| if i <= k { basis.r[i * n + k] } else { 0.0 }).collect();
            let mut y = vec![0.0; n];
            basis.combine(&coefficients, &mut y);
            let defect = y.iter().zip(d).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(defect < 1e-12, "column {k}: {defect:e}");
        }
        for i in 0..basis.len {
            let (mut column, mut against) = (vec![0.0; n], vec![0.0; n]);
            basis.combine(&unit(n, i), &mut column);
            basis.project(&column, &mut against);
            for (j, product) in against[..basis.len].iter().enumerate() {
                assert!((product - f64::from(i == j)).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn columns_come_and_go_and_the_factors_stay_a_factorisation() {
        let n = 11;
        let mut basis = Basis::new(n);
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut h = vec![0.0; n];
        for step in 0..60 {
            if columns.len() == n || (step % 3 == 2 && columns.len() > 1) {
                let k = (step * 5) % columns.len();
                columns.remove(k);
                basis.remove(k, |_, _, _| {});
            } else {
                let d = column(n, step * step + 1);
                let mut z = d.clone();
                let norm = basis.split(&mut z, &mut h);
                if norm > 1e-6 {
                    basis.push(&z, norm, &h);
                    columns.push(d);
                }
            }
            reproduces(&basis, &columns);
        }
        assert!(columns.len() > 5);
    }

    #[test]
    fn a_basis_that_begins_with_unit_vectors_is_the_basis_without_that_knowledge() {
        let n = 11;
        for leaving in [None, Some(4), Some(2), Some(0), Some(6)] {
            let (mut quick, mut plain) = (Basis::new(n), Basis::new(n));
            let mut columns = Vec::new();
            let (mut z, mut h) = (vec![0.0; n], vec![0.0; n]);
            for component in [10, 9, 8, 5, 4] {
                let d: Vec<f64> = column(n, component).iter().map(|x| x.abs() + 1.0).collect();
                // A lower triangular inverse's column, with blocks 0..6 and 6..11.
                let of_block = |i: usize| i >= component && (i < 6) == (component < 6);
                columns.push((0..n).map(|i| if of_block(i) { d[i] } else { 0.0 }).collect::<Vec<_>>());
                quick.push_unit(columns.last().expect("pushed"), component);
            }
            columns.push(column(n, 20));
            columns.push(column(n, 31));
            for (k, d) in columns.iter().enumerate() {
                for basis in [Some(&mut plain), (k >= 5).then_some(&mut quick)].into_iter().flatten() {
                    z.copy_from_slice(d);
                    let norm = basis.split(&mut z, &mut h);
                    basis.push(&z, norm, &h);
                }
            }
            if let Some(k) = leaving {
                columns.remove(k);
                let freed = quick.remove(k, |_, _, _| {}).to_vec();
                let other = plain.remove(k, |_, _, _| {});
                assert!(freed.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-13), "{leaving:?}");
            }
            for basis in [&quick, &plain] {
                reproduces(basis, &columns);
            }
            let rhs = column(n, 3);
            let solved = [&quick, &plain].map(|basis| {
                let (mut lower, mut upper) = (rhs.clone(), rhs.clone());
                basis.solve_lower(&mut lower);
                basis.solve_upper(&mut upper);
                [lower, upper].concat()
            });
            assert!(solved[0].iter().zip(&solved[1]).all(|(a, b)| (a - b).abs() < 1e-12), "{leaving:?}");
        }
    }

    #[test]
    fn a_nearly_dependent_column_still_gives_an_orthogonal_remainder() {
        let n = 6;
        let mut basis = Basis::new(n);
        let mut h = vec![0.0; n];
        for k in 0..3 {
            let mut z = column(n, k);
            let norm = basis.split(&mut z, &mut h);
            basis.push(&z, norm, &h);
        }
        let mut z: Vec<f64> = (0..n).map(|i| 2.0 * column(n, 0)[i] - column(n, 2)[i]).collect();
        z[4] += 1e-9;
        let norm = basis.split(&mut z, &mut h);
        assert!(norm > 1e-11 && norm < 1e-8);
        let mut against = vec![0.0; 3];
        basis.project(&z, &mut against);
        assert!(against.iter().all(|x| x.abs() < 1e-14 * 11.0), "{against:?}");
    }
}
