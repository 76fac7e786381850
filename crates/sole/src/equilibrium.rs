//! Pose, forces and node states together: Newton in the stiffness form (method 2.4).
//!
//! Unknowns: position `O` and orientation `R` of the sole and the tangential slips `v` of the sliding points. For the contact
//! set c the displacements `u_i = R'(Q_i + v_i - O) - p_i` are prescribed, the forces are `f = K_c u`, and with
//! `Q_i = sum_k s_ik q_k` (a few *families* of scalars `s` fixed per point, directions `q` that turn with the pose)
//! `f = Y coefficients + sum_slip K_:i R' v_i`, where `Y = K_c Z` is kept by [`ContactStiffness`]. Equations: total force and
//! moment equal the target's, and for each sliding point the Alart-Curnier condition
//! `G = F_t - mu F_n d = 0, d = z/|z|, z = F_t - rho v`. Sliding unknowns are eliminated first, so each step solves 2s and then
//! 6 equations; the 6 x 6 matrix left over is the tangent stiffness at frozen states.

use crate::estimate::{EulerOrder, Foothold};
use crate::stiffness::{COLUMNS_MAX, ContactStiffness, Rows};
use crate::{NodeState, SoleModel};
use friction::dense::{add_one, add_three, dot, lu_factor, lu_solve, upper_solve};
use friction::natural_map;
use nalgebra::{RowVector3, Vector2};
use spatial::{Mat3, Mat6, Transform, Vec3, Vec6, so3};
use std::sync::Arc;

/// What the sole must carry, and how it changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Target {
    /// Force of the ground on the sole, world (N), rate, second rate.
    pub force: [Vec3; 3],
    /// Zero-moment point on the ground (m), rate, second rate.
    pub zmp: [Vector2<f64>; 3],
}

impl Target {
    fn point(&self, order: usize) -> Vec3 {
        Vec3::new(self.zmp[order].x, self.zmp[order].y, 0.0)
    }

    /// Wrench about the fixed point `c` and its first two time derivatives.
    fn wrench(&self, c: &Vec3) -> [Vec6; 3] {
        let [f, fd, fdd] = self.force;
        let (p, pd, pdd) = (self.point(0) - c, self.point(1), self.point(2));
        [
            stack(&f, &p.cross(&f)),
            stack(&fd, &(pd.cross(&f) + p.cross(&fd))),
            stack(&fdd, &(pdd.cross(&f) + 2.0 * pd.cross(&fd) + p.cross(&fdd))),
        ]
    }

    /// A point between two targets (values only).
    pub(crate) fn between(&self, to: &Self, fraction: f64) -> Self {
        let mut out = *to;
        out.force[0] = self.force[0] * (1.0 - fraction) + to.force[0] * fraction;
        out.zmp[0] = self.zmp[0] * (1.0 - fraction) + to.zmp[0] * fraction;
        out
    }
}

/// How one Newton solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    Converged,
    Unstable,
    Stopped,
}

/// Limits of the Newton iteration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub tolerance: f64,
    pub iterations: usize,
}

/// Reported beside the pose.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Work {
    pub iterations: usize,
    pub landings: usize,
    pub lift_offs: usize,
    pub residual: f64,
}

/// Longest step of the position (m) and of the orientation (rad) in one iteration (facts: robust without a line search).
const STEP_MAX_M: f64 = 0.010;
const STEP_MAX_RAD: f64 = 0.2;
/// Length (m) that makes moments comparable to forces: half a foot.
const MOMENT_ARM_M: f64 = 0.1;
/// Rounding floors are this many units of the last place of the sole's coordinates.
const FLOOR_ULPS: f64 = 40.0;

/// During the iterations a free point is looked at only if its undeformed position is nearer to the ground than this many times
/// the largest displacement in contact. Not a bound, so [`Equilibrium::settle`] looks at all of them when the iterations are over.
const SCREEN: f64 = 2.0;

/// From this iteration on only one point changes its state at a time.
const CAUTIOUS_AFTER: usize = 10;

/// A point whose state does not fit its force or gap, and by how much (N).
#[derive(Debug, Clone, Copy)]
struct Change {
    point: usize,
    to: NodeState,
    wrong_n: f64,
}

/// A saved state to return to when an attempt fails.
#[derive(Debug, Clone)]
struct Saved {
    pose: Transform,
    states: Vec<NodeState>,
    slips: Vec<Vector2<f64>>,
}

/// Opaque copy of a state.
#[derive(Debug, Clone)]
pub(crate) struct Snapshot(Saved);

/// Model, history and workspace of one stance.
#[derive(Debug, Clone)]
pub(crate) struct Equilibrium {
    model: Arc<SoleModel>,
    euler: EulerOrder,
    pub(crate) pose: Transform,
    pub(crate) states: Vec<NodeState>,
    slips: Vec<Vector2<f64>>,
    /// Tangential references Q of every point; meaningless at the first tick, when they follow from the pose (35).
    references: Vec<Vector2<f64>>,
    first: Option<Foothold>,
    stiffness: ContactStiffness,
    /// `K Z` for all points in contact and the families of the first tick.
    full_y: Vec<f64>,
    /// packed sole-frame forces
    f: Vec<f64>,
    f_rate: Vec<f64>,
    f_second: Vec<f64>,
    /// the same at every point, zero where free
    force_full: Vec<f64>,
    /// displacement of every point by the compliance
    u_full: Vec<f64>,
    /// A = K B, 6 columns, and at the first tick the three that the moving references add
    a: Vec<f64>,
    a_first: Vec<f64>,
    /// world positions of the points in contact, by slot
    world: Vec<Vec3>,
    sliding: Vec<usize>,
    sliding_slots: Vec<usize>,
    slip_column: Vec<f64>,
    /// per sliding point: gradient of its condition with its force (sole axes), with its slip
    gradients: Vec<[RowVector3<f64>; 2]>,
    own_rates: Vec<[Vector2<f64>; 2]>,
    jss: Vec<f64>,
    pivots: Vec<usize>,
    /// columns: J_ss^-1 J_sx (6), J_ss^-1 G (1)
    js: Vec<f64>,
    jxs: Vec<f64>,
    changes: Vec<Change>,
    /// tangent about the fixed point O at frozen states, world axes
    pub(crate) tangent: Mat6,
    right_hand: Vec6,
    saved: Saved,
    floor_n: f64,
    floor_m: f64,
    rho: Vec<f64>,
    pub(crate) work: Work,
    /// Rates at the end of the last solved tick: of the pose, its second rate, of the slips.
    rate: Option<(Vec6, Vec6)>,
    slip_rates: Vec<Vector2<f64>>,
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
        stiffness.set_columns(COLUMNS_MAX, |i| rows(&[1.0, points[i].x, points[i].y, points[i].z], &points[i]));
        let full_y = (0..COLUMNS_MAX).flat_map(|j| stiffness.y(j).to_vec()).collect();
        Self {
            euler,
            pose: Transform::identity(),
            states: vec![NodeState::Free; n],
            slips: vec![Vector2::zeros(); n],
            references: vec![Vector2::zeros(); n],
            first: None,
            stiffness,
            full_y,
            f: vec![0.0; ld],
            f_rate: vec![0.0; ld],
            f_second: vec![0.0; ld],
            force_full: vec![0.0; ld],
            u_full: vec![0.0; ld],
            a: vec![0.0; 6 * ld],
            a_first: vec![0.0; 3 * ld],
            world: vec![Vec3::zeros(); n],
            sliding: Vec::with_capacity(n),
            sliding_slots: Vec::with_capacity(n),
            slip_column: vec![0.0; ld],
            gradients: vec![[RowVector3::zeros(); 2]; n],
            own_rates: vec![[Vector2::zeros(); 2]; n],
            jss: vec![0.0; 2 * n * (2 * n + 7)],
            pivots: vec![0; 2 * n],
            js: vec![0.0; 2 * n * 7],
            jxs: vec![0.0; 2 * n * 6],
            changes: Vec::with_capacity(n),
            tangent: Mat6::zeros(),
            right_hand: Vec6::zeros(),
            saved: Saved {
                pose: Transform::identity(),
                states: vec![NodeState::Free; n],
                slips: vec![Vector2::zeros(); n],
            },
            floor_n: floor_m / smallest,
            floor_m,
            rho: rho.collect(),
            work: Work::default(),
            rate: None,
            slip_rates: vec![Vector2::zeros(); n],
            screening: true,
            model,
        }
    }

    pub(crate) fn model(&self) -> &SoleModel {
        &self.model
    }

    /// Is this tick the first of its stance?
    pub(crate) fn is_first(&self) -> bool {
        self.first.is_some()
    }

    /// A new stance: flat at the foothold, everything in contact, references by (35).
    pub(crate) fn begin(&mut self, foothold: Foothold) {
        self.pose = Transform::new(so3::about_z(foothold.yaw_rad), Vec3::new(foothold.x_m, foothold.y_m, 0.0));
        self.first = Some(foothold);
        self.rate = None;
        self.states.fill(NodeState::Stick);
        self.slips.fill(Vector2::zeros());
        self.stiffness.fill(&self.model);
        self.stiffness.copy_columns(COLUMNS_MAX, &self.full_y);
    }

    /// Starts from given references and states instead: for tools that continue a history they hold.
    pub(crate) fn begin_from(&mut self, pose: Transform, references: &[Vector2<f64>]) {
        self.pose = pose;
        self.first = None;
        self.rate = None;
        self.states.fill(NodeState::Stick);
        self.slips.fill(Vector2::zeros());
        self.references.copy_from_slice(references);
        self.refresh();
    }

    /// Recomputes `K_c` and `Y` from the compliance for the present states.
    pub(crate) fn refresh(&mut self) {
        self.stiffness.fill(&self.model);
        let points = self.model.contact_points();
        if self.first.is_some() {
            self.stiffness.copy_columns(COLUMNS_MAX, &self.full_y);
        } else {
            let q = &self.references;
            self.stiffness.set_columns(10, |i| rows(&[1.0, q[i].x, q[i].y], &points[i]));
        }
        for point in 0..self.states.len() {
            if self.states[point] == NodeState::Free {
                self.stiffness.lift(point);
            }
        }
    }

    /// Directions `q_k` of the families; the first is the constant one.
    fn families(&self) -> (usize, [Vec3; 4]) {
        match &self.first {
            None => (3, [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::zeros()]),
            Some(foothold) => {
                let r = self.euler.with_yaw(&self.pose.rotation, foothold.yaw_rad);
                let t = |k: usize| Vec3::new(r[(0, k)], r[(1, k)], 0.0);
                (4, [Vec3::new(foothold.x_m, foothold.y_m, 0.0), t(0), t(1), t(2)])
            }
        }
    }

    fn scalars(&self, point: usize) -> [f64; 4] {
        let p = &self.model.contact_points()[point];
        match self.first {
            None => [1.0, self.references[point].x, self.references[point].y, 0.0],
            Some(_) => [1.0, p.x, p.y, p.z],
        }
    }

    /// Tangential reference of a point at the present pose.
    fn reference(&self, point: usize, families: &(usize, [Vec3; 4])) -> Vec3 {
        let s = self.scalars(point);
        (0..families.0).map(|k| s[k] * families.1[k]).sum()
    }

    /// `f = K_c u` and the world positions of the points in contact at the present pose and slips.
    fn evaluate(&mut self) {
        let (m, ld) = (3 * self.stiffness.len(), self.stiffness.ld());
        let families = self.families();
        let (count, q) = families;
        let f = &mut self.f[..m];
        f.fill(0.0);
        for k in 0..count {
            let offset = if k == 0 { self.pose.translation } else { Vec3::zeros() };
            let c = self.pose.rotation.tr_mul(&(q[k] - offset));
            add_three(
                f,
                self.stiffness.y(3 * k),
                self.stiffness.y(3 * k + 1),
                self.stiffness.y(3 * k + 2),
                c.x,
                c.y,
                c.z,
            );
        }
        add_one(f, self.stiffness.y(3 * count), -1.0);
        self.sliding.clear();
        self.sliding_slots.clear();
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            if self.states[*point] == NodeState::Slip {
                self.sliding.push(*point);
                self.sliding_slots.push(slot);
                let c = self.pose.rotation.tr_mul(&flat(&self.slips[*point]));
                let j = 3 * slot;
                let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
                add_three(f, x, y, z, c.x, c.y, c.z);
            }
        }
        self.force_full[..ld].fill(0.0);
        for slot in 0..self.stiffness.len() {
            let point = self.stiffness.points()[slot];
            self.force_full[3 * point..3 * point + 3].copy_from_slice(&self.f[3 * slot..3 * slot + 3]);
            self.world[slot] = self.reference(point, &families) + flat(&self.slips[point]);
        }
    }

    /// Height of a free point above the ground.
    fn gap(&self, point: usize) -> f64 {
        let up = self.pose.rotation.row(2);
        let p = &self.model.contact_points()[point];
        let c = self.model.compliance().as_slice();
        let ld = self.stiffness.ld();
        let u = |axis: usize| dot(&c[(3 * point + axis) * ld..(3 * point + axis + 1) * ld], &self.force_full);
        self.pose.translation.z + up[0] * (p.x + u(0)) + up[1] * (p.y + u(1)) + up[2] * (p.z + u(2))
    }

    /// Largest displacement of a point in contact (m).
    fn largest_displacement(&self) -> f64 {
        let mut largest = 0.0_f64;
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let local = self.pose.rotation.tr_mul(&(self.world[slot] - self.pose.translation));
            largest = largest.max((local - self.model.contact_points()[*point]).norm_squared());
        }
        largest.sqrt()
    }

    /// World position of a free point.
    fn free_position(&self, point: usize) -> Vec3 {
        let c = self.model.compliance().as_slice();
        let ld = self.stiffness.ld();
        let u =
            Vec3::from_fn(|axis, _| dot(&c[(3 * point + axis) * ld..(3 * point + axis + 1) * ld], &self.force_full));
        self.pose.point(&(self.model.contact_points()[point] + u))
    }

    /// New states from the present forces and gaps; true when any changed. `cautious`: only the point that is most in the wrong
    /// changes, which ends the cycles that changing all of them can run into.
    fn update_states(&mut self, cautious: bool) -> bool {
        self.changes.clear();
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let force = self.pose.rotation * block(&self.f, slot);
            let (tangential, normal) = (Vector2::new(force.x, force.y), force.z);
            let bound = self.model.friction()[*point] * normal;
            let change = |to: NodeState, wrong_n: f64| Change { point: *point, to, wrong_n };
            if normal < -self.floor_n {
                self.changes.push(change(NodeState::Free, -normal));
            } else if self.states[*point] == NodeState::Stick {
                let excess = tangential.norm() - bound;
                if excess > self.floor_n {
                    self.changes.push(change(NodeState::Slip, excess));
                }
            } else {
                let slack = bound - (tangential - self.rho[*point] * self.slips[*point]).norm();
                if slack > self.floor_n {
                    self.changes.push(change(NodeState::Stick, slack));
                }
            }
        }
        let far = if self.screening { SCREEN * self.largest_displacement() } else { f64::INFINITY };
        for point in 0..self.states.len() {
            if self.states[point] == NodeState::Free && self.pose.point(&self.model.contact_points()[point]).z < far {
                let gap = self.gap(point);
                if gap < -self.floor_m {
                    self.changes.push(Change { point, to: NodeState::Stick, wrong_n: -gap * self.rho[point] });
                }
            }
        }
        if cautious
            && let Some(worst) = self.changes.iter().copied().reduce(|a, b| if b.wrong_n > a.wrong_n { b } else { a })
        {
            self.changes.clear();
            self.changes.push(worst);
        }
        let families = self.families();
        for k in 0..self.changes.len() {
            let Change { point, to, .. } = self.changes[k];
            if self.states[point] == NodeState::Free {
                // Lands: sliding when its way since the reference is more sideways than friction can hold.
                let away = self.free_position(point) - self.reference(point, &families);
                let tangential = Vector2::new(away.x, away.y);
                let slides = tangential.norm() > self.model.friction()[point] * away.z.abs();
                self.states[point] = if slides { NodeState::Slip } else { NodeState::Stick };
                self.slips[point] = if slides { tangential } else { Vector2::zeros() };
                self.land(point);
            } else if to == NodeState::Free {
                self.lift(point);
            } else {
                self.states[point] = to;
                self.slips[point] = Vector2::zeros();
            }
        }
        !self.changes.is_empty()
    }

    fn land(&mut self, point: usize) {
        self.work.landings += 1;
        let count = self.families().0;
        let z = rows(&self.scalars(point)[..count], &self.model.contact_points()[point]);
        self.stiffness.land(&self.model, point, &z);
    }

    fn lift(&mut self, point: usize) {
        self.work.lift_offs += 1;
        self.states[point] = NodeState::Free;
        self.slips[point] = Vector2::zeros();
        self.stiffness.lift(point);
    }

    /// Residual and Jacobian at the present point. With `frozen` the references do not follow the pose at the first tick.
    /// Returns the scaled residual; leaves the reduced tangent, its right-hand side and the slip solves in place.
    fn assemble(&mut self, target: &Target, frozen: bool) -> f64 {
        let (m, ld, s) = (3 * self.stiffness.len(), self.stiffness.ld(), self.sliding.len());
        let r = self.pose.rotation;
        let (count, q) = self.families();
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        // A = K B: displacement rates by O' (columns 0-2) and by the angular velocity (3-5).
        for l in 0..3 {
            let (linear, angular) = self.a.split_at_mut(3 * ld);
            let linear = &mut linear[l * ld..l * ld + m];
            let angular = &mut angular[l * ld..l * ld + m];
            linear.fill(0.0);
            angular.fill(0.0);
            add_three(
                linear,
                self.stiffness.y(0),
                self.stiffness.y(1),
                self.stiffness.y(2),
                -r[(l, 0)],
                -r[(l, 1)],
                -r[(l, 2)],
            );
            for k in 0..count {
                let direction = if k == 0 { q[k] - self.pose.translation } else { q[k] };
                let c = r.tr_mul(&direction.cross(&axes[l]));
                let j = 3 * k;
                add_three(
                    angular,
                    self.stiffness.y(j),
                    self.stiffness.y(j + 1),
                    self.stiffness.y(j + 2),
                    c.x,
                    c.y,
                    c.z,
                );
            }
        }
        // Point by point, so that its columns of K are fetched once.
        for (point, slot) in self.sliding.iter().zip(&self.sliding_slots) {
            let v = self.slips[*point];
            if v.x == 0.0 && v.y == 0.0 {
                continue;
            }
            let j = 3 * slot;
            let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
            for l in 0..3 {
                let c = r.tr_mul(&flat(&v).cross(&axes[l]));
                add_three(&mut self.a[(3 + l) * ld..(3 + l) * ld + m], x, y, z, c.x, c.y, c.z);
            }
        }
        // References that follow roll and pitch (35).
        let first = if frozen { None } else { self.first };
        let mut reference_rates = [Mat3::zeros(); 3];
        if let Some(foothold) = first {
            for l in 0..3 {
                let rate = self.euler.with_yaw_rate(&r, foothold.yaw_rad, &axes[l]);
                let column = &mut self.a_first[l * ld..l * ld + m];
                column.fill(0.0);
                for k in 0..3 {
                    let moved = Vec3::new(rate[(0, k)], rate[(1, k)], 0.0);
                    reference_rates[k].set_column(l, &moved);
                    let c = r.tr_mul(&moved);
                    let j = 3 * (k + 1);
                    let (x, y, z) = (self.stiffness.y(j), self.stiffness.y(j + 1), self.stiffness.y(j + 2));
                    add_three(column, x, y, z, c.x, c.y, c.z);
                }
            }
        }
        // Resultants and their rates about the fixed point O.
        let o = self.pose.translation;
        let (mut force, mut moment, mut geometric) = (Vec3::zeros(), Vec3::zeros(), Mat3::zeros());
        let mut weighted = [Vec3::zeros(); 3];
        let (mut sum_a, mut sum_xa) = ([Vec3::zeros(); 6], [Vec3::zeros(); 6]);
        for slot in 0..self.stiffness.len() {
            let arm = self.world[slot] - o;
            let f = r * block(&self.f, slot);
            force += f;
            moment += arm.cross(&f);
            // arm x (w x f) = (w (arm.f) - f (arm.w))
            geometric += arm.dot(&f) * Mat3::identity() - f * arm.transpose();
            let local = r.tr_mul(&arm);
            for l in 0..6 {
                let mut a = block(&self.a[l * ld..], slot);
                if l >= 3 && first.is_some() {
                    a += block(&self.a_first[(l - 3) * ld..], slot);
                }
                sum_a[l] += a;
                sum_xa[l] += local.cross(&a);
            }
            if first.is_some() {
                let p = &self.model.contact_points()[self.stiffness.points()[slot]];
                for k in 0..3 {
                    weighted[k] += p[k] * f;
                }
            }
        }
        let mut j = Mat6::zeros();
        for l in 0..6 {
            j.fixed_view_mut::<3, 1>(0, l).copy_from(&(r * sum_a[l]));
            j.fixed_view_mut::<3, 1>(3, l).copy_from(&(r * sum_xa[l]));
        }
        let mut angular = j.fixed_view::<3, 3>(0, 3).into_owned();
        angular -= so3::skew(&force);
        j.fixed_view_mut::<3, 3>(0, 3).copy_from(&angular);
        let mut turning = j.fixed_view::<3, 3>(3, 3).into_owned();
        turning += geometric;
        if first.is_some() {
            for k in 0..3 {
                turning -= so3::skew(&weighted[k]) * reference_rates[k];
            }
        }
        j.fixed_view_mut::<3, 3>(3, 3).copy_from(&turning);
        let wanted = target.wrench(&o)[0];
        let residual = stack(&force, &moment) - wanted;
        let load = target.force[0].norm();
        let about_zmp = parts(&residual).1 - (target.point(0) - o).cross(&parts(&residual).0);
        let mut scaled = (parts(&residual).0.amax() / load).max(about_zmp.amax() / (MOMENT_ARM_M * load));
        // Sliding points: eliminated.
        let rows_s = 2 * self.states.len();
        for i in 0..s {
            let point = self.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let f = r * block(&self.f, slot);
            let law = self.law(point, &f);
            scaled = scaled.max(law.residual.amax() / load);
            let (g0, g1) = (law.residual.x, law.residual.y);
            self.js[6 * rows_s + 2 * i] = g0;
            self.js[6 * rows_s + 2 * i + 1] = g1;
            for l in 0..6 {
                let mut a = block(&self.a[l * ld..], slot);
                // Transposed use: the wrench rate by this slip is -(K B)' R' e_t.
                let back = r * a;
                if l >= 3 && first.is_some() {
                    a += block(&self.a_first[(l - 3) * ld..], slot);
                }
                let mut rate = r * a;
                if l >= 3 {
                    rate += axes[l - 3].cross(&f);
                }
                let g = law.rate(&rate, &Vector2::zeros());
                self.js[l * rows_s + 2 * i] = g.x;
                self.js[l * rows_s + 2 * i + 1] = g.y;
                self.jxs[(2 * i) * 6 + l] = -back.x;
                self.jxs[(2 * i + 1) * 6 + l] = -back.y;
            }
            for t in 0..2 {
                let turn = axes[t].cross(&f);
                for l in 0..3 {
                    self.jxs[(2 * i + t) * 6 + 3 + l] += turn[l];
                }
            }
            // G' = M f' + N v', with M in the sole's axes.
            self.gradients[i] = [law.gradient(0) * r, law.gradient(1) * r];
            for t in 0..2 {
                let mut slip_rate = Vector2::zeros();
                slip_rate[t] = 1.0;
                self.own_rates[i][t] = law.rate(&Vec3::zeros(), &slip_rate);
            }
        }
        // Column by column: f' = K_:k R' e_t, then M_i f'_i of every sliding point.
        for k in 0..s {
            let j = 3 * self.sliding_slots[k];
            let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
            for t in 0..2 {
                let column = &mut self.slip_column[..m];
                column.fill(0.0);
                add_three(column, x, y, z, r[(t, 0)], r[(t, 1)], r[(t, 2)]);
                let target = &mut self.jss[(2 * k + t) * rows_s..(2 * k + t) * rows_s + 2 * s];
                for ((g, slot), [m0, m1]) in target.chunks_exact_mut(2).zip(&self.sliding_slots).zip(&self.gradients) {
                    let f = &column[3 * slot..3 * slot + 3];
                    g[0] = m0[0] * f[0] + m0[1] * f[1] + m0[2] * f[2];
                    g[1] = m1[0] * f[0] + m1[1] * f[1] + m1[2] * f[2];
                }
                target[2 * k] += self.own_rates[k][t].x;
                target[2 * k + 1] += self.own_rates[k][t].y;
            }
        }
        let mut right = residual;
        if s > 0 {
            // The seven right-hand sides ride along behind the matrix.
            self.jss[2 * s * rows_s..(2 * s + 7) * rows_s].copy_from_slice(&self.js[..7 * rows_s]);
            let ratio = lu_factor(&mut self.jss, rows_s, 2 * s, 7, &mut self.pivots);
            if ratio < f64::EPSILON {
                self.tangent = Mat6::zeros();
                return f64::INFINITY;
            }
            self.js[..7 * rows_s].copy_from_slice(&self.jss[2 * s * rows_s..(2 * s + 7) * rows_s]);
            upper_solve(&self.jss, rows_s, 2 * s, &mut self.js, 7);
            for i in 0..2 * s {
                let back = Vec6::from_column_slice(&self.jxs[6 * i..6 * i + 6]);
                for l in 0..6 {
                    let x = self.js[l * rows_s + i];
                    let mut column = j.column_mut(l);
                    column.axpy(-x, &back, 1.0);
                }
                right.axpy(-self.js[6 * rows_s + i], &back, 1.0);
            }
        }
        self.tangent = j;
        self.right_hand = right;
        scaled
    }

    fn law(&self, point: usize, force: &Vec3) -> SlidingLaw {
        SlidingLaw::new(self.model.friction()[point], self.rho[point], force, &self.slips[point])
    }

    /// Newton from the present state.
    pub(crate) fn newton(&mut self, target: &Target, limits: &Limits) -> End {
        let tolerance = limits.tolerance.max(self.floor_n / target.force[0].norm());
        self.evaluate();
        let mut settled = false;
        for iteration in 0..=limits.iterations {
            let residual = self.assemble(target, false);
            self.work.residual = residual;
            if settled && residual <= tolerance {
                return if self.tangent.determinant() > 0.0 { End::Converged } else { End::Unstable };
            }
            if iteration == limits.iterations || !residual.is_finite() {
                break;
            }
            self.work.iterations += 1;
            let Some(mut step) = scaled_solve(&self.tangent, &-self.right_hand) else { break };
            let (linear, angular) = parts(&step);
            let scale = 1.0_f64.min(STEP_MAX_M / linear.norm()).min(STEP_MAX_RAD / angular.norm());
            if !scale.is_finite() {
                break;
            }
            let rows_s = 2 * self.states.len();
            for i in 0..self.sliding.len() {
                for t in 0..2 {
                    let row = 2 * i + t;
                    let by_pose: f64 = (0..6).map(|l| self.js[l * rows_s + row] * step[l]).sum();
                    self.slips[self.sliding[i]][t] += scale * (-self.js[6 * rows_s + row] - by_pose);
                }
            }
            step *= scale;
            let (linear, angular) = parts(&step);
            self.pose.translation += linear;
            self.pose.rotation = so3::orthonormalised(&(so3::exp(&angular) * self.pose.rotation));
            self.evaluate();
            settled = !self.update_states(iteration >= CAUTIOUS_AFTER);
            if !settled {
                self.evaluate();
            }
        }
        End::Stopped
    }

    /// Twist and acceleration of the sole's origin by implicit differentiation, at frozen references and states. Call after a
    /// converged [`Equilibrium::newton`]; leaves the frozen tangent in place.
    pub(crate) fn rates(&mut self, target: &Target) -> Option<(Vec6, Vec6)> {
        if self.first.is_some() {
            self.assemble(target, true);
        }
        let (m, ld) = (3 * self.stiffness.len(), self.stiffness.ld());
        let r = self.pose.rotation;
        let o = self.pose.translation;
        let rows_s = 2 * self.states.len();
        let [_, rate, second] = target.wrench(&o);
        let x = scaled_solve(&self.tangent, &rate)?;
        let (linear, w) = parts(&x);
        let slip_rate = |js: &[f64], i: usize| {
            -Vector2::from_fn(|t, _| (0..6).map(|l| js[l * rows_s + 2 * i + t] * x[l]).sum::<f64>())
        };
        // f' and f'' along the path with constant rates.
        let (count, q) = self.families();
        let f1 = &mut self.f_rate[..m];
        let f2 = &mut self.f_second[..m];
        f1.fill(0.0);
        f2.fill(0.0);
        for l in 0..6 {
            add_one(f1, &self.a[l * ld..l * ld + m], x[l]);
        }
        for k in 0..count {
            let mut direction = w.cross(&w.cross(&q[k]));
            if k == 0 {
                direction = w.cross(&w.cross(&(q[k] - o))) + 2.0 * w.cross(&linear);
            }
            let c = r.tr_mul(&direction);
            let j = 3 * k;
            add_three(f2, self.stiffness.y(j), self.stiffness.y(j + 1), self.stiffness.y(j + 2), c.x, c.y, c.z);
        }
        for (i, point) in self.sliding.iter().enumerate() {
            let j = 3 * self.stiffness.slot(*point).expect("sliding points touch");
            let v1 = flat(&slip_rate(&self.js, i));
            let columns = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
            let c = r.tr_mul(&v1);
            add_three(f1, columns.0, columns.1, columns.2, c.x, c.y, c.z);
            let c = r.tr_mul(&(w.cross(&w.cross(&flat(&self.slips[*point]))) - 2.0 * w.cross(&v1)));
            add_three(f2, columns.0, columns.1, columns.2, c.x, c.y, c.z);
        }
        // Second derivative of the wrench along that path, sliding law likewise.
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        let world_rates = |slot: usize, f: &[f64], f1: &[f64], f2: &[f64]| {
            let (force, first, second) = (r * block(f, slot), r * block(f1, slot), r * block(f2, slot));
            (first + w.cross(&force), second + 2.0 * w.cross(&first) + w.cross(&w.cross(&force)))
        };
        for slot in 0..self.stiffness.len() {
            let (_, second) = world_rates(slot, &self.f, &self.f_rate, &self.f_second);
            force += second;
            moment += (self.world[slot] - o).cross(&second);
        }
        for i in 0..self.sliding.len() {
            let point = self.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let (first, second) = world_rates(slot, &self.f, &self.f_rate, &self.f_second);
            let v1 = slip_rate(&self.js, i);
            moment += 2.0 * flat(&v1).cross(&first);
            let law = self.law(point, &(r * block(&self.f, slot)));
            let g = law.second(&first, &second, &v1);
            self.js[6 * rows_s + 2 * i] = g.x;
            self.js[6 * rows_s + 2 * i + 1] = g.y;
        }
        let mut right = second - stack(&force, &moment);
        let s = self.sliding.len();
        if s > 0 {
            lu_solve(&self.jss, rows_s, 2 * s, &self.pivots, &mut self.js[6 * rows_s..], 1);
            for i in 0..2 * s {
                let back = Vec6::from_column_slice(&self.jxs[6 * i..6 * i + 6]);
                right.axpy(self.js[6 * rows_s + i], &back, 1.0);
            }
        }
        let acceleration = scaled_solve(&self.tangent, &right)?;
        self.slip_rates.fill(Vector2::zeros());
        for i in 0..s {
            self.slip_rates[self.sliding[i]] = slip_rate(&self.js, i);
        }
        self.rate = Some((x, acceleration));
        Some((x, acceleration))
    }

    /// Displacements of all points by the compliance; returns the largest contact-law violation in newtons:
    /// `|F - P_cone(F - rho (delta + mu |delta_t| n))|` with `delta` from `C f`, not from `K`. A free point under the ground counts
    /// with the force that would be needed to keep it out.
    pub(crate) fn settle(&mut self, positions: &mut [Vec3], forces: &mut [Vec3]) -> f64 {
        let ld = self.stiffness.ld();
        let c = self.model.compliance().as_slice();
        self.u_full.fill(0.0);
        for slot in 0..self.stiffness.len() {
            let f = block(&self.f, slot);
            let j = 3 * self.stiffness.points()[slot] * ld;
            add_three(
                &mut self.u_full,
                &c[j..j + ld],
                &c[j + ld..j + 2 * ld],
                &c[j + 2 * ld..j + 3 * ld],
                f.x,
                f.y,
                f.z,
            );
        }
        let families = self.families();
        let mut worst = 0.0_f64;
        for point in 0..self.states.len() {
            let u = block(&self.u_full, point);
            let position = self.pose.point(&(self.model.contact_points()[point] + u));
            let force = self.pose.rotation * block(&self.force_full, point);
            positions[point] = position;
            forces[point] = force;
            let delta = position - self.reference(point, &families);
            worst = worst.max(natural_map(self.model.friction()[point], self.rho[point], &force, &delta).norm());
        }
        worst
    }

    /// The tick is over: references move to where the points are now (28).
    pub(crate) fn commit(&mut self, positions: &[Vec3]) {
        if let Some(foothold) = self.first.take() {
            let r = self.euler.with_yaw(&self.pose.rotation, foothold.yaw_rad);
            // Columns of the first tick's families become those of the later ones.
            let m = 3 * self.stiffness.len();
            let (y, _, ld) = self.stiffness.columns_mut(10);
            // p = sum_k p_k e_k, kept before its parts are overwritten.
            for i in 0..m {
                let own: f64 = y[12 * ld + i];
                let one = [y[i], y[ld + i], y[2 * ld + i]];
                let mut moved = [[0.0; 3]; 2];
                for axis in 0..3 {
                    let parts = [y[(3 + axis) * ld + i], y[(6 + axis) * ld + i], y[(9 + axis) * ld + i]];
                    for (t, origin) in [foothold.x_m, foothold.y_m].into_iter().enumerate() {
                        moved[t][axis] =
                            origin * one[axis] + r[(t, 0)] * parts[0] + r[(t, 1)] * parts[1] + r[(t, 2)] * parts[2];
                    }
                }
                for axis in 0..3 {
                    y[(3 + axis) * ld + i] = moved[0][axis];
                    y[(6 + axis) * ld + i] = moved[1][axis];
                }
                y[9 * ld + i] = own;
            }
        }
        for i in 0..self.sliding.len() {
            let point = self.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let v = self.slips[point];
            for axis in 0..3 {
                self.stiffness.shift_column(3 + axis, 3 * slot + axis, v.x);
                self.stiffness.shift_column(6 + axis, 3 * slot + axis, v.y);
            }
        }
        for slot in 0..self.stiffness.len() {
            // Exactly where the contact equations put it, not where C f puts it up to rounding.
            let point = self.stiffness.points()[slot];
            self.references[point] = self.world[slot].xy();
            self.slips[point] = Vector2::zeros();
        }
        for point in 0..self.states.len() {
            if self.states[point] == NodeState::Free {
                self.references[point] = positions[point].xy();
            }
        }
    }

    /// Moves pose and slips along the rates of the last tick: a better start than the pose of before when references change smoothly,
    /// and the same one when they do not change. False when there is nothing to go by.
    pub(crate) fn predict(&mut self, dt_s: f64) -> bool {
        let Some((rate, second)) = self.rate.take() else { return false };
        let step = dt_s * rate + 0.5 * dt_s * dt_s * second;
        let (linear, angular) = parts(&step);
        // NaN compares false.
        let sound = linear.norm() < STEP_MAX_M && angular.norm() < STEP_MAX_RAD;
        if !sound {
            return false;
        }
        self.pose.translation += linear;
        self.pose.rotation = so3::orthonormalised(&(so3::exp(&angular) * self.pose.rotation));
        for point in 0..self.states.len() {
            if self.states[point] == NodeState::Slip {
                self.slips[point] = dt_s * self.slip_rates[point];
            }
        }
        true
    }

    /// Remembers the present state.
    pub(crate) fn save(&mut self) {
        self.saved.pose = self.pose;
        self.saved.states.copy_from_slice(&self.states);
        self.saved.slips.copy_from_slice(&self.slips);
    }

    /// Returns to the remembered state.
    pub(crate) fn restore(&mut self) {
        self.pose = self.saved.pose;
        for point in 0..self.states.len() {
            let (was, is) = (self.saved.states[point], self.states[point]);
            if was == NodeState::Free && is != NodeState::Free {
                self.stiffness.lift(point);
            } else if was != NodeState::Free && is == NodeState::Free {
                self.states[point] = was;
                let count = self.families().0;
                let z = rows(&self.scalars(point)[..count], &self.model.contact_points()[point]);
                self.stiffness.land(&self.model, point, &z);
            }
            self.states[point] = was;
            self.slips[point] = self.saved.slips[point];
        }
    }

    /// A copy of the state alone, for the continuation (allocates: only on the slow path).
    pub(crate) fn clone_state(&self) -> Snapshot {
        Snapshot(Saved { pose: self.pose, states: self.states.clone(), slips: self.slips.clone() })
    }

    /// Returns to such a copy.
    pub(crate) fn return_to(&mut self, snapshot: &Snapshot) {
        let own = std::mem::replace(&mut self.saved, snapshot.0.clone());
        self.restore();
        self.saved = own;
    }

    /// Rotation (rad) since the remembered state.
    pub(crate) fn turned_since_saved(&self) -> f64 {
        so3::log(&(self.pose.rotation * self.saved.pose.rotation.transpose())).norm()
    }

    /// Total wrench about the sole's origin, world axes.
    pub(crate) fn wrench(&self) -> (Vec3, Vec3) {
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for slot in 0..self.stiffness.len() {
            let f = self.pose.rotation * block(&self.f, slot);
            force += f;
            moment += (self.world[slot] - self.pose.translation).cross(&f);
        }
        (force, moment)
    }
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

/// Alart-Curnier's condition of a sliding point and its derivatives.
pub(crate) struct SlidingLaw {
    mu: f64,
    rho: f64,
    direction: Vector2<f64>,
    length: f64,
    normal: f64,
    pub(crate) residual: Vector2<f64>,
}

impl SlidingLaw {
    pub(crate) fn new(mu: f64, rho: f64, force: &Vec3, slip: &Vector2<f64>) -> Self {
        let tangential = Vector2::new(force.x, force.y);
        let z = tangential - rho * slip;
        let length = z.norm();
        let direction = if length > 0.0 { z / length } else { Vector2::zeros() };
        let residual = tangential - mu * force.z * direction;
        Self { mu, rho, direction, length, normal: force.z, residual }
    }

    fn across(&self, v: &Vector2<f64>) -> Vector2<f64> {
        v - self.direction * self.direction.dot(v)
    }

    fn turning(&self, rate: &Vector2<f64>) -> Vector2<f64> {
        if self.length > 0.0 { self.across(rate) / self.length } else { Vector2::zeros() }
    }

    /// Gradient of one component of the residual with the force (row vector).
    pub(crate) fn gradient(&self, component: usize) -> RowVector3<f64> {
        let rate = |axis: usize| self.rate(&Vec3::ith(axis, 1.0), &Vector2::zeros())[component];
        RowVector3::new(rate(0), rate(1), rate(2))
    }

    /// Rate of the residual with the force's and the slip's.
    pub(crate) fn rate(&self, force: &Vec3, slip: &Vector2<f64>) -> Vector2<f64> {
        let tangential = Vector2::new(force.x, force.y);
        let d = self.turning(&(tangential - self.rho * slip));
        tangential - self.mu * (force.z * self.direction + self.normal * d)
    }

    /// Second derivative along a path with force rates `first`, `second` and constant slip rate.
    fn second(&self, first: &Vec3, second: &Vec3, slip: &Vector2<f64>) -> Vector2<f64> {
        let z1 = Vector2::new(first.x, first.y) - self.rho * slip;
        let z2 = Vector2::new(second.x, second.y);
        let d1 = self.turning(&z1);
        let d2 = if self.length > 0.0 {
            (self.across(&z2) - 2.0 * self.direction.dot(&z1) * d1) / self.length - d1.norm_squared() * self.direction
        } else {
            Vector2::zeros()
        };
        z2 - self.mu * (second.z * self.direction + 2.0 * first.z * d1 + self.normal * d2)
    }
}
