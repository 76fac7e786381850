//! Spatial algebra in world axes about the origin O of the base.
//!
//! Here a composite is a plain sum, so these types have `+=` and nothing transforms them.

use spatial::{Inertia, Mat3, Transform, Twist, Vec3, Wrench};

/// Inertia of one or several bodies about O: momentum = inertia * twist.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RigidInertia {
    /// Mass (kg).
    pub mass: f64,
    /// Mass times the position of the centre of mass (kg m).
    pub first_moment: Vec3,
    /// Rotational inertia about O (kg m^2).
    pub about_origin: Mat3,
}

impl RigidInertia {
    pub const ZERO: Self = Self {
        mass: 0.0,
        first_moment: Vec3::new(0.0, 0.0, 0.0),
        about_origin: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// Of a body whose frame is at `X_OB` (world axes, measured from O).
    pub fn of(inertia: &Inertia, X_OB: &Transform) -> Self {
        let placed = inertia.seen_from(X_OB);
        Self { mass: placed.mass_kg, first_moment: placed.mass_kg * placed.com, about_origin: placed.about_origin() }
    }

    /// Momentum of a body that moves with a twist; also force of an acceleration.
    pub fn apply(&self, v: &Twist) -> Wrench {
        Wrench {
            force: self.mass * v.linear + v.angular.cross(&self.first_moment),
            moment: self.about_origin * v.angular + self.first_moment.cross(&v.linear),
        }
    }

    pub fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.first_moment += other.first_moment;
        self.about_origin += other.about_origin;
    }
}

/// `V x S`: how the column `S` of a body turns that moves with `V` (Featherstone's `crm`).
pub(crate) fn cross_motion(v: &Twist, s: &Twist) -> Twist {
    Twist { linear: v.angular.cross(&s.linear) + v.linear.cross(&s.angular), angular: v.angular.cross(&s.angular) }
}

/// `V x* F`: how the momentum `F` of a body turns that moves with `V` (Featherstone's `crf`).
pub(crate) fn cross_force(v: &Twist, f: &Wrench) -> Wrench {
    Wrench { force: v.angular.cross(&f.force), moment: v.angular.cross(&f.moment) + v.linear.cross(&f.force) }
}

/// `s * factor`.
pub(crate) fn scaled(s: &Twist, factor: f64) -> Twist {
    Twist { linear: s.linear * factor, angular: s.angular * factor }
}

/// `a + b`.
pub(crate) fn sum(a: &Twist, b: &Twist) -> Twist {
    Twist { linear: a.linear + b.linear, angular: a.angular + b.angular }
}
