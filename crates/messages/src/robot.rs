//! What the robot's driver says and hears.

use crate::plain::plain_struct;
use crate::rotation::from_row_major;
use crate::{Header, MAX_JOINTS};
use iceoryx2::prelude::ZeroCopySend;
use spatial::{Transform, Vec3};

plain_struct! {
    /// Sensors of the robot, sampled at the tick.
    "soleus.RobotStateV2", 856 bytes, RobotState {
        /// Header.
        header: Header,
        /// Number of joints, in the order of the robot's description.
        joint_count: u32,
        /// Sensor faults, one bit each; zero: none.
        fault_bits: u32,
        /// Measured joint angles.
        joint_position_rad: [f64; MAX_JOINTS],
        /// Measured joint rates.
        joint_velocity_rad_per_s: [f64; MAX_JOINTS],
        /// Attitude of the IMU in the world, quaternion x, y, z, w.
        imu_orientation_xyzw: [f64; 4],
        /// Angular velocity of the IMU, in its axes.
        gyro_rad_per_s: [f64; 3],
        /// Specific force at the IMU (acceleration minus gravity), in its axes: +g upwards at rest.
        accelerometer_m_per_s2: [f64; 3],
        /// Force (N) and moment (N m) of the sole on each foot, about the foot sensor's origin, in its axes.
        foot_wrench_n_nm: [[f64; 6]; 2],
    }
}

plain_struct! {
    /// The plan of one foot, for the robot's stabiliser.
    "soleus.PlanFootV2", 160 bytes, PlanFoot {
        /// 1 if the foot shall carry load, else 0.
        loaded: u32,
        /// Always zero.
        reserved: u32,
        /// Fraction of the weight it shall carry.
        load_share: f64,
        /// Force (N) and moment (N m) of the ground on the foot about the ankle, in world axes.
        wrench_n_nm: [f64; 6],
        /// Position of the ankle in the world.
        ankle_position_m: [f64; 3],
        /// Rotation of the ankle frame in the world, row-major.
        ankle_rotation: [f64; 9],
    }
}

plain_struct! {
    /// The whole-body plan the joint references belong to.
    "soleus.PlanV2", 504 bytes, Plan {
        /// Position of the floating base in the world.
        base_position_m: [f64; 3],
        /// Rotation of the floating base in the world, row-major.
        base_rotation: [f64; 9],
        /// Zero-moment point on the ground, of the wrenches that the whole-body step computed; the pattern's without a step.
        zmp_m: [f64; 2],
        /// Centre of mass.
        com_position_m: [f64; 3],
        /// Its velocity.
        com_velocity_m_per_s: [f64; 3],
        /// Its acceleration.
        com_acceleration_m_per_s2: [f64; 3],
        /// Left and right foot.
        feet: [PlanFoot; 2],
    }
}

plain_struct! {
    /// References for the joints' servos and the plan behind them. Command of tick k holds references for tick k + 1.
    "soleus.RobotCommandV2", 1568 bytes, RobotCommand {
        /// Header; the tick is that of the state it answers.
        header: Header,
        /// The pattern it follows.
        pattern_hash: u64,
        /// Walk time of the references; negative before time zero.
        walk_time_s: f64,
        /// Number of joints, in the order of the robot's description.
        joint_count: u32,
        /// What the controller does: [`crate::code::Mode`].
        mode: u32,
        /// Outcome of its quadratic program: [`crate::code::Outcome`].
        status: u32,
        /// Iterations of the quadratic program.
        solver_iterations: u32,
        /// Joint angle references.
        joint_position_reference_rad: [f64; MAX_JOINTS],
        /// Joint rate references.
        joint_velocity_reference_rad_per_s: [f64; MAX_JOINTS],
        /// Feed-forward torques.
        feed_forward_torque_nm: [f64; MAX_JOINTS],
        /// The plan.
        plan: Plan,
        /// Tick of the deformation used: who replays a controller gives it this one.
        deformation_tick: i64,
        /// Its age, in ticks.
        deformation_age_ticks: u32,
        /// Number of active inequality constraints in the quadratic program.
        active_constraints: u32,
        /// KKT residual of the quadratic program.
        solver_residual: f64,
        /// Joints whose position or speed limit was active in the quadratic program: bit *i* is joint *i*.
        joints_limited_bits: u64,
        /// Joints whose torque limit was active in the quadratic program: bit *i* is joint *i*.
        torques_limited_bits: u64,
    }
}

impl Plan {
    /// Pose `X_WB` of the base.
    #[must_use]
    pub fn base(&self) -> Transform {
        Transform::new(from_row_major(&self.base_rotation), Vec3::from(self.base_position_m))
    }
}

impl PlanFoot {
    /// Pose `X_WA` of the ankle.
    #[must_use]
    pub fn ankle(&self) -> Transform {
        Transform::new(from_row_major(&self.ankle_rotation), Vec3::from(self.ankle_position_m))
    }
}
