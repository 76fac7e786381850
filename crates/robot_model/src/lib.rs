//! A robot's folder as the rigid-body model of a walking scene: what planner, controller and simulator build at start.
//!
//! Joints that walking does not move (`walking_locked` in `robot.toml`) are merged into their parents at half-sitting; a
//! [`JointMap`] says where the others are in the robot's interface. Joints with `<mimic>` move with their leaders and are no
//! part of the interface.

#![allow(non_snake_case)] // monogram notation, see the style guide

mod draft;

pub use draft::{Draft, DraftError, MODEL_MASS_KG, draft};
pub use multibody::Motion;

use multibody::{CarriedJoint, HeldLink, Model, ModelError, ModelOptions, carried_joints, held_links};
use robot::{JointMap, Robot};
use std::path::PathBuf;

/// Why a robot's folder makes no model.
#[derive(Debug, thiserror::Error)]
pub enum RobotModelError {
    /// The URDF.
    #[error("{}: no robot that can be computed", .file.display())]
    Model {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        source: Box<ModelError>,
    },
    /// The description names what the URDF does not have.
    #[error("{}: a name that the URDF does not know", .file.display())]
    Name {
        /// The description.
        file: PathBuf,
        /// Which, and the nearest known one.
        source: Box<ModelError>,
    },
    /// The description lists a joint that cannot move or does not exist. Remedy: correct its name or remove it.
    #[error("{}: `joints` lists what is no movable joint of the URDF", .file.display())]
    NotMovable {
        /// The description.
        file: PathBuf,
        /// Which, and the nearest movable one.
        source: Box<ModelError>,
    },
    /// The floating base is another link than the description says. Remedy: correct `base_link`.
    #[error("{}: base_link = \"{found}\", but the root of the URDF is `{root}`; change one of them", .file.display())]
    Base {
        /// The description.
        file: PathBuf,
        /// What it says.
        found: String,
        /// The link without a parent joint.
        root: String,
    },
    /// A movable joint of the URDF is missing in the description.
    #[error("{}: `joints` lacks `{joint}`, a movable joint of the URDF; add it or make it fixed", .file.display())]
    Joints {
        /// The description.
        file: PathBuf,
        /// The joint.
        joint: String,
    },
    /// A joint that another one carries along (`<mimic>`) is listed as one of the interface: it has no drive, position or
    /// torque of its own to be told or reported.
    #[error(
        "{}: `joints` lists `{joint}`, which follows {} in the URDF and is not driven; remove it",
        .file.display(), .leader.as_ref().map_or("a joint that cannot move".to_owned(), |leader| format!("`{leader}`"))
    )]
    Follower {
        /// The description.
        file: PathBuf,
        /// The joint.
        joint: String,
        /// The joint that it follows, if that can move.
        leader: Option<String>,
    },
    /// A leg's joints are not listed.
    #[error("{}: groups.{group} must name the six joints of the leg from the hip; the fourth is the knee", .file.display())]
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
        Self::Name { file: description(robot), source: Box::new(source) }
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
    let locked_joints = robot.description.walking_locked_joints();
    let options = ModelOptions { locked_joints, ..ModelOptions::default() };
    let model = Model::from_urdf(&robot.urdf, &options).map_err(|source| unreadable(robot, source))?;
    let root = &model.frames()[model.base_frame().0].name;
    if *root != robot.description.base_link {
        let (found, root) = (robot.description.base_link.clone(), root.clone());
        return Err(RobotModelError::Base { file: description(robot), found, root });
    }
    followers(robot)?;
    // Locked ones are no joints of the model any more; that the URDF has them was seen when they were locked.
    let is_locked = |name: &String| options.locked_joints.iter().any(|(locked, _)| locked == name);
    for name in robot.description.joints.iter().filter(|name| !is_locked(name)) {
        let not_movable = |source| RobotModelError::NotMovable { file: description(robot), source: Box::new(source) };
        model.joint(name).map_err(not_movable)?;
    }
    let listed = |name: &str| robot.description.joints.iter().any(|joint| joint == name);
    if let Some(joint) = model.joints().iter().find(|joint| !listed(&joint.name)) {
        return Err(RobotModelError::Joints { file: description(robot), joint: joint.name.clone() });
    }
    let names = model.joints().iter().map(|joint| joint.name.as_str());
    let map = JointMap::new(&robot.description, names).expect("every joint of the model is listed");
    Ok((model, map))
}

/// A joint that another one carries along (`<mimic>`): it is at `multiplier * leader + offset` and is none of the interface.
#[derive(Debug, Clone, PartialEq)]
pub struct Follower {
    /// Name in the URDF.
    pub name: String,
    /// Which joint of the interface carries it; `None` if nothing does: then it stays at its offset.
    pub leader: Option<usize>,
    /// Its motion over the leader's.
    pub multiplier: f64,
    /// Its position (rad, m) when the leader is at zero.
    pub offset: f64,
}

/// All joints of a robot that follow others, also those that a walking scene does not move: what a picture of the robot needs
/// beside the joints of its interface.
///
/// # Errors
/// [`RobotModelError::Follower`] if the description lists one of them, [`RobotModelError::Joints`] if it lacks a leader.
pub fn followers(robot: &Robot) -> Result<Vec<Follower>, RobotModelError> {
    let carried = carried_joints(&robot.urdf).map_err(|source| unreadable(robot, source))?;
    let listed = |name: &str| robot.description.joints.iter().position(|joint| joint == name);
    let follower = |CarriedJoint { name, leader, multiplier, offset }| {
        if listed(&name).is_some() {
            return Err(RobotModelError::Follower { file: description(robot), joint: name, leader });
        }
        let leader = leader
            .map(|joint| listed(&joint).ok_or(RobotModelError::Joints { file: description(robot), joint }))
            .transpose()?;
        Ok(Follower { name, leader, multiplier, offset })
    };
    carried.into_iter().map(follower).collect()
}

/// A link of the robot's picture and where it is held: at `position_m`, `rotation` (row-major) in its parent, moved
/// about or along `axis`.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnLink {
    /// Its name.
    pub name: String,
    /// The link that holds it.
    pub parent: String,
    /// Name of the joint between them.
    pub joint: String,
    /// Origin of the joint's frame in the parent.
    pub position_m: [f64; 3],
    /// Its rotation, row-major.
    pub rotation: [f64; 9],
    /// Unit vector in the joint's frame.
    pub axis: [f64; 3],
    /// How it moves.
    pub motion: Motion,
}

/// All links of a robot but its floating base.
///
/// # Errors
/// [`RobotModelError::Model`] if the URDF cannot be read.
pub fn drawn_links(robot: &Robot) -> Result<Vec<DrawnLink>, RobotModelError> {
    let (_, links) = held_links(&robot.urdf).map_err(|source| unreadable(robot, source))?;
    let drawn = |HeldLink { name, parent, joint, X_PJ, axis, motion }| DrawnLink {
        name,
        parent,
        joint,
        position_m: X_PJ.translation.into(),
        rotation: std::array::from_fn(|k| X_PJ.rotation[(k / 3, k % 3)]),
        axis: axis.into(),
        motion,
    };
    Ok(links.into_iter().map(drawn).collect())
}

fn unreadable(robot: &Robot, source: ModelError) -> RobotModelError {
    RobotModelError::Model { file: robot.folder.join(&robot.description.urdf), source: Box::new(source) }
}

/// Names of the legs' joints, left and right, each from the hip; the fourth is the knee.
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
    fn locked_joints_rest_where_the_robot_half_sits() {
        let mut robot = hrp4();
        robot.description.half_sitting_deg.insert("NECK_P".to_owned(), 20.0);
        let (model, map) = walking_model(&robot).expect("it makes a model");
        let place = |name: &str| robot.description.joints.iter().position(|joint| joint == name).expect("a joint");
        assert_eq!(map.resting_rad()[place("NECK_P")], 20.0_f64.to_radians());
        assert_eq!(map.resting_rad()[place("R_HIP_P")], -22.02_f64.to_radians());
        // The model has the neck there, too: the head nods about the y axis.
        let mut workspace = multibody::Workspace::new(&model);
        let placed = multibody::forward_kinematics(&model, &mut workspace, &model.neutral());
        let head = placed.pose(model.frame("NECK_P_LINK").expect("a link")).rotation;
        assert!((head[(0, 2)] - 20.0_f64.to_radians().sin()).abs() < 1e-12, "{head}");
        assert!(model.joint("NECK_P").is_err() && model.joint("R_HIP_P").is_ok());
    }

    #[test]
    fn legs_are_left_then_right_from_the_hip() {
        let [left, right] = leg_joints(&hrp4()).expect("it has legs");
        assert_eq!((left[0].as_str(), left[5].as_str()), ("L_HIP_Y", "L_ANKLE_R"));
        assert_eq!((right[0].as_str(), right[3].as_str()), ("R_HIP_Y", "R_KNEE_P"));
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
    fn followers_are_known_whether_the_scene_moves_them_or_not() {
        let mut robot = hrp4();
        // The elbow walks along; the second hand joint is locked with the first, whose file says nothing of limits then.
        for (joint, mimic) in [
            ("R_ELBOW_P", r#"<mimic joint="L_ELBOW_P" multiplier="-1"/>"#),
            ("R_HAND_J1", r#"<mimic joint="R_HAND_J0" multiplier="0.5" offset="0.1"/>"#),
            ("L_HAND_J1", r#"<mimic joint="L_HAND_J0" multiplier="0" offset="0.2"/>"#),
        ] {
            let opening = format!(r#"<joint name="{joint}" type="revolute">"#);
            assert!(robot.urdf.contains(&opening), "{joint}");
            robot.urdf = robot.urdf.replacen(&opening, &format!("{opening}{mimic}"), 1);
            let listed = walking_model(&robot).expect_err("it is still listed");
            assert!(listed.to_string().contains(joint), "{listed}");
            robot.description.joints.retain(|listed| listed != joint);
            robot.description.groups.values_mut().for_each(|group| group.retain(|member| member != joint));
        }
        let (model, map) = walking_model(&robot).expect("none of them is listed any more");
        let moved: Vec<&str> = model.followers().iter().map(|follower| follower.name.as_str()).collect();
        assert_eq!((moved, map.interface_count()), (vec!["R_ELBOW_P"], 31));
        let mut found = followers(&robot).expect("three");
        found.sort_by(|a, b| a.name.cmp(&b.name));
        let index = |name: &str| robot.description.joints.iter().position(|joint| joint == name);
        let follower =
            |name: &str, leader, multiplier, offset| Follower { name: name.to_owned(), leader, multiplier, offset };
        let expected = [
            follower("L_HAND_J1", None, 0.0, 0.2),
            follower("R_ELBOW_P", index("L_ELBOW_P"), -1.0, 0.0),
            follower("R_HAND_J1", index("R_HAND_J0"), 0.5, 0.1),
        ];
        assert_eq!(found, expected);
        assert_eq!(followers(&hrp4()).expect("none"), []);
        robot.description.joints.retain(|listed| listed != "L_ELBOW_P");
        assert!(matches!(followers(&robot), Err(RobotModelError::Joints { joint, .. }) if joint == "L_ELBOW_P"));
    }

    #[test]
    fn what_is_missing_is_named() {
        let mut robot = hrp4();
        robot.description.joints.retain(|joint| joint != "L_KNEE_P");
        assert!(matches!(walking_model(&robot), Err(RobotModelError::Joints { joint, .. }) if joint == "L_KNEE_P"));
        let mut robot = hrp4();
        robot.description.joints.push("L_KNEE_Y".to_owned());
        let error = walking_model(&robot).expect_err("the URDF has no such joint");
        let cause = std::error::Error::source(&error).expect("which").to_string();
        assert!(
            error.to_string().ends_with("robot.toml: `joints` lists what is no movable joint of the URDF"),
            "{error}"
        );
        assert_eq!(cause, "there is no joint `L_KNEE_Y`; did you mean `L_KNEE_P`?");
        let mut robot = hrp4();
        let elbow = r#"<joint name="R_ELBOW_P" type="#;
        robot.urdf = robot.urdf.replacen(&format!("{elbow}\"revolute\""), &format!("{elbow}\"fixed\""), 1);
        let error = walking_model(&robot).expect_err("it is fixed now");
        assert!(
            matches!(&error, RobotModelError::NotMovable { source, .. } if source.to_string().contains("R_ELBOW_P"))
        );
        let mut robot = hrp4();
        robot.description.base_link = "torso".to_owned();
        let error = walking_model(&robot).expect_err("the pelvis is the root").to_string();
        assert!(
            error
                .ends_with("robot.toml: base_link = \"torso\", but the root of the URDF is `body`; change one of them"),
            "{error}"
        );
        let mut robot = hrp4();
        robot.description.groups.remove("left_leg");
        assert!(matches!(leg_joints(&robot), Err(RobotModelError::Group { group: "left_leg", .. })));
        let mut robot = hrp4();
        robot.description.groups.entry("right_leg".to_owned()).and_modify(|leg| drop(leg.pop()));
        let error = leg_joints(&robot).expect_err("five joints").to_string();
        assert!(error.contains("robot.toml: groups.right_leg must name the six joints"), "{error}");
        let mut robot = hrp4();
        robot.urdf = robot.urdf.replacen("<link name=\"body\">", "<link name=\"torso\">", 1);
        let error = walking_model(&robot).expect_err("two links of one name");
        let cause = std::error::Error::source(&error).expect("what is wrong with the URDF").to_string();
        assert!(error.to_string().ends_with("hrp4.urdf: no robot that can be computed"), "once is enough: {error}");
        assert!(cause.contains("torso"), "{cause}");
        let unknown = RobotModelError::unknown(&robot, ModelError::NoMass);
        assert!(unknown.to_string().ends_with("robot.toml: a name that the URDF does not know"), "{unknown}");
    }
}
