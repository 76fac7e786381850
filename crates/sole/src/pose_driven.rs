//! Forces of the ground on a sole whose pose is given (method 2.3): the simulated robot's foot.
//!
//! Each contact point `i` has a reference `Q_i` on the ground (where it was at the previous step, projected), a normal `n_i` and
//! tangents `T_i`. Points in contact stick (`P_i = Q_i`), slide (`P_i = Q_i + T_i v_i`, friction at its bound and against the
//! slip) or are free. The sole is a Kelvin-Voigt body, stress `C (eps + eta eps')`, integrated implicitly over the step `h`:
//! `u = C_S f / beta + u_prev (beta - 1)/beta` with `beta = 1 + eta/h`, so the contact problem keeps its form with `C_S / beta` and
//! shifted positions. With `K_c = (C_cc)^-1` of the points in contact
//!
//! ```text
//! f_c = beta K_c w_c,   w_i = R'(Q_i + T_i v_i - O) - p_i - u_prev,i (beta - 1)/beta
//! ```
//!
//! and only the slips are unknown: Newton on the Alart-Curnier conditions of the sliding points, node states updated after each
//! step (a primal-dual active set method), warm-started. When it does not settle, block Gauss-Seidel of the `friction` crate finds
//! the states from scratch.

use crate::equilibrium::SlidingLaw;
use crate::estimate::about_moving_origin;
use crate::stiffness::ContactStiffness;
use crate::{Ground, NodeState, SoleModel};
use friction::dense::{add_three, lu_factor, lu_solve};
use friction::{ContactProblem, LocalState, Settings, Workspace, natural_map};
use nalgebra::Vector2;
use spatial::{Mat3, Mat6, Transform, Vec3, Wrench, so3};
use std::sync::Arc;

/// Tolerances and viscosity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseDrivenSettings {
    /// Largest error of the sliding conditions, relative to the largest nodal force.
    pub tolerance: f64,
    /// Kelvin-Voigt time eta (s) in stress = C (eps + eta eps'); 0 = elastic.
    pub viscosity_time_s: f64,
    /// Iterations of the active-set method before Gauss-Seidel takes over.
    pub iterations_max: usize,
}

impl Default for PoseDrivenSettings {
    fn default() -> Self {
        Self { tolerance: 1e-10, viscosity_time_s: 0.0, iterations_max: 40 }
    }
}

/// Outcome of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ContactStatus {
    /// No point touches.
    #[default]
    NoContact,
    /// Solved.
    Solved,
    /// The laws are met no better than the reported residual says.
    NotConverged,
    /// NaN or infinite pose, or a time step that is not positive; the report is unchanged, and so is the history.
    InvalidInput,
}

/// What the ground does to the sole in a given pose.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactReport {
    /// Outcome.
    pub status: ContactStatus,
    /// On the sole, about the sole's origin, world axes.
    pub wrench: Wrench,
    /// Rate of the wrench (about the moving origin, world axes) with the pose (position, rotation vector in the world) at frozen
    /// node states, within one time step.
    pub tangent: Mat6,
    /// Forces on the contact points, world (N).
    pub node_forces: Vec<Vec3>,
    /// World positions of the contact points (m).
    pub node_positions: Vec<Vec3>,
    /// States of the contact points.
    pub node_states: Vec<NodeState>,
    /// Largest contact-law violation over the largest nodal force, from the compliance.
    pub residual: f64,
    /// Active-set iterations.
    pub iterations: usize,
    /// Work taken by friction since the last commit (J), never negative.
    pub friction_work_j: f64,
}

/// Local geometry of a contact point in the world.
#[derive(Debug, Clone, Copy)]
struct Place {
    reference: Vec3,
    /// Columns t1, t2, n.
    frame: Mat3,
    mu: f64,
}

/// One sole pressed on the ground by its pose, with history.
#[derive(Debug, Clone)]
pub struct PoseDrivenContact {
    model: Arc<SoleModel>,
    settings: PoseDrivenSettings,
    /// Positions and displacements at the last commit; positions are none before the first.
    has_history: bool,
    previous: Vec<Vec3>,
    previous_u: Vec<f64>,
    slips: Vec<Vector2<f64>>,
    states: Vec<NodeState>,
    places: Vec<Place>,
    stiffness: ContactStiffness,
    rho: Vec<f64>,
    /// packed by slot: prescribed displacement, six pose columns; the forces they make
    w: Vec<f64>,
    f: Vec<f64>,
    base: Vec<f64>,
    u: Vec<f64>,
    jss: Vec<f64>,
    pivots: Vec<usize>,
    js: Vec<f64>,
    sliding: Vec<usize>,
    report: ContactReport,
}

/// Columns of a packed right-hand side: the displacement itself and its six rates with the pose.
const WIDTH: usize = 7;
/// Rounding floors are this many units of the last place of the largest coordinate.
const FLOOR_ULPS: f64 = 40.0;
/// Iterations given to the active-set method from Gauss-Seidel's states, and Newton steps on the slips alone after that.
const AFTER_SCRATCH_ITERATIONS: usize = 15;
const POLISHING_STEPS: usize = 4;

impl PoseDrivenContact {
    /// In the air, without history.
    #[must_use]
    pub fn new(model: impl Into<Arc<SoleModel>>, settings: PoseDrivenSettings) -> Self {
        let model = model.into();
        let n = model.contact_points().len();
        let ld = 3 * n;
        let c = model.compliance();
        let rho = (0..n).map(|i| 3.0 / (c[(3 * i, 3 * i)] + c[(3 * i + 1, 3 * i + 1)] + c[(3 * i + 2, 3 * i + 2)]));
        Self {
            settings,
            has_history: false,
            previous: vec![Vec3::zeros(); n],
            previous_u: vec![0.0; ld],
            slips: vec![Vector2::zeros(); n],
            states: vec![NodeState::Free; n],
            places: vec![Place { reference: Vec3::zeros(), frame: Mat3::identity(), mu: 0.0 }; n],
            stiffness: ContactStiffness::new(&model),
            rho: rho.collect(),
            w: vec![0.0; WIDTH * ld],
            f: vec![0.0; WIDTH * ld],
            base: vec![0.0; ld],
            u: vec![0.0; ld],
            jss: vec![0.0; 4 * n * n],
            pivots: vec![0; 2 * n],
            js: vec![0.0; 2 * n * WIDTH],
            sliding: Vec::with_capacity(n),
            report: ContactReport {
                status: ContactStatus::NoContact,
                wrench: Wrench::zero(),
                tangent: Mat6::zeros(),
                node_forces: vec![Vec3::zeros(); n],
                node_positions: vec![Vec3::zeros(); n],
                node_states: vec![NodeState::Free; n],
                residual: 0.0,
                iterations: 0,
                friction_work_j: 0.0,
            },
            model,
        }
    }

    /// The sole.
    #[must_use]
    pub fn model(&self) -> &SoleModel {
        &self.model
    }

    /// The last evaluation.
    #[must_use]
    pub fn report(&self) -> &ContactReport {
        &self.report
    }

    /// Continues from a history held elsewhere: positions of the contact points at the previous step (m, world), their states,
    /// and no displacement to relax from.
    pub fn resume(&mut self, previous: &[Vec3], states: &[NodeState]) {
        assert_eq!(previous.len(), self.previous.len(), "one position per contact point");
        self.reset();
        self.previous.copy_from_slice(previous);
        self.states.copy_from_slice(states);
        self.stiffness.synchronise(&self.model, &self.states);
        self.has_history = true;
    }

    /// Forgets everything: as new.
    pub fn reset(&mut self) {
        self.has_history = false;
        self.previous_u.fill(0.0);
        self.slips.fill(Vector2::zeros());
        self.states.fill(NodeState::Free);
        self.stiffness.clear();
    }

    /// Forces at the pose `X_WS` at the end of a step of `dt_s` from the last commit. The history is not touched: several poses
    /// may be tried.
    #[allow(non_snake_case)]
    pub fn evaluate(&mut self, X_WS: &Transform, ground: &dyn Ground, dt_s: f64) -> &ContactReport {
        let finite = X_WS.translation.iter().chain(X_WS.rotation.iter()).all(|x| x.is_finite());
        if !finite || dt_s <= 0.0 || !dt_s.is_finite() {
            self.report.status = ContactStatus::InvalidInput;
            return &self.report;
        }
        let beta = 1.0 + self.settings.viscosity_time_s / dt_s;
        let floor_m = self.place(X_WS, ground, beta);
        let floor_n = floor_m * beta * self.rho.iter().copied().fold(0.0, f64::max);
        self.report.iterations = 0;
        let mut solved = self.iterate(X_WS, beta, floor_n, floor_m, self.settings.iterations_max);
        if !solved && self.settle_from_scratch(X_WS, beta) {
            solved = self.iterate(X_WS, beta, floor_n, floor_m, AFTER_SCRATCH_ITERATIONS);
            if !solved && self.settle_from_scratch(X_WS, beta) {
                // The states stand as found; only the slips are polished.
                self.find_base(X_WS, beta);
                for _ in 0..POLISHING_STEPS {
                    self.add_slips(X_WS, beta);
                    self.slide(X_WS, beta);
                }
                self.add_slips(X_WS, beta);
                self.displace(X_WS, beta);
            }
        }
        self.finish(X_WS, beta, solved);
        &self.report
    }

    /// The active-set iteration; true when states and slips have settled.
    fn iterate(&mut self, pose: &Transform, beta: f64, floor_n: f64, floor_m: f64, limit: usize) -> bool {
        let mut base_is_current = false;
        for _ in 0..limit {
            self.report.iterations += 1;
            if !base_is_current {
                self.find_base(pose, beta);
            }
            self.add_slips(pose, beta);
            let error = self.slide(pose, beta);
            if !self.sliding.is_empty() {
                self.add_slips(pose, beta);
            }
            self.displace(pose, beta);
            let (set_changed, changed) = self.update_states(pose, beta, floor_n, floor_m);
            base_is_current = !set_changed;
            if !changed && !set_changed {
                // Measured before the last Newton step, so the slips are better than this.
                let largest = (0..self.stiffness.len()).map(|s| self.force(s).norm()).fold(floor_n, f64::max);
                if error <= (self.settings.tolerance * largest).max(floor_n) {
                    return true;
                }
            }
        }
        false
    }

    /// Accepts the last evaluation as the new history.
    pub fn commit(&mut self) {
        if self.report.status == ContactStatus::InvalidInput {
            return;
        }
        self.previous.copy_from_slice(&self.report.node_positions);
        self.previous_u.copy_from_slice(&self.u);
        self.slips.fill(Vector2::zeros());
        self.has_history = true;
    }

    /// References, normals and friction; returns the rounding floor of positions.
    fn place(&mut self, pose: &Transform, ground: &dyn Ground, _beta: f64) -> f64 {
        let mut reach = 0.0_f64;
        for (point, p) in self.model.contact_points().iter().enumerate() {
            let from = if self.has_history { self.previous[point] } else { pose.point(p) };
            let (height, n) = ground.height_and_normal(from.x, from.y);
            // The tangent plane at the reference: the previous position is projected along the normal.
            let on_ground = Vec3::new(from.x, from.y, height);
            let reference = from - n * n.dot(&(from - on_ground));
            let side = if n.x.abs() < 0.9 { Vec3::x() } else { Vec3::y() };
            let t1 = (side - n * n.dot(&side)).normalize();
            let frame = Mat3::from_columns(&[t1, n.cross(&t1), n]);
            let mu = self.model.friction()[point] * ground.friction_factor(from.x, from.y);
            self.places[point] = Place { reference, frame, mu };
            reach = reach.max(p.norm());
        }
        FLOOR_ULPS * f64::EPSILON * (reach + pose.translation.norm())
    }

    /// Fills `w`: prescribed displacements without slip, and with `columns` 7 their rates with the pose (slips included).
    fn prescribe(&mut self, pose: &Transform, beta: f64, columns: usize) {
        let ld = self.stiffness.ld();
        let keep = (beta - 1.0) / beta;
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let place = &self.places[*point];
            let row = 3 * slot;
            let arm = place.reference - pose.translation;
            let local = pose.rotation.tr_mul(&arm) - self.model.contact_points()[*point];
            for axis in 0..3 {
                self.w[row + axis] = beta * (local[axis] - keep * self.previous_u[3 * point + axis]);
            }
            if columns > 1 {
                let arm = arm + place.frame.fixed_view::<3, 2>(0, 0) * self.slips[*point];
                for l in 0..3 {
                    let by_position = -beta * pose.rotation.tr_mul(&axes[l]);
                    let by_rotation = beta * pose.rotation.tr_mul(&arm.cross(&axes[l]));
                    for axis in 0..3 {
                        self.w[(1 + l) * ld + row + axis] = by_position[axis];
                        self.w[(4 + l) * ld + row + axis] = by_rotation[axis];
                    }
                }
            }
        }
    }

    /// Forces without slip.
    fn find_base(&mut self, pose: &Transform, beta: f64) {
        self.prescribe(pose, beta, 1);
        self.stiffness.multiply_columns(&self.w, 1, &mut self.f);
        let m = 3 * self.stiffness.len();
        self.base[..m].copy_from_slice(&self.f[..m]);
    }

    /// `f = base + beta K T v`, and the list of sliding points.
    fn add_slips(&mut self, pose: &Transform, beta: f64) {
        let m = 3 * self.stiffness.len();
        self.f[..m].copy_from_slice(&self.base[..m]);
        self.sliding.clear();
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            if self.states[*point] == NodeState::Slip {
                self.sliding.push(*point);
                let v = self.places[*point].frame.fixed_view::<3, 2>(0, 0) * self.slips[*point];
                let c = beta * pose.rotation.tr_mul(&v);
                let j = 3 * slot;
                let (x, y, z) = (self.stiffness.column(j), self.stiffness.column(j + 1), self.stiffness.column(j + 2));
                add_three(&mut self.f[..m], x, y, z, c.x, c.y, c.z);
            }
        }
    }

    fn force(&self, slot: usize) -> Vec3 {
        Vec3::new(self.f[3 * slot], self.f[3 * slot + 1], self.f[3 * slot + 2])
    }

    /// Rotation from the sole's axes to the local frame of a point.
    fn turn(&self, pose: &Transform, point: usize) -> Mat3 {
        self.places[point].frame.transpose() * pose.rotation
    }

    fn law(&self, pose: &Transform, beta: f64, point: usize, slot: usize) -> SlidingLaw {
        let force = self.turn(pose, point) * self.force(slot);
        SlidingLaw::new(self.places[point].mu, beta * self.rho[point], &force, &self.slips[point])
    }

    /// Factorises the sliding conditions; returns their largest error (N), infinite when singular.
    fn factor_sliding(&mut self, pose: &Transform, beta: f64) -> f64 {
        let rows = 2 * self.states.len();
        let mut error = 0.0_f64;
        for i in 0..self.sliding.len() {
            let point = self.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let law = self.law(pose, beta, point, slot);
            error = error.max(law.residual.norm());
            self.js[2 * i] = law.residual.x;
            self.js[2 * i + 1] = law.residual.y;
            let to_local = self.turn(pose, point);
            for k in 0..self.sliding.len() {
                let other = self.sliding[k];
                let block = self.stiffness.block(slot, self.stiffness.slot(other).expect("sliding points touch"));
                let rate = beta * to_local * block * self.turn(pose, other).transpose();
                for t in 0..2 {
                    let mut slip = Vector2::zeros();
                    if i == k {
                        slip[t] = 1.0;
                    }
                    let g = law.rate(&rate.column(t).into(), &slip);
                    self.jss[(2 * k + t) * rows + 2 * i] = g.x;
                    self.jss[(2 * k + t) * rows + 2 * i + 1] = g.y;
                }
            }
        }
        let s = 2 * self.sliding.len();
        if lu_factor(&mut self.jss, rows, s, 0, &mut self.pivots) < f64::EPSILON { f64::INFINITY } else { error }
    }

    /// One Newton step of all slips; returns the error before it.
    fn slide(&mut self, pose: &Transform, beta: f64) -> f64 {
        if self.sliding.is_empty() {
            return 0.0;
        }
        let error = self.factor_sliding(pose, beta);
        if error.is_finite() {
            let (rows, s) = (2 * self.states.len(), 2 * self.sliding.len());
            lu_solve(&self.jss, rows, s, &self.pivots, &mut self.js, 1);
            for i in 0..self.sliding.len() {
                self.slips[self.sliding[i]] -= Vector2::new(self.js[2 * i], self.js[2 * i + 1]);
            }
        }
        error
    }

    /// Displacements and positions of all points from the compliance.
    fn displace(&mut self, pose: &Transform, beta: f64) {
        let ld = self.stiffness.ld();
        let c = self.model.compliance().as_slice();
        let keep = (beta - 1.0) / beta;
        for (u, previous) in self.u.iter_mut().zip(&self.previous_u) {
            *u = keep * previous;
        }
        for slot in 0..self.stiffness.len() {
            let f = self.force(slot) / beta;
            let j = 3 * self.stiffness.points()[slot] * ld;
            add_three(&mut self.u, &c[j..j + ld], &c[j + ld..j + 2 * ld], &c[j + 2 * ld..j + 3 * ld], f.x, f.y, f.z);
        }
        for (point, p) in self.model.contact_points().iter().enumerate() {
            let u = Vec3::new(self.u[3 * point], self.u[3 * point + 1], self.u[3 * point + 2]);
            self.report.node_positions[point] = pose.point(&(p + u));
        }
    }

    /// New states from forces and gaps; (contact set changed, anything else changed).
    fn update_states(&mut self, pose: &Transform, beta: f64, floor_n: f64, floor_m: f64) -> (bool, bool) {
        let (mut set_changed, mut changed) = (false, false);
        for point in 0..self.states.len() {
            let place = self.places[point];
            match self.stiffness.slot(point) {
                Some(slot) => {
                    let force = self.turn(pose, point) * self.force(slot);
                    let bound = place.mu * force.z;
                    let tangential = force.xy();
                    if force.z < -floor_n {
                        self.states[point] = NodeState::Free;
                        self.slips[point] = Vector2::zeros();
                        set_changed = true;
                    } else if self.states[point] == NodeState::Stick {
                        if tangential.norm() > bound + floor_n {
                            self.states[point] = NodeState::Slip;
                            self.slips[point] = Vector2::zeros();
                            changed = true;
                        }
                    } else if (tangential - beta * self.rho[point] * self.slips[point]).norm() < bound - floor_n {
                        self.states[point] = NodeState::Stick;
                        self.slips[point] = Vector2::zeros();
                        changed = true;
                    }
                }
                None => {
                    let away = place.frame.tr_mul(&(self.report.node_positions[point] - place.reference));
                    if away.z < -floor_m {
                        let slides = away.xy().norm() > place.mu * away.z.abs();
                        self.states[point] = if slides { NodeState::Slip } else { NodeState::Stick };
                        self.slips[point] = if slides { away.xy() } else { Vector2::zeros() };
                        set_changed = true;
                    }
                }
            }
        }
        if set_changed {
            self.stiffness.synchronise(&self.model, &self.states);
        }
        (set_changed, changed)
    }

    /// States and slips from scratch by the `friction` crate; false when it fails too. Allocates: only on this slow path.
    fn settle_from_scratch(&mut self, pose: &Transform, beta: f64) -> bool {
        let n = self.states.len();
        let keep = (beta - 1.0) / beta;
        let turns: Vec<Mat3> = (0..n).map(|point| self.turn(pose, point)).collect();
        let c = self.model.compliance();
        let mut delassus = nalgebra::DMatrix::zeros(3 * n, 3 * n);
        let mut free = nalgebra::DVector::zeros(3 * n);
        for b in 0..n {
            for a in 0..n {
                let block = turns[a] * c.fixed_view::<3, 3>(3 * a, 3 * b) * turns[b].transpose() / beta;
                delassus.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(&block);
            }
            let shift = Vec3::from_fn(|axis, _| keep * self.previous_u[3 * b + axis]);
            let undeformed = pose.point(&(self.model.contact_points()[b] + shift));
            let place = &self.places[b];
            free.fixed_rows_mut::<3>(3 * b).copy_from(&place.frame.tr_mul(&(undeformed - place.reference)));
        }
        let mu = self.places.iter().map(|place| place.mu).collect();
        let Ok(problem) = ContactProblem::new(delassus, free, mu) else { return false };
        let mut workspace = Workspace::new(n);
        let settings = Settings { tolerance: self.settings.tolerance, ..Settings::default() };
        let answer = friction::solve(&problem, &mut workspace, &settings);
        for point in 0..n {
            self.slips[point] = Vector2::zeros();
            self.states[point] = match workspace.states()[point] {
                LocalState::Open => NodeState::Free,
                LocalState::Stick => NodeState::Stick,
                LocalState::Slide => {
                    self.slips[point] = answer.delta.fixed_rows::<2>(3 * point).into();
                    NodeState::Slip
                }
            };
        }
        self.stiffness.synchronise(&self.model, &self.states);
        true
    }

    /// Wrench, tangent, residual.
    fn finish(&mut self, pose: &Transform, beta: f64, solved: bool) {
        let report = &mut self.report;
        report.node_states.copy_from_slice(&self.states);
        report.node_forces.fill(Vec3::zeros());
        report.wrench = Wrench::zero();
        report.tangent = Mat6::zeros();
        report.residual = 0.0;
        report.friction_work_j = 0.0;
        if self.stiffness.len() == 0 {
            report.status = ContactStatus::NoContact;
            return;
        }
        let (m, ld) = (3 * self.stiffness.len(), self.stiffness.ld());
        self.factor_sliding(pose, beta);
        self.prescribe(pose, beta, WIDTH);
        // Column 0 holds the forces already: the rates are columns 1 to 6.
        self.stiffness.multiply_columns(&self.w[ld..], WIDTH - 1, &mut self.f[ld..]);
        let (mut force, mut moment, mut geometric) = (Vec3::zeros(), Vec3::zeros(), Mat3::zeros());
        let (mut sum_a, mut sum_xa) = ([Vec3::zeros(); 6], [Vec3::zeros(); 6]);
        let report = &mut self.report;
        let (mut largest, mut worst) = (0.0_f64, 0.0_f64);
        for (slot, point) in self.stiffness.points().iter().enumerate() {
            let place = &self.places[*point];
            let local = Vec3::new(self.f[3 * slot], self.f[3 * slot + 1], self.f[3 * slot + 2]);
            let f = pose.rotation * local;
            report.node_forces[*point] = f;
            let slip = place.frame.fixed_view::<3, 2>(0, 0) * self.slips[*point];
            report.friction_work_j -= f.dot(&slip);
            let arm = place.reference + slip - pose.translation;
            force += f;
            moment += arm.cross(&f);
            geometric += arm.dot(&f) * Mat3::identity() - f * arm.transpose();
            let arm_local = pose.rotation.tr_mul(&arm);
            for l in 0..6 {
                let a = &self.f[(1 + l) * ld + 3 * slot..];
                let a = Vec3::new(a[0], a[1], a[2]);
                sum_a[l] += a;
                sum_xa[l] += arm_local.cross(&a);
            }
            largest = largest.max(f.norm());
        }
        for point in 0..self.states.len() {
            let place = &self.places[point];
            let f = place.frame.tr_mul(&report.node_forces[point]);
            let delta = place.frame.tr_mul(&(report.node_positions[point] - place.reference));
            worst = worst.max(natural_map(place.mu, beta * self.rho[point], &f, &delta).norm());
        }
        report.residual = if largest > 0.0 { worst / largest } else { 0.0 };
        // The laws themselves have the last word.
        let met = solved || report.residual <= self.settings.tolerance;
        report.status = if met { ContactStatus::Solved } else { ContactStatus::NotConverged };
        report.wrench = Wrench { force, moment };
        let mut j = Mat6::zeros();
        for l in 0..6 {
            j.fixed_view_mut::<3, 1>(0, l).copy_from(&(pose.rotation * sum_a[l]));
            j.fixed_view_mut::<3, 1>(3, l).copy_from(&(pose.rotation * sum_xa[l]));
        }
        let upper = j.fixed_view::<3, 3>(0, 3) - so3::skew(&force);
        j.fixed_view_mut::<3, 3>(0, 3).copy_from(&upper);
        let lower = j.fixed_view::<3, 3>(3, 3) + geometric;
        j.fixed_view_mut::<3, 3>(3, 3).copy_from(&lower);
        // Sliding points give way: J - J_xs J_ss^-1 J_sx.
        let s = self.sliding.len();
        if s > 0 {
            let rows = 2 * self.states.len();
            let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
            for i in 0..s {
                let point = self.sliding[i];
                let slot = self.stiffness.slot(point).expect("sliding points touch");
                let law = self.law(pose, beta, point, slot);
                let world = pose.rotation * self.force(slot);
                for l in 0..6 {
                    let a = &self.f[(1 + l) * ld + 3 * slot..];
                    let mut rate = pose.rotation * Vec3::new(a[0], a[1], a[2]);
                    if l >= 3 {
                        rate += axes[l - 3].cross(&world);
                    }
                    let g = law.rate(&self.places[point].frame.tr_mul(&rate), &Vector2::zeros());
                    self.js[l * rows + 2 * i] = g.x;
                    self.js[l * rows + 2 * i + 1] = g.y;
                }
            }
            lu_solve(&self.jss, rows, 2 * s, &self.pivots, &mut self.js, 6);
            for i in 0..s {
                let point = self.sliding[i];
                let slot = self.stiffness.slot(point).expect("sliding points touch");
                let world = pose.rotation * self.force(slot);
                for t in 0..2 {
                    let direction = self.places[point].frame.column(t).into_owned();
                    let turned = direction.cross(&world);
                    let local = pose.rotation.tr_mul(&direction);
                    for row in 0..6 {
                        let a = &self.f[(1 + row) * ld + 3 * slot..];
                        let mut back = -(a[0] * local.x + a[1] * local.y + a[2] * local.z);
                        if row >= 3 {
                            back += turned[row - 3];
                        }
                        for l in 0..6 {
                            j[(row, l)] -= back * self.js[l * rows + 2 * i + t];
                        }
                    }
                }
            }
        }
        debug_assert!(m > 0);
        self.report.tangent = about_moving_origin(&j, &force);
    }
}
