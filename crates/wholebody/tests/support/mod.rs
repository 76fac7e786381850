//! HRP-4, its walks as references, and an ideal plant.
#![allow(dead_code)] // every test binary uses its own part
#![allow(non_snake_case)] // monogram notation

pub mod watch;

use gait::GaitSettings;
use multibody::{Configuration, JointIndex, Model, ModelOptions};
use nalgebra::{DVector, Vector2};
use pattern::{AnkleState, FootReference, SwingTrajectory, WalkPattern};
use robot::Robot;
use spatial::{Mat3, Transform, Twist, Vec3, Wrench, so3};
use std::path::Path;
use wholebody::{
    ConfigurationTargets, FootTarget, LinkCapsule, PostureJoint, RobotState, StepReport, WholeBody, WholeBodyReference,
    WholeBodySettings, initial_configuration,
};

/// Control period (s).
pub const PERIOD_S: f64 = 0.005;

/// Which joints move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Joints {
    /// All 34.
    Full,
    /// Legs, chest, shoulders and elbows: 22.
    Walking,
    /// Legs and chest: 14.
    Legs,
}

/// The robot's folder, read.
pub fn robot() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4")).expect("robots/hrp4 is readable")
}

/// HRP-4's model with its rotors.
pub fn model(robot: &Robot, joints: Joints) -> Model {
    let description = &robot.description;
    let locked_joints = match joints {
        Joints::Full => Vec::new(),
        Joints::Walking => description.walking_locked_joints(),
        Joints::Legs => description
            .joints
            .iter()
            .filter(|name| !["HIP", "KNEE", "ANKLE", "CHEST"].iter().any(|part| name.contains(part)))
            .map(|name| (name.clone(), description.half_sitting_rad(name)))
            .collect(),
    };
    let options = ModelOptions { locked_joints, ..ModelOptions::default() };
    let mut model = Model::from_urdf(&robot.urdf, &options).expect("hrp4.urdf is readable");
    for j in 0..model.joint_count() {
        let servo = description.servo(&model.joints()[j].name).expect("every joint has a servo");
        model.set_rotor_inertia(JointIndex(j), servo.rotor_inertia_kg_m2);
    }
    model
}

/// Settings for HRP-4 from its description.
pub fn settings(robot: &Robot, model: &Model) -> WholeBodySettings {
    let description = &robot.description;
    let mut settings = WholeBodySettings::new(
        [&description.feet.left.ankle_frame, &description.feet.right.ankle_frame],
        &description.torso_link,
    );
    settings.posture = model
        .joints()
        .iter()
        .map(|joint| PostureJoint {
            joint: joint.name.clone(),
            position_rad: description.half_sitting_rad(&joint.name),
        })
        .collect();
    settings.constraints.position_margin_rad = description.limits.position_margin_deg.to_radians();
    settings.constraints.velocity_factor = description.limits.velocity_factor;
    settings.constraints.torque_factor = description.limits.torque_factor;
    settings.collision.capsules = description
        .capsules
        .iter()
        .map(|capsule| LinkCapsule {
            name: capsule.name.clone(),
            link: capsule.link.clone(),
            from_m: Vec3::from(capsule.from_m),
            to_m: Vec3::from(capsule.to_m),
            radius_m: capsule.radius_m,
        })
        .collect();
    settings.collision.pairs = description.collision_pairs.clone();
    settings
}

/// How the soles give way, in place of the estimator: sink and outward roll proportional to a foot's share of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yield {
    /// Sink under the whole weight (m).
    pub sink_m: f64,
    /// Outward roll under the whole weight (rad).
    pub roll_rad: f64,
}

impl Yield {
    /// Undeformed soles.
    pub const RIGID: Self = Self { sink_m: 0.0, roll_rad: 0.0 };
    /// About what the foam does under HRP-4.
    pub const FOAM: Self = Self { sink_m: 8e-4, roll_rad: 0.03 };
}

/// A planned walk turned into references.
pub struct Walk {
    /// The pattern.
    pub pattern: WalkPattern,
    /// How the soles give way.
    pub soles: Yield,
    /// Height of the centre of mass is lowered or raised by this (m).
    pub com_offset_m: f64,
}

impl Walk {
    /// Plans.
    pub fn plan(settings: &GaitSettings) -> Self {
        let plan = gait::plan(settings).expect("a feasible walk");
        Self { pattern: plan.pattern, soles: Yield::FOAM, com_offset_m: 0.0 }
    }

    /// A short straight walk.
    pub fn straight(swings: u32) -> Self {
        let walk = gait::Walk::Straight { swings, step_length_m: 0.05 };
        Self::plan(&GaitSettings { walk, ..GaitSettings::default() })
    }

    /// Everything a step needs at walk time t.
    pub fn reference(&self, t_s: f64) -> WholeBodyReference {
        let r = self.pattern.evaluate(t_s);
        WholeBodyReference {
            com_position: r.com_position() + Vec3::new(0.0, 0.0, self.com_offset_m),
            com_velocity: r.com_velocity(),
            com_acceleration: r.com_acceleration(),
            feet: [0, 1].map(|foot| self.foot(foot, &r.feet[foot], t_s)),
            torso_rotation: so3::about_z(0.5 * (r.feet[0].ankle_foothold.yaw_rad + r.feet[1].ankle_foothold.yaw_rad)),
            torso_angular_velocity: Vec3::zeros(),
            torso_angular_acceleration: Vec3::zeros(),
        }
    }

    fn foot(&self, foot: usize, reference: &FootReference, t_s: f64) -> FootTarget {
        if let Some(swing) = &reference.swing {
            let [from, to] = [swing.from_foothold, swing.to_foothold].map(|at| self.pattern.ankle_pose(&at));
            let flight =
                SwingTrajectory::new(&AnkleState::at_rest(from), &to, swing.t_start_s, swing.t_end_s, swing.apex_m);
            let state = flight.evaluate(t_s);
            return FootTarget {
                ankle_twist: state.twist,
                ankle_acceleration: state.acceleration,
                ..FootTarget::hanging(state.pose)
            };
        }
        let flat = self.pattern.ankle_pose(&reference.ankle_foothold);
        let share = reference.share;
        let outward = if foot == 0 { 1.0 } else { -1.0 };
        // The roll axis is the foot's x axis: right-handed roll by +angle raises the left side.
        let roll = -outward * self.soles.roll_rad;
        let axis: Vec3 = flat.rotation.column(0).into();
        let motion = |k: f64| Twist { linear: Vec3::new(0.0, 0.0, -self.soles.sink_m * k), angular: roll * k * axis };
        FootTarget {
            in_contact: true,
            load_share: share.value,
            ankle_pose: Transform::new(
                flat.rotation * so3::about_x(roll * share.value),
                flat.translation + motion(share.value).linear,
            ),
            ankle_twist: motion(share.rate),
            ankle_acceleration: motion(share.acceleration),
            wrench: Wrench { force: reference.force, moment: Vec3::zeros() },
            zmp: reference.zmp.position,
        }
    }

    /// Length (s).
    pub fn duration_s(&self) -> f64 {
        self.pattern.duration_s()
    }
}

/// The configuration in which a reference is met, from half-sitting.
pub fn start(model: &Model, settings: &WholeBodySettings, reference: &WholeBodyReference) -> RobotState {
    let mut posture = DVector::zeros(model.joint_count());
    for target in &settings.posture {
        posture[model.joint(&target.joint).expect("posture of a model's joint").0] = target.position_rad;
    }
    let frame = |name: &str| model.frame(name).expect("a frame of the model");
    let targets = ConfigurationTargets {
        com: reference.com_position,
        ankles: [frame(&settings.feet[0].ankle_link), frame(&settings.feet[1].ankle_link)],
        ankle_poses: [reference.feet[0].ankle_pose, reference.feet[1].ankle_pose],
        torso: frame(&settings.torso_link),
        torso_rotation: reference.torso_rotation,
        posture,
        limit_margin_rad: settings.constraints.position_margin_rad,
    };
    let q = initial_configuration(model, &targets).expect("the start is within reach");
    RobotState { q, v: DVector::zeros(model.nv()) }
}

/// Walks on an ideal plant, which moves exactly as the step says, and shows every step to `look`.
pub fn walk(
    walk: &Walk,
    body: &mut WholeBody,
    dt_s: f64,
    mut look: impl FnMut(usize, &RobotState, &WholeBodyReference, &StepReport),
) -> RobotState {
    let mut state = start(body.model(), body.settings(), &walk.reference(0.0));
    let ticks = (walk.duration_s() / dt_s).ceil() as usize;
    for tick in 0..ticks {
        let reference = walk.reference(tick as f64 * dt_s);
        let report = body.step(&state, &reference, dt_s);
        look(tick, &state, &reference, report);
        state.q.clone_from(&report.q_next);
        state.v.clone_from(&report.v_next);
    }
    state
}

/// A reference seen from elsewhere.
pub fn moved(reference: &WholeBodyReference, X_WV: &Transform) -> WholeBodyReference {
    let R: Mat3 = X_WV.rotation;
    let turn = |t: &Twist| Twist { linear: R * t.linear, angular: R * t.angular };
    WholeBodyReference {
        com_position: X_WV.point(&reference.com_position),
        com_velocity: R * reference.com_velocity,
        com_acceleration: R * reference.com_acceleration,
        torso_rotation: R * reference.torso_rotation,
        torso_angular_velocity: R * reference.torso_angular_velocity,
        torso_angular_acceleration: R * reference.torso_angular_acceleration,
        feet: [0, 1].map(|i| {
            let foot = &reference.feet[i];
            let zmp = X_WV.point(&Vec3::new(foot.zmp.x, foot.zmp.y, 0.0));
            FootTarget {
                in_contact: foot.in_contact,
                load_share: foot.load_share,
                ankle_pose: *X_WV * foot.ankle_pose,
                ankle_twist: turn(&foot.ankle_twist),
                ankle_acceleration: turn(&foot.ankle_acceleration),
                wrench: Wrench { force: R * foot.wrench.force, moment: R * foot.wrench.moment },
                zmp: Vector2::new(zmp.x, zmp.y),
            }
        }),
    }
}

/// A state seen from elsewhere: v is in the base frame and does not change.
pub fn moved_state(state: &RobotState, X_WV: &Transform) -> RobotState {
    let q = Configuration { base: *X_WV * state.q.base, joints: state.q.joints.clone() };
    RobotState { q, v: state.v.clone() }
}

/// Of a robot that is the same to its left and right: left and right joints exchanged, roll and yaw with the other sign.
pub fn mirrored_joints(model: &Model, joints: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(joints.len(), |i, _| {
        let name = &model.joints()[i].name;
        let other = match name.split_at(2) {
            ("L_", rest) => format!("R_{rest}"),
            ("R_", rest) => format!("L_{rest}"),
            _ => name.clone(),
        };
        let sign = if name.ends_with("_P") { 1.0 } else { -1.0 };
        sign * joints[model.joint(&other).expect("robots are symmetric").0]
    })
}

/// Seen in a mirror in the plane y = 0.
fn flip(v: &Vec3) -> Vec3 {
    Vec3::new(v.x, -v.y, v.z)
}

fn flip_rotation(R: &Mat3) -> Mat3 {
    let S = Mat3::from_diagonal(&Vec3::new(1.0, -1.0, 1.0));
    S * R * S
}

fn flip_pose(X: &Transform) -> Transform {
    Transform::new(flip_rotation(&X.rotation), flip(&X.translation))
}

/// Angular velocities and moments are axial: they turn the other way.
fn flip_twist(V: &Twist) -> Twist {
    Twist { linear: flip(&V.linear), angular: -flip(&V.angular) }
}

/// A reference seen in a mirror: the other foot does what one foot did.
pub fn mirrored(reference: &WholeBodyReference) -> WholeBodyReference {
    WholeBodyReference {
        com_position: flip(&reference.com_position),
        com_velocity: flip(&reference.com_velocity),
        com_acceleration: flip(&reference.com_acceleration),
        torso_rotation: flip_rotation(&reference.torso_rotation),
        torso_angular_velocity: -flip(&reference.torso_angular_velocity),
        torso_angular_acceleration: -flip(&reference.torso_angular_acceleration),
        feet: [1, 0].map(|i: usize| {
            let foot = &reference.feet[i];
            FootTarget {
                in_contact: foot.in_contact,
                load_share: foot.load_share,
                ankle_pose: flip_pose(&foot.ankle_pose),
                ankle_twist: flip_twist(&foot.ankle_twist),
                ankle_acceleration: flip_twist(&foot.ankle_acceleration),
                wrench: Wrench { force: flip(&foot.wrench.force), moment: -flip(&foot.wrench.moment) },
                zmp: Vector2::new(foot.zmp.x, -foot.zmp.y),
            }
        }),
    }
}

/// A state seen in a mirror.
pub fn mirrored_state(model: &Model, state: &RobotState) -> RobotState {
    let mut v = state.v.clone();
    let base = model.base_dofs();
    let part = |k: usize| Vec3::new(state.v[k], state.v[k + 1], state.v[k + 2]);
    v.rows_mut(0, 3).copy_from(&flip(&part(0)));
    v.rows_mut(3, 3).copy_from(&-flip(&part(3)));
    let joints = DVector::from_column_slice(&state.v.as_slice()[base..]);
    v.rows_mut(base, joints.len()).copy_from(&mirrored_joints(model, &joints));
    let q = Configuration { base: flip_pose(&state.q.base), joints: mirrored_joints(model, &state.q.joints) };
    RobotState { q, v }
}
