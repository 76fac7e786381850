//! What the stabiliser is told of the walk.

use nalgebra::Vector2;
use spatial::{Transform, Vec3, Wrench};

/// The plan that comes with a command: what the robot should do at the command's time.
///
/// ZMP and wrenches should be those of the planned *whole-body* motion (what the whole-body controller computed), not of a
/// cart-table: the angular momentum of a swinging leg shifts the ZMP by about 1 cm, and a stabiliser that is told the cart-table's
/// takes the difference for a disturbance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Base pose `X_WB`.
    pub base: Transform,
    /// ZMP on the ground (m).
    pub zmp: Vector2<f64>,
    /// Centre of mass (m).
    pub com: Vec3,
    /// Its velocity (m/s).
    pub com_velocity: Vec3,
    /// Left and right foot.
    pub feet: [FootPlan; 2],
}

/// The plan of one foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootPlan {
    /// Stands on the ground.
    pub in_contact: bool,
    /// Share of the weight it carries, 0 to 1.
    pub load_share: f64,
    /// Force of the ground (N), world axes.
    pub force: Vec3,
    /// The foot's own ZMP on the ground (m).
    pub zmp: Vector2<f64>,
    /// Ankle pose `X_WA`, axes of the foot.
    pub ankle: Transform,
}

impl FootPlan {
    /// From the wrench of the ground about the ankle, world axes: the ZMP is where that wrench has no horizontal moment on the
    /// ground, `height_m` high. A foot without load has it below the ankle.
    #[must_use]
    pub fn of_wrench(in_contact: bool, load_share: f64, about_ankle: &Wrench, ankle: Transform, height_m: f64) -> Self {
        let zmp = about_ankle.zmp(&ankle.translation, height_m).unwrap_or(ankle.translation.xy());
        Self { in_contact, load_share, force: about_ankle.force, zmp, ankle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrench_about_the_ankle_is_a_force_at_a_zmp() {
        let ankle = Transform::from_translation(Vec3::new(0.1, 0.08, 0.103));
        let (force, zmp) = (Vec3::new(5.0, -8.0, 200.0), Vec3::new(0.12, 0.07, 0.0));
        let about_ankle = Wrench::of_force_at(&force, &zmp, &ankle.translation);
        let plan = FootPlan::of_wrench(true, 0.5, &about_ankle, ankle, 0.0);
        assert!((plan.zmp - zmp.xy()).norm() < 1e-15);
        assert_eq!(FootPlan::of_wrench(false, 0.0, &Wrench::zero(), ankle, 0.0).zmp, Vector2::new(0.1, 0.08));
    }
}
