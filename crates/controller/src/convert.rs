//! Messages to what the whole-body step takes, and back.

use messages::{FootDeformation, Plan, PlanFoot, RobotState as StateMessage, SoleDeformation};
use nalgebra::Vector2;
use pattern::Reference;
use spatial::{Mat3, Mat6, Transform, Twist, Vec3, Vec6, Wrench, so3};
use wholebody::observer::FootAnchor;
use wholebody::{FootTarget, LoadedSole, WholeBodyReference};

use crate::heading::body_heading;

/// By how much the length of a unit quaternion may be off: drivers send rounded ones, and broken ones send zeros.
const QUATERNION_LENGTH_ERROR_MAX: f64 = 1e-3;

/// References of one tick: the centre of mass from the pattern, the feet from the soles, the torso upright and facing where the feet
/// do.
pub(crate) fn reference(pattern: &Reference, deformation: &SoleDeformation) -> WholeBodyReference {
    let heading = body_heading(pattern);
    WholeBodyReference {
        com_position: pattern.com_position(),
        com_velocity: pattern.com_velocity(),
        com_acceleration: pattern.com_acceleration(),
        feet: [foot_target(&deformation.feet[0]), foot_target(&deformation.feet[1])],
        torso_rotation: so3::about_z(heading.value),
        torso_angular_velocity: Vec3::new(0.0, 0.0, heading.rate),
        torso_angular_acceleration: Vec3::new(0.0, 0.0, heading.acceleration),
    }
}

/// The ankle pose in a message.
fn ankle_pose(foot: &FootDeformation) -> Transform {
    Transform::new(rotation(&foot.ankle_rotation), Vec3::from(foot.ankle_position_m))
}

fn foot_target(foot: &FootDeformation) -> FootTarget {
    FootTarget {
        in_contact: foot.in_contact == 1,
        load_share: foot.load_share,
        ankle_pose: ankle_pose(foot),
        ankle_twist: Twist::from_vector(&Vec6::from(foot.ankle_twist)),
        ankle_acceleration: Twist::from_vector(&Vec6::from(foot.ankle_acceleration)),
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
        let moment = (zmp - ankles[foot].translation).cross(&planned.force);
        Wrench { force: planned.force, moment }
    };
    let wrenches = computed.unwrap_or_else(|| [planned(0), planned(1)]);
    let total = wrenches[0].about(&-ankles[0].translation) + wrenches[1].about(&-ankles[1].translation);
    let zmp = match computed {
        Some(_) if total.force.z > 0.0 => Vector2::new(-total.moment.y, total.moment.x) / total.force.z,
        _ => pattern.zmp.position,
    };
    let foot = |index: usize| {
        let (planned, ankle) = (&pattern.feet[index], &ankles[index]);
        PlanFoot {
            in_contact: u32::from(planned.in_contact),
            reserved: 0,
            load_share: planned.share.value,
            wrench: wrenches[index].to_vector().into(),
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

/// Measured vertical force of each foot: the sensors' z axes are vertical but for the small tilt of the soles.
pub(crate) fn vertical_forces(state: &StateMessage) -> [f64; 2] {
    state.foot_wrench.map(|wrench| wrench[2])
}

/// A standing foot as the observer's anchor.
pub(crate) fn foot_anchor(foot: &FootDeformation) -> FootAnchor {
    FootAnchor {
        in_contact: foot.in_contact == 1,
        load_share: foot.load_share,
        ankle_pose: ankle_pose(foot),
        ankle_twist: Twist::from_vector(&Vec6::from(foot.ankle_twist)),
    }
}

/// A standing foot's sole as the plan loads it.
pub(crate) fn loaded_sole(foot: &FootDeformation) -> LoadedSole {
    LoadedSole {
        origin: Vec3::from(foot.sole_position_m),
        wrench: Wrench {
            force: Vec3::from_column_slice(&foot.wrench[..3]),
            moment: Vec3::from_column_slice(&foot.wrench[3..]),
        },
        compliance: Mat6::from_row_slice(&foot.compliance),
    }
}

/// Rotation of a quaternion that is one: its length may be off by [`QUATERNION_LENGTH_ERROR_MAX`].
pub(crate) fn unit_rotation([x, y, z, w]: [f64; 4]) -> Option<Mat3> {
    let length = (x * x + y * y + z * z + w * w).sqrt();
    // Not a number is not within the limit.
    ((length - 1.0).abs() <= QUATERNION_LENGTH_ERROR_MAX)
        .then(|| so3::from_quaternion(w / length, &(Vec3::new(x, y, z) / length)))
}

fn rotation(row_major: &[f64; 9]) -> Mat3 {
    Mat3::from_row_slice(row_major)
}

fn row_major(m: &Mat3) -> [f64; 9] {
    m.transpose().as_slice().try_into().expect("3 x 3 numbers")
}
