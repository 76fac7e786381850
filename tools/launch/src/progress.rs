//! How far the walk is: a bar on a terminal, plain lines elsewhere.

use crate::heard::Heard;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// How often the bar is drawn.
const DRAW: Duration = Duration::from_millis(100);
/// How often a line is written where there is no terminal.
const LINE: Duration = Duration::from_secs(5);

/// Shows how far the walk is, on standard error.
pub struct Progress {
    bar: Option<ProgressBar>,
    shown: Instant,
}

impl Progress {
    /// A bar if standard error is a terminal.
    pub fn new() -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("{bar:30.cyan} {msg}").expect("a constant that is right");
            ProgressBar::new(1000).with_style(style)
        });
        Self { bar, shown: Instant::now() }
    }

    /// Shows how far it is, if it is time to.
    pub fn show(&mut self, heard: &Heard) {
        let period = if self.bar.is_some() { DRAW } else { LINE };
        if self.shown.elapsed() < period {
            return;
        }
        self.shown = Instant::now();
        let text = heard.line();
        match &self.bar {
            Some(bar) => {
                bar.set_position((1000.0 * heard.done()) as u64);
                bar.set_message(text);
            }
            None => {
                // Nobody may be listening; the walk goes on.
                let _ = writeln!(std::io::stderr(), "{text}");
            }
        }
    }

    /// Takes the bar away.
    pub fn end(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
