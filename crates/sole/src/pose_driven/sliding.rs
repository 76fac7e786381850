//! The slips: Newton on the Alart-Curnier conditions of all sliding points at once, with factors that are used while they serve.

use super::PoseDrivenContact;
use crate::equilibrium::SlidingLaw;
use crate::list::List;
use friction::dense::{add_three, lu_factor, lu_solve};
use nalgebra::Vector2;
use spatial::Vec3;

/// Factors are used again while they make the error this many times smaller per step. They then cost a step more at most.
const SAME_FACTORS: f64 = 0.1;

/// Factors and right-hand sides.
#[derive(Debug, Clone)]
pub(super) struct Workspace {
    pub jss: Vec<f64>,
    pub pivots: Vec<usize>,
    /// Six columns.
    pub js: Vec<f64>,
    /// `beta K d` for the two tangents of a point.
    pushed: Vec<f64>,
    /// Of each sliding point: gradients of its conditions with its force (sole axes), their rates with its own slips, its slot, its
    /// tangents in sole axes times beta.
    gradients: Vec<[Vec3; 2]>,
    own: Vec<[Vector2<f64>; 2]>,
    slots: Vec<usize>,
    directions: Vec<[Vec3; 2]>,
    /// The points whose conditions are factorised, in order.
    factored: List<usize>,
    last_error: f64,
}

impl Workspace {
    pub fn new(n: usize) -> Self {
        Self {
            jss: vec![0.0; 4 * n * n],
            pivots: vec![0; 2 * n],
            js: vec![0.0; 12 * n],
            pushed: vec![0.0; 6 * n],
            gradients: vec![[Vec3::zeros(); 2]; n],
            own: vec![[Vector2::zeros(); 2]; n],
            slots: vec![0; n],
            directions: vec![[Vec3::zeros(); 2]; n],
            factored: List::with_room_for(n),
            last_error: f64::INFINITY,
        }
    }

    /// The factors are not to be used again.
    pub fn forget(&mut self) {
        self.factored.clear();
    }
}

impl PoseDrivenContact {
    pub(super) fn law(&self, point: usize, slot: usize) -> SlidingLaw {
        let force = self.places[point].frame.tr_mul(&self.forces[slot]);
        SlidingLaw::new(self.places[point].mu, self.beta * self.rho[point], &force, &self.slips[point])
    }

    /// One Newton step of all slips where their error is more than asked for; returns the error before it (N), infinite when no step can be
    /// made, and whether one was.
    pub(super) fn slide_once(&mut self) -> (f64, bool) {
        if self.sliding.is_empty() {
            return (0.0, false);
        }
        let mut error = 0.0_f64;
        for i in 0..self.sliding.len() {
            let point = self.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let law = self.law(point, slot);
            error = error.max(law.residual.norm());
            self.slide.js[2 * i] = law.residual.x;
            self.slide.js[2 * i + 1] = law.residual.y;
        }
        if error <= self.asked_n() {
            return (error, false);
        }
        let first = self.report.iterations <= 1;
        let serve = first || error < SAME_FACTORS * self.slide.last_error;
        self.slide.last_error = error;
        if !(serve && self.are_factored()) && !self.factor_sliding() {
            return (f64::INFINITY, false);
        }
        let (rows, s) = (2 * self.states.len(), 2 * self.sliding.len());
        lu_solve(&self.slide.jss, rows, s, &self.slide.pivots, &mut self.slide.js, 1);
        for i in 0..self.sliding.len() {
            self.slips[self.sliding[i]] -= Vector2::new(self.slide.js[2 * i], self.slide.js[2 * i + 1]);
        }
        (error, true)
    }

    /// Are the factors those of the points that slide now?
    pub(super) fn are_factored(&self) -> bool {
        self.slide.factored.as_slice() == self.sliding.as_slice()
    }

    /// Factorises the sliding conditions; false when they are singular.
    pub(super) fn factor_sliding(&mut self) -> bool {
        let (rows, m, ld) = (2 * self.states.len(), 3 * self.stiffness.len(), self.stiffness.ld());
        let count = self.sliding.len();
        self.slide.factored.clear();
        for i in 0..count {
            let point = self.sliding[i];
            let slot = self.stiffness.slot(point).expect("sliding points touch");
            let (law, turn) = (self.law(point, slot), self.turn(point));
            self.slide.gradients[i] = [0, 1].map(|component| (law.gradient(component) * turn).transpose());
            self.slide.own[i] = [0, 1].map(|t| law.rate(&Vec3::zeros(), &Vector2::ith(t, 1.0)));
            self.slide.slots[i] = slot;
            self.slide.directions[i] = [0, 1].map(|t| self.beta * turn.row(t).transpose());
        }
        let Workspace { jss, pivots, pushed, gradients, own, slots, directions, .. } = &mut self.slide;
        let (first, second) = pushed.split_at_mut(ld);
        for k in 0..count {
            // What a slip along each tangent pushes: two columns, from which the sliding points' rows are gathered.
            let (j, stiffness) = (3 * slots[k], &self.stiffness);
            for (pushed, d) in [&mut first[..m], &mut second[..m]].into_iter().zip(&directions[k]) {
                pushed.fill(0.0);
                let (x, y, z) = (stiffness.column(j), stiffness.column(j + 1), stiffness.column(j + 2));
                add_three(pushed, x, y, z, d.x, d.y, d.z);
            }
            for (t, pushed) in [&first[..m], &second[..m]].into_iter().enumerate() {
                let target = &mut jss[(2 * k + t) * rows..(2 * k + t) * rows + 2 * count];
                for ((target, slot), gradient) in target.chunks_exact_mut(2).zip(slots.iter()).zip(gradients.iter()) {
                    let push = &pushed[3 * slot..3 * slot + 3];
                    for (target, g) in target.iter_mut().zip(gradient) {
                        *target = g.x * push[0] + g.y * push[1] + g.z * push[2];
                    }
                }
                target[2 * k] += own[k][t].x;
                target[2 * k + 1] += own[k][t].y;
            }
        }
        if lu_factor(jss, rows, 2 * count, 0, pivots) < f64::EPSILON {
            return false;
        }
        self.slide.factored.extend_from_slice(&self.sliding);
        true
    }
}
