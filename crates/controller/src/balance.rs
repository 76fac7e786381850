//! The stabiliser here, for robots whose driver has none.
//!
//! Built into a robot it corrects command *k* with what is measured at tick *k + 1*, when the drives take the command up.
//! Here it has what is measured at tick *k*, and nothing newer reaches it: it acts one period later. What that costs is
//! in `docs/walks.md`. The internal state does not know of it: only the references that leave the process are corrected.

use crate::convert;
use crate::settings::ControllerError;
use messages::{CONTROL_PERIOD_S, RobotCommand, RobotState as StateMessage};
use multibody::{FrameIndex, JointIndex, Model, Workspace, forward_kinematics};
use nalgebra::DVector;
use robot::{JointMap, Robot};
use robot_model::{RobotModelError, leg_joints};
use spatial::{Vec3, Wrench};
use stabiliser::{Leg, Sensed, Stabiliser, StabiliserSettings};
use state::Measured;

/// The stabiliser with what it needs of the robot.
pub(crate) struct Balance {
    stabiliser: Stabiliser,
    /// References in the model's order (rad).
    references: DVector<f64>,
    /// About the sensors' origins, in their axes.
    foot_wrenches: [Wrench; 2],
}

impl Balance {
    /// For a robot of this folder.
    ///
    /// # Errors
    /// [`ControllerError`] names setting, joint, frame or leg.
    pub fn new(
        settings: StabiliserSettings,
        robot: &Robot,
        model: &Model,
        ankles: [FrameIndex; 2],
        imu: FrameIndex,
    ) -> Result<Self, ControllerError> {
        settings.check().map_err(|error| error.under("stabiliser"))?;
        let unknown = |source| RobotModelError::unknown(robot, source);
        let names = leg_joints(robot)?;
        let leg = |foot: usize| {
            let mut joints = [JointIndex(0); 6];
            for (joint, name) in joints.iter_mut().zip(&names[foot]) {
                *joint = model.joint(name).map_err(unknown)?;
            }
            let sensor = model.frame(&robot.description.feet[foot].force_sensor_frame).map_err(unknown)?;
            let ankle_in_sole_m = Vec3::from(robot.sole.foot.ankle_in_sole_m(foot));
            Leg::of_model(model, joints, ankles[foot], sensor, &ankle_in_sole_m)
                .map_err(|source| ControllerError::Leg { side: ["left", "right"][foot], source })
        };
        let legs = [leg(0)?, leg(1)?];
        let mut ws = Workspace::new(model);
        let neutral = model.neutral();
        let placed = forward_kinematics(model, &mut ws, &neutral);
        let imu_in_base = (placed.pose(model.base_frame()).inverse() * placed.pose(imu)).rotation;
        Ok(Self {
            stabiliser: Stabiliser::new(settings, model, legs, imu_in_base),
            references: DVector::zeros(model.joint_count()),
            foot_wrenches: [Wrench::zero(); 2],
        })
    }

    /// Takes the forces of a state whose numbers are finite.
    pub fn feel(&mut self, state: &StateMessage) {
        self.foot_wrenches = state.foot_wrench_n_nm.map(|wrench| Wrench::from_vector(&wrench.into()));
    }

    /// Corrects the joint references of a command by the last measurement; without an orientation it leaves them alone.
    pub fn correct(&mut self, model: &Model, joints: &JointMap, measured: &Measured, command: &mut RobotCommand) {
        let Some(orientation) = measured.imu_rotation else { return };
        joints.from_interface(&command.joint_position_reference_rad, self.references.as_mut_slice());
        let sensed = Sensed {
            joint_positions: &measured.joints,
            joint_rates: &measured.joint_rates,
            orientation,
            angular_velocity: measured.gyro,
            foot_wrenches: self.foot_wrenches,
        };
        let plan = convert::stabiliser_plan(&command.plan);
        self.stabiliser.step(model, &self.references, &plan, &sensed, CONTROL_PERIOD_S);
        let corrected = self.stabiliser.joint_positions();
        // A command that is not finite is refused by every driver; the uncorrected one is not.
        if corrected.iter().all(|angle| angle.is_finite()) {
            joints.to_interface(corrected.as_slice(), &mut command.joint_position_reference_rad);
        }
    }
}
