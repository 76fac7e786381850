//! How a URDF becomes a model.

use spatial::Vec3;

/// What the root link is attached to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Base {
    /// Nothing: six degrees of freedom.
    #[default]
    Floating,
    /// The world: the base pose in [`Configuration`](crate::Configuration) says where, and does not move.
    Fixed,
}

/// What to do with links that no real body can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InertiaCheck {
    /// Refuse the robot, naming the link.
    #[default]
    Strict,
    /// Accept the robot, and list such links in [`Model::impossible_links`](crate::Model::impossible_links), as long as every *body* (a link with all that
    /// is fixed to it) has positive principal moments, so that M stays positive definite. Every fourth public URDF needs
    /// this: placeholders on massless sensor links, misplaced digits.
    Tolerant,
}

/// How a URDF becomes a [`Model`](crate::Model).
#[derive(Debug, Clone, PartialEq)]
pub struct ModelOptions {
    /// What the root link is attached to.
    pub base: Base,
    /// Joints that this scene does not move, with the position (rad, m) at which they are merged into their parents. A joint
    /// that mimics a locked one is locked with it, at `multiplier * position + offset`, unless it is listed itself.
    pub locked_joints: Vec<(String, f64)>,
    /// Acceleration of free fall (m/s^2), world axes.
    pub gravity: Vec3,
    /// What to do with links that no real body can be.
    pub inertia: InertiaCheck,
}

impl Default for ModelOptions {
    fn default() -> Self {
        Self {
            base: Base::Floating,
            locked_joints: Vec::new(),
            gravity: Vec3::new(0.0, 0.0, -9.81),
            inertia: InertiaCheck::default(),
        }
    }
}
