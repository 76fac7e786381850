//! Order of the unknowns: those that rest at a bound come last, each in the block of P it belongs to.
//!
//! With `P = L Lᵀ` in this order the gradient `L⁻¹ e` of the bound of the last unknown of a block is a multiple of a unit
//! vector, that of the last but one lies in the last two, and so on: bounds taken up from the end need no projection at all
//! (see [`Basis`](super::basis::Basis)), and the blocks stay apart.

use nalgebra::DMatrix;

/// A permutation that keeps the blocks of a matrix together.
#[derive(Debug, Clone)]
pub struct Order {
    /// Unknown at each position.
    unknowns: Vec<usize>,
    /// Position of each unknown.
    places: Vec<usize>,
    /// Column j of the lower triangle, in this order, is zero from row `ends[j]` on; never decreasing.
    ends: Vec<usize>,
    is_natural: bool,
}

impl Order {
    /// The natural order of `n` unknowns.
    pub fn natural(n: usize) -> Self {
        Self { unknowns: (0..n).collect(), places: (0..n).collect(), ends: vec![n; n], is_natural: true }
    }

    /// Finds the blocks of a symmetric matrix, from its lower triangle, and moves the unknowns that have a rank to their ends, the
    /// highest last.
    pub fn arrange(&mut self, matrix: &DMatrix<f64>, rank: impl Fn(usize) -> Option<f64>) {
        let n = self.places.len();
        let source = matrix.as_slice();
        self.is_natural = true;
        let mut start = 0;
        while start < n {
            let mut end = start + 1;
            let mut j = start;
            while j < end {
                let below = &source[j * n + end..(j + 1) * n];
                if !is_zero(below) {
                    end += below.iter().rposition(|x| *x != 0.0).map_or(0, |last| last + 1);
                }
                self.ends[j] = end;
                j += 1;
            }
            let mut position = start;
            for has_rank in [false, true] {
                for unknown in (start..end).filter(|i| rank(*i).is_some() == has_rank) {
                    self.unknowns[position] = unknown;
                    position += 1;
                }
            }
            let ranked = end - (start..end).filter(|i| rank(*i).is_some()).count();
            let size = |unknown: &usize| rank(*unknown).unwrap_or(0.0);
            self.unknowns[ranked..end].sort_unstable_by(|a, b| size(a).total_cmp(&size(b)).then(a.cmp(b)));
            for (position, unknown) in self.unknowns[start..end].iter().enumerate() {
                self.places[*unknown] = start + position;
            }
            if (start..end).any(|i| self.unknowns[i] != i) {
                self.is_natural = false;
                self.ends[start..end].fill(end);
            }
            start = end;
        }
    }

    /// Unknown at a position.
    pub fn unknown(&self, position: usize) -> usize {
        self.unknowns[position]
    }

    /// Position of an unknown.
    pub fn place(&self, unknown: usize) -> usize {
        self.places[unknown]
    }

    /// Row at which a column of the ordered lower triangle ends.
    pub fn end(&self, position: usize) -> usize {
        self.ends[position]
    }

    /// Rows `from..from + out.len()` of a column of the ordered matrix.
    pub fn column(&self, matrix: &DMatrix<f64>, position: usize, from: usize, out: &mut [f64]) {
        let n = self.places.len();
        let source = &matrix.as_slice()[self.unknowns[position] * n..][..n];
        if self.is_natural {
            out.copy_from_slice(&source[from..from + out.len()]);
        } else {
            self.unknowns[from..].iter().zip(out).for_each(|(i, x)| *x = source[*i]);
        }
    }

    /// A vector by position, from one by unknown.
    pub fn arranged(&self, natural: impl Iterator<Item = f64>, out: &mut [f64]) {
        if self.is_natural {
            out.iter_mut().zip(natural).for_each(|(x, value)| *x = value);
        } else {
            self.places.iter().zip(natural).for_each(|(place, value)| out[*place] = value);
        }
    }

    /// A vector by unknown, from one by position.
    pub fn restored(&self, arranged: &[f64], out: &mut [f64]) {
        if self.is_natural {
            out.copy_from_slice(arranged);
        } else {
            self.places.iter().zip(out).for_each(|(place, x)| *x = arranged[*place]);
        }
    }
}

/// Without branches, so that it costs next to nothing: nearly all of P is looked at, and most of it is zero.
fn is_zero(values: &[f64]) -> bool {
    values.iter().fold(0, |bits, x| bits | (x.to_bits() << 1)) == 0 // the sign does not matter
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chosen_unknowns_come_last_in_their_block_and_blocks_stay_apart() {
        let n = 9;
        // Blocks 0..4 (an arrow: 0 with all), 4..5, 5..9 (a chain).
        let linked = |i: usize, j: usize| match (i.min(j), i.max(j)) {
            (0, b) if b < 4 => true,
            (a, b) if a >= 5 => b - a <= 1,
            (a, b) => a == b,
        };
        let matrix = DMatrix::from_fn(n, n, |i, j| if linked(i, j) { (1 + i * n + j + j * n + i) as f64 } else { 0.0 });
        for chosen in [&[][..], &[3, 8], &[0, 5, 6], &[4], &[0, 1, 2, 3, 4, 5, 6, 7, 8]] {
            let mut order = Order::natural(n);
            let rank = |i: usize| chosen.contains(&i).then_some([0.0, 3.0, 1.0, 2.0][i % 4]);
            order.arrange(&matrix, rank);
            for block in [0..4, 4..5, 5..9] {
                let inside: Vec<usize> = block.clone().map(|p| order.unknown(p)).collect();
                let mut sorted = inside.clone();
                sorted.sort_unstable();
                assert_eq!(sorted, block.collect::<Vec<_>>(), "{chosen:?}");
                assert!(inside.is_sorted_by(|a, b| rank(*a) <= rank(*b)), "{chosen:?}: {inside:?}");
            }
            let mut column = [0.0; 9];
            for p in 0..n {
                assert_eq!(order.place(order.unknown(p)), p);
                order.column(&matrix, p, 0, &mut column);
                for (q, x) in column.iter().enumerate() {
                    assert_eq!(*x, matrix[(order.unknown(q), order.unknown(p))]);
                    assert!(q < order.end(p) || *x == 0.0, "{chosen:?}: column {p} ends at {}", order.end(p));
                }
                assert!(p == 0 || order.end(p) >= order.end(p - 1));
            }
            let (mut arranged, mut back) = ([0.0; 9], [0.0; 9]);
            order.arranged((0..n).map(|i| i as f64), &mut arranged);
            assert!(arranged.iter().enumerate().all(|(p, x)| *x == order.unknown(p) as f64));
            order.restored(&arranged, &mut back);
            assert!(back.iter().enumerate().all(|(i, x)| *x == i as f64));
        }
    }
}
