//! What is carried from step to step: references on the ground, columns, elastic forces; and whether it still agrees with the compliance.

use super::{
    CHECK_STEPS, COLUMN_OF_ONES, COLUMN_OF_PAST, COLUMN_OF_PLACES, ContactStatus, Past, Place, PoseDrivenContact,
    REFRESH, RELAXED_N, Screen,
};
use crate::stiffness::{COLUMNS_MAX, Rows};
use crate::{Ground, SoleModel};
use friction::ContactState;
use friction::dense::dot;
use nalgebra::Vector2;
use spatial::{Mat3, Vec3};

impl PoseDrivenContact {
    /// References, normals and friction of this step.
    pub(super) fn place(&mut self, ground: &dyn Ground) {
        if self.placed && self.past != Past::None {
            return;
        }
        if self.past == Past::Committed {
            for point in 0..self.states.len() {
                match self.states[point] {
                    // Its reference is where it is.
                    ContactState::Stick => self.recolumn(point),
                    ContactState::Slip => self.place_exactly(point, ground),
                    ContactState::Open => self.place_roughly(point, ground),
                }
            }
        } else {
            self.screen.forget();
            for point in 0..self.states.len() {
                self.place_exactly(point, ground);
            }
            self.anchor = self.pose.translation;
            for (columned, place) in self.columned.iter_mut().zip(&self.places) {
                *columned = place.reference - self.anchor;
            }
            self.renew_stiffness();
        }
        self.placed = true;
    }

    /// Where a point was before this step; of a free one that has just been looked at.
    fn previous(&self, point: usize) -> Vec3 {
        let p = &self.model.contact_points()[point];
        match self.past {
            Past::None => self.pose.point(p),
            Past::Given => self.given[point],
            Past::Committed if self.states[point] == ContactState::Open => self.last.point(&(p + self.screen.u[point])),
            Past::Committed => self.places[point].reference,
        }
    }

    /// The tangent plane at the reference: the previous position is projected along the normal.
    pub(super) fn place_exactly(&mut self, point: usize, ground: &dyn Ground) {
        if self.states[point] == ContactState::Open && self.past == Past::Committed {
            self.screen.know(point, displacement(&self.model, &self.last_elastic, point));
        }
        let from = self.previous(point);
        let (height, n) = ground.height_and_normal(from.x, from.y);
        let on_ground = Vec3::new(from.x, from.y, height);
        let reference = from - n * n.dot(&(from - on_ground));
        let side = if n.x.abs() < 0.9 { Vec3::x() } else { Vec3::y() };
        let t1 = (side - n * n.dot(&side)).normalize();
        let frame = Mat3::from_columns(&[t1, n.cross(&t1), n]);
        let mu = self.model.friction()[point] * ground.friction_factor(from.x, from.y);
        self.places[point] = Place { reference, frame, mu, exact: true };
    }

    /// Normal and a point of the ground near a free point.
    fn place_roughly(&mut self, point: usize, ground: &dyn Ground) {
        let from = self.last.point(&(self.model.contact_points()[point] + self.screen.u[point]));
        let (height, n) = ground.height_and_normal(from.x, from.y);
        let place = &mut self.places[point];
        place.reference = Vec3::new(from.x, from.y, height);
        place.frame.set_column(2, &n);
        place.exact = false;
    }

    /// Brings the columns up to the reference of a point that sticks.
    fn recolumn(&mut self, point: usize) {
        let moved = self.places[point].reference - self.anchor - self.columned[point];
        if moved == Vec3::zeros() {
            return;
        }
        let slot = self.stiffness.slot(point).expect("sticking points touch");
        for a in 0..3 {
            for b in 0..3 {
                if moved[b] != 0.0 {
                    self.stiffness.shift_column(3 * a + b, 3 * slot + a, moved[b]);
                }
            }
        }
        self.columned[point] += moved;
    }

    /// Contact set and columns as states, references and elastic forces say, from the compliance.
    pub(super) fn renew_stiffness(&mut self) {
        let Self { stiffness, model, states, columned, last_elastic, .. } = self;
        let (model, columned, last_elastic) = (&**model, &*columned, &*last_elastic);
        stiffness.refresh(model, states, |point| rows(model, columned, last_elastic, point));
    }

    /// Contact set as the states say; of points that land the place must be exact.
    pub(super) fn follow_states(&mut self) {
        if self.stiffness.len() == 0 {
            self.anchor = self.pose.translation;
        }
        for (point, state) in self.states.iter().enumerate() {
            if *state != ContactState::Open && self.stiffness.slot(point).is_none() {
                self.columned[point] = self.places[point].reference - self.anchor;
            }
        }
        let Self { stiffness, model, states, columned, last_elastic, .. } = self;
        let (model, columned, last_elastic) = (&**model, &*columned, &*last_elastic);
        stiffness.synchronise(model, states, |point| rows(model, columned, last_elastic, point));
    }

    /// Accepts the last evaluation as the new history.
    pub fn commit(&mut self) {
        if self.report.status == ContactStatus::InvalidInput {
            return;
        }
        let (keep, inverse, m) = (self.keep(), 1.0 / self.beta, 3 * self.stiffness.len());
        for (y, f) in self.stiffness.y_mut(COLUMN_OF_PAST).iter_mut().zip(&self.f[..m]) {
            *y = keep * *y + inverse * f;
        }
        self.screen.commit(&self.states);
        for point in self.stiffness.points() {
            let place = &mut self.places[*point];
            let slip = &self.slips[*point];
            place.reference += place.frame.column(0) * slip.x + place.frame.column(1) * slip.y;
            debug_assert!(place.exact);
            let at = self.pose.rotation.tr_mul(&(place.reference - self.pose.translation));
            self.screen.know(*point, at - self.model.contact_points()[*point]);
        }
        self.slips.fill(Vector2::zeros());
        let largest = self.elastic.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
        if largest < RELAXED_N {
            self.elastic.fill(0.0);
        }
        self.last_elastic.copy_from_slice(&self.elastic);
        self.last = self.pose;
        self.past = Past::Committed;
        self.placed = false;
        self.commits_since_check += 1;
        if self.commits_since_check >= CHECK_STEPS && m > 0 {
            self.check();
        }
    }

    /// Do the carried columns still say what the compliance says? Where not, they are made anew, and the next evaluation uses those.
    fn check(&mut self) {
        self.commits_since_check = 0;
        self.drift = self.drift_n();
        let largest = self.forces[..self.stiffness.len()].iter().map(|f| f.norm()).fold(0.0, f64::max);
        if self.drift > (REFRESH.min(self.settings.tolerance) * largest).max(self.floor_n()) {
            for point in 0..self.states.len() {
                if self.stiffness.slot(point).is_some() {
                    self.columned[point] = self.places[point].reference - self.anchor;
                }
            }
            self.renew_stiffness();
            self.slide.forget();
        }
        self.drift = if largest > 0.0 { self.drift / largest } else { 0.0 };
    }

    /// Largest difference between where the points in contact are and where the compliance puts them under their forces, as a force (N).
    pub(super) fn drift_n(&self) -> f64 {
        let mut worst = 0.0_f64;
        for point in self.stiffness.points() {
            let u = displacement(&self.model, &self.elastic, *point);
            let at = self.pose.point(&(self.model.contact_points()[*point] + u));
            worst = worst.max(self.beta * self.rho[*point] * (at - self.places[*point].reference).norm());
        }
        worst
    }
}

/// `u = C_S e` at a point.
pub(super) fn displacement(model: &SoleModel, elastic: &[f64], point: usize) -> Vec3 {
    let (c, ld) = (model.compliance().as_slice(), elastic.len());
    Vec3::from_fn(|axis, _| dot(&c[(3 * point + axis) * ld..(3 * point + axis + 1) * ld], elastic))
}

/// Rows of the columns at a point: reference coordinates, one, place in the sole, displacement before.
fn rows(model: &SoleModel, columned: &[Vec3], last_elastic: &[f64], point: usize) -> Rows {
    let mut z = [[0.0; COLUMNS_MAX]; 3];
    let (q, p) = (&columned[point], &model.contact_points()[point]);
    let u = displacement(model, last_elastic, point);
    for axis in 0..3 {
        for b in 0..3 {
            z[axis][3 * axis + b] = q[b];
        }
        z[axis][COLUMN_OF_ONES + axis] = 1.0;
        z[axis][COLUMN_OF_PLACES] = p[axis];
        z[axis][COLUMN_OF_PAST] = u[axis];
    }
    z
}

impl Screen {
    pub(super) fn new(model: &SoleModel) -> Self {
        let n = model.contact_points().len();
        let c = model.compliance();
        let norms = (0..n * n).map(|k| c.fixed_view::<3, 3>(3 * (k / n), 3 * (k % n)).norm());
        let norms: Vec<f64> = norms.collect();
        Self {
            u: vec![Vec3::zeros(); n],
            moved_m: vec![0.0; n],
            norm_max: norms.iter().copied().fold(0.0, f64::max),
            norms,
            change_n: vec![0.0; n],
            changes_n: 0.0,
        }
    }

    /// Everything is undeformed, and that is known.
    pub(super) fn forget(&mut self) {
        self.u.fill(Vec3::zeros());
        self.moved_m.fill(0.0);
    }

    /// The displacement of a point at the last commit.
    fn know(&mut self, point: usize, u: Vec3) {
        self.u[point] = u;
        self.moved_m[point] = 0.0;
    }

    /// Takes the elastic forces of an evaluation and of the last commit.
    pub(super) fn take(&mut self, elastic: &[f64], last: &[f64]) {
        self.changes_n = 0.0;
        for ((change, e), last) in self.change_n.iter_mut().zip(elastic.chunks_exact(3)).zip(last.chunks_exact(3)) {
            let d = [e[0] - last[0], e[1] - last[1], e[2] - last[2]];
            *change = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            self.changes_n += *change;
        }
    }

    /// How far (m) a point can be in this evaluation from where it was when last computed; by the cheaper bound where that is no more
    /// than `enough`.
    pub(super) fn reach_m(&self, point: usize, enough: f64) -> f64 {
        let at_most = self.moved_m[point] + self.norm_max * self.changes_n;
        if at_most <= enough {
            return at_most;
        }
        let n = self.u.len();
        self.moved_m[point] + dot(&self.norms[point * n..(point + 1) * n], &self.change_n)
    }

    /// The evaluation becomes history.
    fn commit(&mut self, states: &[ContactState]) {
        if self.changes_n == 0.0 {
            return;
        }
        let n = self.u.len();
        for (point, state) in states.iter().enumerate() {
            if *state == ContactState::Open {
                self.moved_m[point] += dot(&self.norms[point * n..(point + 1) * n], &self.change_n);
            }
        }
    }
}
