//! `config/recorder.toml`, where every key is documented, and what is read with it.

use lateness::RightsSettings;
use ranges::{OutOfRange, Range};
use recording::{Follower, Link, RunInfo, ViewerSettings};
use robot::{Robot, RobotError};
use robot_model::{Motion, RobotModelError};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    robot: PathBuf,
    sole_file: Option<PathBuf>,
    output_file: PathBuf,
    #[serde(default)]
    overwrite: bool,
    #[serde(default)]
    scenario: String,
    #[serde(default)]
    settings: Vec<String>,
    attachment_folder: PathBuf,
    flush_period_s: f64,
    contact_every_ticks: i64,
    scene_every_ticks: i64,
    #[serde(default = "own_rights")]
    real_time: RightsSettings,
}

/// What the recorder asks of the system by the clock.
fn own_rights() -> RightsSettings {
    RightsSettings::background(0)
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
    /// The recording; `{start}` in its name stands for the time at which it is begun.
    pub output_file: PathBuf,
    /// Whether a finished recording of this name is replaced.
    pub overwrite: bool,
    /// What was launched, if a launcher did.
    pub scenario: String,
    /// What was changed for it on the command line.
    pub settings: Vec<String>,
    /// Folder whose files are attached.
    pub attachment_folder: Option<PathBuf>,
    /// How often everything so far is made readable.
    pub flush_period_s: f64,
    /// Every how many ticks node-by-node contact is recorded.
    pub contact_every_ticks: i64,
    /// What the viewers' messages need to know.
    pub viewer: ViewerSettings,
    /// What it asks of the system by the clock.
    pub real_time: RightsSettings,
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

/// How often a recording is made readable (s).
const FLUSH_PERIOD_S: Range = Range::between(0.01, 60.0);
/// Every how many ticks something is recorded: an hour of them is as good as never.
const STRIDE_TICKS: Range = Range::between(1.0, 720_000.0);

impl TryFrom<File> for RecorderSettings {
    type Error = OutOfRange;

    fn try_from(file: File) -> Result<Self, OutOfRange> {
        FLUSH_PERIOD_S.demand("flush_period_s", file.flush_period_s, "a killed recorder loses this much: 0.5 to 5")?;
        for (key, found) in
            [("contact_every_ticks", file.contact_every_ticks), ("scene_every_ticks", file.scene_every_ticks)]
        {
            STRIDE_TICKS.demand(key, found as f64, "1 records every tick")?;
        }
        let attachment_folder = Some(file.attachment_folder).filter(|folder| !folder.as_os_str().is_empty());
        Ok(Self {
            robot_folder: file.robot,
            sole_file: file.sole_file,
            sole_files: Vec::new(),
            output_file: file.output_file,
            overwrite: file.overwrite,
            scenario: file.scenario,
            settings: file.settings,
            attachment_folder,
            flush_period_s: file.flush_period_s,
            contact_every_ticks: file.contact_every_ticks,
            viewer: ViewerSettings { scene_every_ticks: file.scene_every_ticks, ..ViewerSettings::default() },
            real_time: file.real_time,
        })
    }
}

/// What viewers are told of a robot: names of joints and links, shapes, sizes.
///
/// # Errors
/// If its URDF is not as it should be.
pub fn viewer_settings(robot: &Robot) -> Result<ViewerSettings, RobotModelError> {
    let joint_names = robot.description.joints.clone();
    let followers: Vec<Follower> = robot_model::followers(robot)?
        .into_iter()
        .map(|robot_model::Follower { name, leader, multiplier, offset }| Follower { name, leader, multiplier, offset })
        .collect();
    let names = joint_names.iter().chain(followers.iter().map(|follower| &follower.name));
    let names: Vec<&String> = names.collect();
    let links = robot_model::drawn_links(robot)?.into_iter().map(|link| Link {
        moved_by: match link.motion {
            Motion::Fixed => None,
            Motion::Turns | Motion::Slides => names.iter().position(|name| **name == link.joint),
        },
        name: link.name,
        parent: link.parent,
        position_m: link.position_m,
        rotation: link.rotation,
        axis: link.axis,
        slides: link.motion == Motion::Slides,
    });
    let links = links.collect();
    Ok(ViewerSettings {
        joint_names,
        followers,
        base_link: robot.description.base_link.clone(),
        links,
        urdf: robot.urdf.clone(),
        sole_size_m: robot.sole_outline().size_m,
        ..ViewerSettings::default()
    })
}

/// Files larger than this are not attached (meshes for the eye).
const ATTACHMENT_MAX_BYTES: u64 = 8 << 20;
/// All attached files together are not larger than this.
const ATTACHMENTS_MAX_BYTES: u64 = 64 << 20;

impl RecorderSettings {
    /// Reads the robot: names and sizes for the viewers.
    ///
    /// # Errors
    /// If the robot's folder is not as it should be.
    pub fn read_robot(&mut self) -> Result<(), UnusableRobot> {
        let robot = Robot::load_on(&self.robot_folder, self.sole_file.as_deref())?;
        self.viewer = ViewerSettings { scene_every_ticks: self.viewer.scene_every_ticks, ..viewer_settings(&robot)? };
        self.sole_files =
            std::iter::once(robot.sole_file.clone()).chain(robot.sole.mesh_file(&robot.sole_file)).collect();
        Ok(())
    }

    /// Where a recording is written that is begun at some time.
    #[must_use]
    pub fn output_path(&self, start: SystemTime) -> PathBuf {
        let name = self.output_file.file_name().unwrap_or_default().to_string_lossy();
        self.output_file.with_file_name(name.replace("{start}", &files::utc::compact(start)))
    }

    /// Facts about this run and the files to attach: those of the attachment folder and of the robot's folder, and
    /// the sole if it is none of them.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn run_info(&self, facts: &[(&str, String)]) -> std::io::Result<RunInfo> {
        let mut info = RunInfo::default();
        info.facts.extend(facts.iter().map(|(key, value)| ((*key).to_string(), value.clone())));
        let launched = [("scenario", self.scenario.clone()), ("settings", self.settings.join(" "))];
        info.facts.extend(launched.map(|(key, value)| (key.to_string(), value)));
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

/// Attaches the files of a folder and, as far as names are believed, of the folders in it: meshes.
fn attach(folder: &Path, prefix: &str, info: &mut RunInfo) -> std::io::Result<()> {
    let mut paths: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        paths.push(entry?.path());
    }
    // The order in which a file system lists its files must not change the recording.
    paths.sort();
    for path in paths {
        let Some(name) = path.file_name() else { continue };
        let name = format!("{prefix}/{}", name.to_string_lossy());
        if !files::stays_inside(Path::new(&name)) {
            continue;
        }
        // Not followed: a link to a folder may lead round in a circle.
        if path.symlink_metadata()?.is_dir() {
            attach(&path, &name, info)?;
        } else {
            attach_file(&path, prefix, info)?;
        }
    }
    Ok(())
}

/// Attaches a file; one that is too large, or of another kind, is left out and named.
fn attach_file(path: &Path, prefix: &str, info: &mut RunInfo) -> std::io::Result<()> {
    let Some(name) = path.file_name() else { return Ok(()) };
    let attached: u64 = info.files.iter().map(|(_, content)| content.len() as u64).sum();
    let room = ATTACHMENT_MAX_BYTES.min(ATTACHMENTS_MAX_BYTES.saturating_sub(attached));
    match files::read(path, room) {
        Ok(content) => info.files.push((format!("{prefix}/{}", name.to_string_lossy()), content)),
        Err(error) if error.get_ref().is_some_and(|inner| inner.is::<files::Refused>()) => {
            tracing::warn!("{} is not attached to the recording: it {error}", path.display());
        }
        Err(error) => return Err(error),
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
            overwrite: false,
            scenario: String::new(),
            settings: Vec::new(),
            attachment_folder: None,
            flush_period_s: 1.0,
            contact_every_ticks: 1,
            viewer: ViewerSettings::default(),
            real_time: RightsSettings::default(),
        }
    }

    #[test]
    fn meshes_in_folders_are_attached_and_what_is_no_file_is_not() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::create_dir_all(folder.path().join("meshes/left")).expect("writable");
        std::fs::write(folder.path().join("meshes/left/foot.stl"), "solid").expect("writable");
        std::fs::write(folder.path().join("robot.toml"), "x").expect("writable");
        std::os::unix::fs::symlink("/dev/zero", folder.path().join("zero")).expect("a link");
        std::os::unix::fs::symlink(".", folder.path().join("round")).expect("a link");
        let info = settings(folder.path()).run_info(&[]).expect("readable");
        let names: Vec<&str> = info.files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["robot/meshes/left/foot.stl", "robot/robot.toml"]);
    }

    #[test]
    fn recordings_are_called_after_their_begin_where_that_is_wanted() {
        let mut settings = settings(Path::new(""));
        settings.output_file = PathBuf::from("a/walk-{start}.mcap");
        let time = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(1_795_297_512);
        assert_eq!(settings.output_path(time), Path::new("a/walk-20261121T214512Z.mcap"));
        settings.output_file = PathBuf::from("walk.mcap");
        assert_eq!(settings.output_path(time), Path::new("walk.mcap"));
    }

    #[test]
    fn viewers_are_told_of_joints_that_follow_others() {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4");
        let mut plain = settings(&shipped);
        plain.read_robot().expect("it ships");
        let links = &plain.viewer.links;
        assert_eq!(links.iter().filter(|link| link.moved_by.is_some()).count(), 34, "a link for each joint");
        assert!(links.len() > 34 && plain.viewer.urdf.contains("<robot"));
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
