//! Joints of the robot's interface and joints of a scene's model.

use crate::RobotDescription;

/// Which joint of the robot's interface (`robot.toml`, all joints) each joint of a scene's model is. Joints that the scene
/// locks have a place in the interface only; they rest at the half-sitting posture.
#[derive(Debug, Clone, PartialEq)]
pub struct JointMap {
    interface_of_model: Vec<usize>,
    resting_rad: Vec<f64>,
}

impl JointMap {
    /// Map of a model whose joints have these names, in its order. `None` if a name is no joint of the robot.
    pub fn new<'a>(robot: &RobotDescription, model_joints: impl IntoIterator<Item = &'a str>) -> Option<Self> {
        let index = |name: &str| robot.joints.iter().position(|joint| joint == name);
        let interface_of_model = model_joints.into_iter().map(index).collect::<Option<Vec<_>>>()?;
        let resting_rad = robot.joints.iter().map(|joint| robot.half_sitting_rad(joint)).collect();
        Some(Self { interface_of_model, resting_rad })
    }

    /// Number of joints in the interface.
    #[must_use]
    pub fn interface_count(&self) -> usize {
        self.resting_rad.len()
    }

    /// Half-sitting position of every joint of the interface (rad).
    #[must_use]
    pub fn resting_rad(&self) -> &[f64] {
        &self.resting_rad
    }

    /// The bit of a joint of the model among those of the interface: its bit *i* is joint *i*.
    ///
    /// # Panics
    /// If the model has no such joint, or the interface more than 64.
    #[must_use]
    pub fn interface_bit(&self, model_joint: usize) -> u64 {
        1 << self.interface_of_model[model_joint]
    }

    /// Writes the model's values into an array in the interface's order; other joints keep what is there.
    ///
    /// # Panics
    /// If one of the arrays is too short.
    pub fn to_interface(&self, model: &[f64], interface: &mut [f64]) {
        for (value, index) in model.iter().zip(&self.interface_of_model) {
            interface[*index] = *value;
        }
    }

    /// Reads the model's values out of an array in the interface's order.
    ///
    /// # Panics
    /// If one of the arrays is too short.
    pub fn from_interface(&self, interface: &[f64], model: &mut [f64]) {
        for (value, index) in model.iter_mut().zip(&self.interface_of_model) {
            *value = interface[*index];
        }
    }
}
