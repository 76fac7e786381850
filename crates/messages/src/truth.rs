//! What the simulator really did; for the recorder and for judging, never for the control loop.

use crate::plain::plain_struct;
use crate::{Header, MAX_JOINTS};
use iceoryx2::prelude::ZeroCopySend;

plain_struct! {
    /// The simulated robot at the tick.
    "soleus.TruthV2", 1760 bytes, Truth {
        /// Header.
        header: Header,
        /// Simulated time since tick 0.
        time_s: f64,
        /// Walk time; negative before time zero.
        walk_time_s: f64,
        /// Number of joints, in the order of the robot's description.
        joint_count: u32,
        /// 1 once the robot has fallen.
        fallen: u32,
        /// Tick of the fall; meaningless while `fallen` is 0.
        fall_tick: i64,
        /// Why it counts as fallen: [`crate::code::Fall`].
        fall_cause: u32,
        /// Newton steps of the plant's integration in the tick.
        contact_iterations: u32,
        /// Position of the floating base in the world.
        base_position_m: [f64; 3],
        /// Rotation of the floating base in the world, row-major.
        base_rotation: [f64; 9],
        /// Velocity (m/s) of the base's origin and angular velocity (rad/s), world axes.
        base_twist_m_rad_per_s: [f64; 6],
        /// Real joint angles.
        joint_position_rad: [f64; MAX_JOINTS],
        /// Real joint rates.
        joint_velocity_rad_per_s: [f64; MAX_JOINTS],
        /// Torques at the joints.
        joint_torque_nm: [f64; MAX_JOINTS],
        /// Centre of mass.
        com_position_m: [f64; 3],
        /// Its velocity.
        com_velocity_m_per_s: [f64; 3],
        /// Its acceleration.
        com_acceleration_m_per_s2: [f64; 3],
        /// Linear momentum.
        linear_momentum_kg_m_per_s: [f64; 3],
        /// Angular momentum about the centre of mass.
        angular_momentum_kg_m2_per_s: [f64; 3],
        /// Zero-moment point of both feet's wrenches on the ground; the last one while nothing carries.
        zmp_m: [f64; 2],
        /// Force (N) and moment (N m) of the ground on each sole about its sole origin, world axes.
        foot_wrench_n_nm: [[f64; 6]; 2],
        /// Positions of the sole frames in the world.
        sole_position_m: [[f64; 3]; 2],
        /// Rotations of the sole frames in the world, row-major.
        sole_rotation: [[f64; 9]; 2],
        /// Positions of the ankles in the world.
        ankle_position_m: [[f64; 3]; 2],
        /// Kinetic energy.
        kinetic_energy_j: f64,
        /// Potential energy of gravity.
        potential_energy_j: f64,
        /// Elastic energy of both soles; zero for hard feet.
        elastic_energy_j: f64,
        /// Work of the servos since tick 0.
        servo_work_j: f64,
        /// Largest violation of the contact laws at the tick, over the largest nodal force; zero for hard feet.
        contact_residual: f64,
        /// Tick of the command under which the robot came here: that of the placing command at tick 0.
        command_tick: i64,
        /// Joints at or beyond the limits of their position: bit *i* is joint *i*.
        joints_at_limit_bits: u64,
        /// Drives at the limit of their torque: bit *i* is joint *i*.
        drives_saturated_bits: u64,
        /// Sum of the forces that push the robot, the ground's aside; zero while none does.
        push_force_n: [f64; 3],
        /// Where the strongest of them acts, in the world.
        push_point_m: [f64; 3],
    }
}
