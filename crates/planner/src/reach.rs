//! Whether the robot's legs can follow a walk.

use gait::{LegClearance, LegReach};
use multibody::leg::{LegError, LegKinematics};
use multibody::{Configuration, JointIndex, Limits, Model, Workspace};
use pattern::Side;
use robot::Robot;
use robot_model::{RobotModelError, leg_joints, walking_model};
use spatial::{Transform, Vec3, so3};

/// Both legs of a robot: inverse kinematics and joint limits. The body is upright and stands to the centre of
/// mass as it does at half-sitting; walking moves the centre of mass in the body by about a centimetre.
#[derive(Debug, Clone)]
pub struct RobotLegs {
    legs: [LegKinematics; 2],
    /// Joint angles at half-sitting (rad), near which walking is.
    half_sitting_rad: [[f64; 6]; 2],
    names: [[String; 6]; 2],
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
    /// No inverse kinematics holds for one.
    #[error("the {side} leg has no inverse kinematics")]
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
            let kinematics = LegKinematics::of_model(&model, &joints, ankle);
            let kinematics = kinematics.map_err(|source| LegsError::Leg { side, source })?;
            Ok::<_, LegsError>((kinematics, joints.map(|joint| model.joints()[joint.0].limits)))
        };
        let (left, right) = (leg(0, "left")?, leg(1, "right")?);
        Ok(Self {
            legs: [left.0, right.0],
            limits: [left.1, right.1],
            half_sitting_rad: names
                .each_ref()
                .map(|leg| leg.each_ref().map(|name| robot.description.half_sitting_rad(name))),
            names,
            base_from_com: -com_in_base(&model, robot),
            mass_kg: model.total_mass_kg(),
        })
    }

    /// Name of a leg's joint, counted from the hip.
    #[must_use]
    pub fn joint_name(&self, leg: Side, joint: usize) -> &str {
        &self.names[leg.index()][joint]
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
    let com = multibody::forward_kinematics(model, &mut workspace, &q).center_of_mass() - q.base.translation;
    Vec3::new(com.x, 0.0, com.z)
}

impl LegReach for RobotLegs {
    fn clearance(&self, leg: Side, com: &Vec3, heading_rad: f64, ankle: &Transform) -> LegClearance {
        let heading = so3::about_z(heading_rad);
        let base = Transform::new(heading, com + heading * self.base_from_com);
        let kinematics = &self.legs[leg.index()];
        let X_BF = base.inverse() * *ankle;
        let found = kinematics.inverse(&X_BF, &self.half_sitting_rad[leg.index()]);
        let limits = &self.limits[leg.index()];
        let distance = (X_BF.translation - kinematics.hip_in_base()).norm();
        // With the knee at its lower limit the leg is as long as it may get.
        let extension_m = kinematics.length_m(limits[3].lower.max(0.0)) - distance;
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

#[cfg(test)]
mod tests {
    use super::*;
    use multibody::FrameIndex;
    use std::path::Path;

    /// The robot that ships, with the means to stand it up by joint angles.
    struct Standing {
        robot: Robot,
        model: Model,
        joints: [[JointIndex; 6]; 2],
        ankles: [FrameIndex; 2],
    }

    fn standing() -> Standing {
        let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4")).expect("it ships");
        let (model, _) = walking_model(&robot).expect("it ships");
        let names = leg_joints(&robot).expect("it ships");
        let joints = names.each_ref().map(|leg| std::array::from_fn(|i| model.joint(&leg[i]).expect("a joint")));
        let ankles = [0, 1].map(|foot| model.frame(&robot.description.feet[foot].ankle_frame).expect("a frame"));
        Standing { robot, model, joints, ankles }
    }

    impl Standing {
        /// Ankle and the centre of mass that goes with the base, the base upright with a heading somewhere, the leg bent by `angles`.
        fn by_forward_kinematics(&self, leg: Side, angles: &[f64; 6], heading_rad: f64) -> (Transform, Vec3) {
            let mut q: Configuration = self.model.neutral();
            q.base = Transform::new(so3::about_z(heading_rad), Vec3::new(0.3, -1.2, 0.8));
            for (joint, angle) in self.joints[leg.index()].iter().zip(angles) {
                q.joints[joint.0] = *angle;
            }
            let mut workspace = Workspace::new(&self.model);
            let placed = multibody::forward_kinematics(&self.model, &mut workspace, &q);
            let com = q.base.translation + q.base.rotation * com_in_base(&self.model, &self.robot);
            (placed.pose(self.ankles[leg.index()]), com)
        }
    }

    /// Joint angles within and beyond their limits, through forward kinematics and back: the room is that of the worst joint.
    #[test]
    fn the_room_of_a_leg_is_that_of_the_joints_that_put_it_there() {
        let standing = standing();
        let legs = RobotLegs::new(&standing.robot).expect("it ships");
        for leg in Side::BOTH {
            let limits = legs.limits[leg.index()];
            for sample in 1..=500_u32 {
                // Weyl's sequence over ranges that are a tenth wider on each side; the knee stays bent, its other solution mirrors it.
                let share =
                    |joint: usize| (f64::from(sample) * [2.0_f64, 3.0, 5.0, 7.0, 11.0, 13.0][joint].sqrt()).fract();
                let angles: [f64; 6] = std::array::from_fn(|joint| {
                    let (lower, upper) = (limits[joint].lower, limits[joint].upper);
                    let beyond = if joint == 3 { 0.0 } else { 0.1 * (upper - lower) };
                    lower.max(if joint == 3 { 0.02 } else { lower }) - beyond + (upper - lower + beyond) * share(joint)
                });
                let rooms = [0, 1, 2, 3, 4, 5].map(|j| (angles[j] - limits[j].lower).min(limits[j].upper - angles[j]));
                let worst = (0..6).min_by(|a, b| rooms[*a].total_cmp(&rooms[*b])).expect("six");
                let heading_rad = 6.0 * share(0) - 3.0;
                let (ankle, com) = standing.by_forward_kinematics(leg, &angles, heading_rad);
                let found = legs.clearance(leg, &com, heading_rad, &ankle);
                let message = format!("{leg:?} {angles:?}: {found:?}, {rooms:?}");
                assert!((found.joint_rad - rooms[worst]).abs() < 1e-9 && found.joint == worst, "{message}");
                // As far as the ankle is from the hip, so much shorter than stretched it is.
                assert!(found.extension_m > 0.0, "{message}");
            }
        }
    }

    #[test]
    fn a_leg_with_its_knee_at_the_limit_is_as_long_as_it_gets() {
        let standing = standing();
        let legs = RobotLegs::new(&standing.robot).expect("it ships");
        for leg in Side::BOTH {
            let straightest = legs.limits[leg.index()][3].lower.max(0.0);
            for (knee, shorter_m) in [(straightest, 0.0), (straightest + 1.0, 0.05)] {
                let (ankle, com) = standing.by_forward_kinematics(leg, &[0.1, -0.05, -0.4, knee, 0.2, 0.03], 0.7);
                let found = legs.clearance(leg, &com, 0.7, &ankle).extension_m;
                assert!(
                    if shorter_m == 0.0 { found.abs() < 1e-12 } else { found > shorter_m },
                    "{leg:?} {knee}: {found}"
                );
                // A COM that much higher takes the hip away along the leg, or nearly so.
                let lifted = legs.clearance(leg, &(com + Vec3::new(0.0, 0.0, 0.01)), 0.7, &ankle).extension_m;
                assert!((0.005..=0.01).contains(&(found - lifted)), "{leg:?}: {lifted} after {found}");
            }
        }
    }
}
