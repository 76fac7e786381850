//! A robot's folder as the rigid-body model of a walking scene: what planner, controller and simulator build at start.
//!
//! Joints that walking does not move (`walking_locked` in `robot.toml`) are merged into their parents at half-sitting; a
//! [`JointMap`] says where the others are in the robot's interface. Joints with `<mimic>` move with their leaders and are no
//! part of the interface.

use multibody::{Model, ModelError, ModelOptions};
use robot::{JointMap, Robot};
use std::path::PathBuf;

/// Why a robot's folder makes no model.
#[derive(Debug, thiserror::Error)]
pub enum RobotModelError {
    /// The URDF, or a name that it does not know.
    #[error("{}: {source}", .file.display())]
    Model {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        source: Box<ModelError>,
    },
    /// A movable joint of the URDF is missing in the description.
    #[error("{}: `joints` lacks a movable joint of the URDF; add it or make it fixed", .file.display())]
    Joints {
        /// The description.
        file: PathBuf,
    },
    /// A joint that another one carries along (`<mimic>`) is listed as one of the interface: it has no drive, position or
    /// torque of its own to be told or reported.
    #[error("{}: `joints` lists `{joint}`, which follows `{leader}` in the URDF and is not driven; remove it", .file.display())]
    Follower {
        /// The description.
        file: PathBuf,
        /// The joint.
        joint: String,
        /// The joint that it follows.
        leader: String,
    },
    /// A leg's joints are not listed.
    #[error("{}: groups.{group} must name hip yaw, roll, pitch, knee, ankle pitch and roll", .file.display())]
    Group {
        /// The description.
        file: PathBuf,
        /// Which group.
        group: &'static str,
    },
}

impl RobotModelError {
    /// A name in `robot.toml` that the model does not know.
    #[must_use]
    pub fn unknown(robot: &Robot, source: ModelError) -> Self {
        Self::Model { file: description(robot), source: Box::new(source) }
    }
}

fn description(robot: &Robot) -> PathBuf {
    robot.folder.join("robot.toml")
}

/// The floating-base model with the joints that walking moves, and where they are in the robot's interface.
///
/// # Errors
/// [`RobotModelError`] names the file.
pub fn walking_model(robot: &Robot) -> Result<(Model, JointMap), RobotModelError> {
    let options = ModelOptions { locked_joints: robot.description.walking_locked_joints(), ..ModelOptions::default() };
    let model = Model::from_urdf(&robot.urdf, &options).map_err(|source| RobotModelError::Model {
        file: robot.folder.join(&robot.description.urdf),
        source: Box::new(source),
    })?;
    for follower in model.followers() {
        if robot.description.joints.contains(&follower.name) {
            let (joint, leader) = (follower.name.clone(), model.joints()[follower.joint.0].name.clone());
            return Err(RobotModelError::Follower { file: description(robot), joint, leader });
        }
    }
    let names = model.joints().iter().map(|joint| joint.name.as_str());
    let map =
        JointMap::new(&robot.description, names).ok_or_else(|| RobotModelError::Joints { file: description(robot) })?;
    Ok((model, map))
}

/// Names of the legs' joints, left and right, each from the hip: yaw, roll, pitch, knee, ankle pitch, ankle roll.
///
/// # Errors
/// [`RobotModelError::Group`].
pub fn leg_joints(robot: &Robot) -> Result<[[String; 6]; 2], RobotModelError> {
    let leg = |group: &'static str| {
        let joints =
            robot.description.groups.get(group).and_then(|joints| <[String; 6]>::try_from(joints.clone()).ok());
        joints.ok_or_else(|| RobotModelError::Group { file: description(robot), group })
    };
    Ok([leg("left_leg")?, leg("right_leg")?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn hrp4() -> Robot {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4");
        Robot::load(&folder).expect("the robot that ships can be read")
    }

    #[test]
    fn values_survive_the_way_to_the_interface_and_back() {
        let (model, map) = walking_model(&hrp4()).expect("the robot that ships makes a model");
        assert_eq!(map.interface_count(), 34);
        let wanted: Vec<f64> = (0..model.joint_count()).map(|joint| joint as f64 + 0.5).collect();
        let (mut interface, mut found) = (vec![f64::NAN; 34], vec![0.0; wanted.len()]);
        map.to_interface(&wanted, &mut interface);
        map.from_interface(&interface, &mut found);
        assert_eq!(found, wanted);
        let untouched = interface.iter().filter(|value| value.is_nan()).count();
        assert_eq!(untouched, 34 - model.joint_count());
    }

    #[test]
    fn a_joint_that_follows_another_one_is_moved_but_is_none_of_the_interface() {
        let mut robot = hrp4();
        let elbow = r#"<joint name="R_ELBOW_P" type="revolute">"#;
        robot.urdf = robot.urdf.replacen(elbow, &format!(r#"{elbow}<mimic joint="L_ELBOW_P"/>"#), 1);
        let listed = walking_model(&robot);
        assert!(matches!(&listed, Err(RobotModelError::Follower { joint, .. }) if joint == "R_ELBOW_P"), "{listed:?}");
        robot.description.joints.retain(|joint| joint != "R_ELBOW_P");
        let (model, map) = walking_model(&robot).expect("the elbow is not listed any more");
        assert_eq!((model.joint_count(), model.followers().len(), map.interface_count()), (21, 1, 33));
    }

    #[test]
    fn what_is_missing_is_named() {
        let mut robot = hrp4();
        robot.description.joints.retain(|joint| joint != "L_KNEE_P");
        assert!(matches!(walking_model(&robot), Err(RobotModelError::Joints { .. })));
        let mut robot = hrp4();
        robot.description.groups.remove("left_leg");
        assert!(matches!(leg_joints(&robot), Err(RobotModelError::Group { group: "left_leg", .. })));
        let mut robot = hrp4();
        robot.urdf = robot.urdf.replacen("<link name=\"body\">", "<link name=\"torso\">", 1);
        let error = walking_model(&robot).expect_err("two links of one name").to_string();
        assert!(error.contains("hrp4.urdf") && error.contains("torso"), "{error}");
    }
}
