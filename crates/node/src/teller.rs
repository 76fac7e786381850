//! A thread that says what a thread under SCHED_FIFO must not take the time to say: formatting and writing may block.

use lateness::Overrun;
use messages::code::Process;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What may wait to be said; more is counted.
const WAITING_MAX: usize = 64;
/// Overruns are said at most so often, the rest as a number: a machine that is too slow overruns at every tick.
const EVERY: Duration = Duration::from_secs(1);

/// Hands overruns to the thread.
pub(crate) struct Teller {
    /// `None` while it is dropped.
    to_say: Option<SyncSender<(i64, Overrun)>>,
    thread: Option<JoinHandle<()>>,
}

impl Teller {
    /// Starts the thread; before the calling one enters its policy, so that it stays ordinary. `None` if the system has no thread for it.
    pub(crate) fn start(process: Process) -> Option<Self> {
        let (to_say, said) = sync_channel(WAITING_MAX);
        let work = move || listen(process, &said, &mut |line| tracing::warn!("{line}"));
        let thread = std::thread::Builder::new().name("teller".to_string()).spawn(work).ok()?;
        Some(Self { to_say: Some(to_say), thread: Some(thread) })
    }

    /// An overrun at a tick. Neither waits nor allocates.
    pub(crate) fn overrun(&self, tick: i64, overrun: Overrun) {
        // Health counts those that find no room.
        let _ = self.to_say.iter().try_for_each(|to_say| to_say.try_send((tick, overrun)));
    }
}

impl Drop for Teller {
    /// What was handed over is said first.
    fn drop(&mut self) {
        self.to_say = None;
        // A teller that broke down has said so itself.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Says what comes until nobody is left to say anything.
fn listen(process: Process, said: &Receiver<(i64, Overrun)>, say: &mut dyn FnMut(&str)) {
    let (mut last, mut worst, mut more) = (None::<Instant>, None::<(i64, Overrun)>, 0_u64);
    loop {
        let heard = said.recv_timeout(EVERY);
        if let Ok((tick, overrun)) = heard {
            more += 1;
            if worst.is_none_or(|(_, worst)| overrun.late_ns > worst.late_ns) {
                worst = Some((tick, overrun));
            }
        }
        let over = heard == Err(RecvTimeoutError::Disconnected);
        if (over || last.is_none_or(|last| last.elapsed() >= EVERY))
            && let Some((tick, overrun)) = worst.take()
        {
            say(&words(process, tick, overrun, more));
            (last, more) = (Some(Instant::now()), 0);
        }
        if over {
            return;
        }
    }
}

fn words(process: Process, tick: i64, overrun: Overrun, of: u64) -> String {
    let ms = |ns: u64| ns as f64 * 1e-6;
    let (late_ms, step_ms) = (ms(overrun.late_ns), ms(overrun.step_ns));
    let of = if of > 1 { format!(" (the worst of {of})") } else { String::new() };
    format!(
        "tick {tick}: {process} ended {late_ms:.2} ms after the tick's time{of}, {step_ms:.2} ms of it {}",
        overrun.step
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_of_many_overruns_is_said_with_its_step_and_the_rest_as_a_number() {
        let (to_say, heard) = sync_channel(WAITING_MAX);
        let overrun = |step, late_ns| Overrun { step, step_ns: late_ns / 2, late_ns };
        for (tick, overrun) in [
            (7, overrun("solving", 6_000_000)),
            (8, overrun("waking up", 9_000_000)),
            (9, overrun("solving", 7_000_000)),
        ] {
            to_say.try_send((tick, overrun)).expect("there is room");
        }
        drop(to_say);
        let mut lines = Vec::new();
        listen(Process::Controller, &heard, &mut |line| lines.push(line.to_string()));
        assert_eq!(
            lines,
            [
                "tick 7: controller ended 6.00 ms after the tick's time, 3.00 ms of it solving",
                "tick 8: controller ended 9.00 ms after the tick's time (the worst of 2), 4.50 ms of it waking up"
            ]
        );
    }

    #[test]
    fn one_that_is_not_heard_delays_nobody() {
        let (to_say, heard) = sync_channel(1);
        let teller = Teller { to_say: Some(to_say), thread: None };
        let overrun = Overrun { step: "solving", step_ns: 1, late_ns: 2 };
        (0..1000).for_each(|tick| teller.overrun(tick, overrun));
        assert_eq!(heard.try_iter().count(), 1);
    }
}
