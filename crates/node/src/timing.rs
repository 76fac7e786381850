//! The times of a process's cycles, as health tells them.

use crate::system::{page_faults, thread_cpu_ns};
use crate::teller::Teller;
use lateness::{Deadlines, Figure, Quantiles, Watch};
use messages::code::Process;
use messages::{CONTROL_PERIOD_NS, Health, LatenessFigures, TimingFigures};

/// A wake-up that is later counts as late: a fifth of the period. What a free core does is ten times better (ns).
const WAKE_DEADLINE_NS: u64 = CONTROL_PERIOD_NS / 5;
/// Each histogram is looked through once in so many cycles, the four in turn: health tells a second's news, and no cycle pays for all.
const LOOK_CYCLES: u64 = 200;

/// Watches the cycles.
pub(crate) struct Timing {
    watch: Watch,
    teller: Option<Teller>,
    processor_before_ns: u64,
    /// As they were when the first tick with a time came.
    faults_before: Option<(u64, u64)>,
    has_time: bool,
}

impl Timing {
    /// `answer_deadline_ns` counts from the tick's time.
    pub(crate) fn new(process: Process, answer_deadline_ns: u64, real_time: bool) -> Self {
        let deadlines =
            Deadlines { wake_ns: WAKE_DEADLINE_NS, answer_ns: answer_deadline_ns, cycle_ns: CONTROL_PERIOD_NS };
        Self {
            watch: Watch::new(deadlines),
            teller: real_time.then(|| Teller::start(process)).flatten(),
            processor_before_ns: 0,
            faults_before: None,
            has_time: false,
        }
    }

    pub(crate) fn watch(&mut self) -> &mut Watch {
        &mut self.watch
    }

    pub(crate) fn woke(&mut self, tick_ns: u64, now_ns: u64) {
        if tick_ns > 0 && self.faults_before.is_none() {
            self.faults_before = Some(page_faults());
        }
        self.has_time = tick_ns > 0;
        self.watch.woke(tick_ns, now_ns);
    }

    /// Whether the cycle's tick has a time, so that lateness is known.
    pub(crate) fn has_time(&self) -> bool {
        self.has_time
    }

    /// The cycle of a tick has ended.
    pub(crate) fn ended(&mut self, tick: i64, now_ns: u64, health: &mut Health) {
        let processor_ns = thread_cpu_ns();
        let used_ns = processor_ns - std::mem::replace(&mut self.processor_before_ns, processor_ns);
        // The first one would have all that was built before.
        let used_ns = if health.cycles > 1 { used_ns } else { 0 };
        let (cycle, overrun) = self.watch.ended(used_ns, now_ns);
        if let (Some(overrun), Some(teller)) = (overrun, &self.teller) {
            teller.overrun(tick, overrun);
        }
        health.processor_time_ns = used_ns;
        health.wake_lateness_ns = cycle.woke_ns.unwrap_or(0);
        health.inputs_lateness_ns = cycle.inputs_ns.unwrap_or(0);
        health.publish_lateness_ns = cycle.published_ns.unwrap_or(0);
        (health.late_wakes, health.late_answers) = (self.watch.late_wakes, self.watch.late_answers);
        if self.has_time {
            health.misses = self.watch.overruns;
        }
        if let Some(before) = self.faults_before {
            let now = page_faults();
            (health.minor_faults, health.major_faults) = (now.0 - before.0, now.1 - before.1);
        }
        let turn = health.cycles % LOOK_CYCLES;
        if turn % (LOOK_CYCLES / 4) == 0 {
            self.look(Figure::ALL[(turn / (LOOK_CYCLES / 4)) as usize], &mut health.timing);
        }
    }

    /// Looks through all histograms: for the last words of a process.
    pub(crate) fn look_at_all(&self, timing: &mut TimingFigures) {
        Figure::ALL.into_iter().for_each(|figure| self.look(figure, timing));
    }

    fn look(&self, figure: Figure, timing: &mut TimingFigures) {
        let told = told(self.watch.histogram(figure).quantiles());
        *match figure {
            Figure::Woke => &mut timing.woke,
            Figure::Inputs => &mut timing.inputs,
            Figure::Published => &mut timing.published,
            Figure::Processor => &mut timing.processor,
        } = told;
    }
}

fn told(quantiles: Quantiles) -> LatenessFigures {
    LatenessFigures {
        count: quantiles.count,
        p50_ns: quantiles.p50_ns.unwrap_or(0),
        p99_ns: quantiles.p99_ns.unwrap_or(0),
        p999_ns: quantiles.p999_ns.unwrap_or(0),
        max_ns: quantiles.max_ns,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::code::{Reason, State};

    #[test]
    fn health_tells_what_the_watch_saw() {
        let mut timing = Timing::new(Process::Estimator, 1_500_000, false);
        let mut health = Health::new(Process::Estimator, State::Running, Reason::None);
        for cycle in 1..=1000_u64 {
            let tick_ns = cycle * CONTROL_PERIOD_NS;
            health.cycles = cycle;
            timing.woke(tick_ns, tick_ns + 30_000);
            timing.watch().inputs_there(tick_ns + 40_000);
            timing.watch().published(tick_ns + if cycle == 500 { 2_000_000 } else { 90_000 });
            timing.ended(cycle as i64, tick_ns + 2_100_000, &mut health);
        }
        assert_eq!((health.wake_lateness_ns, health.inputs_lateness_ns), (30_000, 40_000));
        assert_eq!((health.publish_lateness_ns, health.late_answers), (90_000, 1));
        assert_eq!((health.late_wakes, health.misses, health.major_faults), (0, 0, 0));
        assert_eq!(health.timing.woke.count, 1000, "this is the turn of the first histogram");
        assert!(health.timing.published.count < 1000, "the others had theirs before");
        timing.look_at_all(&mut health.timing);
        let published = health.timing.published;
        assert_eq!((published.count, published.max_ns, published.p999_ns), (1000, 2_000_000, 0));
        assert!((published.p99_ns as f64 / 90_000.0 - 1.0).abs() < 0.01, "{published:?}");
    }

    #[test]
    fn without_a_time_nothing_is_late() {
        let mut timing = Timing::new(Process::Estimator, 1_500_000, false);
        let mut health =
            Health { cycles: 2, misses: 7, ..Health::new(Process::Estimator, State::Running, Reason::None) };
        timing.woke(0, 5);
        timing.ended(3, 900_000_000, &mut health);
        assert_eq!((health.wake_lateness_ns, health.late_answers, health.misses), (0, 0, 7));
    }
}
