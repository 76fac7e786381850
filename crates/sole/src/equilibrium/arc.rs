//! Where a way of loads comes to no further: does the equilibrium end there, or was it only not found?
//!
//! The part `w` of the way becomes a seventh unknown, the length of arc along the curve of equilibria the seventh equation (pseudo-arclength
//! continuation). At a fold the tangent is singular, the bordered matrix is not: the curve is followed round it. Where it turns back, with the
//! equations solved on both sides, no equilibrium of this curve carries more: that is shown, not concluded from a failure.

use super::system::{Reduction, References};
use super::{Equilibrium, Limits, MOMENT_ARM_M, STEP_MAX_M, Target};
use nalgebra::{SMatrix, SVector};
use spatial::Vec6;

/// Coordinates: position (m), rotation vector times [`MOMENT_ARM_M`] (m), part of the way times [`WAY_M`] (m).
type Vec7 = SVector<f64, 7>;
type Mat7 = SMatrix<f64, 7, 7>;

/// What became of the curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ArcEnd {
    /// It turns back: no more than this part of the way is carried.
    TurnsBack { fraction: f64 },
    /// It leads on: this part is carried, and the present state carries it.
    Passed { fraction: f64 },
    /// It was lost.
    Lost,
}

/// Length (m) that the whole way of loads counts for. From the centre to the fold of the first tick the sole turns by 0.3 rad: 30 mm.
const WAY_M: f64 = 0.01;
/// First, shortest and number of the steps along the curve (m), and iterations of each.
const ARC_FIRST_M: f64 = 5e-4;
const ARC_LAST_M: f64 = 2e-6;
const ARC_STEPS: usize = 40;
const ARC_ITERATIONS: usize = 12;

impl Equilibrium {
    /// Follows the curve of equilibria from the present one, which carries the part `start` of the way, until it has turned back by more than
    /// the tolerance, has led on by `enough`, or is lost.
    pub(crate) fn follow_arc(&mut self, way: [&Target; 2], start: f64, enough: f64, limits: &Limits) -> ArcEnd {
        let (mut w, mut top, mut length) = (start, start, ARC_FIRST_M);
        // Where to: first the way of more load.
        self.evaluate();
        let Some(mut direction) = self.arc_direction(way, w, &Vec7::ith(6, 1.0)) else { return ArcEnd::Lost };
        self.save_reached();
        for _ in 0..ARC_STEPS {
            if self.multiplications() > limits.multiplications {
                return ArcEnd::Lost;
            }
            let found = self.arc_step(way, w, &(length * direction), limits);
            let next = found.and_then(|w| self.arc_direction(way, w, &direction).map(|direction| (w, direction)));
            let Some((next_w, next_direction)) = next else {
                self.return_to_reached();
                self.evaluate();
                length *= 0.5;
                match self.arc_direction(way, w, &direction) {
                    Some(again) if length >= ARC_LAST_M => direction = again,
                    _ => return ArcEnd::Lost,
                }
                continue;
            };
            top = f64::max(top, next_w);
            let (up, down) = (direction[6], next_direction[6]);
            if up > 0.0 && down < 0.0 {
                // The top between a slope upwards and one downwards, as of a parabola.
                top = f64::max(top, w + 0.5 * length * up * up / ((up - down) * WAY_M));
            }
            // Solved on both sides of the top.
            if down < 0.0 && top - next_w > limits.tolerance {
                return ArcEnd::TurnsBack { fraction: f64::min(top, 1.0) };
            }
            (w, direction) = (next_w, next_direction);
            self.save_reached();
            if w >= f64::min(start + enough, 1.0) {
                return ArcEnd::Passed { fraction: w };
            }
            length = f64::min(1.5 * length, STEP_MAX_M);
        }
        ArcEnd::Lost
    }

    /// Solves for the equilibrium nearest to a step along the curve; returns its part of the way.
    fn arc_step(&mut self, way: [&Target; 2], w: f64, step: &Vec7, limits: &Limits) -> Option<f64> {
        let normal = step.normalize();
        let mut w = w + step[6] / WAY_M;
        // To first order the slips follow the pose.
        self.advance(&pose_part(step), 1.0);
        self.evaluate();
        let mut settled = !self.update_states();
        self.evaluate();
        for _ in 0..ARC_ITERATIONS {
            let target = way[0].on_way(way[1], w);
            let residual = self.residual(&target);
            if settled && residual <= self.reachable(&target, limits) {
                return Some(w);
            }
            let regular = self.assemble(References::Follow) == Reduction::Done && residual.is_finite();
            self.work.iterations += 1;
            let right = -self.scaled_right_hand();
            let Some(correction) = self.bordered(&target, &normal, &right, 0.0).filter(|_| regular) else {
                return None;
            };
            // What is farther away than the step is long belongs to another part of the curve.
            if correction.norm() > 4.0 * step.norm() {
                return None;
            }
            w += correction[6] / WAY_M;
            self.advance(&pose_part(&correction), 1.0);
            self.evaluate();
            settled = !self.update_states();
            if !settled {
                self.evaluate();
            }
        }
        None
    }

    /// Unit vector along the curve at the present equilibrium, on the side of another one.
    fn arc_direction(&mut self, way: [&Target; 2], w: f64, side: &Vec7) -> Option<Vec7> {
        let target = way[0].on_way(way[1], w);
        self.residual(&target);
        if self.assemble(References::Follow) == Reduction::Singular {
            return None;
        }
        // Along the curve the conditions stay met: the slips move with the pose alone.
        self.scratch.js.from_mut(6).fill(0.0);
        self.bordered(&target, side, &Vec6::zeros(), 1.0).map(|direction| direction.normalize())
    }

    fn scaled_right_hand(&self) -> Vec6 {
        Vec6::from_fn(|i, _| self.scratch.right_hand[i] / unit(i))
    }

    /// Solves `J dx - W' dw = right, normal . (dx, dw) = last`, all in scaled coordinates.
    fn bordered(&self, target: &Target, normal: &Vec7, right: &Vec6, last: f64) -> Option<Vec7> {
        let way = target.wrench(&self.stance.pose.translation)[1];
        let size = self.scratch.tangent.amax();
        let matrix = Mat7::from_fn(|i, j| match (i, j) {
            // As large as the stiffness, which does not change what it says.
            (6, _) => size * normal[j],
            (_, 6) => -way[i] / (unit(i) * WAY_M),
            _ => self.scratch.tangent[(i, j)] / (unit(i) * unit(j)),
        });
        let rhs = Vec7::from_fn(|i, _| if i < 6 { right[i] } else { size * last });
        matrix.full_piv_lu().solve(&rhs).filter(|x| x.iter().all(|x| x.is_finite()))
    }
}

fn unit(i: usize) -> f64 {
    if i < 3 { 1.0 } else { MOMENT_ARM_M }
}

/// Translation and rotation vector of a step along the curve.
fn pose_part(step: &Vec7) -> Vec6 {
    Vec6::from_fn(|i, _| step[i] / unit(i))
}
