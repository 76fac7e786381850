//! Stiffness of the set of points in contact, kept up to date as points land and lift.
//!
//! For the contact set c, `f_c = K_c u_c` with `K_c = (C_cc)^-1`: it depends on the *set* only, never on the pose or on stick
//! and slip (facts: stiffness form). One point more or less is a rank-3 update by the bordering formulas
//!
//! ```text
//! G = K C_ca,  S = C_aa - C_ac G:   K+ = [K + G S^-1 G',  -G S^-1;  -S^-1 G',  S^-1]     (a lands)
//! K+ = K_rr - K_ra K_aa^-1 K_ar                                                        (a lifts)
//! ```
//!
//! and the same formulas carry along `Y = K_c Z` for a few fixed columns `Z`, in which the displacements of all stuck points are
//! linear whatever the pose.

use crate::SoleModel;
use crate::list::List;
use friction::ContactState;
use friction::dense::{add_one, add_three, dot};
use spatial::{Mat3, Vec3};

/// Most columns of `Y` that any user keeps.
pub(crate) const COLUMNS_MAX: usize = 14;
const ABSENT: usize = usize::MAX;

/// `K_c`, packed in the order in which points came; see the module.
#[derive(Debug, Clone)]
pub(crate) struct ContactStiffness {
    ld: usize,
    /// slot -> point
    points: List<usize>,
    /// point -> slot
    slots: Vec<usize>,
    /// ld x ld, column by column, leading 3c x 3c in use
    k: Vec<f64>,
    /// ld x columns
    y: Vec<f64>,
    columns: usize,
    /// ld x 3 scratch each
    gain: Vec<f64>,
    /// Multiplications that landing and lifting have cost.
    pub(crate) multiplications: u64,
    scaled: Vec<f64>,
    column: Vec<f64>,
}

/// Three rows of `Z` at a point.
pub(crate) type Rows = [[f64; COLUMNS_MAX]; 3];

impl ContactStiffness {
    pub(crate) fn new(model: &SoleModel) -> Self {
        let n = model.contact_points().len();
        let ld = 3 * n;
        Self {
            ld,
            points: List::with_room_for(n),
            slots: vec![ABSENT; n],
            k: vec![0.0; ld * ld],
            y: vec![0.0; ld * COLUMNS_MAX],
            columns: 0,
            multiplications: 0,
            gain: vec![0.0; 3 * ld],
            scaled: vec![0.0; 3 * ld],
            column: vec![0.0; 3 * ld],
        }
    }

    /// Number of points in contact.
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// Points in contact, in slot order.
    pub(crate) fn points(&self) -> &[usize] {
        &self.points
    }

    /// Slot of a point in contact.
    pub(crate) fn slot(&self, point: usize) -> Option<usize> {
        (self.slots[point] != ABSENT).then_some(self.slots[point])
    }

    pub(crate) fn ld(&self) -> usize {
        self.ld
    }

    /// Column `j` of `K_c`, rows in use.
    pub(crate) fn column(&self, j: usize) -> &[f64] {
        &self.k[j * self.ld..j * self.ld + 3 * self.points.len()]
    }

    /// Column `j` of `Y`, rows in use.
    pub(crate) fn y(&self, j: usize) -> &[f64] {
        &self.y[j * self.ld..j * self.ld + 3 * self.points.len()]
    }

    /// The same, to be changed: for columns that follow a recursion.
    pub(crate) fn y_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.y[j * self.ld..j * self.ld + 3 * self.points.len()]
    }

    /// 3 x 3 block of `K_c`.
    pub(crate) fn block(&self, row_slot: usize, column_slot: usize) -> Mat3 {
        Mat3::from_fn(|i, j| self.k[(3 * column_slot + j) * self.ld + 3 * row_slot + i])
    }

    /// As if rounding had made `K_c` and `Y` smaller by this part.
    #[cfg(test)]
    pub(crate) fn drift(&mut self, part: f64) {
        self.k.iter_mut().chain(&mut self.y).for_each(|x| *x *= 1.0 - part);
    }

    /// Makes it another one's of the same sole.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        let m = 3 * other.points.len();
        self.points.clear();
        self.points.extend_from_slice(&other.points);
        self.slots.copy_from_slice(&other.slots);
        for j in 0..m {
            self.k[j * self.ld..j * self.ld + m].copy_from_slice(&other.k[j * self.ld..j * self.ld + m]);
        }
        self.copy_columns(other.columns, &other.y);
    }

    /// No point in contact.
    pub(crate) fn clear(&mut self) {
        for point in self.points.drain(..) {
            self.slots[point] = ABSENT;
        }
    }

    /// All points in contact, in their own order; `Y` is not touched.
    pub(crate) fn fill(&mut self, model: &SoleModel) {
        self.points.clear();
        self.points.extend(0..self.slots.len());
        for (point, slot) in self.slots.iter_mut().enumerate() {
            *slot = point;
        }
        self.k.copy_from_slice(model.stiffness().as_slice());
    }

    /// Sets `Y = K_c Z` afresh from the rows of `Z` at each point.
    pub(crate) fn set_columns(&mut self, columns: usize, z: impl Fn(usize) -> Rows) {
        self.columns = columns;
        let m = 3 * self.points.len();
        for c in 0..columns {
            self.y[c * self.ld..c * self.ld + m].fill(0.0);
        }
        for (slot, point) in self.points.iter().enumerate() {
            let rows = z(*point);
            let k = &self.k[3 * slot * self.ld..];
            let (a, b, c) = (&k[..m], &k[self.ld..self.ld + m], &k[2 * self.ld..2 * self.ld + m]);
            for j in 0..columns {
                if rows[0][j] != 0.0 || rows[1][j] != 0.0 || rows[2][j] != 0.0 {
                    add_three(&mut self.y[j * self.ld..j * self.ld + m], a, b, c, rows[0][j], rows[1][j], rows[2][j]);
                }
            }
        }
    }

    /// Copies all columns of `Y` that a finished computation holds (`columns` columns, leading dimension as here).
    pub(crate) fn copy_columns(&mut self, columns: usize, y: &[f64]) {
        self.columns = columns;
        self.y[..columns * self.ld].copy_from_slice(&y[..columns * self.ld]);
    }

    /// Mutable access to the columns of `Y`, for linear recombination; `columns` becomes their number.
    pub(crate) fn columns_mut(&mut self, columns: usize) -> (&mut [f64], &[f64], usize) {
        self.columns = columns;
        (&mut self.y, &self.k, self.ld)
    }

    /// A point lands. `z` are its rows of `Z`.
    pub(crate) fn land(&mut self, model: &SoleModel, point: usize, z: &Rows) {
        debug_assert!(self.slots[point] == ABSENT);
        let (ld, m) = (self.ld, 3 * self.points.len());
        // The gain and the update of rank three.
        self.multiplications += 6 * (m * m) as u64;
        let compliance = model.compliance().as_slice();
        for axis in 0..3 {
            let source = &compliance[(3 * point + axis) * ld..(3 * point + axis + 1) * ld];
            let target = &mut self.column[axis * ld..axis * ld + m];
            for (block, other) in target.chunks_exact_mut(3).zip(self.points.iter()) {
                block.copy_from_slice(&source[3 * other..3 * other + 3]);
            }
        }
        // G = K C_ca, one pass over K.
        self.gain.fill(0.0);
        {
            let (g0, rest) = self.gain.split_at_mut(ld);
            let (g1, g2) = rest.split_at_mut(ld);
            let (g0, g1, g2) = (&mut g0[..m], &mut g1[..m], &mut g2[..m]);
            for j in 0..m {
                let k = &self.k[j * ld..j * ld + m];
                let (x, y, z) = (self.column[j], self.column[ld + j], self.column[2 * ld + j]);
                for i in 0..m {
                    g0[i] = x.mul_add(k[i], g0[i]);
                    g1[i] = y.mul_add(k[i], g1[i]);
                    g2[i] = z.mul_add(k[i], g2[i]);
                }
            }
        }
        let schur = Mat3::from_fn(|i, j| {
            compliance[(3 * point + j) * ld + 3 * point + i]
                - dot(&self.column[i * ld..i * ld + m], &self.gain[j * ld..j * ld + m])
        });
        let inverse = symmetric_inverse(&schur);
        self.scale_gain(m, &inverse);
        self.rank_three(m, 1.0);
        for axis in 0..3 {
            for i in 0..m {
                let value = -self.scaled[axis * ld + i];
                self.k[(m + axis) * ld + i] = value;
                self.k[i * ld + m + axis] = value;
            }
            for other in 0..3 {
                self.k[(m + axis) * ld + m + other] = inverse[(other, axis)];
            }
        }
        for j in 0..self.columns {
            let y = &mut self.y[j * ld..(j + 1) * ld];
            let t = Vec3::from_fn(|i, _| dot(&self.column[i * ld..i * ld + m], &y[..m]) - z[i][j]);
            let (h0, h1, h2) = (&self.scaled[..m], &self.scaled[ld..ld + m], &self.scaled[2 * ld..2 * ld + m]);
            add_three(&mut y[..m], h0, h1, h2, t.x, t.y, t.z);
            let own = -(inverse * t);
            y[m..m + 3].copy_from_slice(own.as_slice());
        }
        self.slots[point] = self.points.len();
        self.points.push(point);
    }

    /// A point lifts; the last slot moves into its place.
    pub(crate) fn lift(&mut self, point: usize) {
        let slot = self.slots[point];
        debug_assert!(slot != ABSENT);
        let (ld, m, a) = (self.ld, 3 * self.points.len(), 3 * slot);
        self.multiplications += 3 * (m * m) as u64;
        let inverse = symmetric_inverse(&self.block(slot, slot));
        for axis in 0..3 {
            let from = (a + axis) * ld;
            self.gain[axis * ld..axis * ld + m].copy_from_slice(&self.k[from..from + m]);
        }
        self.scale_gain(m, &inverse);
        self.rank_three(m, -1.0);
        for j in 0..self.columns {
            let y = &mut self.y[j * ld..j * ld + m];
            let own = [y[a], y[a + 1], y[a + 2]];
            let (h0, h1, h2) = (&self.scaled[..m], &self.scaled[ld..ld + m], &self.scaled[2 * ld..2 * ld + m]);
            // h = K_ra K_aa^-1 contracts with Y_a, because K_ra already sits in h.
            add_three(y, h0, h1, h2, -own[0], -own[1], -own[2]);
        }
        let last = m - 3;
        if a != last {
            for axis in 0..3 {
                let (front, back) = self.k.split_at_mut((last + axis) * ld);
                front[(a + axis) * ld..(a + axis) * ld + m].copy_from_slice(&back[..m]);
            }
            for j in 0..last {
                let column = &mut self.k[j * ld..j * ld + m];
                column.copy_within(last.., a);
            }
            for j in 0..self.columns {
                self.y[j * ld..j * ld + m].copy_within(last.., a);
            }
        }
        self.points.swap_remove(slot);
        if let Some(moved) = self.points.get(slot) {
            self.slots[*moved] = slot;
        }
        self.slots[point] = ABSENT;
    }

    /// `scaled = gain * inverse`.
    fn scale_gain(&mut self, m: usize, inverse: &Mat3) {
        let ld = self.ld;
        let (g0, g1, g2) = (&self.gain[..m], &self.gain[ld..ld + m], &self.gain[2 * ld..2 * ld + m]);
        for axis in 0..3 {
            let target = &mut self.scaled[axis * ld..axis * ld + m];
            target.fill(0.0);
            add_three(target, g0, g1, g2, inverse[(0, axis)], inverse[(1, axis)], inverse[(2, axis)]);
        }
    }

    /// `K += sign * scaled * gain'`.
    fn rank_three(&mut self, m: usize, sign: f64) {
        let ld = self.ld;
        let (h0, h1, h2) = (&self.scaled[..m], &self.scaled[ld..ld + m], &self.scaled[2 * ld..2 * ld + m]);
        for j in 0..m {
            let (x, y, z) = (sign * self.gain[j], sign * self.gain[ld + j], sign * self.gain[2 * ld + j]);
            add_three(&mut self.k[j * ld..j * ld + m], h0, h1, h2, x, y, z);
        }
    }

    /// Makes the contact set what the states say, by the cheaper way: point by point, or from all points in contact. `z` are the rows
    /// of `Z` at a point.
    pub(crate) fn synchronise(&mut self, model: &SoleModel, states: &[ContactState], z: impl Fn(usize) -> Rows) {
        let differs = |point: usize, slots: &[usize]| (states[point] == ContactState::Open) == (slots[point] != ABSENT);
        let changes = (0..states.len()).filter(|p| differs(*p, &self.slots)).count();
        let free = states.iter().filter(|s| **s == ContactState::Open).count();
        // Filling is a copy of the stiffness, about as much work as one update.
        if changes > free + 1 {
            self.fill(model);
            self.change_points(model, states, None::<&fn(usize) -> Rows>);
            self.set_columns(self.columns, &z);
        } else {
            self.change_points(model, states, Some(&z));
        }
    }

    /// `K_c` and `Y` anew from the compliance, by the cheaper way: what updates have left behind is gone.
    pub(crate) fn refresh(&mut self, model: &SoleModel, states: &[ContactState], z: impl Fn(usize) -> Rows) {
        let free = states.iter().filter(|s| **s == ContactState::Open).count();
        if 2 * free < states.len() {
            self.fill(model);
        } else {
            self.clear();
        }
        self.change_points(model, states, None::<&fn(usize) -> Rows>);
        self.set_columns(self.columns, &z);
    }

    /// Lifts and lands points until the set is that of the states; without `z` the columns of `Y` are left to the caller.
    fn change_points(&mut self, model: &SoleModel, states: &[ContactState], z: Option<&impl Fn(usize) -> Rows>) {
        let columns = self.columns;
        if z.is_none() {
            self.columns = 0;
        }
        for point in 0..states.len() {
            if states[point] == ContactState::Open && self.slots[point] != ABSENT {
                self.lift(point);
            }
        }
        for point in 0..states.len() {
            if states[point] != ContactState::Open && self.slots[point] == ABSENT {
                self.land(model, point, &z.map_or([[0.0; COLUMNS_MAX]; 3], |z| z(point)));
            }
        }
        self.columns = columns;
    }

    /// `y_j += x * K column k`, for reference positions that moved.
    pub(crate) fn shift_column(&mut self, j: usize, k: usize, x: f64) {
        let (ld, m) = (self.ld, 3 * self.points.len());
        add_one(&mut self.y[j * ld..j * ld + m], &self.k[k * ld..k * ld + m], x);
    }
}

/// Inverse of a symmetric positive definite 3 x 3 matrix by cofactors.
fn symmetric_inverse(m: &Mat3) -> Mat3 {
    let (a, b, c) = (m[(0, 0)], 0.5 * (m[(0, 1)] + m[(1, 0)]), 0.5 * (m[(0, 2)] + m[(2, 0)]));
    let (d, e, f) = (m[(1, 1)], 0.5 * (m[(1, 2)] + m[(2, 1)]), m[(2, 2)]);
    let (xx, xy, xz) = (d * f - e * e, c * e - b * f, b * e - c * d);
    let (yy, yz, zz) = (a * f - c * c, b * c - a * e, a * d - b * b);
    let determinant = a * xx + b * xy + c * xz;
    Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) / determinant
}
