//! What viewers show: transforms, joints, and a scene of soles, forces, centre of mass and zero-moment point.

use crate::ros;
use crate::wire::{VARINT, put_double, put_key, put_nested, put_text, put_time, put_varint};
use messages::{ContactNodes, SoleContact, Truth, from_row_major};
use spatial::{Wrench, so3};

/// Newtons that are drawn as long as a metre.
const FORCE_SCALE_N_PER_M: f64 = 1000.0;
/// Forces smaller than this are not drawn: the arrow would be shorter than a tenth of a millimetre.
const FORCE_MIN_N: f64 = 0.1;

const WHITE: [f64; 4] = [0.85, 0.85, 0.85, 0.8];
const BLUE: [f64; 4] = [0.2, 0.4, 0.9, 0.8];
const GREEN: [f64; 4] = [0.2, 0.7, 0.3, 1.0];
const RED: [f64; 4] = [0.85, 0.2, 0.2, 1.0];
const ORANGE: [f64; 4] = [0.95, 0.6, 0.1, 1.0];

/// What the drawings need to know of the robot.
#[derive(Debug, Clone, Default)]
pub struct ViewerSettings {
    /// Names of the joints in the order of the messages.
    pub joint_names: Vec<String>,
    /// Joints that are none of the messages' and move with one that is.
    pub followers: Vec<Follower>,
    /// Name of the floating base's link.
    pub base_link: String,
    /// All other links.
    pub links: Vec<Link>,
    /// Text of the URDF; viewers draw its shapes.
    pub urdf: String,
    /// Length, width and thickness of the soles; the sole frame is at the centre of the bottom.
    pub sole_size_m: [f64; 3],
    /// How often scene and transforms are drawn; at least 1.
    pub scene_every_ticks: i64,
}

/// A joint at `multiplier * leader + offset` (`<mimic>` in a URDF): viewers draw it at zero if they are not told
/// where it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Follower {
    /// Name of the joint.
    pub name: String,
    /// The joint that carries it, in the order of the messages; `None` if it stays at its offset.
    pub leader: Option<usize>,
    /// Its motion over the leader's.
    pub multiplier: f64,
    /// Its position (rad, m) when the leader is at zero.
    pub offset: f64,
}

/// A link and where it is held.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Its name.
    pub name: String,
    /// The link that holds it.
    pub parent: String,
    /// Where it is in its parent when its joint is at zero (m).
    pub position_m: [f64; 3],
    /// How it is turned then, row-major.
    pub rotation: [f64; 9],
    /// The joint that moves it, in the order of the messages and then of the followers; `None`: none does.
    pub moved_by: Option<usize>,
    /// Unit vector about which it turns or along which it slides.
    pub axis: [f64; 3],
    /// Whether it slides.
    pub slides: bool,
}

/// Draws.
#[derive(Debug, Clone)]
pub struct Viewer {
    pub(crate) settings: ViewerSettings,
    /// Joints and followers of the truth at hand: names, positions, rates, torques.
    names: Vec<String>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    efforts: Vec<f64>,
}

type Mat3 = [f64; 9];

impl Viewer {
    /// With settings.
    pub fn new(settings: ViewerSettings) -> Self {
        Self { settings, names: Vec::new(), positions: Vec::new(), velocities: Vec::new(), efforts: Vec::new() }
    }

    pub(crate) fn scene_every_ticks(&self) -> i64 {
        self.settings.scene_every_ticks.max(1)
    }

    pub(crate) fn urdf(&self) -> &str {
        &self.settings.urdf
    }

    /// Takes the joints out of the truth.
    pub(crate) fn look_at(&mut self, truth: &Truth) {
        let count = (truth.joint_count as usize).min(truth.joint_position_rad.len());
        let ViewerSettings { joint_names, followers, .. } = &self.settings;
        if self.names.len() != count + followers.len() {
            let name = |joint| joint_names.get(joint).cloned().unwrap_or_else(|| format!("joint {joint}"));
            self.names = (0..count).map(name).chain(followers.iter().map(|follower| follower.name.clone())).collect();
        }
        for (out, values, is_position) in [
            (&mut self.positions, &truth.joint_position_rad, true),
            (&mut self.velocities, &truth.joint_velocity_rad_per_s, false),
        ] {
            out.clear();
            out.extend_from_slice(&values[..count]);
            for Follower { leader, multiplier, offset, .. } in followers {
                let of_leader = leader.and_then(|leader| values[..count].get(leader)).copied().unwrap_or(0.0);
                out.push(multiplier * of_leader + if is_position { *offset } else { 0.0 });
            }
        }
        self.efforts.clear();
        self.efforts.extend_from_slice(&truth.joint_torque_nm[..count]);
        self.efforts.resize(self.names.len(), 0.0);
    }

    /// `foxglove.FrameTransforms`: base and soles in the world, every link in its parent.
    pub(crate) fn transforms(&self, truth: &Truth, time_ns: u64, out: &mut Vec<u8>) {
        let mut transform = |parent: &str, child: &str, position: [f64; 3], rotation: &Mat3| {
            put_nested(out, 1, |out| {
                put_time(out, 1, time_ns);
                put_text(out, 2, parent);
                put_text(out, 3, child);
                put_vector(out, 4, position);
                put_rotation(out, 5, rotation);
            });
        };
        transform("world", &self.settings.base_link, truth.base_position_m, &truth.base_rotation);
        for (foot, child) in ["left_sole", "right_sole"].into_iter().enumerate() {
            transform("world", child, truth.sole_position_m[foot], &truth.sole_rotation[foot]);
        }
        for link in &self.settings.links {
            let at = link.moved_by.and_then(|joint| self.positions.get(joint)).copied().unwrap_or(0.0);
            let (position, rotation) = link.placed(at);
            transform(&link.parent, &link.name, position, &rotation);
        }
    }

    /// `sensor_msgs/msg/JointState`.
    pub(crate) fn joints(&self, time_ns: u64, out: &mut Vec<u8>) {
        let Self { names, positions, velocities, efforts, .. } = self;
        ros::put_joints(&ros::Joints { time_ns, names, positions, velocities, efforts }, out);
    }

    /// `foxglove.SceneUpdate` of the truth.
    pub(crate) fn scene(&self, truth: &Truth, time_ns: u64, out: &mut Vec<u8>) {
        put_entity(out, time_ns, "robot", |out| {
            for foot in 0..2 {
                let (position, rotation) = (truth.sole_position_m[foot], &truth.sole_rotation[foot]);
                let [_, _, thickness] = self.settings.sole_size_m;
                let middle = std::array::from_fn(|row| position[row] + rotation[3 * row + 2] * 0.5 * thickness);
                put_solid(out, CUBES, middle, rotation, self.settings.sole_size_m, [BLUE, GREEN][foot]);
                let (from, force) = at_zmp(position, &truth.foot_wrench_n_nm[foot]);
                put_arrow(out, from, force);
            }
            put_solid(out, SPHERES, truth.com_position_m, &IDENTITY, [0.04; 3], ORANGE);
            let [x, y] = truth.zmp_m;
            put_solid(out, SPHERES, [x, y, 0.0], &IDENTITY, [0.02, 0.02, 0.005], RED);
        });
    }

    /// `foxglove.SceneUpdate` of the estimator's contact forces, node by node.
    pub(crate) fn contact(&self, contact: &SoleContact, time_ns: u64, out: &mut Vec<u8>) {
        put_entity(out, time_ns, "contact", |out| {
            put_nested(out, LINES, |out| {
                put_key(out, 1, VARINT);
                put_varint(out, LINE_LIST);
                put_double(out, 3, 1.0);
                put_key(out, 4, VARINT);
                put_varint(out, 1);
                for feet in &contact.feet {
                    put_node_forces(out, feet);
                }
                put_color(out, 6, WHITE);
            });
        });
    }
}

/// Field numbers of `foxglove.SceneEntity`.
const ARROWS: u32 = 7;
const CUBES: u32 = 8;
const SPHERES: u32 = 9;
const LINES: u32 = 11;
/// `foxglove.LinePrimitive.Type.LINE_LIST`.
const LINE_LIST: u64 = 2;

const IDENTITY: Mat3 = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// An entity of the scene, in the world, that replaces the one drawn before.
fn put_entity(out: &mut Vec<u8>, time_ns: u64, id: &str, content: impl FnOnce(&mut Vec<u8>)) {
    put_nested(out, 2, |out| {
        put_time(out, 1, time_ns);
        put_text(out, 2, "world");
        put_text(out, 3, id);
        content(out);
    });
}

fn put_solid(out: &mut Vec<u8>, number: u32, middle: [f64; 3], rotation: &Mat3, size: [f64; 3], color: [f64; 4]) {
    put_nested(out, number, |out| {
        put_pose(out, 1, middle, rotation);
        put_vector(out, 2, size);
        put_color(out, 3, color);
    });
}

/// Where the force of a wrench about `origin` (world axes) acts: at the zero-moment point in the horizontal plane
/// through it.
fn at_zmp(origin: [f64; 3], wrench: &[f64; 6]) -> ([f64; 3], [f64; 3]) {
    let wrench = Wrench::from_vector(&(*wrench).into());
    let point = wrench.zmp(&origin.into(), origin[2]).map_or(origin, |zmp| [zmp.x, zmp.y, origin[2]]);
    (point, wrench.force.into())
}

impl Link {
    /// Position and rotation in the parent with its joint at `q`.
    fn placed(&self, q: f64) -> ([f64; 3], Mat3) {
        let r = &self.rotation;
        if self.slides {
            let along = |row: usize| (0..3).map(|k| r[3 * row + k] * self.axis[k]).sum::<f64>() * q;
            return (std::array::from_fn(|row| self.position_m[row] + along(row)), *r);
        }
        // Rodrigues: 1 + sin q [a] + (1 - cos q) [a]^2.
        let ([x, y, z], (sin, cos)) = (self.axis, q.sin_cos());
        let c = 1.0 - cos;
        let turn = [
            cos + c * x * x,
            c * x * y - sin * z,
            c * x * z + sin * y,
            c * x * y + sin * z,
            cos + c * y * y,
            c * y * z - sin * x,
            c * x * z - sin * y,
            c * y * z + sin * x,
            cos + c * z * z,
        ];
        let product = |k: usize| (0..3).map(|j| r[3 * (k / 3) + j] * turn[3 * j + k % 3]).sum();
        (self.position_m, std::array::from_fn(product))
    }
}

/// A force as an arrow; arrows point along their x axis.
fn put_arrow(out: &mut Vec<u8>, from: [f64; 3], force: [f64; 3]) {
    let magnitude = force.iter().map(|x| x * x).sum::<f64>().sqrt();
    if !magnitude.is_finite() || magnitude < FORCE_MIN_N {
        return;
    }
    let x = force.map(|component| component / magnitude);
    // Any axis that is not along the force completes it.
    let helper = if x[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
    let y = normalized(cross(helper, x));
    let z = cross(x, y);
    let rotation = [x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]];
    let length = magnitude / FORCE_SCALE_N_PER_M;
    put_nested(out, ARROWS, |out| {
        put_pose(out, 1, from, &rotation);
        put_double(out, 2, 0.8 * length);
        put_double(out, 3, 0.01);
        put_double(out, 4, 0.2 * length);
        put_double(out, 5, 0.02);
        put_color(out, 6, RED);
    });
}

fn put_node_forces(out: &mut Vec<u8>, nodes: &ContactNodes) {
    let count = (nodes.count as usize).min(nodes.position_m.len());
    for (position, force) in nodes.position_m.iter().zip(&nodes.force_n).take(count) {
        if force.iter().any(|component| component.abs() >= FORCE_MIN_N) {
            // Single nodes carry little: they are drawn ten times as long.
            let end = std::array::from_fn(|axis| position[axis] + 10.0 * force[axis] / FORCE_SCALE_N_PER_M);
            put_vector(out, 5, *position);
            put_vector(out, 5, end);
        }
    }
}

fn put_pose(out: &mut Vec<u8>, number: u32, position: [f64; 3], rotation: &Mat3) {
    put_nested(out, number, |out| {
        put_vector(out, 1, position);
        put_rotation(out, 2, rotation);
    });
}

fn put_vector(out: &mut Vec<u8>, number: u32, vector: [f64; 3]) {
    put_nested(out, number, |out| (1..).zip(vector).for_each(|(number, x)| put_double(out, number, x)));
}

fn put_color(out: &mut Vec<u8>, number: u32, color: [f64; 4]) {
    put_nested(out, number, |out| (1..).zip(color).for_each(|(number, x)| put_double(out, number, x)));
}

fn put_rotation(out: &mut Vec<u8>, number: u32, rotation: &Mat3) {
    let (w, v) = so3::quaternion(&from_row_major(rotation));
    put_nested(out, number, |out| (1..).zip([v.x, v.y, v.z, w]).for_each(|(number, x)| put_double(out, number, x)));
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn normalized(a: [f64; 3]) -> [f64; 3] {
    let norm = a.iter().map(|x| x * x).sum::<f64>().sqrt();
    a.map(|x| x / norm)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_turn_about_and_slide_along_their_axes() {
        // The joint's frame is a quarter turn about x from its parent's: its z axis points along the parent's -y.
        let rotation = [1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0];
        let mut link = Link {
            name: String::new(),
            parent: String::new(),
            position_m: [1.0, 2.0, 3.0],
            rotation,
            moved_by: Some(0),
            axis: [0.0, 0.0, 1.0],
            slides: false,
        };
        let (position, turned) = link.placed(std::f64::consts::FRAC_PI_2);
        assert_eq!(position, [1.0, 2.0, 3.0]);
        // x of the child: a quarter turn about z leads x to y, which is the parent's z.
        let child_x = [turned[0], turned[3], turned[6]];
        assert!(child_x.iter().zip([0.0, 0.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-15), "{child_x:?}");
        link.slides = true;
        assert_eq!(link.placed(0.5), ([1.0, 1.5, 3.0], rotation));
        assert_eq!(at_zmp([1.0, 2.0, 0.0], &[5.0, 0.0, 100.0, 3.0, -4.0, 7.0]).0, [1.04, 2.03, 0.0]);
        assert_eq!(at_zmp([1.0, 2.0, 0.0], &[0.0, 0.0, 0.0, 3.0, -4.0, 7.0]).0, [1.0, 2.0, 0.0]);
    }
}
