//! Quadratic programs of chosen ticks, as files.

use controller::Programs;
use messages::code::Outcome;
use wholebody::WholeBody;

/// Writes them. What cannot be written is said once; the walk goes on.
pub struct ProgramWriter {
    settings: Programs,
    troubles: u32,
    failed: bool,
}

impl ProgramWriter {
    /// Nothing written yet.
    pub fn new(settings: Programs) -> Self {
        Self { settings, troubles: 0, failed: false }
    }

    /// Writes the last program of `body`, if it is one that was asked for: `tick-50.json`.
    pub fn write(&mut self, tick: i64, status: u32, body: &WholeBody) {
        let trouble = status == Outcome::Relaxed.code() || status == Outcome::Held.code();
        let as_trouble = trouble && self.troubles < self.settings.trouble_max;
        if self.failed || !(as_trouble || self.settings.ticks.contains(&tick)) {
            return;
        }
        self.troubles += u32::from(as_trouble);
        let Some(program) = body.last_program() else { return };
        let folder = &self.settings.output_folder;
        let path = folder.join(format!("tick-{tick}.json"));
        if let Err(error) = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&path, program.to_json())) {
            tracing::warn!("programs cannot be written: {}: {error}", path.display());
            self.failed = true;
        }
    }
}
