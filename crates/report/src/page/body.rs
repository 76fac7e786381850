//! The robot as it is drawn: links with simple shapes, from the URDF in the recording.

use super::geometry::{of_rpy, rotated};
use serde::Serialize;
use std::collections::BTreeMap;
use urdf_rs::{Geometry, JointType, Pose};

/// A sole of the paper's size, for recordings that do not say theirs (m).
const SOLE_SIZE_M: [f64; 3] = [0.23, 0.13, 0.021];

/// What a link looks like and how it hangs on another.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Link {
    name: String,
    /// Index of the parent; -1 for the root.
    parent: i32,
    position: [f64; 3],
    quaternion: [f64; 4],
    axis: [f64; 3],
    /// Index of the joint that moves it among the messages'; -1: none.
    joint: i32,
    slides: bool,
    multiplier: f64,
    offset: f64,
    shapes: Vec<Shape>,
}

#[derive(Debug, Clone, Serialize)]
struct Shape {
    kind: &'static str,
    size: Vec<f64>,
    position: [f64; 3],
    quaternion: [f64; 4],
    color: [f64; 3],
}

/// The robot.
#[derive(Debug, Clone, Default)]
pub(super) struct Body {
    /// Parents before their children; empty if there is no URDF that can be read.
    pub links: Vec<Link>,
    /// Names of the joints in the order of the messages.
    pub joints: Vec<String>,
    /// Largest torque of each (N m).
    pub effort_nm: Vec<f64>,
    pub sole_size_m: [f64; 3],
}

impl Body {
    /// From a recording's files. What is missing or cannot be read is not drawn.
    pub fn read(files: &[(String, Vec<u8>)]) -> Self {
        let text = |name: &str| {
            let found = files.iter().find(|(file, _)| file == name);
            found.map(|(_, content)| String::from_utf8_lossy(content).into_owned())
        };
        let robot: toml::Table = text("robot/robot.toml").and_then(|text| text.parse().ok()).unwrap_or_default();
        let joints: Vec<String> = robot
            .get("joints")
            .and_then(toml::Value::as_array)
            .map(|joints| joints.iter().filter_map(|joint| joint.as_str().map(str::to_string)).collect())
            .unwrap_or_default();
        let urdf = robot.get("urdf").and_then(toml::Value::as_str).map(|name| format!("robot/{name}"));
        let urdf = urdf.and_then(|name| text(&name)).and_then(|text| urdf_rs::read_from_string(&text).ok());
        let mut body = Self { sole_size_m: sole_size_m(files).unwrap_or(SOLE_SIZE_M), ..Self::default() };
        if let Some(urdf) = urdf {
            let effort = |name: &String| {
                urdf.joints.iter().find(|joint| joint.name == *name).map_or(f64::NAN, |joint| joint.limit.effort)
            };
            body.effort_nm = joints.iter().map(effort).collect();
            body.links = links(&urdf, &joints);
        }
        body.joints = joints;
        body
    }

    /// Corners of a sole's outline on the ground plan.
    pub fn sole_corners(&self, position: &[f64; 3], rotation: &[f64; 9]) -> [[f64; 2]; 4] {
        let [length, width, _] = self.sole_size_m;
        [(0.5, 0.5), (0.5, -0.5), (-0.5, -0.5), (-0.5, 0.5)].map(|(x, y)| {
            let corner = rotated(rotation, [x * length, y * width, 0.0]);
            [position[0] + corner[0], position[1] + corner[1]]
        })
    }
}

/// Size of the sole: that of its own file, else of the robot's.
fn sole_size_m(files: &[(String, Vec<u8>)]) -> Option<[f64; 3]> {
    let mut candidates: Vec<_> = files.iter().filter(|(name, _)| name.ends_with(".toml")).collect();
    candidates.retain(|(name, _)| name.starts_with("sole/") || name == "robot/sole.toml");
    candidates.sort_by_key(|(name, _)| !name.starts_with("sole/"));
    candidates.iter().find_map(|(_, content)| {
        let table: toml::Table = String::from_utf8_lossy(content).parse().ok()?;
        let size: Vec<f64> = table.get("mesh")?.get("box_m")?.as_array()?.iter().filter_map(number).collect();
        size.try_into().ok().filter(|size: &[f64; 3]| size.iter().all(|edge| (1e-3..=10.0).contains(edge)))
    })
}

fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|integer| integer as f64))
}

fn links(urdf: &urdf_rs::Robot, joints: &[String]) -> Vec<Link> {
    let materials: BTreeMap<&str, [f64; 3]> = urdf
        .materials
        .iter()
        .filter_map(|material| material.color.as_ref().map(|color| (material.name.as_str(), rgb(color))))
        .collect();
    let above = |name: &str| urdf.joints.iter().find(|joint| joint.child.link == name);
    let index_of = |name: &str| joints.iter().position(|joint| joint == name);
    let mut links: Vec<Link> = Vec::new();
    let mut waiting: Vec<&urdf_rs::Link> = urdf.links.iter().collect();
    // Parents first; what hangs on nothing that is there is left out.
    loop {
        let before = waiting.len();
        waiting.retain(|link| {
            let joint = above(&link.name);
            let parent = joint.map(|joint| links.iter().position(|known| known.name == joint.parent.link));
            let (parent, pose) = match (parent, joint) {
                (None, _) => (-1, Pose::default()),
                (Some(Some(parent)), Some(joint)) => (parent as i32, joint.origin.clone()),
                _ => return true,
            };
            let moves = joint.filter(|joint| joint.joint_type != JointType::Fixed);
            let mimic = moves.and_then(|joint| joint.mimic.as_ref());
            let leader =
                mimic.map_or_else(|| moves.map(|joint| joint.name.as_str()), |mimic| Some(mimic.joint.as_str()));
            links.push(Link {
                name: link.name.clone(),
                parent,
                position: *pose.xyz,
                quaternion: of_rpy(*pose.rpy),
                axis: moves.map_or([0.0, 0.0, 1.0], |joint| *joint.axis.xyz),
                joint: leader.and_then(index_of).map_or(-1, |joint| joint as i32),
                slides: moves.is_some_and(|joint| joint.joint_type == JointType::Prismatic),
                multiplier: mimic.and_then(|mimic| mimic.multiplier).unwrap_or(1.0),
                offset: mimic.and_then(|mimic| mimic.offset).unwrap_or(0.0),
                shapes: shapes(link, &materials),
            });
            false
        });
        if waiting.is_empty() || waiting.len() == before {
            return links;
        }
    }
}

/// The simple shapes of what is to be seen; where that is meshes, those of what is to be touched.
fn shapes(link: &urdf_rs::Link, materials: &BTreeMap<&str, [f64; 3]>) -> Vec<Shape> {
    const GREY: [f64; 3] = [0.7, 0.7, 0.72];
    let seen = link.visual.iter().filter_map(|visual| {
        let material = visual.material.as_ref();
        let own = material.and_then(|material| material.color.as_ref()).map(rgb);
        let color = own.or_else(|| material.and_then(|material| materials.get(material.name.as_str()).copied()));
        shape(&visual.geometry, &visual.origin, color.unwrap_or(GREY))
    });
    let seen: Vec<Shape> = seen.collect();
    if !seen.is_empty() {
        return seen;
    }
    link.collision.iter().filter_map(|collision| shape(&collision.geometry, &collision.origin, GREY)).collect()
}

fn shape(geometry: &Geometry, origin: &Pose, color: [f64; 3]) -> Option<Shape> {
    let (kind, size) = match geometry {
        Geometry::Box { size } => ("box", size.to_vec()),
        Geometry::Cylinder { radius, length } => ("cylinder", vec![*radius, *length]),
        Geometry::Capsule { radius, length } => ("capsule", vec![*radius, *length]),
        Geometry::Sphere { radius } => ("sphere", vec![*radius]),
        Geometry::Mesh { .. } => return None,
    };
    Some(Shape { kind, size, position: *origin.xyz, quaternion: of_rpy(*origin.rpy), color })
}

fn rgb(color: &urdf_rs::Color) -> [f64; 3] {
    let [red, green, blue, _] = *color.rgba;
    [red, green, blue]
}
