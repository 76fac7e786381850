//! The files of a recording, where a process can read them.

use crate::error::ReplayError;
use messages::code::Process;
use recording::Recording;
use scenario::{Config, Setting};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Configuration and robot of a recorded run in a folder of their own, which goes with this value.
#[derive(Debug)]
pub struct Unpacked {
    folder: TempDir,
}

impl Unpacked {
    /// Writes the attached files.
    ///
    /// # Errors
    /// If the recording is damaged or there is no room for its files.
    pub fn new(recording: &Recording) -> Result<Self, ReplayError> {
        let failed = |path: PathBuf| move |source| ReplayError::Unpack { path, source };
        let folder = TempDir::with_prefix("soleus-replay-").map_err(failed(std::env::temp_dir()))?;
        for (name, content) in recording.files()? {
            // Names are a folder and a file, as the recorder gives them; anything else is not ours to write.
            let Some((group, file)) = name.split_once('/').filter(|(group, file)| is_plain(group) && is_plain(file))
            else {
                tracing::warn!("the attachment `{name}` is left out: not the name of a file in a folder");
                continue;
            };
            let group = folder.path().join(group);
            std::fs::create_dir_all(&group).map_err(failed(group.clone()))?;
            let path = group.join(file);
            std::fs::write(&path, content).map_err(failed(path.clone()))?;
        }
        Ok(Self { folder })
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
        let config = Config::read(&path)?;
        let mut moved = vec![setting("robot", &self.folder.path().join("robot"))];
        if let Some(sole_file) = config.table().get("sole_file").and_then(|value| value.as_str())
            && let Some(name) = Path::new(sole_file).file_name()
        {
            // Attached as one of the robot's files if it lies in the robot's folder, else apart.
            let places = ["sole", "robot"].map(|group| self.folder.path().join(group).join(name));
            let place = places.iter().find(|place| place.is_file());
            let attached = || ReplayError::NotAttached { name: format!("sole/{}", name.to_string_lossy()) };
            moved.push(setting("sole_file", place.ok_or_else(attached)?));
        }
        Ok(config.with_settings(&moved))
    }
}

fn setting(key: &str, path: &Path) -> Setting {
    Setting { key: vec![key.to_string()], value: path.display().to_string().into() }
}

/// Whether a name stays in its folder.
fn is_plain(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    matches!((parts.next(), parts.next()), (Some(std::path::Component::Normal(_)), None))
}
