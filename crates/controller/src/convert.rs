//! Messages to what the whole-body step takes, and back.

use messages::{
    FootDeformation, Plan, PlanFoot, RobotState as StateMessage, SoleDeformation, from_row_major, row_major,
};
use nalgebra::Vector2;
use pattern::Reference;
use robot::JointMap;
use spatial::{Mat6, Transform, Twist, Vec3, Vec6, Wrench};
use state::observer::FootAnchor;
use state::{Measured, unit_rotation};
use wholebody::{FootTarget, LoadedSole, WholeBodyReference};

/// References of one tick, the feet from the soles.
pub(crate) fn reference(pattern: &Reference, deformation: &SoleDeformation) -> WholeBodyReference {
    tracking::reference(pattern, [foot_target(&deformation.feet[0]), foot_target(&deformation.feet[1])])
}

/// The ankle pose in a message.
fn ankle_pose(foot: &FootDeformation) -> Transform {
    Transform::new(from_row_major(&foot.ankle_rotation), Vec3::from(foot.ankle_position_m))
}

fn foot_target(foot: &FootDeformation) -> FootTarget {
    FootTarget {
        in_contact: foot.loaded == 1,
        load_share: foot.load_share,
        ankle_pose: ankle_pose(foot),
        ankle_twist: Twist::from_vector(&Vec6::from(foot.ankle_twist_m_rad_per_s)),
        ankle_acceleration: Twist::from_vector(&Vec6::from(foot.ankle_acceleration_m_rad_per_s2)),
        // The plan has no vertical moment at the ZMP.
        wrench: Wrench { force: Vec3::from(foot.planned_force_n), moment: Vec3::zeros() },
        zmp: Vector2::from(foot.planned_zmp_m),
    }
}

/// The plan that a command's references belong to. `computed` are the wrenches of the whole-body step about the ankles, world axes:
/// with the ZMP they make they are what the joint references need. The pattern's cart-table knows nothing of a swinging leg, whose
/// angular momentum shifts the ZMP by about 1 cm; a stabiliser that is told the cart-table's takes that for a disturbance. Without a
/// solved step the pattern's stand in.
pub(crate) fn plan(
    pattern: &Reference,
    base: &Transform,
    ankles: &[Transform; 2],
    computed: Option<[Wrench; 2]>,
) -> Plan {
    let planned = |foot: usize| {
        let planned = &pattern.feet[foot];
        let zmp = Vec3::new(planned.zmp.position.x, planned.zmp.position.y, 0.0);
        Wrench::of_force_at(&planned.force, &zmp, &ankles[foot].translation)
    };
    let wrenches = computed.unwrap_or_else(|| [planned(0), planned(1)]);
    let total = wrenches[0].about(&-ankles[0].translation) + wrenches[1].about(&-ankles[1].translation);
    let zmp = computed.and_then(|_| total.zmp(&Vec3::zeros(), 0.0)).unwrap_or(pattern.zmp.position);
    let foot = |index: usize| {
        let (planned, ankle) = (&pattern.feet[index], &ankles[index]);
        PlanFoot {
            loaded: u32::from(planned.in_contact),
            reserved: 0,
            load_share: planned.share.value,
            wrench_n_nm: wrenches[index].to_vector().into(),
            ankle_position_m: ankle.translation.into(),
            ankle_rotation: row_major(&ankle.rotation),
        }
    };
    Plan {
        base_position_m: base.translation.into(),
        base_rotation: row_major(&base.rotation),
        zmp_m: zmp.into(),
        com_position_m: pattern.com_position().into(),
        com_velocity_m_per_s: pattern.com_velocity().into(),
        com_acceleration_m_per_s2: pattern.com_acceleration().into(),
        feet: [foot(0), foot(1)],
    }
}

/// The same plan as a stabiliser is told it.
pub(crate) fn stabiliser_plan(plan: &Plan) -> stabiliser::Plan {
    let foot = |foot: &PlanFoot| {
        let wrench = Wrench::from_vector(&Vec6::from(foot.wrench_n_nm));
        // The plan's ground is z = 0.
        stabiliser::FootPlan::of_wrench(foot.loaded == 1, foot.load_share, &wrench, foot.ankle(), 0.0)
    };
    stabiliser::Plan {
        base: plan.base(),
        zmp: Vector2::from(plan.zmp_m),
        com: Vec3::from(plan.com_position_m),
        com_velocity: Vec3::from(plan.com_velocity_m_per_s),
        feet: [foot(&plan.feet[0]), foot(&plan.feet[1])],
    }
}

/// What the robot measures, in the model's order of joints. The sensors' z axes are vertical but for the small tilt of the soles.
pub(crate) fn measured(state: &StateMessage, joints: &JointMap, measured: &mut Measured) {
    measured.tick = state.header.tick;
    measured.faulty = state.fault_bits != 0;
    joints.from_interface(&state.joint_position_rad, measured.joints.as_mut_slice());
    joints.from_interface(&state.joint_velocity_rad_per_s, measured.joint_rates.as_mut_slice());
    measured.imu_rotation = unit_rotation(state.imu_orientation_xyzw);
    measured.gyro = Vec3::from(state.gyro_rad_per_s);
    measured.vertical_n = state.foot_wrench_n_nm.map(|wrench| wrench[2]);
}

/// A standing foot as the observer's anchor.
pub(crate) fn foot_anchor(foot: &FootDeformation) -> FootAnchor {
    FootAnchor {
        in_contact: foot.loaded == 1,
        load_share: foot.load_share,
        ankle_pose: ankle_pose(foot),
        ankle_twist: Twist::from_vector(&Vec6::from(foot.ankle_twist_m_rad_per_s)),
    }
}

/// A standing foot's sole as the plan loads it.
pub(crate) fn loaded_sole(foot: &FootDeformation) -> LoadedSole {
    LoadedSole {
        origin: Vec3::from(foot.sole_position_m),
        wrench: Wrench {
            force: Vec3::from_column_slice(&foot.wrench_n_nm[..3]),
            moment: Vec3::from_column_slice(&foot.wrench_n_nm[3..]),
        },
        compliance: Mat6::from_row_slice(&foot.compliance_m_rad_per_n_nm),
    }
}
