//! What a pattern says of one instant.

use crate::{Foothold, PhaseKind};
use nalgebra::Vector2;
use spatial::Vec3;

/// A number that changes with time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scalar {
    /// Value.
    pub value: f64,
    /// First derivative (1/s).
    pub rate: f64,
    /// Second derivative (1/s^2).
    pub acceleration: f64,
}

/// A point that moves on the ground, in world axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Planar {
    /// Position (m).
    pub position: Vector2<f64>,
    /// Velocity (m/s).
    pub velocity: Vector2<f64>,
    /// Acceleration (m/s^2).
    pub acceleration: Vector2<f64>,
}

/// The horizontal motion of the COM, in world axes; its height is [`Reference::com_height_m`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlanarMotion {
    /// Position (m).
    pub position: Vector2<f64>,
    /// Velocity (m/s).
    pub velocity: Vector2<f64>,
    /// Acceleration (m/s^2).
    pub acceleration: Vector2<f64>,
    /// Third derivative (m/s^3).
    pub jerk: Vector2<f64>,
    /// Fourth derivative (m/s^4).
    pub snap: Vector2<f64>,
}

/// Everything the pattern says about one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// Walk time (s), clamped to the walk.
    pub t_s: f64,
    /// Which phase it lies in (at a boundary: the later one).
    pub phase_index: usize,
    /// Kind of that phase.
    pub kind: PhaseKind,
    /// The swing that phase carries out, prepares or follows, counted from 1.
    pub step: u32,
    /// ZMP of the whole robot, as planned.
    pub zmp: Planar,
    /// The body's own ZMP, from the planned one.
    pub zmp_shift: Planar,
    /// Centre of mass.
    pub com: PlanarMotion,
    /// Its constant height above the ground (m).
    pub com_height_m: f64,
    /// Left and right foot.
    pub feet: [FootReference; 2],
}

impl Reference {
    /// Position of the COM (m).
    #[must_use]
    pub fn com_position(&self) -> Vec3 {
        Vec3::new(self.com.position.x, self.com.position.y, self.com_height_m)
    }

    /// Velocity of the COM (m/s).
    #[must_use]
    pub fn com_velocity(&self) -> Vec3 {
        Vec3::new(self.com.velocity.x, self.com.velocity.y, 0.0)
    }

    /// Acceleration of the COM (m/s^2).
    #[must_use]
    pub fn com_acceleration(&self) -> Vec3 {
        Vec3::new(self.com.acceleration.x, self.com.acceleration.y, 0.0)
    }
}

/// What the pattern asks of one foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootReference {
    /// Whether it is on the ground (its load may still be zero at the very instant of landing).
    pub in_contact: bool,
    /// Fraction of the robot's weight that it carries.
    pub share: Scalar,
    /// Force of the ground on it (N): `share (M x'', M y'', M g)`.
    pub force: Vec3,
    /// First derivative of the force (N/s).
    pub force_rate: Vec3,
    /// Second derivative of the force (N/s^2).
    pub force_acceleration: Vec3,
    /// Its ZMP. In the air, where there is none, the ankle's foothold at rest.
    pub zmp: Planar,
    /// Under the ankle: where it stands or will land.
    pub ankle_foothold: Foothold,
    /// Under the origin of the sole frame (centre of the undeformed sole): where it stands or will land.
    pub sole_foothold: Foothold,
    /// Walk time (s) of the landing that began, or will begin, the contact at this foothold; 0 for the initial stance.
    pub contact_since_s: f64,
    /// Present in the air.
    pub swing: Option<SwingReference>,
}

/// The flight a foot is in. Footholds lie under the ankle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwingReference {
    /// Where it left.
    pub from_foothold: Foothold,
    /// Where it will land.
    pub to_foothold: Foothold,
    /// Walk time of take-off (s).
    pub t_start_s: f64,
    /// Walk time of landing (s).
    pub t_end_s: f64,
    /// Height of the highest point above the higher of the two ends (m).
    pub apex_m: f64,
}
