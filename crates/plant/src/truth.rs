//! What the simulator really did. The recorder and tests may read it, no controller.

use nalgebra::Vector2;
use spatial::{Transform, Twist, Vec3, Wrench};

use crate::energy::Energies;
use stabiliser::StabiliserReport;

/// The simulated robot at a tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Truth {
    /// Time since the robot was placed (s).
    pub t_s: f64,
    /// Base pose `X_WB`.
    pub base: Transform,
    /// Twist of the base's origin, world axes.
    pub base_twist: Twist,
    /// Centre of mass (m).
    pub com: Vec3,
    /// Its velocity (m/s).
    pub com_velocity: Vec3,
    /// Its acceleration (m/s^2), from the forces that act at the tick.
    pub com_acceleration: Vec3,
    /// Angular momentum about the centre of mass (kg m^2/s), world axes.
    pub angular_momentum: Vec3,
    /// ZMP of both feet together on the horizontal plane through the mean height of the ground below them (m); `None` when
    /// nothing presses on the ground.
    pub zmp: Option<Vector2<f64>>,
    /// Sum of the forces that push the robot (N), world axes; zero while none does.
    pub push_force: Vec3,
    /// Where the strongest of them acts (m), in the world.
    pub push_point: Vec3,
    /// Left and right foot.
    pub feet: [FootTruth; 2],
    /// Energies.
    pub energies: Energies,
    /// How the integration went during the last tick.
    pub integration: Integration,
    /// What the stabiliser did with the last command.
    pub stabiliser: StabiliserReport,
    /// Joint references changed by the drives' limits since the robot was placed.
    pub limited_references: u64,
}

/// One foot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FootTruth {
    /// Pose `X_WS` of the sole frame (undeformed sole, fixed in the foot).
    pub sole: Transform,
    /// Pose `X_WA` of the ankle.
    pub ankle: Transform,
    /// Wrench of the ground about the sole frame's origin, world axes.
    pub wrench: Wrench,
    /// The foot's ZMP on the horizontal plane through the ground below the sole's centre (m); `None` in the air.
    pub zmp: Option<Vector2<f64>>,
    /// Height of the ground below the sole's centre (m).
    pub ground_height_m: f64,
}

/// How the integration went during one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Integration {
    /// Integration steps that were taken.
    pub steps: usize,
    /// Steps that were tried and then taken in shorter ones.
    pub rejected_steps: usize,
    /// Largest vertical force of the ground on both feet at the end of a step (N).
    pub vertical_force_max_n: f64,
    /// Newton steps in all of them.
    pub newton_steps: usize,
    /// Steps whose equations were not met to the tolerance.
    pub unconverged_steps: usize,
    /// Steps in which a contact problem was not solved to its tolerance.
    pub unconverged_contacts: usize,
    /// Most drives at their torque limit in one step.
    pub saturated_drives_max: usize,
}
