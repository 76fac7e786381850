//! What a Newton step is computed in.

use super::Change;
use crate::columns::Columns;
use crate::list::List;
use nalgebra::{RowVector3, Vector2};
use spatial::{Mat6, Vec3, Vec6};

/// All memory of a step. The points in contact (packed, by slot) come from `evaluate`, the system from `assemble`; nothing in it is history.
#[derive(Debug, Clone)]
pub(crate) struct Scratch {
    /// Forces in the sole frame, packed, and their first two rates (3 per slot).
    pub(super) f: Vec<f64>,
    pub(super) f_rate: Vec<f64>,
    pub(super) f_second: Vec<f64>,
    /// The same forces at every point, zero where it is off the ground.
    pub(super) force_full: Vec<f64>,
    /// Displacement of every point by the compliance.
    pub(super) u_full: Vec<f64>,
    /// World positions of the points in contact, by slot.
    pub(super) world: Vec<Vec3>,
    /// Points that slide, and their slots.
    pub(super) sliding: List<usize>,
    pub(super) sliding_slots: List<usize>,
    /// `A = K B`: rates of the packed forces with the pose (6 columns), and at the first tick what the moving references add (3).
    pub(super) a: Columns,
    pub(super) a_first: Columns,
    /// Rates of the packed forces with one slip.
    pub(super) slip_column: Vec<f64>,
    /// Per sliding point: gradient of its condition with its force (sole axes), and with its slip.
    pub(super) gradients: Vec<[RowVector3<f64>; 2]>,
    pub(super) own_rates: Vec<[Vector2<f64>; 2]>,
    /// `J_ss` and behind it seven right-hand sides; its factors after `eliminate`.
    pub(super) jss: Columns,
    pub(super) pivots: Vec<usize>,
    /// `J_ss^-1 J_sx` (6 columns) and `J_ss^-1 G`.
    pub(super) js: Columns,
    /// Per slip: its column of `J_xs`.
    pub(super) jxs: Vec<Vec6>,
    pub(super) changes: List<Change>,
    /// Tangent about the fixed point O at frozen states, world axes.
    pub(crate) tangent: Mat6,
    pub(super) right_hand: Vec6,
    /// Force and moment about O less those wanted, world axes.
    pub(super) misfit: Vec6,
}

impl Scratch {
    pub(super) fn new(points: usize) -> Self {
        let (n, m) = (points, 3 * points);
        Self {
            f: vec![0.0; m],
            f_rate: vec![0.0; m],
            f_second: vec![0.0; m],
            force_full: vec![0.0; m],
            u_full: vec![0.0; m],
            world: vec![Vec3::zeros(); n],
            sliding: List::with_room_for(n),
            sliding_slots: List::with_room_for(n),
            a: Columns::zeros(m, 6),
            a_first: Columns::zeros(m, 3),
            slip_column: vec![0.0; m],
            gradients: vec![[RowVector3::zeros(); 2]; n],
            own_rates: vec![[Vector2::zeros(); 2]; n],
            jss: Columns::zeros(2 * n, 2 * n + 7),
            pivots: vec![0; 2 * n],
            js: Columns::zeros(2 * n, 7),
            jxs: vec![Vec6::zeros(); 2 * n],
            changes: List::with_room_for(n),
            tangent: Mat6::zeros(),
            right_hand: Vec6::zeros(),
            misfit: Vec6::zeros(),
        }
    }
}
