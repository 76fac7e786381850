//! Inverse kinematics of any leg of six revolute joints, by damped Newton steps from angles that are nearly right.
//!
//! The leg is a product of turns about axes that are fixed in the base (product of exponentials): axis `w_i` through the
//! point `p_i` with all joints at zero, and `X_BF(0)`, the foot's pose there,
//!
//! ```text
//! X_BF(q) = T(w_1, p_1; q_1) ... T(w_6, p_6; q_6) X_BF(0),     T(w, p; a) x = p + exp(a w) (x - p)
//! ```
//!
//! A step minimises `|e - J dq|^2 + mu |dq|^2` with `e` the way and turn (times [`TURN_M`]) that are left. It is taken if it
//! makes `e` smaller; `mu` falls with every step that is and rises with every one that is not (Levenberg, Marquardt).
//! Near the solution the method is Newton's: digits double with every step. Beyond reach it ends as near as it gets.
//! References: Lynch, Park, *Modern Robotics* (2017), chapters 4 and 6; Sugihara, IEEE Trans. Robotics 27 (2011).

use super::{LegAngles, LegError};
use crate::algorithms::forward_kinematics;
use crate::model::{FrameIndex, JointIndex, JointMotion, Model};
use crate::workspace::Workspace;
use nalgebra::{DMatrix, Matrix6, Vector6};
use spatial::{Transform, Vec3, so3};

/// A turn by one radian counts as much as this way (m): about what it moves a foot's edge.
const TURN_M: f64 = 0.2;
/// What is left at the end (m): a thousand times the rounding of lengths below 1 m.
const TOLERANCE_M: f64 = 1e-12;
/// Steps, refused ones too. From the posture of the tick before two or three are needed.
const STEPS_MAX: usize = 100;
/// Longest step of one joint (rad): farther the linear model says nothing.
const STRIDE_MAX_RAD: f64 = 0.5;
/// Damping at the beginning and its bounds (m^2): a leg's `J'J` has eigenvalues from about 1e-3 up to 1 m^2.
const DAMPING_START: f64 = 1e-6;
const DAMPING_LEAST: f64 = 1e-15;
const DAMPING_MOST: f64 = 1e3;
/// Joint angles (rad) at which six joints must be able to move the foot in every direction: all bent a little.
const BENT_RAD: [f64; 6] = [0.1, -0.1, -0.3, 0.6, -0.3, 0.1];
/// Smallest share of the largest singular value of J there: far below any leg's, far above rounding.
const FREE_MIN: f64 = 1e-4;

/// A leg as a chain of axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegChain {
    /// Unit vectors, base axes.
    axes: [Vec3; 6],
    /// A point on each axis, base frame (m).
    points: [Vec3; 6],
    /// `X_BF` with all joints at zero.
    foot: Transform,
}

impl LegChain {
    /// Reads the axes off a model.
    ///
    /// # Errors
    /// [`LegError::OtherJoints`], [`LegError::Order`], [`LegError::Sliding`] or [`LegError::NotFree`].
    pub fn of_model(model: &Model, joints: &[JointIndex; 6], ankle: FrameIndex) -> Result<Self, LegError> {
        let name = |joint: usize| model.joints()[joint].name.clone();
        for joint in 0..model.joint_count() {
            if model.moves(JointIndex(joint), ankle) != joints.contains(&JointIndex(joint)) {
                return Err(LegError::OtherJoints { joint: name(joint) });
            }
        }
        // Joints come in the order in which the tree is walked.
        if let Some(pair) = joints.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(LegError::Order { joint: name(pair[1].0) });
        }
        if let Some(joint) = joints.iter().find(|joint| model.joints()[joint.0].motion != JointMotion::Revolute) {
            return Err(LegError::Sliding { joint: name(joint.0) });
        }
        let mut ws = Workspace::new(model);
        let mut q = model.neutral();
        q.joints.fill(0.0);
        let mut placed = forward_kinematics(model, &mut ws, &q);
        let foot = placed.pose(model.base_frame()).inverse() * placed.pose(ankle);
        let mut J = DMatrix::zeros(6, model.nv());
        placed.jacobian(ankle, &mut J);
        let (mut axes, mut points) = ([Vec3::zeros(); 6], [Vec3::zeros(); 6]);
        for (i, joint) in joints.iter().enumerate() {
            let column = J.column(model.column(*joint));
            axes[i] = column.fixed_rows::<3>(3).into();
            let moved: Vec3 = column.fixed_rows::<3>(0).into();
            // `moved = w x r` with r across the axis from it to the ankle: r = moved x w.
            points[i] = foot.translation - moved.cross(&axes[i]);
        }
        let chain = Self { axes, points, foot };
        let singular = chain.jacobian(&BENT_RAD).1.singular_values();
        let share = singular.min() / singular.max();
        if share < FREE_MIN {
            return Err(LegError::NotFree { joint: name(joints[0].0), share });
        }
        Ok(chain)
    }

    /// Foot pose in the base frame at the given angles (rad).
    #[must_use]
    pub fn forward(&self, joints_rad: &[f64; 6]) -> Transform {
        let turns = self.axes.iter().zip(&self.points).zip(joints_rad);
        turns.fold(Transform::identity(), |X, ((axis, point), angle)| X * turn(axis, point, *angle)) * self.foot
    }

    /// Foot pose, and its Jacobian in base axes at the foot's origin, linear first, turns in units of 1 / [`TURN_M`].
    fn jacobian(&self, joints_rad: &[f64; 6]) -> (Transform, Matrix6<f64>) {
        let pose = self.forward(joints_rad);
        let mut J = Matrix6::zeros();
        let mut X = Transform::identity();
        for (i, angle) in joints_rad.iter().enumerate() {
            let (axis, point) = (X.rotation * self.axes[i], X.point(&self.points[i]));
            J.fixed_view_mut::<3, 1>(0, i).copy_from(&axis.cross(&(pose.translation - point)));
            J.fixed_view_mut::<3, 1>(3, i).copy_from(&(TURN_M * axis));
            X = X * turn(&self.axes[i], &self.points[i], *angle);
        }
        (pose, J)
    }

    /// The angles near `near_rad` that bring the foot to the pose `X_BF`, or as near to it as they get.
    #[must_use]
    pub fn inverse(&self, X_BF: &Transform, near_rad: &[f64; 6]) -> LegAngles {
        let mut angles = *near_rad;
        let (pose, mut J) = self.jacobian(&angles);
        let mut left = way(&pose, X_BF);
        let mut damping = DAMPING_START;
        for _ in 0..STEPS_MAX {
            if left.norm() < TOLERANCE_M || damping > DAMPING_MOST {
                break;
            }
            let normal = J.tr_mul(&J) + damping * Matrix6::identity();
            let Some(factor) = normal.cholesky() else { break };
            let mut step = factor.solve(&J.tr_mul(&left));
            step *= (STRIDE_MAX_RAD / step.amax().max(STRIDE_MAX_RAD)).min(1.0);
            let tried = std::array::from_fn(|i| angles[i] + step[i]);
            let (pose, J_tried) = self.jacobian(&tried);
            let left_tried = way(&pose, X_BF);
            // Also refuses what is not a number.
            if left_tried.norm() < left.norm() {
                (angles, J, left) = (tried, J_tried, left_tried);
                damping = (damping * 0.1).max(DAMPING_LEAST);
            } else {
                damping *= 10.0;
            }
        }
        let missed_m = left.norm();
        LegAngles { joints_rad: angles, out_of_reach_m: if missed_m < MET_M { 0.0 } else { missed_m } }
    }

    /// The point nearest to the first three axes, where most hips have them meet, in the base frame (m).
    #[must_use]
    pub fn hip_in_base(&self) -> Vec3 {
        let mut across = spatial::Mat3::zeros();
        let mut sum = Vec3::zeros();
        for (axis, point) in self.axes.iter().zip(&self.points).take(3) {
            let part = spatial::Mat3::identity() - axis * axis.transpose();
            across += part;
            sum += part * point;
        }
        // Three parallel axes have no such point: the first one's will do.
        across.try_inverse().map_or(self.points[0], |inverse| inverse * sum)
    }
}

/// A pose counts as met if less than this is left (m): neither drives nor encoders see it.
const MET_M: f64 = 1e-9;

/// A turn about an axis through a point.
fn turn(axis: &Vec3, point: &Vec3, angle: f64) -> Transform {
    let rotation = so3::exp(&(axis * angle));
    Transform::new(rotation, point - rotation * point)
}

/// Way and turn from one pose to another, base axes.
fn way(from: &Transform, to: &Transform) -> Vector6<f64> {
    let turn = TURN_M * so3::log(&(to.rotation * from.rotation.transpose()));
    let way = to.translation - from.translation;
    Vector6::new(way.x, way.y, way.z, turn.x, turn.y, turn.z)
}
