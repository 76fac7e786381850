//! Step 1 of the stabiliser: the motion of the centre of mass from encoders, inertial unit and the planned standing places.

use multibody::{Configuration, Model, Workspace, forward_kinematics_velocity};
use nalgebra::{DMatrix, DVector, Vector2};
use spatial::{Mat3, Transform, Vec3, Wrench, so3};

use crate::{Leg, Plan, standing_place};

/// What the stabiliser takes of a robot's sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensed<'a> {
    /// Joint positions in the model's order (rad).
    pub joint_positions: &'a DVector<f64>,
    /// Joint rates (rad/s).
    pub joint_rates: &'a DVector<f64>,
    /// Orientation of the inertial unit in the world.
    pub orientation: Mat3,
    /// Angular velocity (rad/s), axes of the unit.
    pub angular_velocity: Vec3,
    /// Wrench of the ground on each foot, in the axes of its sensor and about its origin.
    pub foot_wrenches: [Wrench; 2],
}

/// The robot's motion as it measures it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeasuredMotion {
    /// Centre of mass (m).
    pub com: Vec3,
    /// Its velocity (m/s).
    pub com_velocity: Vec3,
    /// Divergent component of motion (m).
    pub dcm: Vector2<f64>,
    /// `w` (rad/s), from the planned height.
    pub omega: f64,
    /// Roll and pitch of the base against the plan, as a rotation vector in world axes (rad).
    pub base_tilt: Vector2<f64>,
}

/// Memory of the measurement. The kinematics are those of a robot whose base sits at the world's origin, turned as measured.
pub(super) struct Measurement {
    legs: [Leg; 2],
    /// `R_BI`.
    imu_in_base: Mat3,
    ws: Workspace,
    q: Configuration,
    v: DVector<f64>,
    com_jacobian: DMatrix<f64>,
    ankles: [Transform; 2],
}

impl Measurement {
    pub fn new(model: &Model, legs: [Leg; 2], imu_in_base: Mat3) -> Self {
        Self {
            legs,
            imu_in_base,
            ws: Workspace::new(model),
            q: model.neutral(),
            v: DVector::zeros(model.nv()),
            com_jacobian: DMatrix::zeros(3, model.nv()),
            ankles: [Transform::identity(); 2],
        }
    }

    /// Ankle of a foot as last measured: orientation in world axes, position relative to the base's origin.
    pub fn ankle(&self, foot: usize) -> Transform {
        self.ankles[foot]
    }

    pub fn motion(&mut self, model: &Model, plan: &Plan, sensors: &Sensed<'_>, gravity: f64) -> MeasuredMotion {
        let R_WB = self.base_orientation(plan, sensors);
        self.q.base = Transform::new(R_WB, Vec3::zeros());
        self.q.joints.copy_from(&sensors.joint_positions);
        let w_B = self.imu_in_base * sensors.angular_velocity;
        self.v.fill(0.0);
        self.v.fixed_rows_mut::<3>(3).copy_from(&w_B);
        self.v.rows_mut(model.base_dofs(), model.joint_count()).copy_from(&sensors.joint_rates);
        let mut moving = forward_kinematics_velocity(model, &mut self.ws, &self.q, &self.v);

        // Where the base's origin is and how it moves, if each stance foot stands where it was planned to.
        let (mut position, mut velocity, mut weight) = (Vec3::zeros(), Vec3::zeros(), 0.0);
        for (i, leg) in self.legs.iter().enumerate() {
            let ankle = moving.pose(leg.ankle);
            self.ankles[i] = ankle;
            let foot = &plan.feet[i];
            let share = if foot.in_contact { foot.load_share } else { 0.0 };
            let (place, _) = standing_place(leg, foot);
            let turn = ankle.rotation * foot.ankle.rotation.transpose();
            let arm = turn * (foot.ankle.translation - place);
            let twist = moving.velocity(leg.ankle);
            position += share * (place + arm - ankle.translation);
            velocity += share * (twist.angular.cross(&arm) - twist.linear);
            weight += share;
        }
        if weight > 0.0 {
            position /= weight;
            velocity /= weight;
        } else {
            // In the air nothing is anchored: the plan stands in.
            position = plan.base.translation;
        }

        moving.com_jacobian(&mut self.com_jacobian);
        let com = moving.center_of_mass() + position;
        let relative = &self.com_jacobian * &self.v;
        let com_velocity = Vec3::new(relative[0], relative[1], relative[2]) + velocity;
        let ground =
            plan.feet.iter().zip(&self.legs).map(|(foot, leg)| (foot.load_share, standing_place(leg, foot).0.z));
        let ground_height: f64 = ground.map(|(share, z)| share * z).sum();
        let omega = (gravity / (plan.com.z - ground_height)).sqrt();
        let tilt = so3::log(&(R_WB * plan.base.rotation.transpose()));
        MeasuredMotion { com, com_velocity, dcm: com.xy() + com_velocity.xy() / omega, omega, base_tilt: tilt.xy() }
    }

    /// Measured orientation of the base with the plan's heading.
    fn base_orientation(&self, plan: &Plan, sensors: &Sensed<'_>) -> Mat3 {
        let R_WB = sensors.orientation * self.imu_in_base.transpose();
        let heading = |R: &Mat3| R[(1, 0)].atan2(R[(0, 0)]);
        so3::about_z(heading(&plan.base.rotation) - heading(&R_WB)) * R_WB
    }
}
