//! HRP-4 for tests: model, standing configurations, commands.

use multibody::{Base, Configuration, JointIndex, Model, ModelOptions, Workspace, center_of_mass, forward_kinematics};
use nalgebra::{DVector, Vector2};
use plant::leg::LegGeometry;
use plant::{CornerSettings, FootPlan, Plan, PlantCommand, PlantFrames};
use sole::{Level, MeshSource, SoleModel, SoleSettings};
use spatial::{Transform, Vec3};
use std::sync::LazyLock;

const URDF: &str = include_str!("../../../../robots/hrp4/hrp4.urdf");

/// Joints that walking does not move.
const LOCKED: [&str; 12] = [
    "NECK_Y", "NECK_P", "R_WRIST_Y", "R_WRIST_P", "R_WRIST_R", "R_HAND_J0", "R_HAND_J1", "L_WRIST_Y", "L_WRIST_P",
    "L_WRIST_R", "L_HAND_J0", "L_HAND_J1",
];

const LEG: [&str; 6] = ["HIP_Y", "HIP_R", "HIP_P", "KNEE_P", "ANKLE_P", "ANKLE_R"];

/// The ankle in the sole frame, left foot (m).
pub const ANKLE_IN_SOLE_M: [f64; 3] = [-0.015, -0.011, 0.103];

pub fn model() -> Model {
    let locked_joints = LOCKED.map(|name| (name.to_owned(), 0.0)).to_vec();
    let options = ModelOptions { base: Base::Floating, locked_joints, ..Default::default() };
    Model::from_urdf(URDF, &options).expect("the robot's own file")
}

pub fn frames() -> PlantFrames {
    PlantFrames {
        imu: "imu".to_owned(),
        ankles: ["l_ankle", "r_ankle"].map(str::to_owned),
        force_sensors: ["l_foot_force_sensor", "r_foot_force_sensor"].map(str::to_owned),
        legs: ["L", "R"].map(|side| LEG.map(|joint| format!("{side}_{joint}"))),
    }
}

fn leg_joints(model: &Model) -> [[JointIndex; 6]; 2] {
    frames().legs.map(|leg| leg.map(|name| model.joint(&name).expect("a leg's joint")))
}

/// Half-sitting arms and chest; the legs follow from [`stand`].
pub fn posture(model: &Model) -> Configuration {
    let mut q = model.neutral();
    for (name, degrees) in [
        ("CHEST_P", 8.0), ("R_SHOULDER_P", -3.0), ("L_SHOULDER_P", -3.0), ("R_SHOULDER_R", -10.0), ("L_SHOULDER_R", 10.0),
        ("R_ELBOW_P", -30.0), ("L_ELBOW_P", -30.0),
    ] {
        q.joints[model.joint(name).expect("a joint of the upper body").0] = f64::to_radians(degrees);
    }
    q
}

/// Feet at the given ankle poses, torso upright, centre of mass at `com`: the base is moved until it is.
pub fn stand(model: &Model, ankles: &[Transform; 2], com: Vec3) -> Configuration {
    let frames = frames();
    let joints = leg_joints(model);
    let legs: Vec<LegGeometry> = (0..2)
        .map(|i| LegGeometry::of_model(model, &joints[i], model.frame(&frames.ankles[i]).unwrap()).expect("HRP-4's leg"))
        .collect();
    let mut ws = Workspace::new(model);
    let mut q = posture(model);
    q.base.translation = com;
    for _ in 0..50 {
        for (leg, (joints, ankle)) in legs.iter().zip(joints.iter().zip(ankles)) {
            let found = leg.inverse(&(q.base.inverse() * *ankle));
            for (joint, angle) in joints.iter().zip(found.joints_rad) {
                q.joints[joint.0] = angle;
            }
        }
        forward_kinematics(model, &mut ws, &q);
        q.base.translation += com - center_of_mass(model, &ws);
    }
    assert!((center_of_mass(model, &ws) - com).norm() < 1e-9, "no configuration found");
    q
}

/// Ankle poses of flat feet beside each other, soles sunk by `sink_m`.
pub fn flat_ankles(sink_m: f64) -> [Transform; 2] {
    [0.0815, -0.0815].map(|y| Transform::from_translation(Vec3::new(0.0, y, ANKLE_IN_SOLE_M[2] - sink_m)))
}

/// A plan at rest: the ZMP below the centre of mass, each foot loaded in proportion, its own ZMP below the ankle.
pub fn resting_plan(model: &Model, q: &Configuration, ankles: &[Transform; 2], com: Vec3, loads: [f64; 2]) -> Plan {
    let weight = model.total_mass_kg() * model.gravity().norm();
    let feet = [0, 1].map(|i| {
        let zmp = if loads[i] == 1.0 { com.xy() } else { ankles[i].translation.xy() };
        FootPlan {
            in_contact: loads[i] > 0.0,
            load_share: loads[i],
            force: Vec3::new(0.0, 0.0, loads[i] * weight),
            zmp: Vector2::new(zmp.x, zmp.y),
            ankle: ankles[i],
        }
    });
    Plan { base: q.base, zmp: com.xy(), com, com_velocity: Vec3::zeros(), feet }
}

pub fn command(q: &Configuration, plan: Option<Plan>) -> PlantCommand {
    PlantCommand { joint_positions: q.joints.clone(), joint_torques: DVector::zeros(q.joints.len()), plan }
}

/// The plant's default soles: 8 x 7 patches condensed from a fine mesh, left and right. Built once: it takes a second.
pub fn soles() -> [SoleModel; 2] {
    static LEFT: LazyLock<SoleModel> = LazyLock::new(|| {
        let settings = SoleSettings {
            mesh: MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [23, 13, 6] },
            level: Level::Patches { cells: [8, 7] },
            ..Default::default()
        };
        SoleModel::build(&settings).expect("the default sole")
    });
    [LEFT.clone(), LEFT.mirrored()]
}

/// Hard feet, left and right.
pub fn hard_soles() -> [CornerSettings; 2] {
    [-1.0, 1.0].map(|y| CornerSettings { ankle_in_sole_m: [-0.015, 0.011 * y, 0.103], ..Default::default() })
}
