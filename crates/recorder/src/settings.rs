//! `config/recorder.toml`, where every key is documented, and what is read with it.

use recording::{Follower, RunInfo, ViewerSettings};
use robot::{Robot, RobotError};
use robot_model::RobotModelError;
use serde::Deserialize;
use std::path::{Path, PathBuf};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    robot: PathBuf,
    sole_file: Option<PathBuf>,
    output_file: PathBuf,
    attachment_folder: PathBuf,
    flush_period_s: f64,
    contact_every_ticks: i64,
    scene_every_ticks: i64,
}

/// Settings of the recorder, checked.
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "File")]
pub struct RecorderSettings {
    /// The robot's folder.
    pub robot_folder: PathBuf,
    /// Another sole than that of the robot's folder.
    pub sole_file: Option<PathBuf>,
    /// The description of the sole, and its mesh if it has one; known once the robot has been read.
    pub sole_files: Vec<PathBuf>,
    /// The recording.
    pub output_file: PathBuf,
    /// Folder whose files are attached.
    pub attachment_folder: Option<PathBuf>,
    /// How often everything so far is made readable.
    pub flush_period_s: f64,
    /// Every how many ticks node-by-node contact is recorded.
    pub contact_every_ticks: i64,
    /// What the viewers' messages need to know.
    pub viewer: ViewerSettings,
}

/// A setting is out of its range.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum SettingsError {
    /// The flush period.
    #[error("flush_period_s = {found}: must be between 0.01 and 60")]
    FlushPeriod {
        /// In the file.
        found: f64,
    },
    /// A stride.
    #[error("{key} = {found}: must be at least 1")]
    Stride {
        /// Which key.
        key: &'static str,
        /// In the file.
        found: i64,
    },
}

/// The robot cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum UnusableRobot {
    /// Its folder.
    #[error(transparent)]
    Folder(#[from] RobotError),
    /// Its URDF.
    #[error(transparent)]
    Model(#[from] RobotModelError),
}

impl TryFrom<File> for RecorderSettings {
    type Error = SettingsError;

    fn try_from(file: File) -> Result<Self, SettingsError> {
        if !(0.01..=60.0).contains(&file.flush_period_s) {
            return Err(SettingsError::FlushPeriod { found: file.flush_period_s });
        }
        for (key, found) in
            [("contact_every_ticks", file.contact_every_ticks), ("scene_every_ticks", file.scene_every_ticks)]
        {
            if found < 1 {
                return Err(SettingsError::Stride { key, found });
            }
        }
        let attachment_folder = Some(file.attachment_folder).filter(|folder| !folder.as_os_str().is_empty());
        Ok(Self {
            robot_folder: file.robot,
            sole_file: file.sole_file,
            sole_files: Vec::new(),
            output_file: file.output_file,
            attachment_folder,
            flush_period_s: file.flush_period_s,
            contact_every_ticks: file.contact_every_ticks,
            viewer: ViewerSettings { scene_every_ticks: file.scene_every_ticks, ..ViewerSettings::default() },
        })
    }
}

/// Files larger than this are not attached (meshes for the eye).
const ATTACHMENT_MAX_BYTES: u64 = 8 << 20;

impl RecorderSettings {
    /// Reads the robot: names and sizes for the viewers.
    ///
    /// # Errors
    /// If the robot's folder is not as it should be.
    pub fn read_robot(&mut self) -> Result<(), UnusableRobot> {
        let robot = Robot::load_on(&self.robot_folder, self.sole_file.as_deref())?;
        self.viewer.joint_names = robot.description.joints.clone();
        self.viewer.followers = robot_model::followers(&robot)?
            .into_iter()
            .map(|robot_model::Follower { name, leader, multiplier, offset }| Follower {
                name,
                leader,
                multiplier,
                offset,
            })
            .collect();
        self.viewer.base_link = robot.description.base_link.clone();
        self.viewer.sole_size_m = robot.sole_outline().size_m;
        self.sole_files =
            std::iter::once(robot.sole_file.clone()).chain(robot.sole.mesh_file(&robot.sole_file)).collect();
        Ok(())
    }

    /// Facts about this run and the files to attach: those of the attachment folder and of the robot's folder, and
    /// the sole if it is none of them.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn run_info(&self, facts: &[(&str, String)]) -> std::io::Result<RunInfo> {
        let mut info = RunInfo::default();
        info.facts.extend(facts.iter().map(|(key, value)| ((*key).to_string(), value.clone())));
        if let Some(folder) = &self.attachment_folder {
            attach(folder, "config", &mut info)?;
        }
        attach(&self.robot_folder, "robot", &mut info)?;
        for path in self.sole_files.iter().filter(|path| path.parent() != Some(&self.robot_folder)) {
            attach_file(path, "sole", &mut info)?;
        }
        Ok(info)
    }
}

fn attach(folder: &Path, prefix: &str, info: &mut RunInfo) -> std::io::Result<()> {
    let mut paths: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        paths.push(entry?.path());
    }
    // The order in which a file system lists its files must not change the recording.
    paths.sort();
    for path in paths {
        attach_file(&path, prefix, info)?;
    }
    Ok(())
}

fn attach_file(path: &Path, prefix: &str, info: &mut RunInfo) -> std::io::Result<()> {
    let metadata = path.metadata()?;
    if let (true, Some(name)) = (metadata.is_file() && metadata.len() <= ATTACHMENT_MAX_BYTES, path.file_name()) {
        info.files.push((format!("{prefix}/{}", name.to_string_lossy()), std::fs::read(path)?));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Settings for the robot of a folder.
    fn settings(robot_folder: &Path) -> RecorderSettings {
        RecorderSettings {
            robot_folder: robot_folder.to_owned(),
            sole_file: None,
            sole_files: Vec::new(),
            output_file: PathBuf::new(),
            attachment_folder: None,
            flush_period_s: 1.0,
            contact_every_ticks: 1,
            viewer: ViewerSettings::default(),
        }
    }

    #[test]
    fn viewers_are_told_of_joints_that_follow_others() {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4");
        let mut plain = settings(&shipped);
        plain.read_robot().expect("it ships");
        assert_eq!((plain.viewer.joint_names.len(), plain.viewer.followers.len()), (34, 0));

        // The same robot, one finger of which closes with the thumb and has no drive of its own.
        let folder = tempfile::tempdir().expect("a temporary folder");
        let copy = |name: &str, change: &dyn Fn(String) -> String| {
            let text = std::fs::read_to_string(shipped.join(name)).expect("it ships");
            std::fs::write(folder.path().join(name), change(text)).expect("room");
        };
        let finger = r#"<joint name="R_HAND_J1" type="revolute">"#;
        copy("sole.toml", &|text| text);
        copy("hrp4.urdf", &|text| text.replacen(finger, &format!(r#"{finger}<mimic joint="R_HAND_J0"/>"#), 1));
        copy("robot.toml", &|text| text);
        let refused = settings(folder.path()).read_robot().expect_err("robot.toml lists it still").to_string();
        assert!(refused.contains("R_HAND_J1") && refused.contains("robot.toml"), "{refused}");
        copy("robot.toml", &|text| text.replace(r#", "R_HAND_J1""#, ""));
        let mut coupled = settings(folder.path());
        coupled.read_robot().expect("one joint less");
        let leader = coupled.viewer.joint_names.iter().position(|name| name == "R_HAND_J0");
        let follower = Follower { name: "R_HAND_J1".to_string(), leader, multiplier: 1.0, offset: 0.0 };
        assert_eq!((coupled.viewer.joint_names.len(), coupled.viewer.followers), (33, vec![follower]));
    }
}
