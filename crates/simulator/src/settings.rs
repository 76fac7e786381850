//! The simulator's configuration.

use lateness::RightsSettings;
use multibody::Model;
use plant::ground::GroundShape;
use plant::sensor::SensorSettings;
use plant::settings::DriveSettings;
use plant::{PlantFrames, PlantSettings, PlantSoleSettings};
use ranges::{OutOfRange, Range};
use robot::Robot;
use robot_model::{RobotModelError, leg_joints};
use serde::Deserialize;
use std::path::PathBuf;

/// `config/simulator.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulatorSettings {
    /// Folder of the robot.
    pub robot: PathBuf,
    /// Another sole than that of the robot's folder: a file like its `sole.toml`.
    #[serde(default)]
    pub sole_file: Option<PathBuf>,
    /// When the run ends.
    #[serde(default)]
    pub run: RunSettings,
    /// The plant's own soles.
    #[serde(default)]
    pub sole: PlantSoleSettings,
    /// The plant. Drives that it does not name come from the robot's folder.
    #[serde(default)]
    pub plant: PlantSettings,
    /// What it asks of the system by the clock.
    #[serde(default = "own_rights")]
    pub real_time: RightsSettings,
}

/// What the simulator asks of the system by the clock.
fn own_rights() -> RightsSettings {
    RightsSettings::fifo(70, 0)
}

/// When the run ends.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RunSettings {
    /// How long the robot goes on standing after the walk (s).
    pub after_walk_s: f64,
    /// How long it may take until the walk begins (s); longer ends the run. The controller, which knows what is in the way, gives up
    /// earlier.
    pub settle_time_max_s: f64,
}

impl Default for RunSettings {
    fn default() -> Self {
        Self { after_walk_s: 1.0, settle_time_max_s: 20.0 }
    }
}

/// Why there is no simulated robot.
#[derive(Debug, thiserror::Error)]
pub enum SimulatorError {
    /// The robot's folder.
    #[error(transparent)]
    Robot(#[from] robot::RobotError),
    /// Its model.
    #[error(transparent)]
    Model(#[from] RobotModelError),
    /// More joints than a message carries.
    #[error("{}: {found} joints, a message carries at most {}", .file.display(), messages::MAX_JOINTS)]
    TooManyJoints {
        /// The description.
        file: PathBuf,
        /// Number of joints.
        found: usize,
    },
    /// The stabiliser would ask for a ZMP that the sole does not carry.
    #[error(
        "plant.stabiliser.{field} = {found}, but the sole of {} carries {largest:.6} to either side: at most that, better 1 cm less", .file.display()
    )]
    StabiliserBeyondSole {
        /// Key in the simulator's configuration.
        field: &'static str,
        /// What it says (m).
        found: f64,
        /// Half of what carries (m).
        largest: f64,
        /// The description of the sole.
        file: PathBuf,
    },
    /// A setting cannot be.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// Its soles.
    #[error(transparent)]
    Soles(#[from] soles::SolesError),
    /// The plant.
    #[error("plant: {0}")]
    Plant(#[from] plant::PlantError),
}

/// A day (s).
const WAIT_S: Range = Range::between(0.0, 86_400.0);

/// Names of what the plant must know.
pub(crate) fn frames(robot: &Robot) -> Result<PlantFrames, RobotModelError> {
    let description = &robot.description;
    let feet = &description.feet;
    Ok(PlantFrames {
        imu: description.imu_frame.clone(),
        ankles: [0, 1].map(|foot| feet[foot].ankle_frame.clone()),
        force_sensors: [0, 1].map(|foot| feet[foot].force_sensor_frame.clone()),
        legs: leg_joints(robot)?,
    })
}

impl SimulatorSettings {
    /// Is every value one that can be?
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        WAIT_S.demand("run.after_walk_s", self.run.after_walk_s, "a second is usual")?;
        let settle = "longer than the controller's settle.time_max_s";
        WAIT_S.demand("run.settle_time_max_s", self.run.settle_time_max_s, settle)?;
        self.sole.check()?;
        self.plant.check().map_err(|wrong| wrong.under("plant"))
    }

    /// What the plant models, one part a line.
    pub(crate) fn models(&self) -> Vec<String> {
        let sole = &self.sole;
        let mut soles = format!("soles: {:?}", sole.level).to_lowercase();
        for (name, factor) in [
            ("young_modulus_factor", sole.young_modulus_factor),
            ("friction_factor", sole.friction_factor),
            ("thickness_factor", sole.thickness_factor),
        ] {
            if factor != 1.0 {
                soles += &format!(", {name} {factor}");
            }
        }
        let ground = match &self.plant.ground.shape {
            GroundShape::Flat => "flat".to_string(),
            GroundShape::Slope { rise_x, rise_y } => format!("a slope of {rise_x} forward, {rise_y} to the left"),
            GroundShape::Steps { rise_m, count, .. } => format!("{count} steps of {rise_m} m"),
            GroundShape::Bumps { height_m, length_m } => format!("bumps of {height_m} m every {length_m} m"),
            GroundShape::HeightField { heights_m, .. } => format!("a field of {} heights", heights_m.len()),
        };
        let exact = SensorSettings { seed: self.plant.sensors.seed, ..SensorSettings::default() };
        let sensors = if self.plant.sensors == exact { "exact" } else { "with errors" };
        let stabiliser = if self.plant.stabiliser.enabled { "on" } else { "off" };
        vec![
            soles,
            format!("ground: {ground}, {} patches of other friction", self.plant.ground.friction_patches.len()),
            format!("sensors: {sensors}"),
            format!("stabiliser in the robot: {stabiliser}"),
            format!("pushes: {}", self.plant.pushes.len()),
        ]
    }

    /// Does the stabiliser, if there is one, keep to what the sole carries?
    pub(crate) fn check_stabiliser(&self, robot: &Robot) -> Result<(), SimulatorError> {
        let stabiliser = &self.plant.stabiliser;
        let [half_length_m, half_width_m] = robot.sole_outline().carrying_m.map(|edge_m| 0.5 * edge_m);
        for (field, found, largest) in [
            ("zmp_half_length_m", stabiliser.zmp_half_length_m, half_length_m),
            ("zmp_half_width_m", stabiliser.zmp_half_width_m, half_width_m),
        ] {
            if stabiliser.enabled && found > largest {
                let file = robot.sole_file.clone();
                return Err(SimulatorError::StabiliserBeyondSole { field, found, largest, file });
            }
        }
        Ok(())
    }

    /// The plant's settings, with the robot's drives for the joints that are not named.
    pub(crate) fn plant(&self, robot: &Robot, model: &Model) -> PlantSettings {
        let mut settings = self.plant.clone();
        settings.step.control_period_s = messages::CONTROL_PERIOD_S;
        for joint in model.joints() {
            if let Some(servo) = robot.description.servo(&joint.name) {
                settings.servo.joints.entry(joint.name.clone()).or_insert(DriveSettings {
                    stiffness_nm_per_rad: servo.kp_nm_per_rad,
                    damping_nm_s_per_rad: servo.kd_nm_s_per_rad,
                    rotor_inertia_kg_m2: servo.rotor_inertia_kg_m2,
                    viscous_friction_nm_s_per_rad: servo.viscous_friction_nm_s_per_rad,
                    coulomb_friction_nm: servo.coulomb_friction_nm,
                    ..DriveSettings::default()
                });
            }
        }
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_stabiliser_keeps_to_what_the_sole_carries() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let mut settings: SimulatorSettings =
            scenario::load(&root.join("config/simulator.toml"), &[]).expect("it ships");
        for sole in ["sole.toml", "sole-rounded.toml"] {
            let file = settings.robot.join(sole);
            let robot = Robot::load_on(&settings.robot, Some(&file)).expect("it ships");
            settings.check_stabiliser(&robot).expect("what ships fits");
        }
        let mut robot = Robot::load(&settings.robot).expect("it ships");
        for (size_m, said) in [
            ([0.18, 0.13, 0.021], "zmp_half_length_m = 0.092, but"),
            ([0.23, 0.09, 0.021], "zmp_half_width_m = 0.047, but"),
        ] {
            robot.sole.mesh.box_m = Some(size_m);
            let refused = settings.check_stabiliser(&robot).expect_err("too small a sole").to_string();
            assert!(refused.contains(said) && refused.contains("sole.toml"), "no `{said}` in {refused}");
        }
        settings.plant.stabiliser.enabled = false;
        settings.check_stabiliser(&robot).expect("nobody asks for a ZMP");
    }

    #[test]
    fn drives_are_the_robot_s_unless_the_configuration_names_them() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let mut settings: SimulatorSettings =
            scenario::load(&root.join("config/simulator.toml"), &[]).expect("it ships");
        let mut robot = Robot::load(&settings.robot).expect("it ships");
        // Other than any default.
        for (k, servo) in robot.description.servos.iter_mut().enumerate() {
            (servo.kp_nm_per_rad, servo.kd_nm_s_per_rad) = (1000.0 + k as f64, 10.0 + k as f64);
            (servo.rotor_inertia_kg_m2, servo.coulomb_friction_nm) = (0.5 + k as f64, 3.0 + k as f64);
            servo.viscous_friction_nm_s_per_rad = 7.0 + k as f64;
        }
        let own = DriveSettings { stiffness_nm_per_rad: 42.0, ..DriveSettings::default() };
        settings.plant.servo.joints.insert("L_KNEE_P".to_owned(), own);
        let (model, _) = robot_model::walking_model(&robot).expect("it ships");
        let drives = settings.plant(&robot, &model).servo.joints;
        assert_eq!(drives.len(), model.joint_count());
        for joint in model.joints() {
            let (drive, servo) =
                (drives[&joint.name], robot.description.servo(&joint.name).expect("every joint has one"));
            if joint.name == "L_KNEE_P" {
                assert_eq!(drive, own);
                continue;
            }
            assert_eq!(
                (drive.stiffness_nm_per_rad, drive.damping_nm_s_per_rad),
                (servo.kp_nm_per_rad, servo.kd_nm_s_per_rad)
            );
            assert_eq!(drive.rotor_inertia_kg_m2, servo.rotor_inertia_kg_m2);
            assert_eq!(drive.coulomb_friction_nm, servo.coulomb_friction_nm);
            assert_eq!(drive.viscous_friction_nm_s_per_rad, servo.viscous_friction_nm_s_per_rad);
        }
    }
}
