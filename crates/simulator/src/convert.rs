//! The plant's quantities to messages, and commands to the plant.

use messages::code::Fall as FallCode;
use messages::{Header, Plan as PlanMessage, RobotCommand, RobotState, Truth as TruthMessage, row_major};
use multibody::Configuration;
use nalgebra::{DVector, Vector2};
use plant::{Fall, FallReason, FootPlan, Plan, PlantCommand, PlantSensors, Truth};
use robot::JointMap;
use spatial::{Vec3, Vec6, Wrench, so3};

/// What the robot measures, as its driver says it.
pub(crate) fn state_message(header: Header, joints: &JointMap, sensors: &PlantSensors) -> RobotState {
    let mut out = RobotState { header, joint_count: joints.interface_count() as u32, ..RobotState::default() };
    let resting = joints.resting_rad();
    out.joint_position_rad[..resting.len()].copy_from_slice(resting);
    joints.to_interface(sensors.joint_positions.as_slice(), &mut out.joint_position_rad);
    joints.to_interface(sensors.joint_rates.as_slice(), &mut out.joint_velocity_rad_per_s);
    let (w, v) = so3::quaternion(&sensors.orientation);
    out.imu_orientation_xyzw = [v.x, v.y, v.z, w];
    out.gyro_rad_per_s = sensors.angular_velocity.into();
    out.accelerometer_m_per_s2 = sensors.acceleration.into();
    out.foot_wrench_n_nm = sensors.foot_wrenches.map(|wrench| wrench.to_vector().into());
    out
}

/// The robot before it stands: at half-sitting, upright, without load.
pub(crate) fn unplaced_state(robot_fingerprint: u64, joints: &JointMap, gravity: f64) -> RobotState {
    let mut out = RobotState {
        header: Header::new(-1, robot_fingerprint),
        joint_count: joints.interface_count() as u32,
        imu_orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        accelerometer_m_per_s2: [0.0, 0.0, gravity],
        ..RobotState::default()
    };
    let resting = joints.resting_rad();
    out.joint_position_rad[..resting.len()].copy_from_slice(resting);
    out
}

/// The configuration a command's references and plan describe.
pub(crate) fn configuration(command: &RobotCommand, joints: &JointMap, joint_count: usize) -> Configuration {
    let mut q = Configuration { base: command.plan.base(), joints: DVector::zeros(joint_count) };
    joints.from_interface(&command.joint_position_reference_rad, q.joints.as_mut_slice());
    q
}

/// Writes a command for the plant.
pub(crate) fn plant_command(command: &RobotCommand, joints: &JointMap, out: &mut PlantCommand) {
    joints.from_interface(&command.joint_position_reference_rad, out.joint_positions.as_mut_slice());
    joints.from_interface(&command.feed_forward_torque_nm, out.joint_torques.as_mut_slice());
    out.plan = Some(plan(&command.plan));
}

fn plan(message: &PlanMessage) -> Plan {
    let foot = |foot: &messages::PlanFoot| {
        let wrench = Wrench::from_vector(&Vec6::from(foot.wrench_n_nm));
        // The plan's ground is z = 0.
        FootPlan::of_wrench(foot.loaded == 1, foot.load_share, &wrench, foot.ankle(), 0.0)
    };
    Plan {
        base: message.base(),
        zmp: Vector2::from(message.zmp_m),
        com: Vec3::from(message.com_position_m),
        com_velocity: Vec3::from(message.com_velocity_m_per_s),
        feet: [foot(&message.feet[0]), foot(&message.feet[1])],
    }
}

/// What really is. `last_zmp_m` stands in while nothing carries.
pub(crate) fn truth_message(
    header: Header,
    walk_time_s: f64,
    joints: &JointMap,
    truth: &Truth,
    sensors: &PlantSensors,
    exact: (&[f64], &[f64]),
    last_zmp_m: [f64; 2],
) -> TruthMessage {
    let mut out = TruthMessage {
        header,
        time_s: truth.t_s,
        walk_time_s,
        joint_count: joints.interface_count() as u32,
        base_position_m: truth.base.translation.into(),
        base_rotation: row_major(&truth.base.rotation),
        base_twist_m_rad_per_s: truth.base_twist.to_vector().into(),
        angular_momentum_kg_m2_per_s: truth.angular_momentum.into(),
        push_force_n: truth.push_force.into(),
        push_point_m: truth.push_point.into(),
        com_position_m: truth.com.into(),
        com_velocity_m_per_s: truth.com_velocity.into(),
        com_acceleration_m_per_s2: truth.com_acceleration.into(),
        zmp_m: truth.zmp.map_or(last_zmp_m, Into::into),
        foot_wrench_n_nm: truth.feet.map(|foot| foot.wrench.to_vector().into()),
        sole_position_m: truth.feet.map(|foot| foot.sole.translation.into()),
        sole_rotation: truth.feet.map(|foot| row_major(&foot.sole.rotation)),
        ankle_position_m: truth.feet.map(|foot| foot.ankle.translation.into()),
        kinetic_energy_j: truth.energies.kinetic_j,
        potential_energy_j: truth.energies.potential_j,
        servo_work_j: truth.energies.flows.servo_j,
        contact_iterations: truth.integration.newton_steps as u32,
        ..TruthMessage::default()
    };
    let resting = joints.resting_rad();
    out.joint_position_rad[..resting.len()].copy_from_slice(resting);
    joints.to_interface(exact.0, &mut out.joint_position_rad);
    joints.to_interface(exact.1, &mut out.joint_velocity_rad_per_s);
    joints.to_interface(sensors.joint_torques.as_slice(), &mut out.joint_torque_nm);
    out
}

/// What a fall is called across process borders.
pub(crate) fn fall_code(fall: &Fall) -> FallCode {
    match fall.reason {
        FallReason::BaseLow(_) => FallCode::BaseLow,
        FallReason::Tilted(_) => FallCode::Tilted,
        FallReason::LinkLow(..) => FallCode::BodyContact,
        FallReason::NotFinite => FallCode::Diverged,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stabiliser_is_told_the_plan_as_it_came() {
        let mut message = PlanMessage {
            base_rotation: [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            base_position_m: [1.0, 2.0, 3.0],
            zmp_m: [0.4, 0.5],
            com_position_m: [0.6, 0.7, 0.8],
            com_velocity_m_per_s: [0.1, -0.2, 0.3],
            ..PlanMessage::default()
        };
        let quarter_turn = so3::about_z(std::f64::consts::FRAC_PI_2);
        for (foot, side) in message.feet.iter_mut().zip([1.0, -1.0]) {
            foot.loaded = u32::from(side > 0.0);
            foot.load_share = 0.5 + 0.25 * side;
            foot.ankle_position_m = [0.1, 0.08 * side, 0.1];
            foot.ankle_rotation = message.base_rotation;
            // 200 N upwards, 30 mm in front of the ankle and 10 mm to its left.
            foot.wrench_n_nm = [0.0, 0.0, 200.0, 2.0, -6.0, 0.0];
        }
        let plan = plan(&message);
        assert!((plan.base.rotation - quarter_turn).norm() < 1e-15, "{}", plan.base.rotation);
        assert_eq!((plan.base.translation, plan.zmp), (Vec3::new(1.0, 2.0, 3.0), Vector2::new(0.4, 0.5)));
        assert_eq!((plan.com, plan.com_velocity), (Vec3::new(0.6, 0.7, 0.8), Vec3::new(0.1, -0.2, 0.3)));
        for (foot, side) in plan.feet.iter().zip([1.0, -1.0]) {
            assert_eq!((foot.in_contact, foot.load_share), (side > 0.0, 0.5 + 0.25 * side));
            assert_eq!(foot.force, Vec3::new(0.0, 0.0, 200.0));
            assert!((foot.zmp - Vector2::new(0.13, 0.08 * side + 0.01)).norm() < 1e-15, "{}", foot.zmp);
            assert!((foot.ankle.rotation - quarter_turn).norm() < 1e-15);
        }
    }
}
