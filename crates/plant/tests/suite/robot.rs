//! HRP-4 for tests: model, standing configurations, commands.

use multibody::leg::LegGeometry;
use multibody::{
    Configuration, FrameIndex, JointIndex, Model, ModelOptions, Workspace, forward_kinematics, rnea_with_external,
};
use nalgebra::{DVector, Vector2};
use plant::settings::DriveSettings;
use plant::{CornerSettings, FootPlan, Plan, PlantCommand, PlantFrames, PlantSettings};
use robot::Robot;
use sole::{Level, MeshSource, SoleModel, SoleSettings};
use spatial::{Transform, Vec3, Wrench};
use std::path::Path;
use std::sync::LazyLock;

const LEG: [&str; 6] = ["HIP_Y", "HIP_R", "HIP_P", "KNEE_P", "ANKLE_P", "ANKLE_R"];

fn hrp4() -> &'static Robot {
    static ROBOT: LazyLock<Robot> = LazyLock::new(|| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4");
        Robot::load(&folder).expect("the robot's own files")
    });
    &ROBOT
}

/// The ankle in the sole frame, left foot (m).
pub const ANKLE_IN_SOLE_M: [f64; 3] = [-0.015, -0.011, 0.103];

pub fn urdf() -> String {
    hrp4().urdf.clone()
}

/// Hands, wrists and neck.
pub fn locked_joints() -> Vec<(String, f64)> {
    hrp4().description.walking_locked_joints()
}

/// Walking model.
pub fn model() -> Model {
    let options = ModelOptions { locked_joints: locked_joints(), ..Default::default() };
    Model::from_urdf(&hrp4().urdf, &options).expect("the robot's own file")
}

pub fn frames() -> PlantFrames {
    let description = &hrp4().description;
    let feet = [&description.feet[0], &description.feet[1]];
    PlantFrames {
        imu: description.imu_frame.clone(),
        ankles: feet.map(|foot| foot.ankle_frame.clone()),
        force_sensors: feet.map(|foot| foot.force_sensor_frame.clone()),
        legs: ["L", "R"].map(|side| LEG.map(|joint| format!("{side}_{joint}"))),
    }
}

/// Default settings with the drives of `robot.toml`.
pub fn settings() -> PlantSettings {
    let mut settings = PlantSettings::default();
    for joint in model().joints() {
        let servo = hrp4().description.servo(&joint.name).expect("every joint has a servo");
        let drive = DriveSettings {
            stiffness_nm_per_rad: servo.kp_nm_per_rad,
            damping_nm_s_per_rad: servo.kd_nm_s_per_rad,
            rotor_inertia_kg_m2: servo.rotor_inertia_kg_m2,
            viscous_friction_nm_s_per_rad: servo.viscous_friction_nm_s_per_rad,
            coulomb_friction_nm: servo.coulomb_friction_nm,
            ..Default::default()
        };
        settings.servo.joints.insert(joint.name.clone(), drive);
    }
    settings
}

fn leg_joints(model: &Model) -> [[JointIndex; 6]; 2] {
    frames().legs.map(|leg| leg.map(|name| model.joint(&name).expect("a leg's joint")))
}

/// Half-sitting; the legs then follow from [`stand`].
pub fn posture(model: &Model) -> Configuration {
    let mut q = model.neutral();
    for (angle, joint) in q.joints.iter_mut().zip(model.joints()) {
        *angle = hrp4().description.half_sitting_rad(&joint.name);
    }
    q
}

/// Feet at the given ankle poses, torso upright, centre of mass at `com`: the base is moved until it is.
pub fn stand(model: &Model, ankles: &[Transform; 2], com: Vec3) -> Configuration {
    let frames = frames();
    let joints = leg_joints(model);
    let legs: Vec<LegGeometry> = (0..2)
        .map(|i| {
            LegGeometry::of_model(model, &joints[i], model.frame(&frames.ankles[i]).unwrap()).expect("HRP-4's leg")
        })
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
        q.base.translation += com - forward_kinematics(model, &mut ws, &q).center_of_mass();
    }
    assert!((forward_kinematics(model, &mut ws, &q).center_of_mass() - com).norm() < 1e-9, "no configuration found");
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

/// Holds a configuration with the torques of statics: the weight shared by the feet as the plan says.
pub fn command(model: &Model, q: &Configuration, plan: &Plan) -> PlantCommand {
    let mut ws = Workspace::new(model);
    let placed = forward_kinematics(model, &mut ws, q);
    let external: Vec<(FrameIndex, Wrench)> = (0..2)
        .map(|i| {
            let foot = &plan.feet[i];
            let ankle = model.frame(&frames().ankles[i]).unwrap();
            let arm = Vec3::new(foot.zmp.x, foot.zmp.y, 0.0) - placed.pose(ankle).translation;
            (ankle, Wrench { force: foot.force, moment: arm.cross(&foot.force) })
        })
        .collect();
    let zero = DVector::zeros(model.nv());
    let mut tau = zero.clone();
    rnea_with_external(model, &mut ws, q, &zero, &zero, &external, &mut tau);
    let joint_torques = tau.rows(model.base_dofs(), model.joint_count()).into_owned();
    PlantCommand { joint_positions: q.joints.clone(), joint_torques, plan: Some(*plan) }
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
