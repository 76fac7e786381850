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

mod finish;
mod states;
mod system;

use crate::list::List;
use crate::stiffness::ContactStiffness;
use crate::{Ground, NodeState, SoleModel};
use nalgebra::Vector2;
use spatial::{Mat3, Mat6, Transform, Vec3, Wrench};
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
    /// NaN or infinite pose, one farther than [`FARTHEST_M`] from the world's origin, or a time step that is not positive; the report is
    /// unchanged, and so is the history.
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
    /// Elastic energy of the whole sole, `1/2 u' C_S^-1 u` (J): what pressing has stored and unloading gives back, without what viscosity takes.
    pub elastic_energy_j: f64,
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
    /// `C_S^-1 u` at the last commit (N): the elastic part of the forces, which relaxes as the displacement does.
    previous_elastic: Vec<f64>,
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
    elastic: Vec<f64>,
    jss: Vec<f64>,
    pivots: Vec<usize>,
    js: Vec<f64>,
    sliding: List<usize>,
    report: ContactReport,
}

/// Farthest coordinate of a pose that is believed (m). There a position has digits of 1e-11 m, and forces of 1e-5 N drown in them; squares of
/// far larger ones overflow, and a foot deep in the ground would be without contact.
pub const FARTHEST_M: f64 = 1e5;
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
            previous_elastic: vec![0.0; ld],
            slips: vec![Vector2::zeros(); n],
            states: vec![NodeState::Free; n],
            places: vec![Place { reference: Vec3::zeros(), frame: Mat3::identity(), mu: 0.0 }; n],
            stiffness: ContactStiffness::new(&model),
            rho: rho.collect(),
            w: vec![0.0; WIDTH * ld],
            f: vec![0.0; WIDTH * ld],
            base: vec![0.0; ld],
            u: vec![0.0; ld],
            elastic: vec![0.0; ld],
            jss: vec![0.0; 4 * n * n],
            pivots: vec![0; 2 * n],
            js: vec![0.0; 2 * n * WIDTH],
            sliding: List::with_room_for(n),
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
                elastic_energy_j: 0.0,
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
        self.previous_elastic.fill(0.0);
        self.slips.fill(Vector2::zeros());
        self.states.fill(NodeState::Free);
        self.stiffness.clear();
    }

    /// Forces at the pose `X_WS` at the end of a step of `dt_s` from the last commit. The history is not touched: several poses
    /// may be tried.
    #[allow(non_snake_case)]
    pub fn evaluate(&mut self, X_WS: &Transform, ground: &dyn Ground, dt_s: f64) -> &ContactReport {
        let near = X_WS.translation.iter().all(|x| x.abs() <= FARTHEST_M);
        let finite = X_WS.rotation.iter().all(|x| x.is_finite());
        if !near || !finite || dt_s <= 0.0 || !dt_s.is_finite() {
            self.report.status = ContactStatus::InvalidInput;
            return &self.report;
        }
        let beta = 1.0 + self.settings.viscosity_time_s / dt_s;
        let floor_m = self.place(X_WS, ground);
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
        self.previous_elastic.copy_from_slice(&self.elastic);
        self.slips.fill(Vector2::zeros());
        self.has_history = true;
    }
}
