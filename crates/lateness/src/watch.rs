//! The times of one process's cycles.

use crate::Lateness;

/// Most steps of a cycle that have a name.
const STEPS_MAX: usize = 8;

/// The four figures of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Figure {
    /// From the tick's time to when the thread ran.
    Woke = 0,
    /// From the tick's time to when all inputs were there.
    Inputs = 1,
    /// From the tick's time to when the answer was out.
    Published = 2,
    /// Time of the processor in the cycle.
    Processor = 3,
}

impl Figure {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Woke, Self::Inputs, Self::Published, Self::Processor];

    /// A word for people.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Woke => "woke",
            Self::Inputs => "inputs",
            Self::Published => "published",
            Self::Processor => "processor",
        }
    }
}

/// From when on something is late, from the tick's time (ns).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deadlines {
    /// A wake-up.
    pub wake_ns: u64,
    /// The answer: later, nobody uses it.
    pub answer_ns: u64,
    /// The whole cycle: later, the next one is late as well.
    pub cycle_ns: u64,
}

/// A cycle that has ended: lateness against the tick's time (ns), `None` where the cycle has no such time; the processor's time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cycle {
    /// Until the thread ran.
    pub woke_ns: Option<u64>,
    /// Until all inputs were there.
    pub inputs_ns: Option<u64>,
    /// Until the answer was out.
    pub published_ns: Option<u64>,
    /// Time of the processor.
    pub processor_ns: u64,
}

/// A cycle that took too long, and what of it took longest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Overrun {
    /// The longest step.
    pub step: &'static str,
    /// How long that step took (ns).
    pub step_ns: u64,
    /// From the tick's time to the end of the last step (ns).
    pub late_ns: u64,
}

/// Follows the cycles of one process: four histograms, three counters. Nothing here allocates after [`Watch::new`].
#[derive(Debug, Clone)]
pub struct Watch {
    deadlines: Deadlines,
    histograms: [Lateness; 4],
    /// Time of the tick; zero: there is none (lock-step).
    tick_ns: u64,
    cycle: Cycle,
    steps: [(&'static str, u64); STEPS_MAX],
    steps_count: usize,
    /// Wake-ups that were late.
    pub late_wakes: u64,
    /// Answers that were late.
    pub late_answers: u64,
    /// Cycles that ended late.
    pub overruns: u64,
}

impl Watch {
    /// For a process with these deadlines.
    #[must_use]
    pub fn new(deadlines: Deadlines) -> Self {
        Self {
            deadlines,
            histograms: std::array::from_fn(|_| Lateness::default()),
            tick_ns: 0,
            cycle: Cycle::default(),
            steps: [("", 0); STEPS_MAX],
            steps_count: 0,
            late_wakes: 0,
            late_answers: 0,
            overruns: 0,
        }
    }

    /// The thread runs, for the tick of this time; zero: nobody looks at a clock, and nothing can be late.
    pub fn woke(&mut self, tick_ns: u64, now_ns: u64) {
        self.tick_ns = tick_ns;
        self.cycle = Cycle::default();
        self.steps_count = 0;
        self.cycle.woke_ns = self.late_by(now_ns);
        self.mark("waking up", now_ns);
    }

    /// All inputs are there.
    pub fn inputs_there(&mut self, now_ns: u64) {
        self.cycle.inputs_ns = self.late_by(now_ns);
        self.mark("waiting for inputs", now_ns);
    }

    /// A step of the cycle has ended. Steps beyond the eighth count with the next that has a place.
    pub fn step_done(&mut self, name: &'static str, now_ns: u64) {
        self.mark(name, now_ns);
    }

    /// The answer is out.
    pub fn published(&mut self, now_ns: u64) {
        self.cycle.published_ns = self.late_by(now_ns);
        self.mark("publishing", now_ns);
    }

    /// The cycle has ended. Says what took longest if it was too late.
    pub fn ended(&mut self, processor_ns: u64, now_ns: u64) -> (Cycle, Option<Overrun>) {
        self.mark("rest of the cycle", now_ns);
        self.cycle.processor_ns = processor_ns;
        let cycle = self.cycle;
        let lateness = [cycle.woke_ns, cycle.inputs_ns, cycle.published_ns, Some(processor_ns)];
        for (histogram, time_ns) in self.histograms.iter_mut().zip(lateness) {
            time_ns.into_iter().for_each(|time_ns| histogram.record(time_ns));
        }
        let beyond = |time_ns: Option<u64>, deadline_ns: u64| time_ns.is_some_and(|time_ns| time_ns > deadline_ns);
        let late_wake = beyond(cycle.woke_ns, self.deadlines.wake_ns);
        let late_answer = beyond(cycle.published_ns, self.deadlines.answer_ns);
        let overrun = beyond(self.late_by(now_ns), self.deadlines.cycle_ns);
        self.late_wakes += u64::from(late_wake);
        self.late_answers += u64::from(late_answer);
        self.overruns += u64::from(overrun);
        let told = (late_answer || overrun).then(|| self.longest_step());
        (cycle, told)
    }

    /// A histogram.
    #[must_use]
    pub fn histogram(&self, figure: Figure) -> &Lateness {
        &self.histograms[figure as usize]
    }

    fn late_by(&self, now_ns: u64) -> Option<u64> {
        // A stamp of the future, by a broken driver, is late by nothing.
        (self.tick_ns > 0).then(|| now_ns.saturating_sub(self.tick_ns))
    }

    fn mark(&mut self, name: &'static str, now_ns: u64) {
        if self.tick_ns > 0 && self.steps_count < STEPS_MAX {
            self.steps[self.steps_count] = (name, now_ns);
            self.steps_count += 1;
        } else if self.tick_ns > 0 {
            self.steps[STEPS_MAX - 1] = (name, now_ns);
        }
    }

    fn longest_step(&self) -> Overrun {
        let (mut before, mut longest) = (self.tick_ns, ("", 0));
        for (name, end_ns) in &self.steps[..self.steps_count] {
            let took_ns = end_ns.saturating_sub(before);
            if took_ns > longest.1 {
                longest = (name, took_ns);
            }
            before = *end_ns;
        }
        Overrun { step: longest.0, step_ns: longest.1, late_ns: before.saturating_sub(self.tick_ns) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEADLINES: Deadlines = Deadlines { wake_ns: 1_000, answer_ns: 3_000, cycle_ns: 5_000 };

    /// A cycle for the tick at 10,000 with these marks after it: woke, inputs, published, ended.
    fn cycle(watch: &mut Watch, [woke, inputs, published, ended]: [u64; 4]) -> (Cycle, Option<Overrun>) {
        let t = 10_000;
        watch.woke(t, t + woke);
        watch.inputs_there(t + inputs);
        watch.step_done("solving", t + published - 10);
        watch.published(t + published);
        watch.ended(77, t + ended)
    }

    #[test]
    fn times_are_measured_from_the_tick_and_kept_in_histograms() {
        let mut watch = Watch::new(DEADLINES);
        let (told, overrun) = cycle(&mut watch, [100, 300, 700, 900]);
        assert_eq!((told.woke_ns, told.inputs_ns, told.published_ns), (Some(100), Some(300), Some(700)));
        assert_eq!((told.processor_ns, overrun), (77, None));
        let largest = Figure::ALL.map(|figure| watch.histogram(figure).max_ns());
        assert_eq!(largest, [100, 300, 700, 77]);
        assert_eq!((watch.late_wakes, watch.late_answers, watch.overruns), (0, 0, 0));
    }

    /// What a deadline on execution time alone never sees.
    #[test]
    fn one_that_wakes_late_and_computes_briefly_is_late() {
        let mut watch = Watch::new(DEADLINES);
        let (_, overrun) = cycle(&mut watch, [20_000, 20_010, 20_100, 20_110]);
        assert_eq!(overrun, Some(Overrun { step: "waking up", step_ns: 20_000, late_ns: 20_110 }));
        assert_eq!((watch.late_wakes, watch.late_answers, watch.overruns), (1, 1, 1));
    }

    #[test]
    fn the_longest_step_is_named_wherever_it_is() {
        let mut watch = Watch::new(DEADLINES);
        for (marks, step) in [
            ([10, 3_500, 3_900, 4_000], "waiting for inputs"),
            ([10, 100, 4_900, 4_950], "solving"),
            ([10, 100, 300, 6_000], "rest of the cycle"),
        ] {
            assert_eq!(cycle(&mut watch, marks).1.map(|overrun| overrun.step), Some(step));
        }
        assert_eq!((watch.late_wakes, watch.late_answers, watch.overruns), (0, 2, 1));
    }

    #[test]
    fn in_lock_step_nothing_is_late_and_processor_time_is_measured_all_the_same() {
        let mut watch = Watch::new(DEADLINES);
        watch.woke(0, 99_000);
        watch.published(200_000);
        let (cycle, overrun) = watch.ended(500, 300_000);
        assert_eq!((cycle, overrun), (Cycle { processor_ns: 500, ..Cycle::default() }, None));
        assert_eq!(watch.histogram(Figure::Woke).count(), 0);
        assert_eq!(watch.histogram(Figure::Processor).count(), 1);
    }

    #[test]
    fn a_stamp_of_the_future_and_many_steps_break_nothing() {
        let mut watch = Watch::new(DEADLINES);
        watch.woke(50_000, 10_000);
        assert_eq!(watch.ended(0, 10_001).0.woke_ns, Some(0));
        watch.woke(50_000, 50_010);
        (0..20).for_each(|step| watch.step_done("many", 50_100 + step));
        let (_, overrun) = watch.ended(0, 59_000);
        assert_eq!(overrun.map(|overrun| overrun.step), Some("rest of the cycle"));
    }
}
