//! Where a walk begins.

use multibody::FrameIndex;
use nalgebra::DVector;
use wholebody::{
    ConfigurationError, ConfigurationTargets, RobotState, WholeBody, WholeBodyReference, initial_configuration,
};

/// What the start of a walk takes from the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Frames of the ankles, left and right.
    pub ankles: [FrameIndex; 2],
    /// Frame of the torso.
    pub torso: FrameIndex,
    /// Joint positions to stay close to, in the model's order (rad).
    pub posture: DVector<f64>,
}

impl Start {
    /// Frames and posture of a whole body, as its settings name them.
    ///
    /// # Panics
    /// If the settings name what the model does not have: [`WholeBody::new`] has refused that.
    #[must_use]
    pub fn of(body: &WholeBody) -> Self {
        let (model, settings) = (body.model(), body.settings());
        let frame = |name: &str| model.frame(name).expect("WholeBody::new has found it");
        let mut posture = DVector::zeros(model.joint_count());
        for target in &settings.posture {
            posture[model.joint(&target.joint).expect("WholeBody::new has found it").0] = target.position_rad;
        }
        let ankles = settings.feet.each_ref().map(|foot| frame(&foot.ankle_link));
        Self { ankles, torso: frame(&settings.torso_link), posture }
    }
}

/// At rest, nearest to the posture with centre of mass, ankles and torso in place.
///
/// # Errors
/// If no configuration within the joint limits has them there.
pub fn start(body: &WholeBody, from: &Start, wanted: &WholeBodyReference) -> Result<RobotState, ConfigurationError> {
    let targets = ConfigurationTargets {
        com: wanted.com_position,
        ankles: from.ankles,
        ankle_poses: wanted.feet.map(|foot| foot.ankle_pose),
        torso: from.torso,
        torso_rotation: wanted.torso_rotation,
        posture: from.posture.clone(),
        limit_margin_rad: body.settings().constraints.position_margin_rad,
    };
    let q = initial_configuration(body.model(), &targets)?;
    Ok(RobotState { q, v: DVector::zeros(body.model().nv()) })
}
