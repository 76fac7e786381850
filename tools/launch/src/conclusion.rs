//! What a run was: figures from its closed recording, `figures.json`, the page.

use crate::Ending;
use crate::folder::RunFolder;
use crate::heard::Heard;
use messages::code::Process;
use node::ExitCode;
use recording::Recording;
use report::{Gather, PageSettings, ReportSettings, Verdict, WalkFigures};
use std::path::PathBuf;

/// What there is to say and to see.
pub struct Conclusion {
    /// The figures.
    pub figures: WalkFigures,
    /// The page, if one was made.
    pub page: Option<PathBuf>,
}

impl Conclusion {
    /// Reads the recording, or takes what the processes kept if there is none; writes figures and page into the run's folder. What cannot
    /// be written is told and does not change how the run ended.
    pub fn draw(folder: &RunFolder, heard: &Heard, settings: &ReportSettings, with_page: bool) -> Self {
        let (mut figures, page) = match Self::recorded(folder, with_page) {
            Ok((figures, page)) => (figures, page),
            Err(why) => {
                tracing::warn!("no figures of the recording, only what the processes kept: {why}");
                (Gather::of_health(&heard.healths(), settings), None)
            }
        };
        figures.times_real_time = figures.times_real_time.or(heard.speed());
        let text = serde_json::to_string_pretty(&figures).expect("numbers and words");
        let mut conclusion = Self { figures, page: None };
        conclusion.write(folder.figures(), text + "\n");
        if let Some(html) = page {
            let path = folder.page();
            conclusion.page = conclusion.write(path.clone(), html).then_some(path);
        }
        conclusion
    }

    fn recorded(folder: &RunFolder, with_page: bool) -> Result<(WalkFigures, Option<String>), String> {
        let path = folder.recording();
        if path.with_extension("mcap.partial").exists() || !path.is_file() {
            return Err("there is no finished recording".to_string());
        }
        let recording = Recording::open(&path).map_err(|error| error.to_string())?;
        if with_page {
            let log = |process: &Process| {
                let text = std::fs::read(folder.log(process.word())).unwrap_or_default();
                report::log_lines(process.word(), &String::from_utf8_lossy(&text))
            };
            let logs: Vec<_> = Process::ALL.iter().flat_map(log).collect();
            match report::page(&recording, &folder.name(), &logs, &PageSettings::default()) {
                Ok(mut page) => return Ok((page.figures.remove(0), Some(page.html))),
                Err(why) => tracing::warn!("no page: {why}"),
            }
        }
        Ok((report::figures(&recording).map_err(|error| error.to_string())?, None))
    }

    fn write(&self, path: PathBuf, text: String) -> bool {
        match std::fs::write(&path, text) {
            Ok(()) => true,
            Err(error) => {
                tracing::warn!("cannot write {}: {error}", path.display());
                false
            }
        }
    }

    /// The table for the terminal.
    pub fn table(&self) -> String {
        report::table(&self.figures)
    }

    /// How the launch ends by the verdict on a walk that came to its end.
    pub fn ending(&self) -> Result<(), Ending> {
        let figures = &self.figures;
        match figures.verdict {
            Verdict::Walked | Verdict::Unjudged => Ok(()),
            Verdict::Fell => Err(Ending::new(ExitCode::Failed, format!("the robot fell: {}", figures.verdict_reason))),
            Verdict::EndedEarly => {
                Err(Ending::new(ExitCode::Failed, format!("the walk ended early: {}", figures.verdict_reason)))
            }
            Verdict::OffPlan => {
                Err(Ending::new(ExitCode::NotWalked, format!("walked, but off its plan: {}", figures.verdict_reason)))
            }
        }
    }
}
