//! Where the points' states run in circles: Newton on the pose alone, the contact solved exactly at every pose.
//!
//! [`Equilibrium::newton`] changes pose and states in turns. Where normal and tangential forces of neighbours are strongly coupled (Poisson's
//! ratio near a half, friction above one) each set of states asks for another one, and so on: no line search on the pose helps, because the
//! residual belongs to states that are not those of the pose. Here they are: the contact problem at a given pose always has a solution,
//! `friction::solve` finds it, the forces are then a function of the pose, and a step along their derivative (the same tangent) can be
//! shortened until the load is nearer. It starts from the state of the last tick and the equations are the same ones.

use super::system::{Reduction, References};
use super::{End, Equilibrium, Limits, STEP_MAX_M, STEP_MAX_RAD, Target, parts, scaled_solve};
use friction::{ContactProblem, ContactState, Settings, Status, Workspace, solve};
use nalgebra::{DMatrix, DVector, Vector2};
use spatial::{Vec3, so3};

// Measured with the first ticks that `examples/hard_cases.rs` ends with: 1920, of which 85 are unsolved when this is
// tried once, for the load itself, and no step on the way to it (295 without this file at all).

/// Contact problems solved in all. 20: 94 unsolved, 60: 78, without limit 75 in half as much time again.
const CONTACTS_MAX: usize = 30;
/// Halvings of a step that does not bring the load nearer; the last one is taken all the same, because where the contact has two solutions
/// the forces may jump.
const HALVINGS: usize = 5;
/// The contact is solved to this part of its forces, the pose to this residual; the remaining digits are [`Equilibrium::newton`]'s.
const CONTACT_TOLERANCE: f64 = 1e-9;
const POSE_TOLERANCE: f64 = 1e-6;
/// Per contact problem. 60 and 10: 86 unsolved, in twice the time; 200 and 30: 84. No proximal method: it takes seconds where it finds anything.
const SWEEPS_MAX: usize = 100;
const NEWTON_MAX: usize = 15;

impl Equilibrium {
    /// Newton on the pose with a line search on the residual of the load. Allocates: only on the slow path.
    pub(crate) fn newton_on_pose(&mut self, target: &Target, limits: &Limits) -> End {
        let mut workspace = Workspace::new(self.stance.states.len());
        self.evaluate();
        self.residual(target);
        // The states to start from are not those of this load: any first step will do.
        let mut before = f64::INFINITY;
        let mut contacts = 0;
        while contacts < CONTACTS_MAX && self.multiplications() <= limits.multiplications {
            if self.assemble(References::Follow) == Reduction::Singular {
                return End::Stopped;
            }
            self.work.iterations += 1;
            let Some(step) = scaled_solve(&self.scratch.tangent, &-self.scratch.right_hand) else {
                return End::Stopped;
            };
            let (linear, angular) = parts(&step);
            let mut scale = 1.0_f64.min(STEP_MAX_M / linear.norm()).min(STEP_MAX_RAD / angular.norm());
            if !scale.is_finite() {
                return End::Stopped;
            }
            let from = self.stance.pose;
            let mut residual = f64::INFINITY;
            for _ in 0..=HALVINGS {
                self.stance.pose.translation = from.translation + scale * linear;
                self.stance.pose.rotation = so3::orthonormalised(&(so3::exp(&(scale * angular)) * from.rotation));
                contacts += 1;
                if self.multiplications() > limits.multiplications {
                    return End::Stopped;
                }
                residual = if self.solve_contact(&mut workspace) { self.residual(target) } else { f64::INFINITY };
                if residual < before {
                    break;
                }
                scale *= 0.5;
            }
            if !residual.is_finite() {
                return End::Stopped;
            }
            if residual <= POSE_TOLERANCE.max(limits.tolerance) {
                return self.newton(target, limits, false);
            }
            before = residual;
        }
        End::Stopped
    }

    /// Forces, states and slips at the present pose; `false`: the laws could not be met.
    fn solve_contact(&mut self, workspace: &mut Workspace) -> bool {
        let n = self.stance.states.len();
        let (c, r) = (self.sole.model.compliance(), self.stance.pose.rotation);
        let mut delassus = DMatrix::zeros(3 * n, 3 * n);
        for b in 0..n {
            for a in 0..n {
                let block = r * c.fixed_view::<3, 3>(3 * a, 3 * b) * r.transpose();
                delassus.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(&block);
            }
        }
        let families = self.families();
        let mut undeformed = DVector::zeros(3 * n);
        for (point, p) in self.sole.model.contact_points().iter().enumerate() {
            let away: Vec3 = self.stance.pose.point(p) - self.reference(point, &families);
            undeformed.fixed_rows_mut::<3>(3 * point).copy_from(&away);
        }
        let Ok(problem) = ContactProblem::of_model(delassus, undeformed, self.sole.model.friction().to_vec()) else {
            return false;
        };
        let settings = Settings {
            tolerance: CONTACT_TOLERANCE,
            sweeps_max: SWEEPS_MAX,
            newton_iterations_max: NEWTON_MAX,
            proximal_iterations_max: 0,
        };
        let answer = solve(&problem, workspace, &settings);
        // Each sweep passes over the matrix, and so, six times, does making it. (The few iterations of Newton's inside cost more.)
        let m = 3 * n as u64;
        self.work.multiplications += (answer.iterations as u64 + 6) * m * m;
        for point in 0..n {
            let touches = workspace.states()[point] != ContactState::Open;
            if touches && self.stance.states[point] == ContactState::Open {
                self.stance.states[point] = ContactState::Stick;
                self.land(point);
            } else if !touches && self.stance.states[point] != ContactState::Open {
                self.lift(point);
            }
            if touches {
                let slides = workspace.states()[point] == ContactState::Slip;
                let delta = Vector2::new(answer.delta[3 * point], answer.delta[3 * point + 1]);
                self.stance.states[point] = if slides { ContactState::Slip } else { ContactState::Stick };
                self.stance.slips[point] = if slides { delta } else { Vector2::zeros() };
            }
        }
        self.evaluate();
        answer.status == Status::Solved
    }
}
