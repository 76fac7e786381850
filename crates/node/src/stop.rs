//! Being asked to stop.

use crate::exit::ExitCode;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

/// How long one that was asked to stop may finish what it is at.
const AFTER_ASKED: Duration = Duration::from_secs(1);
/// How long coming into a domain may take: it takes milliseconds, and longer only on a machine that does not run us.
pub const START_PATIENCE: Duration = Duration::from_secs(60);

/// Whether SIGINT or SIGTERM came.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    asked: Arc<AtomicBool>,
}

impl Stop {
    /// Catches SIGINT and SIGTERM from now on.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn on_signals() -> io::Result<Self> {
        let stop = Self::default();
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            signal_hook::flag::register(signal, Arc::clone(&stop.asked))?;
        }
        // Writing beyond `ulimit -f` then fails as on a full disk, which has an answer, and does not end the process.
        signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default())?;
        Ok(stop)
    }

    /// Does something that may never end, at most for `patience`, and not for longer than a moment once asked to stop: then the whole
    /// process ends. For what is in the hands of others, as making shared memory is.
    pub fn bound<T>(&self, what: &str, patience: Duration, asked: ExitCode, work: impl FnOnce() -> T) -> T {
        let (done, over) = mpsc::channel::<()>();
        let (stop, what) = (self.clone(), what.to_string());
        let guard = move || {
            let start = Instant::now();
            let mut asked_since = None;
            while over.recv_timeout(Duration::from_millis(20)) == Err(RecvTimeoutError::Timeout) {
                if stop.asked() && asked_since.get_or_insert_with(Instant::now).elapsed() > AFTER_ASKED {
                    tracing::warn!("asked to stop while {what}");
                    std::process::exit(asked.code().into());
                }
                if start.elapsed() > patience {
                    tracing::error!("{what} takes longer than {} s: given up", patience.as_secs_f64());
                    std::process::exit(ExitCode::Start.code().into());
                }
            }
        };
        // Without a thread to look on it is done all the same.
        let guard = std::thread::Builder::new().spawn(guard).ok();
        let result = work();
        drop(done);
        if let Some(guard) = guard {
            let _ = guard.join();
        }
        result
    }

    /// Whether one came.
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// Forgets what came so far, to hear whether it comes again.
    pub fn forget(&self) {
        self.asked.store(false, Ordering::Relaxed);
    }
}
