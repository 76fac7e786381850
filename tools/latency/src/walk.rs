//! One walk: the launcher as a person starts it, and what it left.

use crate::ticks::Ticks;
use anyhow::{Context, bail};
use node::ExitCode;
use recording::Recording;
use report::WalkFigures;
use scenario::{Scenario, Setting};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A walk to be.
#[derive(Debug, Clone)]
pub struct Walk {
    /// The scenario's file.
    pub scenario: PathBuf,
    /// Keys that are changed.
    pub settings: Vec<Setting>,
    /// By the clock.
    pub real_time: bool,
}

/// A walk that was.
#[derive(Debug)]
pub struct Walked {
    /// Its folder.
    pub folder: PathBuf,
    /// Its figures.
    pub figures: WalkFigures,
    /// What its recording says of time.
    pub ticks: Ticks,
    /// How the launch ended.
    pub code: i32,
}

/// Root of the workspace, beside whose binaries we lie; scenarios are found there.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).expect("tools/latency is in the workspace").to_path_buf()
}

/// A scenario that ships.
pub fn shipped(name: &str) -> PathBuf {
    root().join("config/scenarios").join(name).with_extension("toml")
}

impl Walk {
    /// Of a shipped scenario.
    pub fn of(name: &str, settings: &[Setting], real_time: bool) -> Self {
        Self { scenario: shipped(name), settings: settings.to_vec(), real_time }
    }

    /// With one more key changed.
    pub fn set(mut self, setting: &str) -> anyhow::Result<Self> {
        self.settings.push(setting.parse().with_context(|| format!("`{setting}`"))?);
        Ok(self)
    }

    /// Cores that its processes ask for, each once.
    pub fn cores(&self) -> anyhow::Result<Vec<u32>> {
        let scenario = Scenario::load(&self.scenario, &self.settings)?;
        let asked = |process: &str| {
            let table = scenario.config(process).ok()?.table().get("real_time")?.as_table()?.clone();
            u32::try_from(table.get("core")?.as_integer()?).ok()
        };
        let mut cores: Vec<u32> = ["simulator", "controller", "estimator"].into_iter().filter_map(asked).collect();
        cores.sort_unstable();
        cores.dedup();
        Ok(cores)
    }

    /// The highest priority that its processes ask for.
    pub fn priority(&self) -> anyhow::Result<u32> {
        let scenario = Scenario::load(&self.scenario, &self.settings)?;
        let asked = |process: &str| {
            let table = scenario.config(process).ok()?.table().get("real_time")?.as_table()?.clone();
            u32::try_from(table.get("priority")?.as_integer()?).ok()
        };
        Ok(["simulator", "controller", "estimator"].into_iter().filter_map(asked).max().unwrap_or(1))
    }

    /// Walks it, in a folder that is replaced. A fall or a walk off its plan is a result; what could not be walked at all is an error.
    pub fn walk(&self, folder: &Path) -> anyhow::Result<Walked> {
        let launcher = std::env::current_exe().context("no path of our own")?.with_file_name("soleus-launch");
        let mut command = Command::new(&launcher);
        command.arg(&self.scenario).arg("--out").arg(folder).args(["--overwrite", "--no-report"]);
        if self.real_time {
            command.arg("--real-time");
        }
        for setting in &self.settings {
            command.arg("--set").arg(setting.to_string());
        }
        let ended = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).output();
        let ended = ended.with_context(|| format!("cannot start {}", launcher.display()))?;
        let code = ended.status.code().unwrap_or(-1);
        let said = || String::from_utf8_lossy(&ended.stderr).into_owned();
        let results =
            [ExitCode::Done, ExitCode::Failed, ExitCode::NotWalked, ExitCode::Deadlines, ExitCode::SafetyStop];
        if !results.iter().any(|result| i32::from(result.code()) == code) {
            bail!("the launch of {} ended with code {code}:\n{}", self.scenario.display(), said());
        }
        let text = std::fs::read_to_string(folder.join("figures.json"));
        let text = text.with_context(|| format!("no figures of {}: {}", self.scenario.display(), said()))?;
        let figures = serde_json::from_str(&text).context("figures.json")?;
        let recording = Recording::open(&folder.join("walk.mcap"))?;
        let ticks = Ticks::read(&recording)?;
        Ok(Walked { folder: folder.to_path_buf(), figures, ticks, code })
    }
}

impl Walked {
    /// Runs a process again from the recording: whether it said the same to the bit, or why that cannot be told.
    pub fn replays(&self, process: &str) -> Result<bool, String> {
        let replayer = std::env::current_exe().map_err(|error| error.to_string())?.with_file_name("soleus-replayer");
        let mut command = Command::new(replayer);
        command.arg(self.folder.join("walk.mcap")).args(["--process", process]);
        let ended = command.stdin(Stdio::null()).output().map_err(|error| error.to_string())?;
        match ended.status.code() {
            Some(0) => Ok(true),
            Some(1) => Ok(false),
            _ => Err(String::from_utf8_lossy(&ended.stderr).lines().last().unwrap_or("no reason").to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cores_and_priorities_are_those_of_the_effective_configuration() {
        let walk = Walk::of("flat", &[], true);
        assert_eq!((walk.cores().expect("it ships"), walk.priority().expect("it ships")), (vec![0, 1], 70));
        let moved = walk.set("controller.real_time.core=0").expect("a setting");
        let moved = moved.set("estimator.real_time.core=0").expect("a setting");
        let moved = moved.set("simulator.real_time.priority=81").expect("a setting");
        assert_eq!((moved.cores().expect("still right"), moved.priority().expect("still right")), (vec![0], 81));
    }
}
