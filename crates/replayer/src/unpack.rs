//! The files of a recording, where a process can read them.

use crate::error::ReplayError;
use messages::code::Process;
use recording::Recording;
use scenario::{Config, Setting, Table};
use std::fs::{File, Permissions};
use std::io::{ErrorKind, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::{Builder, TempDir};

/// Configuration and robot of a recorded run in a folder of their own, which goes with this value.
///
/// A recording may come from anybody. What is in it is written nowhere else, and nothing outside of the folder is
/// read for it: robot and sole name only files beside their own.
#[derive(Debug)]
pub struct Unpacked {
    folder: TempDir,
    /// Says to the next replay that this folder is in use; the system lets go of it however this process ends.
    _lock: File,
}

/// How the names of the folders begin.
const PREFIX: &str = "soleus-replay-";
/// The locked file in it.
const LOCK: &str = "in-use";

impl Unpacked {
    /// Writes the attached files, after removing the folders of replays that were killed.
    ///
    /// # Errors
    /// If the recording is damaged or there is no room for its files.
    pub fn new(recording: &Recording) -> Result<Self, ReplayError> {
        let failed = |path: PathBuf| move |source| ReplayError::Unpack { path, source };
        let place = std::env::temp_dir();
        remove_abandoned(&place);
        let own = Permissions::from_mode(0o700);
        let folder = Builder::new().prefix(PREFIX).permissions(own).tempdir_in(&place).map_err(failed(place))?;
        let lock_path = folder.path().join(LOCK);
        let lock = files::create_new(&lock_path).map_err(failed(lock_path))?;
        // Without locks in its file system nobody removes it in time.
        let _ = lock.try_lock();
        for (name, content) in recording.files()? {
            // Names are those of files in folders, as the recorder gives them; anything else is not ours to write.
            let is_ours = files::stays_inside(Path::new(&name)) && name.contains('/');
            if !is_ours {
                tracing::warn!(
                    "the attachment `{}` is left out: not the name of a file in a folder",
                    name.escape_debug()
                );
                continue;
            }
            let path = folder.path().join(&name);
            let parent = path.parent().expect("it is in a folder").to_path_buf();
            std::fs::create_dir_all(&parent).map_err(failed(parent))?;
            let content = of_today(&name, content);
            let written = files::create_new(&path).and_then(|mut file| file.write_all(&content));
            written.map_err(|source| match source.kind() {
                ErrorKind::AlreadyExists => ReplayError::AttachedTwice { name },
                _ => ReplayError::Unpack { path, source },
            })?;
        }
        Ok(Self { folder, _lock: lock })
    }

    /// The configuration a process had in the run, on the robot and sole of the run.
    ///
    /// # Errors
    /// If it was not attached or is no configuration.
    pub fn config(&self, process: Process) -> Result<Config, ReplayError> {
        let name = format!("config/{process}.toml");
        let path = self.folder.path().join(&name);
        if !path.is_file() {
            return Err(ReplayError::NotAttached { name });
        }
        let config = Config::read_alone(&path)?;
        let mut moved = self.moved(config.table(), &[])?;
        // What it was told of other processes is for the same robot.
        for (name, below) in config.table() {
            match below.as_table() {
                Some(below) if below.contains_key("robot") => moved.extend(self.moved(below, &[name])?),
                _ => {}
            }
        }
        Ok(config.with_settings(&moved))
    }

    /// Robot and sole of a table, where they lie now; `at` is where the table stands.
    fn moved(&self, table: &Table, at: &[&str]) -> Result<Vec<Setting>, ReplayError> {
        let setting = |key: &str, path: &Path| Setting {
            key: at.iter().chain([&key]).map(|part| (*part).to_string()).collect(),
            value: path.display().to_string().into(),
        };
        let mut moved = vec![setting("robot", &self.folder.path().join("robot"))];
        if let Some(sole_file) = table.get("sole_file") {
            let name = sole_file.as_str().and_then(|file| Path::new(file).file_name());
            let name = name.ok_or_else(|| ReplayError::NotAttached { name: format!("sole_file = {sole_file}") })?;
            // Attached as one of the robot's files if it lies in the robot's folder, else apart.
            let places = ["sole", "robot"].map(|group| self.folder.path().join(group).join(name));
            let place = places.iter().find(|place| place.is_file());
            let attached = || ReplayError::NotAttached { name: format!("sole/{}", name.to_string_lossy()) };
            moved.push(setting("sole_file", place.ok_or_else(attached)?));
        }
        Ok(moved)
    }
}

/// A robot's file without the key that had no effect and is none any more: `solver.tolerance` of a sole.
fn of_today(name: &str, content: Vec<u8>) -> Vec<u8> {
    let is_of_robot = ["robot/", "sole/"].iter().any(|group| name.starts_with(group)) && name.ends_with(".toml");
    let table = std::str::from_utf8(&content).ok().filter(|_| is_of_robot).and_then(|text| text.parse::<Table>().ok());
    let Some(mut table) = table else { return content };
    let solver = table.get_mut("solver").and_then(|solver| solver.as_table_mut());
    match solver.and_then(|solver| solver.remove("tolerance")) {
        Some(_) => table.to_string().into_bytes(),
        None => content,
    }
}

/// Removes the folders of replays that ended without doing so: ours, and locked by nobody. What cannot be removed
/// stays.
fn remove_abandoned(place: &Path) {
    let ours = std::fs::metadata("/proc/self").map_or(u32::MAX, |metadata| metadata.uid());
    for entry in std::fs::read_dir(place).into_iter().flatten().flatten() {
        if !entry.file_name().to_string_lossy().starts_with(PREFIX) {
            continue;
        }
        let path = entry.path();
        // Not followed: a link is nobody's folder.
        let is_ours = path.symlink_metadata().is_ok_and(|metadata| metadata.is_dir() && metadata.uid() == ours);
        let Some(age) = is_ours.then(|| path.metadata().and_then(|metadata| metadata.modified()).ok()).flatten() else {
            continue;
        };
        let is_free = match files::open(&path.join(LOCK)) {
            Ok((lock, _)) => lock.try_lock().is_ok(),
            // Just being made, or not of this kind; old ones are abandoned.
            Err(_) => age.elapsed().is_ok_and(|age| age > Duration::from_secs(60)),
        };
        if is_free {
            let _ = std::fs::remove_dir_all(&path);
        }
    }
}
