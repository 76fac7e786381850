//! Diagnostics on standard error, which by the clock an ordinary thread writes: a disk that is slow must not hold up a thread under
//! SCHED_FIFO.

use crate::arguments::LogFormat;
use std::io::{self, Write};
use std::sync::OnceLock;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

/// Lines that may wait to be written; more are lost and counted.
const WAITING_MAX: usize = 256;
/// How long an ending process waits for its last words to be written.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// What the writing thread is handed.
enum Handed {
    Line(Vec<u8>),
    /// Everything before it has been written when this is answered.
    Flush(SyncSender<()>),
}

static HANDS: OnceLock<SyncSender<Handed>> = OnceLock::new();

/// Begins diagnostics on standard error: `RUST_LOG` chooses, `info` if it says nothing.
pub fn start_diagnostics(format: LogFormat) {
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("info"));
    let builder = tracing_subscriber::fmt().with_env_filter(filter).with_writer(|| Out).with_target(false);
    // Where nobody listens, complaining of it would end the process.
    let builder = builder.log_internal_errors(false);
    // Fails only if diagnostics have begun already, as in a test that runs several programs; then they go there.
    let _ = match format {
        LogFormat::Text => builder.with_ansi(false).try_init(),
        LogFormat::Json => builder.json().try_init(),
    };
}

/// From now on an ordinary thread writes; to be called before the calling one enters its policy.
pub(crate) fn hand_over() {
    let (hands, handed) = sync_channel(WAITING_MAX);
    let work = move || write_all(&handed, &mut io::stderr());
    if std::thread::Builder::new().name("diagnostics".to_string()).spawn(work).is_ok() {
        // A second shell in one process keeps the first thread.
        let _ = HANDS.set(hands);
    }
}

/// Waits until what was said is written, if somebody else writes it.
pub(crate) fn flush() {
    let Some(hands) = HANDS.get() else { return };
    let (written, wait) = sync_channel(1);
    if hands.send(Handed::Flush(written)).is_ok() {
        // Standard error that takes nothing for so long is not waited for.
        let _ = wait.recv_timeout(LAST_WORDS);
    }
}

fn write_all(handed: &Receiver<Handed>, out: &mut impl Write) {
    for handed in handed {
        match handed {
            // Nobody may be listening.
            Handed::Line(line) => drop(out.write_all(&line)),
            Handed::Flush(written) => {
                let _ = out.flush();
                let _ = written.send(());
            }
        }
    }
}

/// Where lines go: each comes whole, in one call.
struct Out;

impl Write for Out {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        match HANDS.get() {
            None => io::stderr().write(line),
            Some(hands) => {
                // Neither waits: what finds no room is lost, and health counts what matters.
                let _ = hands.try_send(Handed::Line(line.to_vec()));
                Ok(line.len())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        if HANDS.get().is_none() { io::stderr().flush() } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_handed_over_is_written_in_order_and_answered_when_it_is() {
        let (hands, handed) = sync_channel(8);
        let (written, wait) = sync_channel(1);
        for line in ["one\n", "two\n"] {
            hands.try_send(Handed::Line(line.as_bytes().to_vec())).expect("there is room");
        }
        hands.try_send(Handed::Flush(written)).expect("there is room");
        drop(hands);
        let mut out = Vec::new();
        write_all(&handed, &mut out);
        assert_eq!((out.as_slice(), wait.try_recv()), (b"one\ntwo\n".as_slice(), Ok(())));
    }
}
