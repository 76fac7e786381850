//! When a run counts as fallen.

use multibody::{FrameIndex, Model, Placed};
use sole::Ground;

use crate::settings::FallSettings;

/// How a robot fell.
#[derive(Debug, Clone, PartialEq)]
pub struct Fall {
    /// When, in time since the robot was placed (s).
    pub t_s: f64,
    /// What was seen first.
    pub reason: FallReason,
}

/// What makes a fall.
#[derive(Debug, Clone, PartialEq)]
pub enum FallReason {
    /// The base came too low: its height above the ground (m).
    BaseLow(f64),
    /// The base tilted too far: angle of its z axis to the vertical (rad).
    Tilted(f64),
    /// A link other than the feet came to the ground: its name, and the height of its origin above the ground (m).
    LinkLow(String, f64),
    /// The state is no longer finite.
    NotFinite,
}

impl std::fmt::Display for FallReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::BaseLow(height_m) => write!(f, "the base is only {height_m:.3} m above the ground"),
            Self::Tilted(angle_rad) => write!(f, "the base is tilted by {:.1} degrees", angle_rad.to_degrees()),
            Self::LinkLow(name, height_m) => write!(f, "link {name} is only {height_m:.3} m above the ground"),
            Self::NotFinite => write!(f, "the simulated state is no longer finite"),
        }
    }
}

/// Looks for a fall; `links` are the frames that must stay above the ground.
pub(crate) fn detect(
    settings: &FallSettings,
    model: &Model,
    placed: &Placed<'_>,
    links: &[FrameIndex],
    ground: &dyn Ground,
) -> Option<FallReason> {
    let base = placed.pose(model.base_frame());
    if !base.translation.iter().chain(base.rotation.iter()).all(|x| x.is_finite()) {
        return Some(FallReason::NotFinite);
    }
    let above_ground = |p: &spatial::Vec3| p.z - ground.height_and_normal(p.x, p.y).0;
    let height_m = above_ground(&base.translation);
    if height_m < settings.base_height_min_m {
        return Some(FallReason::BaseLow(height_m));
    }
    let tilt_rad = base.rotation[(2, 2)].clamp(-1.0, 1.0).acos();
    if tilt_rad > settings.tilt_max_rad {
        return Some(FallReason::Tilted(tilt_rad));
    }
    links.iter().find_map(|&link| {
        let height_m = above_ground(&placed.pose(link).translation);
        (height_m < settings.link_height_min_m)
            .then(|| FallReason::LinkLow(model.frames()[link.0].name.clone(), height_m))
    })
}
