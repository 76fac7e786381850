//! Pose, forces and node states together: Newton in the stiffness form (method 2.4).
//!
//! Unknowns: position `O` and orientation `R` of the sole and the tangential slips `v` of the sliding points. For the contact
//! set c the displacements `u_i = R'(Q_i + v_i - O) - p_i` are prescribed, the forces are `f = K_c u`, and with
//! `Q_i = sum_k s_ik q_k` (a few *families* of scalars `s` fixed per point, directions `q` that turn with the pose)
//! `f = Y coefficients + sum_slip K_:i R' v_i`, where `Y = K_c Z` is kept by [`ContactStiffness`]. Equations: total force and
//! moment equal the target's, and for each sliding point the Alart-Curnier condition
//! `G = F_t - mu F_n d = 0, d = z/|z|, z = F_t - rho v`. Sliding unknowns are eliminated first, so each step solves 2s and then
//! 6 equations; the 6 x 6 matrix left over is the tangent stiffness at frozen states.
//!
//! Here: the state of a stance and its history. The equations are in `residual`, their derivatives in `system`, the iteration and
//! the rates in `newton`, the points' states in `states`, what is done when these run in circles in `pose_newton`.

mod arc;
mod circles;
mod newton;
mod pose_newton;
mod residual;
mod scratch;
mod sliding;
mod stance;
mod states;
mod system;
mod target;

pub(crate) use arc::ArcEnd;
pub(crate) use sliding::SlidingLaw;
pub(crate) use target::Target;

use crate::SoleModel;
use crate::euler_order::EulerOrder;
use crate::stiffness::{COLUMNS_MAX, ContactStiffness, Rows};
use friction::ContactState;
use nalgebra::Vector2;
use scratch::Scratch;
use spatial::{Mat3, Mat6, Transform, Vec3, Vec6, so3};
use stance::{Saved, Stance};
use std::sync::Arc;

/// How one Newton solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    Converged,
    Unstable,
    /// Out of iterations, or nowhere to go, with states that fit the pose.
    Stopped,
    /// The same, with states that did not.
    Circling,
}

/// Limits of the Newton iteration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub tolerance: f64,
    pub iterations: usize,
    /// Of the tick so far; no further iteration is begun beyond it.
    pub multiplications: u64,
}

/// Reported beside the pose.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Work {
    pub iterations: usize,
    pub landings: usize,
    pub lift_offs: usize,
    pub residual: f64,
    /// Of the linear systems; those of points that land and lift are counted where they are done.
    pub multiplications: u64,
}

// What each constant is worth was measured with `examples/hard_cases.rs`: 2123 ticks, 61,572 iterations, 101 ticks unsolved because they
// fold. "Half" and "double" say how the iterations change when it is halved and doubled; the same ticks are solved, to the same answers,
// unless said otherwise.

/// Longest step of the position (m) and of the orientation (rad) in one iteration, in place of a line search. A tenth of a sole's
/// thickness: longer steps make many points land or lift at once that should not. Half 0, double +5 %, four times +13 %, most of it where
/// the load leaps from tick to tick (15,800 iterations there; 12,300, 19,900, 25,500). The turn hardly matters beside it: half and double 0.
const STEP_MAX_M: f64 = 0.0025;
const STEP_MAX_RAD: f64 = 0.2;
/// Length (m) that makes moments comparable to forces: half a foot. Half and double: less than 0.3 %.
const MOMENT_ARM_M: f64 = 0.1;
/// Rounding floors are this many units of the last place of the sole's coordinates: what the sums over some hundred points lose. Half
/// and double: 1 %.
const FLOOR_ULPS: f64 = 40.0;

/// A first tick begins with the points that are not higher above the lowest one than this many times the depth to which the load would press
/// the lowest ones alone, flat. Four: a ZMP at the edge presses one end deeper.
const START_DEPTHS: f64 = 4.0;
/// So many of Newton's longest steps are left to the iteration: deeper than any sole is thick.
const DEEP_STEPS: f64 = 16.0;
/// Points within this height (m) lie in one plane: what rounding in a mesh file leaves of one.
const PLANE_M: f64 = 1e-6;

/// During the iterations a free point is looked at only if its undeformed position is nearer to the ground than this many times
/// the largest displacement in contact. Not a bound, so [`Equilibrium::settle`] looks at all of them when the iterations are over.
/// Half, double and without any screening: the same iterations; looking at all points costs time only.
const SCREEN: f64 = 2.0;

/// Simplified Newton: the factors of the last step are used again when, at the rate of that step, the iteration would end within
/// this many more. New factors cost about as much as that many steps with old ones where every point slides, less elsewhere.
/// Half -3 %, double +3 %.
const SAME_FACTORS: i32 = 4;

/// Columns of `Y` at the first tick of a stance: four families of three, and the undeformed position.
const FIRST_COLUMNS: usize = 13;

/// A point whose state does not fit its force or gap.
#[derive(Debug, Clone, Copy)]
struct Change {
    point: usize,
    to: ContactState,
}

/// Everything about a sole that does not change.
#[derive(Debug, Clone)]
struct Sole {
    model: Arc<SoleModel>,
    euler: EulerOrder,
    /// `K Z` for all points in contact and the families of the first tick.
    full_y: Vec<f64>,
    /// What rounding leaves of a force (N) and of a gap (m).
    floor_n: f64,
    floor_m: f64,
    /// Alart-Curnier's scale of every point (N/m).
    rho: Vec<f64>,
    /// Vertical stiffness of all points together (N/m).
    bonded: f64,
    /// Unless all points lie in one plane.
    raised: Option<Raised>,
}

/// Which points stand higher than others: side faces, a round bottom.
#[derive(Debug, Clone)]
struct Raised {
    /// Above the lowest point (m).
    heights: Vec<f64>,
    /// `K_c` of the points within [`PLANE_M`] of the lowest one, with the columns of the first tick, and their vertical stiffness (N/m).
    lowest: ContactStiffness,
    lowest_stiffness: f64,
}

impl Raised {
    fn new(model: &SoleModel, full: &ContactStiffness) -> Option<Self> {
        let points = model.contact_points();
        let bottom = points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        let heights: Vec<f64> = points.iter().map(|p| p.z - bottom).collect();
        let is_low = |point: &usize| heights[*point] <= PLANE_M;
        let low = (0..heights.len()).filter(is_low).count();
        if low == heights.len() {
            return None;
        }
        let mut lowest = full.clone();
        if 2 * low > heights.len() {
            (0..heights.len()).filter(|point| !is_low(point)).for_each(|point| lowest.lift(point));
        } else {
            lowest.clear();
            let z = |p: &Vec3| rows(&[1.0, p.x, p.y, p.z], p);
            (0..heights.len()).filter(is_low).for_each(|point| lowest.land(model, point, &z(&points[point])));
        }
        let lowest_stiffness = vertical(&lowest);
        Some(Self { heights, lowest, lowest_stiffness })
    }
}

/// Model, history and workspace of one stance.
#[derive(Debug, Clone)]
pub(crate) struct Equilibrium {
    sole: Sole,
    pub(crate) stance: Stance,
    stiffness: ContactStiffness,
    pub(crate) scratch: Scratch,
    saved: Saved,
    reached: Saved,
    pub(crate) work: Work,
    /// Free points far from the ground are not looked at; see [`SCREEN`].
    pub(crate) screening: bool,
}

fn stack(a: &Vec3, b: &Vec3) -> Vec6 {
    Vec6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

fn parts(v: &Vec6) -> (Vec3, Vec3) {
    (v.fixed_rows::<3>(0).into(), v.fixed_rows::<3>(3).into())
}

fn block(f: &[f64], slot: usize) -> Vec3 {
    Vec3::new(f[3 * slot], f[3 * slot + 1], f[3 * slot + 2])
}

fn flat(v: &Vector2<f64>) -> Vec3 {
    Vec3::new(v.x, v.y, 0.0)
}

impl Equilibrium {
    pub(crate) fn new(model: Arc<SoleModel>, euler: EulerOrder) -> Self {
        let n = model.contact_points().len();
        let ld = 3 * n;
        let reach = model.contact_points().iter().map(|p| p.norm()).fold(0.0, f64::max);
        let c = model.compliance();
        let smallest = (0..ld).map(|i| c[(i, i)]).fold(f64::INFINITY, f64::min);
        let floor_m = FLOOR_ULPS * f64::EPSILON * reach;
        let rho = (0..n).map(|i| 3.0 / (c[(3 * i, 3 * i)] + c[(3 * i + 1, 3 * i + 1)] + c[(3 * i + 2, 3 * i + 2)]));
        let mut stiffness = ContactStiffness::new(&model);
        stiffness.fill(&model);
        let points = model.contact_points();
        stiffness.set_columns(FIRST_COLUMNS, |i| rows(&[1.0, points[i].x, points[i].y, points[i].z], &points[i]));
        let raised = Raised::new(&model, &stiffness);
        let bonded = vertical(&stiffness);
        let full_y = (0..FIRST_COLUMNS).flat_map(|j| stiffness.y(j).to_vec()).collect();
        Self {
            sole: Sole {
                euler,
                full_y,
                floor_n: floor_m / smallest,
                floor_m,
                rho: rho.collect(),
                bonded,
                raised,
                model,
            },
            stance: Stance::new(n),
            stiffness,
            scratch: Scratch::new(n),
            saved: Saved::new(n),
            reached: Saved::new(n),
            work: Work::default(),
            screening: true,
        }
    }

    /// What rounding leaves of a force (N).
    pub(crate) fn floor_n(&self) -> f64 {
        self.sole.floor_n
    }

    pub(crate) fn model(&self) -> &SoleModel {
        &self.sole.model
    }

    /// Is this tick the first of its stance?
    pub(crate) fn is_first(&self) -> bool {
        self.stance.first.is_some()
    }

    /// A new stance: flat at the foothold, which is the origin, heading as given; everything in contact, references by (35).
    pub(crate) fn begin(&mut self, yaw_rad: f64) {
        self.stance.pose = Transform::new(so3::about_z(yaw_rad), Vec3::zeros());
        self.stance.first = Some(yaw_rad);
        self.stance.rate = None;
        self.stance.states.fill(ContactState::Stick);
        self.stance.slips.fill(Vector2::zeros());
        self.stiffness.fill(&self.sole.model);
        self.stiffness.copy_columns(FIRST_COLUMNS, &self.sole.full_y);
    }

    /// Before the first solve: points that this load cannot press to the ground begin off it (of a flat sole that is none), and a foam so soft
    /// that Newton's steps would not get there begins at the depth to which the load presses it flat.
    pub(crate) fn lower(&mut self, normal_n: f64) {
        let stiffness = self.sole.raised.as_ref().map_or(self.sole.bonded, |raised| raised.lowest_stiffness);
        let depth = normal_n / stiffness;
        self.stance.pose.translation.z = if depth > DEEP_STEPS * STEP_MAX_M { -depth } else { 0.0 };
        let Some(raised) = &self.sole.raised else { return };
        let reach = START_DEPTHS * depth + PLANE_M;
        // Mostly it is the lowest plane, whose stiffness is at hand.
        let lies_flat = raised.heights.iter().all(|height| (*height <= reach) == (*height <= PLANE_M));
        if lies_flat && !self.stance.states.iter().zip(&raised.heights).all(|(state, h)| *state == start(*h, reach)) {
            self.stiffness.copy_from(&raised.lowest);
            self.stance.slips.fill(Vector2::zeros());
            for (state, height) in self.stance.states.iter_mut().zip(&raised.heights) {
                *state = start(*height, reach);
            }
        }
        for point in 0..self.stance.states.len() {
            let height = self.sole.raised.as_ref().map_or(0.0, |raised| raised.heights[point]);
            match (self.stance.states[point], start(height, reach)) {
                (ContactState::Open, ContactState::Stick) => {
                    self.stance.states[point] = ContactState::Stick;
                    self.land(point);
                }
                (ContactState::Stick | ContactState::Slip, ContactState::Open) => self.lift(point),
                _ => {}
            }
        }
    }

    /// Starts from given references and states instead: for tools that continue a history they hold.
    pub(crate) fn begin_from(&mut self, pose: Transform, references: &[Vec3]) {
        self.stance.pose = pose;
        self.stance.first = None;
        self.stance.rate = None;
        self.stance.states.fill(ContactState::Stick);
        self.stance.slips.fill(Vector2::zeros());
        for (own, reference) in self.stance.references.iter_mut().zip(references) {
            *own = reference.xy();
        }
        self.refresh();
    }

    /// Recomputes `K_c` and `Y` from the compliance for the present states.
    pub(crate) fn refresh(&mut self) {
        self.stiffness.fill(&self.sole.model);
        let points = self.sole.model.contact_points();
        if self.stance.first.is_some() {
            self.stiffness.copy_columns(FIRST_COLUMNS, &self.sole.full_y);
        } else {
            let q = &self.stance.references;
            self.stiffness.set_columns(10, |i| rows(&[1.0, q[i].x, q[i].y], &points[i]));
        }
        for point in 0..self.stance.states.len() {
            if self.stance.states[point] == ContactState::Open {
                self.stiffness.lift(point);
            }
        }
    }

    /// Directions `q_k` of the families; the first is the constant one.
    fn families(&self) -> (usize, [Vec3; 4]) {
        match &self.stance.first {
            None => (3, [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::zeros()]),
            Some(yaw_rad) => {
                let r = self.sole.euler.with_yaw(&self.stance.pose.rotation, *yaw_rad);
                let t = |k: usize| Vec3::new(r[(0, k)], r[(1, k)], 0.0);
                (4, [Vec3::zeros(), t(0), t(1), t(2)])
            }
        }
    }

    fn scalars(&self, point: usize) -> [f64; 4] {
        let p = &self.sole.model.contact_points()[point];
        match self.stance.first {
            None => [1.0, self.stance.references[point].x, self.stance.references[point].y, 0.0],
            Some(_) => [1.0, p.x, p.y, p.z],
        }
    }

    /// Tangential reference of a point at the present pose.
    fn reference(&self, point: usize, families: &(usize, [Vec3; 4])) -> Vec3 {
        let s = self.scalars(point);
        (0..families.0).map(|k| s[k] * families.1[k]).sum()
    }

    /// The tick is over: references move to where the points are now (28).
    pub(crate) fn commit(&mut self, positions: &[Vec3]) {
        if let Some(yaw_rad) = self.stance.first.take() {
            let r = self.sole.euler.with_yaw(&self.stance.pose.rotation, yaw_rad);
            // Columns of the first tick's families become those of the later ones.
            let m = 3 * self.stiffness.len();
            let (y, _, ld) = self.stiffness.columns_mut(10);
            // p = sum_k p_k e_k, kept before its parts are overwritten.
            for i in 0..m {
                let own: f64 = y[12 * ld + i];
                let mut moved = [[0.0; 3]; 2];
                for axis in 0..3 {
                    let parts = [y[(3 + axis) * ld + i], y[(6 + axis) * ld + i], y[(9 + axis) * ld + i]];
                    for (t, moved) in moved.iter_mut().enumerate() {
                        moved[axis] = r[(t, 0)] * parts[0] + r[(t, 1)] * parts[1] + r[(t, 2)] * parts[2];
                    }
                }
                for axis in 0..3 {
                    y[(3 + axis) * ld + i] = moved[0][axis];
                    y[(6 + axis) * ld + i] = moved[1][axis];
                }
                y[9 * ld + i] = own;
            }
        }
        for i in 0..self.scratch.sliding.len() {
            let point = self.scratch.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let v = self.stance.slips[point];
            for axis in 0..3 {
                self.stiffness.shift_column(3 + axis, 3 * slot + axis, v.x);
                self.stiffness.shift_column(6 + axis, 3 * slot + axis, v.y);
            }
        }
        for slot in 0..self.stiffness.len() {
            // Exactly where the contact equations put it, not where C f puts it up to rounding.
            let point = self.stiffness.points()[slot];
            self.stance.references[point] = self.scratch.world[slot].xy();
            self.stance.slips[point] = Vector2::zeros();
        }
        for point in 0..self.stance.states.len() {
            if self.stance.states[point] == ContactState::Open {
                self.stance.references[point] = positions[point].xy();
            }
        }
    }

    /// Nothing has been done yet.
    pub(crate) fn reset_work(&mut self) {
        self.work = Work::default();
        self.stiffness.multiplications = 0;
    }

    /// Largest entry of `K_c C_cc - 1`.
    pub(crate) fn stiffness_error(&self) -> f64 {
        let (c, points) = (self.sole.model.compliance(), self.stiffness.points());
        let place = |row: usize| 3 * points[row / 3] + row % 3;
        let mut worst = 0.0_f64;
        for j in 0..3 * points.len() {
            let k = self.stiffness.column(j);
            for i in 0..3 * points.len() {
                let product: f64 = k.iter().enumerate().map(|(l, k)| c[(place(i), place(l))] * k).sum();
                worst = worst.max((product - f64::from(u8::from(i == j))).abs());
            }
        }
        worst
    }

    /// As if rounding had made `K_c` and what follows from it softer by this part.
    #[cfg(test)]
    pub(crate) fn drift(&mut self, part: f64) {
        self.stiffness.drift(part);
    }

    /// Multiplications since.
    pub(crate) fn multiplications(&self) -> u64 {
        self.work.multiplications + self.stiffness.multiplications
    }

    /// Remembers the present state.
    pub(crate) fn save(&mut self) {
        self.saved.keep(&self.stance);
    }

    /// Returns to the remembered state.
    pub(crate) fn restore(&mut self) {
        self.stance.pose = self.saved.pose;
        for point in 0..self.stance.states.len() {
            let (was, is) = (self.saved.states[point], self.stance.states[point]);
            if was == ContactState::Open && is != ContactState::Open {
                self.stiffness.lift(point);
            } else if was != ContactState::Open && is == ContactState::Open {
                self.stance.states[point] = was;
                let count = self.families().0;
                let z = rows(&self.scalars(point)[..count], &self.sole.model.contact_points()[point]);
                self.stiffness.land(&self.sole.model, point, &z);
            }
            self.stance.states[point] = was;
            self.stance.slips[point] = self.saved.slips[point];
        }
    }

    /// Remembers the state that the continuation has reached.
    pub(crate) fn save_reached(&mut self) {
        self.reached.keep(&self.stance);
    }

    /// Returns to it.
    pub(crate) fn return_to_reached(&mut self) {
        std::mem::swap(&mut self.saved, &mut self.reached);
        self.restore();
        std::mem::swap(&mut self.saved, &mut self.reached);
    }

    /// Angle (rad) to an earlier orientation.
    pub(crate) fn turned_since(&self, before: &Mat3) -> f64 {
        so3::log(&(self.stance.pose.rotation * before.transpose())).norm()
    }

    /// Mean depth of the undeformed places of the points in contact under the ground, over the thickness; see
    /// [`crate::StanceReport::compression`].
    pub(crate) fn compression(&self) -> f64 {
        let thickness = self.sole.model.statistics().thickness_m;
        let points = self.stiffness.points();
        if thickness <= 0.0 || points.is_empty() {
            return 0.0;
        }
        let depth: f64 = points.iter().map(|p| -self.stance.pose.point(&self.sole.model.contact_points()[*p]).z).sum();
        depth / (points.len() as f64 * thickness)
    }

    /// Total wrench about the sole's origin, world axes.
    pub(crate) fn wrench(&self) -> (Vec3, Vec3) {
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for slot in 0..self.stiffness.len() {
            let f = self.stance.pose.rotation * block(&self.scratch.f, slot);
            force += f;
            moment += (self.scratch.world[slot] - self.stance.pose.translation).cross(&f);
        }
        (force, moment)
    }
}

/// Vertical stiffness of all points in contact together: the third column of `Y` is that of equal vertical displacements.
fn vertical(stiffness: &ContactStiffness) -> f64 {
    stiffness.y(2).iter().skip(2).step_by(3).sum()
}

/// How a point begins that is so high above the lowest one.
fn start(height_m: f64, reach_m: f64) -> ContactState {
    if height_m <= reach_m { ContactState::Stick } else { ContactState::Open }
}

/// Rows of Z: `s_k e_j` for every family k, then the undeformed position.
fn rows(scalars: &[f64], p: &Vec3) -> Rows {
    let mut out = [[0.0; COLUMNS_MAX]; 3];
    for axis in 0..3 {
        for (k, s) in scalars.iter().enumerate() {
            out[axis][3 * k + axis] = *s;
        }
        out[axis][3 * scalars.len()] = p[axis];
    }
    out
}

/// Solves with a 6 x 6 matrix whose rows and columns mix lengths and angles.
pub(crate) fn scaled_solve(matrix: &Mat6, right: &Vec6) -> Option<Vec6> {
    let unit = |i: usize| if i < 3 { 1.0 } else { MOMENT_ARM_M };
    let scaled = Mat6::from_fn(|i, j| matrix[(i, j)] / (unit(i) * unit(j)));
    let rhs = Vec6::from_fn(|i, _| right[i] / unit(i));
    let x = scaled.lu().solve(&rhs)?;
    let out = Vec6::from_fn(|i, _| x[i] / unit(i));
    out.iter().all(|x| x.is_finite()).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MeshSource, SoleSettings};

    #[test]
    fn an_equilibrium_beyond_the_fold_is_found_to_be_unstable() {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.03], cells: [10, 5, 5] };
        let model = Arc::new(SoleModel::build(&SoleSettings { mesh, ..SoleSettings::default() }).expect("a sole"));
        // At the first tick the ZMP folds back at 0.91 of the half-length and a tilt of 17 degrees: at 0.9 there are two.
        let zero = Vec3::zeros();
        let zmp = [Vector2::new(0.9 * 0.115, 0.0), Vector2::zeros(), Vector2::zeros()];
        let target = Target { force: [Vec3::z() * 383.0, zero, zero], zmp };
        let limits = Limits { tolerance: 1e-9, iterations: 60, multiplications: u64::MAX };
        let mut found = [Vec::new(), Vec::new()];
        for start_deg in 8..28 {
            let mut equilibrium = Equilibrium::new(Arc::clone(&model), EulerOrder::default());
            equilibrium.begin(0.0);
            let tilt = so3::exp(&Vec3::new(0.0, f64::from(start_deg).to_radians(), 0.0));
            // The front edge a few millimetres deep.
            equilibrium.stance.pose =
                Transform::new(tilt, Vec3::z() * (0.115 * f64::from(start_deg).to_radians().sin() - 0.004));
            let end = equilibrium.newton(&target, &limits, false);
            let tilt_deg = equilibrium.stance.pose.rotation[(2, 2)].acos().to_degrees();
            match end {
                End::Converged => found[0].push(tilt_deg),
                End::Unstable => found[1].push(tilt_deg),
                End::Stopped | End::Circling => {}
            }
        }
        let [stable, unstable] = found;
        assert!(!stable.is_empty() && stable.iter().all(|tilt_deg| *tilt_deg < 17.5), "{stable:?}");
        assert!(!unstable.is_empty() && unstable.iter().all(|tilt_deg| *tilt_deg > 16.5), "{unstable:?}");
    }
}
