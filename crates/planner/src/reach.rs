//! Whether the robot's legs can follow a walk.

use gait::{LegClearance, LegReach};
use multibody::leg::{LegError, LegGeometry};
use multibody::{Configuration, JointIndex, Limits, Model, Workspace};
use pattern::Side;
use robot::Robot;
use robot_model::{RobotModelError, leg_joints, walking_model};
use spatial::{Transform, Vec3, so3};

/// Both legs of a robot: closed-form inverse kinematics and joint limits. The body is upright and stands to the centre of
/// mass as it does at half-sitting; walking moves the centre of mass in the body by about a centimetre.
#[derive(Debug, Clone)]
pub struct RobotLegs {
    legs: [LegGeometry; 2],
    limits: [[Limits; 6]; 2],
    base_from_com: Vec3,
    mass_kg: f64,
}

/// Why the legs are not known.
#[derive(Debug, thiserror::Error)]
pub enum LegsError {
    /// The robot's folder makes no model.
    #[error(transparent)]
    Model(#[from] RobotModelError),
    /// The closed form does not hold.
    #[error("the {side} leg has no closed-form inverse kinematics")]
    Leg {
        /// Which leg.
        side: &'static str,
        /// What is wrong with it.
        source: LegError,
    },
}

impl RobotLegs {
    /// The legs of a robot's folder.
    ///
    /// # Errors
    /// [`LegsError`] names leg, joint or group.
    pub fn new(robot: &Robot) -> Result<Self, LegsError> {
        let (model, _) = walking_model(robot)?;
        let names = leg_joints(robot)?;
        let unknown = |source| RobotModelError::unknown(robot, source);
        let leg = |foot: usize, side| {
            let mut joints = [JointIndex(0); 6];
            for (joint, name) in joints.iter_mut().zip(&names[foot]) {
                *joint = model.joint(name).map_err(unknown)?;
            }
            let ankle = model.frame(&robot.description.feet[foot].ankle_frame).map_err(unknown)?;
            let geometry = LegGeometry::of_model(&model, &joints, ankle);
            let geometry = geometry.map_err(|source| LegsError::Leg { side, source })?;
            Ok::<_, LegsError>((geometry, joints.map(|joint| model.joints()[joint.0].limits)))
        };
        let (left, right) = (leg(0, "left")?, leg(1, "right")?);
        Ok(Self {
            legs: [left.0, right.0],
            limits: [left.1, right.1],
            base_from_com: -com_in_base(&model, robot),
            mass_kg: model.total_mass_kg(),
        })
    }

    /// Mass of the whole robot (kg).
    #[must_use]
    pub fn mass_kg(&self) -> f64 {
        self.mass_kg
    }
}

/// Centre of mass at half-sitting, from the base (m); without its sideways part, which stands for an uneven stance.
fn com_in_base(model: &Model, robot: &Robot) -> Vec3 {
    let mut q: Configuration = model.neutral();
    for (position, joint) in q.joints.iter_mut().zip(model.joints()) {
        *position = robot.description.half_sitting_rad(&joint.name);
    }
    let mut workspace = Workspace::new(model);
    multibody::forward_kinematics(model, &mut workspace, &q);
    let com = multibody::center_of_mass(model, &workspace) - q.base.translation;
    Vec3::new(com.x, 0.0, com.z)
}

impl LegReach for RobotLegs {
    fn clearance(&self, leg: Side, com: &Vec3, heading_rad: f64, ankle: &Transform) -> LegClearance {
        let heading = so3::about_z(heading_rad);
        let base = Transform::new(heading, com + heading * self.base_from_com);
        let geometry = &self.legs[leg.index()];
        let X_BF = base.inverse() * *ankle;
        let found = geometry.inverse(&X_BF);
        let limits = &self.limits[leg.index()];
        // With the knee at its lower limit the leg is as long as it may get.
        let stretched = |knee: f64| {
            let knee_to_hip = Vec3::new(0.0, geometry.knee_offset_m, -geometry.thigh_m);
            (knee_to_hip + so3::about_y(knee) * Vec3::new(0.0, 0.0, -geometry.shank_m)).norm()
        };
        let distance = (X_BF.translation - geometry.hip_in_base).norm();
        let extension_m = stretched(limits[3].lower.max(0.0)) - distance;
        let room = |joint: usize| {
            let angle = found.joints_rad[joint];
            (angle - limits[joint].lower).min(limits[joint].upper - angle)
        };
        // A joint without an angle has less room than any other.
        let order = |joint: usize| if room(joint).is_nan() { f64::NEG_INFINITY } else { room(joint) };
        let joint = (0..6).min_by(|a, b| order(*a).total_cmp(&order(*b))).expect("a leg has six joints");
        LegClearance { extension_m, joint_rad: room(joint), joint }
    }
}
