//! What the whole body shall do at a tick.

use pattern::Reference;
use spatial::{Vec3, so3};
use wholebody::{FootTarget, WholeBodyReference};

/// References of one tick: the centre of mass from the pattern, the feet from the soles, the torso upright and facing where the feet do.
#[must_use]
pub fn reference(pattern: &Reference, feet: [FootTarget; 2]) -> WholeBodyReference {
    let heading = pattern.body_heading();
    WholeBodyReference {
        com_position: pattern.com_position(),
        com_velocity: pattern.com_velocity(),
        com_acceleration: pattern.com_acceleration(),
        feet,
        torso_rotation: so3::about_z(heading.value),
        torso_angular_velocity: Vec3::new(0.0, 0.0, heading.rate),
        torso_angular_acceleration: Vec3::new(0.0, 0.0, heading.acceleration),
    }
}
