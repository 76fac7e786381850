//! The folder of a run: effective configuration, logs, recording.

use crate::Ending;
use scenario::Scenario;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};
use toml::Value;

/// The folder of a run.
pub struct RunFolder {
    /// Where it is, absolute.
    pub path: PathBuf,
}

impl RunFolder {
    /// Makes the folder and writes the effective configuration of every process into it.
    pub fn create(scenario: &Scenario, out: Option<&Path>) -> Result<Self, Ending> {
        let path =
            out.map_or_else(|| Path::new("runs").join(format!("{}-{}", now(), scenario.name)), Path::to_path_buf);
        let failed =
            |error: std::io::Error| Ending::new(3, format!("cannot make the run folder {}: {error}", path.display()));
        let path = std::path::absolute(&path).map_err(failed)?;
        let folder = Self { path: path.clone() };
        std::fs::create_dir_all(folder.path.join("config")).map_err(failed)?;
        std::fs::create_dir_all(folder.path.join("logs")).map_err(failed)?;
        // Not with its permissions: what is in a run folder is its user's alone.
        let scenario_text = std::fs::read(&scenario.path).map_err(failed)?;
        std::fs::write(folder.path.join("config/scenario.toml"), scenario_text).map_err(failed)?;
        for (process, config) in scenario.processes() {
            let mut table = config.table().clone();
            if process == "recorder" {
                let text = |path: PathBuf| Value::String(path.display().to_string());
                table.insert("output_file".to_string(), text(folder.recording()));
                table.insert("attachment_folder".to_string(), text(folder.path.join("config")));
            }
            if let Some(Value::Table(programs)) = table.get_mut("programs") {
                let folder = path.join("programs").display().to_string();
                programs.entry("output_folder").or_insert(Value::String(folder));
            }
            let text = toml::to_string_pretty(&table).expect("what was read from TOML can be written as TOML");
            let title = format!("# Effective configuration of the {process} in scenario `{}`.\n", scenario.name);
            std::fs::write(folder.config(process), title + &text).map_err(failed)?;
        }
        Ok(folder)
    }

    /// The recording.
    pub fn recording(&self) -> PathBuf {
        self.path.join("walk.mcap")
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

/// Now, in universal time: 20261121-214512.
fn now() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    let (year, month, day) = civil(seconds / 86400);
    let (hour, minute, second) = (seconds / 3600 % 24, seconds / 60 % 60, seconds % 60);
    format!("{year:04}{month:02}{day:02}-{hour:02}{minute:02}{second:02}")
}

/// Year, month and day of a number of days since 1970-01-01, in the Gregorian calendar.
fn civil(days: u64) -> (u64, u64, u64) {
    // Counted from 0000-03-01, so that the leap day is the last of its year; 146097 days are 400 years.
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    // Months from March on: 153 days are five of them.
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    (400 * era + year_of_era + u64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::civil;

    #[test]
    fn days_have_their_dates() {
        // Each from `date -u -d @$((86400 * days)) +%F`.
        for (days, date) in [
            (0, (1970, 1, 1)),
            (59, (1970, 3, 1)),
            (11_016, (2000, 2, 29)),
            (20_513, (2026, 3, 1)),
            (20_778, (2026, 11, 21)),
        ] {
            assert_eq!(civil(days), date);
        }
    }
}
