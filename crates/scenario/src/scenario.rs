//! A scenario: the configurations of all processes.

use crate::config::{Config, nearest, parse_table};
use crate::error::{ConfigError, Origin, Problem};
use crate::locate::line_of;
use crate::setting::{EXAMPLE, Setting};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// The processes a scenario may name.
pub const PROCESSES: [&str; 5] = ["planner", "estimator", "controller", "simulator", "recorder"];

/// The section of what a run is judged by.
const REPORT: &str = "report";

/// A scenario, read and merged; every process's configuration is checked when it is parsed into its settings.
#[derive(Debug, Clone)]
pub struct Scenario {
    /// The file's name without its ending.
    pub name: String,
    /// One sentence about it.
    pub title: String,
    /// The scenario's file.
    pub path: PathBuf,
    /// The robot's folder, absolute. Also in every process's configuration, as its key `robot`.
    pub robot: PathBuf,
    /// The sole it stands on, absolute, if it is not that of the robot's folder. Also in every process's configuration, as its key
    /// `sole_file`.
    pub sole_file: Option<PathBuf>,
    /// What the run is judged by: the section `report`.
    pub report: Config,
    parts: BTreeMap<&'static str, Part>,
}

#[derive(Debug, Clone)]
struct Part {
    on: bool,
    config: Config,
}

impl Scenario {
    /// Reads a scenario and the configuration files it names, and changes single keys (`planner.gait.lambda=0.8`).
    ///
    /// # Errors
    /// Whatever is wrong with files and the scenario's own keys.
    pub fn load(path: &Path, settings: &[Setting]) -> Result<Self, ConfigError> {
        let text = files::read_text(path, files::CONFIG_MAX_BYTES).map_err(|source| ConfigError::Read {
            path: path.to_path_buf(),
            wanted_by: None,
            source,
        })?;
        let file = File { path, table: parse_table(path, &text)?, text: &text };
        let mut top: Vec<&str> = vec!["robot", "sole_file", "title", REPORT];
        top.extend(PROCESSES);
        file.only_known_keys(&top)?;
        for setting in settings {
            let first = setting.key[0].as_str();
            let wrong = |problem| ConfigError::Key { origin: Origin::CommandLine, key: setting.key.join("."), problem };
            if !top.contains(&first) {
                let known: Vec<String> = top.iter().map(|name| (*name).to_string()).collect();
                return Err(wrong(Problem::Unknown { nearest: nearest(first, &known), known }));
            }
            if (PROCESSES.contains(&first) || first == REPORT) && setting.key.len() == 1 {
                let reason = format!("a process, not a key: name one of its keys, as in {EXAMPLE}");
                return Err(wrong(Problem::Invalid { reason }));
            }
        }
        let robot = file.path_at("robot", "must be the robot's folder", settings)?;
        let robot = robot.ok_or_else(|| file.error(&["robot"], Problem::Missing))?;
        let sole_file = file.path_at("sole_file", "must be the path of a sole's description", settings)?;
        let mut parts = BTreeMap::new();
        for process in PROCESSES {
            let settings: Vec<Setting> = settings.iter().filter_map(|setting| setting.below(process)).collect();
            if let Some(part) = file.part(process, &robot, sole_file.as_deref(), &settings)? {
                parts.insert(process, part);
            }
        }
        file.tell_of_each_other(&mut parts, settings)?;
        let below: Vec<Setting> = settings.iter().filter_map(|setting| setting.below(REPORT)).collect();
        let report = match file.table.get(REPORT) {
            None => Table::new(),
            Some(Value::Table(table)) => table.clone(),
            Some(_) => return Err(file.error(&[REPORT], Problem::Invalid { reason: "must be a table".to_string() })),
        };
        let report = Config::empty().with_table(path, &text, &[REPORT], report).with_settings(&below);
        let name = path.file_stem().map_or_else(|| "scenario".to_string(), |stem| stem.to_string_lossy().into_owned());
        let title = file.table.get("title").and_then(Value::as_str).unwrap_or_default().to_string();
        Ok(Self { name, title, path: path.to_path_buf(), robot, sole_file, report, parts })
    }

    /// Whether a process is part of the scenario and on.
    pub fn has(&self, process: &str) -> bool {
        self.parts.get(process).is_some_and(|part| part.on)
    }

    /// The configuration of a process that is on.
    ///
    /// # Errors
    /// [`Problem::Missing`] if the scenario lacks it.
    pub fn config(&self, process: &str) -> Result<&Config, ConfigError> {
        self.parts.get(process).filter(|part| part.on).map(|part| &part.config).ok_or_else(|| ConfigError::Key {
            origin: Origin::File { path: self.path.clone(), line: None },
            key: process.to_string(),
            problem: Problem::Missing,
        })
    }

    /// The processes that are on, in the order in which they are started.
    pub fn processes(&self) -> impl Iterator<Item = (&'static str, &Config)> {
        PROCESSES
            .iter()
            .filter_map(|name| self.parts.get(name).filter(|part| part.on).map(|part| (*name, &part.config)))
    }
}

/// The scenario's file while it is read.
struct File<'a> {
    path: &'a Path,
    text: &'a str,
    table: Table,
}

impl File<'_> {
    fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new("."))
    }

    fn origin(&self, key: &[&str]) -> Origin {
        let key: Vec<String> = key.iter().map(|part| (*part).to_string()).collect();
        Origin::File { path: self.path.to_path_buf(), line: line_of(self.text, &key) }
    }

    fn error(&self, key: &[&str], problem: Problem) -> ConfigError {
        ConfigError::Key { origin: self.origin(key), key: key.join("."), problem }
    }

    fn only_known_keys(&self, known: &[&str]) -> Result<(), ConfigError> {
        let known: Vec<String> = known.iter().map(|name| (*name).to_string()).collect();
        match self.table.keys().find(|key| !known.contains(key)) {
            Some(key) => Err(self.error(&[key], Problem::Unknown { nearest: nearest(key, &known), known })),
            None => Ok(()),
        }
    }

    /// A process whose own configuration has a table with another one's name is told what the scenario tells that one.
    fn tell_of_each_other(
        &self,
        parts: &mut BTreeMap<&'static str, Part>,
        settings: &[Setting],
    ) -> Result<(), ConfigError> {
        for who in PROCESSES {
            for other in PROCESSES {
                let (Some(part), Some(told)) = (parts.get(who), parts.get(other)) else { continue };
                if !part.config.table().get(other).is_some_and(Value::is_table) {
                    continue;
                }
                let reason = || {
                    format!(
                        "the {who} takes this from the {other} of the scenario: change the key there, as in `{other}.KEY`"
                    )
                };
                let problem = || Problem::Invalid { reason: reason() };
                if let Some(setting) =
                    settings.iter().find(|setting| setting.key.starts_with(&[who.into(), other.into()]))
                {
                    let key = setting.key.join(".");
                    return Err(ConfigError::Key { origin: Origin::CommandLine, key, problem: problem() });
                }
                if self.table.get(who).is_some_and(|table| table.get(other).is_some()) {
                    return Err(self.error(&[who, other], problem()));
                }
                let config = part.config.clone().with_part(other, &told.config);
                parts.get_mut(who).expect("it was just there").config = config;
            }
        }
        Ok(())
    }

    /// The path under a key that all processes share, absolute: the command line's, else the scenario's.
    fn path_at(&self, key: &str, meaning: &str, settings: &[Setting]) -> Result<Option<PathBuf>, ConfigError> {
        let on_command_line = settings.iter().rev().find(|setting| setting.key == [key]);
        let origin = || if on_command_line.is_some() { Origin::CommandLine } else { self.origin(&[key]) };
        let Some(value) = on_command_line.map(|setting| &setting.value).or(self.table.get(key)) else {
            return Ok(None);
        };
        let Some(text) = value.as_str() else {
            let problem = Problem::Invalid { reason: meaning.to_string() };
            return Err(ConfigError::Key { origin: origin(), key: key.to_string(), problem });
        };
        let path = if on_command_line.is_some() { PathBuf::from(text) } else { self.folder().join(text) };
        match path.canonicalize() {
            Ok(path) => Ok(Some(path)),
            Err(source) => Err(ConfigError::Read { path, wanted_by: Some(origin()), source }),
        }
    }

    /// The configuration of a process: its base file, the scenario's changes, the robot, the command line's changes.
    fn part(
        &self,
        process: &str,
        robot: &Path,
        sole_file: Option<&Path>,
        settings: &[Setting],
    ) -> Result<Option<Part>, ConfigError> {
        let invalid = |key: &[&str], reason: &str| self.error(key, Problem::Invalid { reason: reason.to_string() });
        let Some(value) = self.table.get(process) else { return Ok(None) };
        let Value::Table(mut changes) = value.clone() else { return Err(invalid(&[process], "must be a table")) };
        let mut on = match changes.remove("on") {
            None => true,
            Some(Value::Boolean(on)) => on,
            Some(_) => return Err(invalid(&[process, "on"], "must be true or false")),
        };
        let mut kept = Vec::new();
        for setting in settings {
            match (setting.key.as_slice(), &setting.value) {
                ([key], Value::Boolean(value)) if key == "on" => on = *value,
                _ => kept.push(setting.clone()),
            }
        }
        let config = match changes.remove("config") {
            Some(Value::String(base)) => {
                let base = self.folder().join(base);
                Config::read(&base).map_err(|error| match error {
                    // The base itself; a file that the base names is told with its place there.
                    ConfigError::Read { path, source, wanted_by: None } => {
                        ConfigError::Read { path, source, wanted_by: Some(self.origin(&[process, "config"])) }
                    }
                    other => other,
                })?
            }
            Some(_) => return Err(invalid(&[process, "config"], "must be the path of a configuration file")),
            None => return Err(self.error(&[process, "config"], Problem::Missing)),
        };
        changes.insert("robot".to_string(), Value::String(robot.display().to_string()));
        if let Some(sole_file) = sole_file {
            changes.insert("sole_file".to_string(), Value::String(sole_file.display().to_string()));
        }
        let config = config.with_table(self.path, self.text, &[process], changes).with_settings(&kept);
        Ok(Some(Part { on, config }))
    }
}
