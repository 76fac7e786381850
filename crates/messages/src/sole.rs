//! What the estimator says about the soles.

use crate::plain::plain_struct;
use crate::{Header, MAX_CONTACT_NODES};
use iceoryx2::prelude::ZeroCopySend;

plain_struct! {
    /// Deformation of one foot's sole under its planned force, and where the ankle is because of it.
    "soleus.FootDeformationV2", 752 bytes, FootDeformation {
        /// 1 if the foot carries load, else 0; without load the poses are those of the undeformed sole at its foothold.
        loaded: u32,
        /// Outcome of the estimate: [`crate::code::Outcome`].
        status: u32,
        /// How many ticks ago this estimate was made: 0 if fresh, more when later ones failed.
        age_ticks: u32,
        /// Iterations of the solver at this tick.
        iterations: u32,
        /// Planned fraction of the weight on this foot.
        load_share: f64,
        /// Position of the ankle in the world.
        ankle_position_m: [f64; 3],
        /// Rotation of the ankle frame in the world, row-major.
        ankle_rotation: [f64; 9],
        /// Velocity (m/s) of the ankle and angular velocity (rad/s), world axes.
        ankle_twist_m_rad_per_s: [f64; 6],
        /// Acceleration (m/s^2) of the ankle and angular acceleration (rad/s^2), world axes.
        ankle_acceleration_m_rad_per_s2: [f64; 6],
        /// Position of the sole frame in the world.
        sole_position_m: [f64; 3],
        /// Rotation of the sole frame in the world, row-major.
        sole_rotation: [f64; 9],
        /// Planned force of the ground on the foot, world axes.
        planned_force_n: [f64; 3],
        /// Planned zero-moment point of this foot in the world.
        planned_zmp_m: [f64; 2],
        /// Compliance, row-major 6 x 6: change of the sole frame's pose (m, rad; world axes) per change of the wrench of the ground
        /// on the sole (N, N m; world axes, about the sole origin). More force upwards lets the frame sink: the diagonal is negative.
        compliance_m_rad_per_n_nm: [f64; 36],
        /// Force (N) and moment (N m) of the ground on the sole about the sole origin, world axes.
        wrench_n_nm: [f64; 6],
        /// Velocity (m/s) and angular velocity (rad/s) of the sole frame's origin, world axes.
        sole_twist_m_rad_per_s: [f64; 6],
        /// Nodes that stick.
        nodes_sticking: u32,
        /// Nodes that slip.
        nodes_slipping: u32,
        /// Largest scaled residual of equilibrium and contact laws.
        residual: f64,
    }
}

plain_struct! {
    /// Deformation of both soles at the tick.
    "soleus.SoleDeformationV2", 1552 bytes, SoleDeformation {
        /// Header; the tick is that of the robot state it answers.
        header: Header,
        /// Walk time of the estimate; negative before time zero.
        walk_time_s: f64,
        /// The pattern it belongs to.
        pattern_hash: u64,
        /// Left and right foot.
        feet: [FootDeformation; 2],
    }
}

plain_struct! {
    /// Nodes of one sole that may touch the ground.
    "soleus.ContactNodesV1", 13320 bytes, ContactNodes {
        /// Number of nodes.
        count: u32,
        /// Always zero.
        reserved: u32,
        /// Positions in the world.
        position_m: [[f64; 3]; MAX_CONTACT_NODES],
        /// Forces of the ground on the nodes, world axes.
        force_n: [[f64; 3]; MAX_CONTACT_NODES],
        /// States: [`crate::code::ContactState`].
        state: [u32; MAX_CONTACT_NODES],
    }
}

plain_struct! {
    /// Contact of both soles, node by node, for viewing.
    "soleus.SoleContactV1", 26672 bytes, SoleContact {
        /// Header.
        header: Header,
        /// Left and right foot.
        feet: [ContactNodes; 2],
    }
}
