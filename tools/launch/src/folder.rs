//! The folder of a run: effective configuration, logs, recording.

use crate::{Ending, Launch};
use node::ExitCode;
use scenario::Scenario;
use std::fs::{DirBuilder, OpenOptions};
use std::io::Write;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use toml::Value;

/// The folder of a run.
pub struct RunFolder {
    /// Where it is, absolute.
    pub path: PathBuf,
    /// What was there before.
    before: Before,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Before {
    Nothing,
    EmptyFolder,
    AnotherRun,
}

/// What a run that was refused may have put into its folder.
const PARTS: [&str; 5] = ["config", "logs", "programs", "walk.mcap", "walk.mcap.partial"];

impl RunFolder {
    /// Makes the folder and writes the effective configuration of every process into it. Nothing that is there is touched unless
    /// that is asked for.
    pub fn create(scenario: &Scenario, arguments: &Launch) -> Result<Self, Ending> {
        let path = arguments.out.clone().unwrap_or_else(|| unused(&scenario.name));
        let failed = |error: std::io::Error| {
            Ending::new(ExitCode::Start, format!("cannot make the run folder {}: {error}", path.display()))
        };
        let path = std::path::absolute(&path).map_err(failed)?;
        let before = match path.read_dir().map(Iterator::count) {
            Err(_) => Before::Nothing,
            Ok(0) => Before::EmptyFolder,
            Ok(_) => Before::AnotherRun,
        };
        if before == Before::AnotherRun && !arguments.overwrite {
            let path = path.display();
            let reason = format!("--out {path}: there is something in it; name another folder, or add --overwrite");
            return Err(Ending::new(ExitCode::Configuration, reason));
        }
        let folder = Self { path, before };
        let filled = folder.fill(scenario, arguments);
        if filled.is_err() {
            folder.remove();
        }
        let failed = |error| {
            let path = folder.path.display();
            Ending::new(ExitCode::Start, format!("cannot make the run folder {path}: {error}"))
        };
        filled.map_err(failed)?;
        Ok(folder)
    }

    fn fill(&self, scenario: &Scenario, arguments: &Launch) -> std::io::Result<()> {
        let (folder, path) = (self, &self.path);
        for folder in [path.clone(), path.join("config"), path.join("logs")] {
            DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
        }
        let write = |path: &Path, text: &str| {
            let options = OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(path);
            options.and_then(|mut file| file.write_all(text.as_bytes()))
        };
        let text = files::read_text(&scenario.path, files::CONFIG_MAX_BYTES)?;
        write(&folder.config("scenario"), &text)?;
        let judged_by = scenario.report.effective_text();
        write(&folder.config("report"), &format!("# What the run is judged by.\n{judged_by}"))?;
        // What a former run said must not be taken for this one's.
        for former in [folder.figures(), folder.page()] {
            match std::fs::remove_file(former) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        for (process, config) in scenario.processes() {
            let mut table = config.table().clone();
            if process == "recorder" {
                let text = |path: PathBuf| Value::String(path.display().to_string());
                table.insert("output_file".to_string(), text(folder.recording()));
                table.insert("overwrite".to_string(), Value::Boolean(arguments.overwrite));
                table.insert("attachment_folder".to_string(), text(folder.path.join("config")));
                table.insert("scenario".to_string(), Value::String(scenario.name.clone()));
                let settings = arguments.settings.iter().map(|setting| Value::String(setting.to_string())).collect();
                table.insert("settings".to_string(), Value::Array(settings));
            }
            if let Some(Value::Table(programs)) = table.get_mut("programs") {
                let folder = path.join("programs").display().to_string();
                programs.entry("output_folder").or_insert(Value::String(folder));
            }
            let text = toml::to_string_pretty(&table).expect("what was read from TOML can be written as TOML");
            let title = format!("# Effective configuration of the {process} in scenario `{}`.\n", scenario.name);
            write(&folder.config(process), &(title + &text))?;
        }
        Ok(())
    }

    /// Takes back what was made, for a run that was refused before anything moved; what was there before stays.
    pub fn remove(&self) {
        if self.before == Before::AnotherRun {
            return;
        }
        for part in PARTS.map(|part| self.path.join(part)) {
            // What cannot be removed can be looked at.
            let _ = if part.is_dir() && !part.is_symlink() {
                std::fs::remove_dir_all(&part)
            } else {
                std::fs::remove_file(&part)
            };
        }
        if self.before == Before::Nothing {
            let _ = std::fs::remove_dir(&self.path);
        }
    }

    /// What the recorder said about recordings that it found unfinished here.
    pub fn recovered(&self) -> Vec<String> {
        let said = std::fs::read_to_string(self.log("recorder")).unwrap_or_default();
        let found = said.lines().filter_map(|line| line.find(RECOVERED).map(|at| line[at..].to_string()));
        found.collect()
    }

    /// The recording.
    pub fn recording(&self) -> PathBuf {
        self.path.join("walk.mcap")
    }

    /// The figures of the run.
    pub fn figures(&self) -> PathBuf {
        self.path.join("figures.json")
    }

    /// The page of the run.
    pub fn page(&self) -> PathBuf {
        self.path.join("report.html")
    }

    /// What the run is called.
    pub fn name(&self) -> String {
        self.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }

    /// Configuration of a process.
    pub fn config(&self, process: &str) -> PathBuf {
        self.path.join("config").join(format!("{process}.toml"))
    }

    /// What a process said.
    pub fn log(&self, process: &str) -> PathBuf {
        self.path.join("logs").join(format!("{process}.log"))
    }
}

/// How the recorder begins when it says that it has finished a recording for one that was killed.
const RECOVERED: &str = "recovered ";

/// A folder of a time and a scenario that is not there yet: `runs/20261121T214512Z-flat`.
fn unused(scenario: &str) -> PathBuf {
    let name = format!("runs/{}-{scenario}", files::utc::compact(SystemTime::now()));
    let numbered = (2..).map(|number| PathBuf::from(format!("{name}-{number}")));
    let mut names = std::iter::once(PathBuf::from(&name)).chain(numbered);
    names.find(|path| !path.exists()).expect("a folder has not all of them")
}
