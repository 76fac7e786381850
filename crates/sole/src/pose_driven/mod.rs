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
//!
//! # Cost
//! Without slips `f_c` is linear in the pose: `K_c` times the nine columns `Q_b e_a`, three of ones, `p` and `u_prev` gives it at any
//! pose by 14 axpys, and [`ContactStiffness`] carries these columns along as points land and lift. `Q` of a sticking point stays, bit for
//! bit; that of a sliding one moves as an offset from the `Q` in the columns until it sticks again. `K_c u_prev` follows its recursion
//! `g <- g (beta - 1)/beta + f/beta`. Displacements of all points are `u = C_S e` with the elastic forces `e <- e (beta - 1)/beta + f/beta`,
//! so those of free points are needed only where one might land. That is decided by a bound: if `e` has changed by `d` since `u_i` was last
//! computed, `u_i` has by no more than the sum of `|C_ij| |d_j|`. A free point farther from the ground than that stays free.
//!
//! What is carried along is checked against the compliance every [`CHECK_STEPS`] commits, and made anew where it has drifted.

mod finish;
mod history;
mod scratch;
mod sliding;
mod states;
mod system;
mod tangent;

use crate::list::List;
use crate::stiffness::{COLUMNS_MAX, ContactStiffness};
use crate::{Ground, SoleModel};
use friction::ContactState;
use nalgebra::Vector2;
use scratch::Scratch;
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
    pub node_states: Vec<ContactState>,
    /// Largest contact-law violation over the largest nodal force. What the carried stiffness contributes is known from its last check
    /// against the compliance.
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
    /// Reference, tangents and friction are those of the point's previous position; else only the normal and a point of the ground near it.
    exact: bool,
}

/// Where the previous positions of the points come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Past {
    /// There are none: each pose is its own past.
    None,
    /// From outside.
    Given,
    /// From the last commit.
    Committed,
}

/// One sole pressed on the ground by its pose, with history.
#[derive(Debug, Clone)]
pub struct PoseDrivenContact {
    model: Arc<SoleModel>,
    settings: PoseDrivenSettings,
    past: Past,
    /// Pose at the last commit.
    last: Transform,
    /// Positions that were given from outside.
    given: Vec<Vec3>,
    /// `e = C_S^-1 u` (N), the elastic part of the forces, at the last commit and at the last evaluation.
    last_elastic: Vec<f64>,
    elastic: Vec<f64>,
    slips: Vec<Vector2<f64>>,
    states: Vec<ContactState>,
    places: Vec<Place>,
    /// The places hold for this step.
    placed: bool,
    /// References as they are in the columns, relative to `anchor`.
    columned: Vec<Vec3>,
    anchor: Vec3,
    stiffness: ContactStiffness,
    screen: Screen,
    rho: Vec<f64>,
    rho_max: f64,
    reach_m: f64,
    /// Packed by slot: forces without slip and with it; six pose columns.
    base: Vec<f64>,
    f: Vec<f64>,
    rates: Vec<f64>,
    /// World forces by slot.
    forces: Vec<Vec3>,
    sliding: List<usize>,
    slide: sliding::Workspace,
    scratch: Scratch,
    /// What the last evaluation was asked.
    pose: Transform,
    beta: f64,
    /// Counts changes of any point's state.
    changes: u64,
    commits_since_check: u32,
    /// Error of the carried stiffness over the largest force at the last check.
    drift: f64,
    report: ContactReport,
}

/// Displacements of the points as last computed, and what bounds how far they have moved since.
#[derive(Debug, Clone)]
struct Screen {
    /// Displacement when last computed.
    u: Vec<Vec3>,
    /// How far it can have moved until the last commit (m).
    moved_m: Vec<f64>,
    /// Norms of the blocks of `C_S`, row by row, and the largest (m/N).
    norms: Vec<f64>,
    norm_max: f64,
    /// How much each point's elastic force has changed since the last commit, and their sum (N).
    change_n: Vec<f64>,
    changes_n: f64,
}

/// Farthest coordinate of a pose that is believed (m). There a position has digits of 1e-11 m, and forces of 1e-5 N drown in them; squares of
/// far larger ones overflow, and a foot deep in the ground would be without contact.
pub const FARTHEST_M: f64 = 1e5;
/// Columns of `Y`: nine of references, three of ones, place in the sole, previous displacement.
const COLUMN_OF_ONES: usize = 9;
const COLUMN_OF_PLACES: usize = 12;
const COLUMN_OF_PAST: usize = 13;
/// Rounding floors are this many units of the last place of the largest coordinate.
const FLOOR_ULPS: f64 = 40.0;
/// Iterations given to the active-set method from Gauss-Seidel's states, and Newton steps on the slips alone after that.
const AFTER_SCRATCH_ITERATIONS: usize = 15;
const POLISHING_STEPS: usize = 4;
/// Commits from one check of the carried stiffness to the next: a twentieth of the ticks at five steps each. A check is one product with
/// the compliance, the work of some ten evaluations.
pub const CHECK_STEPS: u32 = 100;
/// The carried stiffness is made anew when it is off by more than this part of the largest force, or the tolerance if that is smaller.
const REFRESH: f64 = 1e-10;
/// The laws are met when they hold to this many times what was asked of the sliding points, whose own measure differs from the laws' by
/// less (a factor of at most `sqrt(2) (1 + mu)`).
const ACCEPTED: f64 = 10.0;
/// Elastic forces that have all relaxed to less than this (N) are none: 1e-11 m on a sole's softest point.
const RELAXED_N: f64 = 1e-7;

impl PoseDrivenContact {
    /// In the air, without history.
    #[must_use]
    pub fn new(model: impl Into<Arc<SoleModel>>, settings: PoseDrivenSettings) -> Self {
        let model = model.into();
        let n = model.contact_points().len();
        let ld = 3 * n;
        let c = model.compliance();
        let rho = (0..n).map(|i| 3.0 / (c[(3 * i, 3 * i)] + c[(3 * i + 1, 3 * i + 1)] + c[(3 * i + 2, 3 * i + 2)]));
        let rho: Vec<f64> = rho.collect();
        let mut stiffness = ContactStiffness::new(&model);
        stiffness.set_columns(COLUMNS_MAX, |_| [[0.0; COLUMNS_MAX]; 3]);
        Self {
            settings,
            past: Past::None,
            last: Transform::identity(),
            given: vec![Vec3::zeros(); n],
            last_elastic: vec![0.0; ld],
            elastic: vec![0.0; ld],
            slips: vec![Vector2::zeros(); n],
            states: vec![ContactState::Open; n],
            places: vec![Place { reference: Vec3::zeros(), frame: Mat3::identity(), mu: 0.0, exact: false }; n],
            placed: false,
            columned: vec![Vec3::zeros(); n],
            anchor: Vec3::zeros(),
            stiffness,
            screen: Screen::new(&model),
            rho_max: rho.iter().copied().fold(0.0, f64::max),
            rho,
            reach_m: model.contact_points().iter().map(|p| p.norm()).fold(0.0, f64::max),
            base: vec![0.0; ld],
            f: vec![0.0; ld],
            rates: vec![0.0; 6 * ld],
            forces: vec![Vec3::zeros(); n],
            sliding: List::with_room_for(n),
            slide: sliding::Workspace::new(n),
            scratch: Scratch::new(n),
            pose: Transform::identity(),
            beta: 1.0,
            changes: 0,
            commits_since_check: 0,
            drift: 0.0,
            report: ContactReport {
                status: ContactStatus::NoContact,
                wrench: Wrench::zero(),
                tangent: Mat6::zeros(),
                node_forces: vec![Vec3::zeros(); n],
                node_positions: vec![Vec3::zeros(); n],
                node_states: vec![ContactState::Open; n],
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

    /// The last evaluation that was completed ([`evaluate`](Self::evaluate), [`complete`](Self::complete)).
    #[must_use]
    pub fn report(&self) -> &ContactReport {
        &self.report
    }

    /// Counts every change of a point's state: while it stays, a tangent stays nearly true.
    #[must_use]
    pub fn state_changes(&self) -> u64 {
        self.changes
    }

    /// Continues from a history held elsewhere: positions of the contact points at the previous step (m, world), their states,
    /// and no displacement to relax from.
    pub fn resume(&mut self, previous: &[Vec3], states: &[ContactState]) {
        assert_eq!(previous.len(), self.given.len(), "one position per contact point");
        self.reset();
        self.given.copy_from_slice(previous);
        self.states.copy_from_slice(states);
        self.past = Past::Given;
    }

    /// Forgets everything: as new.
    pub fn reset(&mut self) {
        self.past = Past::None;
        self.placed = false;
        self.last_elastic.fill(0.0);
        self.elastic.fill(0.0);
        self.slips.fill(Vector2::zeros());
        self.states.fill(ContactState::Open);
        self.stiffness.clear();
        self.screen.forget();
        self.slide.forget();
        self.drift = 0.0;
        self.commits_since_check = 0;
        self.changes += 1;
    }

    /// Forces at the pose `X_WS` at the end of a step of `dt_s` from the last commit, with the tangent and everything else that the report
    /// holds. The history is not touched: several poses may be tried.
    #[allow(non_snake_case)]
    pub fn evaluate(&mut self, X_WS: &Transform, ground: &dyn Ground, dt_s: f64) -> &ContactReport {
        self.attempt(X_WS, ground, dt_s);
        if self.report.status != ContactStatus::InvalidInput {
            self.slide.forget();
            self.report.tangent = self.tangent();
            self.complete();
        }
        &self.report
    }

    /// The same without what only an observer needs: of the report are new the status, the wrench, the residual, the iterations and the
    /// work of friction.
    #[allow(non_snake_case)]
    pub fn attempt(&mut self, X_WS: &Transform, ground: &dyn Ground, dt_s: f64) -> &ContactReport {
        let near = X_WS.translation.iter().all(|x| x.abs() <= FARTHEST_M);
        let finite = X_WS.rotation.iter().all(|x| x.is_finite());
        if !near || !finite || dt_s <= 0.0 || !dt_s.is_finite() {
            self.report.status = ContactStatus::InvalidInput;
            return &self.report;
        }
        self.pose = *X_WS;
        self.beta = 1.0 + self.settings.viscosity_time_s / dt_s;
        self.place(ground);
        self.report.iterations = 0;
        let settled = self.iterate(ground, self.settings.iterations_max)
            || (self.settle_from_scratch(ground) && self.iterate(ground, AFTER_SCRATCH_ITERATIONS));
        if !settled && self.settle_from_scratch(ground) {
            // The states stand as found; only the slips are polished.
            self.find_base();
            for _ in 0..POLISHING_STEPS {
                self.add_slips();
                self.slide_once();
            }
            self.add_slips();
            self.press();
        }
        self.finish();
        &self.report
    }

    /// The active-set iteration; true when states and slips have settled.
    fn iterate(&mut self, ground: &dyn Ground, limit: usize) -> bool {
        let mut base_is_current = false;
        for _ in 0..limit {
            self.report.iterations += 1;
            if !base_is_current {
                self.find_base();
            }
            self.add_slips();
            let (error, moved) = self.slide_once();
            if moved {
                self.add_slips();
            }
            self.press();
            let (set_changed, changed) = self.update_states(ground);
            base_is_current = !set_changed;
            if !changed && !set_changed && !moved && error.is_finite() {
                return true;
            }
        }
        false
    }

    /// Error of the sliding conditions (N) that is small enough.
    fn asked_n(&self) -> f64 {
        let largest = self.forces[..self.stiffness.len()].iter().map(|f| f.norm_squared()).fold(0.0, f64::max).sqrt();
        (self.settings.tolerance * largest).max(self.floor_n())
    }

    /// What rounding leaves of a position (m).
    fn floor_m(&self) -> f64 {
        FLOOR_ULPS * f64::EPSILON * (self.reach_m + self.pose.translation.norm())
    }

    /// What that is as a force (N).
    fn floor_n(&self) -> f64 {
        self.floor_m() * self.beta * self.rho_max
    }

    /// Part of the displacement that the foam keeps from the last commit, `(beta - 1)/beta`.
    fn keep(&self) -> f64 {
        (self.beta - 1.0) / self.beta
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MeshSource, Plane, SoleSettings};
    use spatial::so3;

    fn contact() -> PoseDrivenContact {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [5, 4, 2] };
        let model = SoleModel::build(&SoleSettings { mesh, ..SoleSettings::default() }).expect("a sole");
        PoseDrivenContact::new(model, PoseDrivenSettings { viscosity_time_s: 0.02, ..PoseDrivenSettings::default() })
    }

    /// Rocks, slides and lifts parts of the sole.
    fn pose(step: u32) -> Transform {
        let t = 1e-3 * f64::from(step);
        let turn = so3::from_roll_pitch_yaw(0.02 * (9.0 * t).sin(), 0.03 * (7.0 * t).sin(), 0.1 * t);
        Transform::new(turn, Vec3::new(2e-3 * (12.0 * t).sin(), 0.0, -0.8e-3))
    }

    #[test]
    fn a_stiffness_that_has_drifted_is_made_anew() {
        let [mut contact, mut drifted] = [contact(), contact()];
        let mut noticed = 0;
        for step in 0..5 * CHECK_STEPS {
            if step == 2 * CHECK_STEPS + 7 {
                drifted.stiffness.drift(1e-6);
            }
            for contact in [&mut contact, &mut drifted] {
                contact.evaluate(&pose(step), &Plane, 1e-3);
                contact.commit();
            }
            let [right, found] = [&contact, &drifted].map(|contact| contact.report.clone());
            assert!(right.residual < 1e-9 && right.status == ContactStatus::Solved, "step {step}: {}", right.residual);
            let error = (right.wrench.force - found.wrench.force).norm() / right.wrench.force.norm();
            match step {
                _ if step < 2 * CHECK_STEPS + 7 => assert_eq!(right, found),
                _ if step < 3 * CHECK_STEPS => assert!(error > 1e-8, "step {step}: {error}"),
                _ => {
                    noticed += u32::from(found.residual > 1e-8);
                    // What was pressed in with the wrong stiffness relaxes with the foam.
                    assert!(step < 4 * CHECK_STEPS || error < 1e-8, "step {step}: {error}");
                }
            }
        }
        assert_eq!(noticed, CHECK_STEPS, "from the check that finds it to the next one");
    }

    #[test]
    fn carried_columns_are_those_of_the_compliance() {
        let mut contact = contact();
        for step in 0..300 {
            contact.evaluate(&pose(step), &Plane, 1e-3);
            contact.commit();
            let drift = contact.drift_n() / contact.report.wrench.force.norm();
            assert!(drift < 1e-11, "step {step}: {drift}");
        }
        assert!(contact.changes > 30, "points land, slide and lift: {}", contact.changes);
    }
}
