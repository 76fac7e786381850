//! Columns of numbers, one behind the other.

use std::ops::{Index, IndexMut};

/// Columns of `rows` numbers each; what is used of them may be shorter.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    data: Vec<f64>,
    rows: usize,
}

impl Columns {
    pub(crate) fn zeros(rows: usize, columns: usize) -> Self {
        Self { data: vec![0.0; rows * columns], rows }
    }

    /// Distance from a number to its right neighbour.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Column `j`.
    pub(crate) fn column(&self, j: usize) -> &[f64] {
        &self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// The first `m` rows of column `j`, all zero.
    pub(crate) fn cleared(&mut self, j: usize, m: usize) -> &mut [f64] {
        let column = &mut self.data[j * self.rows..j * self.rows + m];
        column.fill(0.0);
        column
    }

    /// The first `m` rows of column `j`.
    pub(crate) fn head_mut(&mut self, j: usize, m: usize) -> &mut [f64] {
        &mut self.data[j * self.rows..j * self.rows + m]
    }

    /// Columns from `j` on, one behind the other.
    pub(crate) fn from(&self, j: usize) -> &[f64] {
        &self.data[j * self.rows..]
    }

    /// Columns from `j` on, one behind the other.
    pub(crate) fn from_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.data[j * self.rows..]
    }
}

impl Index<[usize; 2]> for Columns {
    type Output = f64;

    /// Row `i` of column `j`.
    fn index(&self, [i, j]: [usize; 2]) -> &f64 {
        debug_assert!(i < self.rows);
        &self.data[j * self.rows + i]
    }
}

impl IndexMut<[usize; 2]> for Columns {
    fn index_mut(&mut self, [i, j]: [usize; 2]) -> &mut f64 {
        debug_assert!(i < self.rows);
        &mut self.data[j * self.rows + i]
    }
}
