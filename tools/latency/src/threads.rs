//! Reference threads: one per core, one priority above ours, that do nothing but wake up.

use lateness::reference::{PERIOD_NS, Reference, Sample};
use lateness::{PolicyWish, RightsSettings};
use node::{Rights, clock_monotonic_ns, sleep_until_ns};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// Running reference threads.
pub struct References {
    stop: Arc<AtomicBool>,
    threads: Vec<(usize, JoinHandle<(Rights, Vec<Sample>)>)>,
}

impl References {
    /// One on each core, for at most so many seconds.
    pub fn start(cores: &[u32], priority: u32, seconds_max: u64) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let thread = |core: u32| {
            let stop = Arc::clone(&stop);
            std::thread::spawn(move || wake_up(core, priority, seconds_max, &stop))
        };
        let threads = cores.iter().map(|core| (*core as usize, thread(*core))).collect();
        Self { stop, threads }
    }

    /// Ends them: what each saw, and what it was refused.
    pub fn finish(self) -> (Vec<Reference>, Vec<String>) {
        self.stop.store(true, Ordering::Relaxed);
        let (mut references, mut refused) = (Vec::new(), Vec::new());
        for (core, thread) in self.threads {
            let (rights, samples) = thread.join().expect("it only sleeps");
            references.push(Reference::of(core, &samples));
            refused.extend(rights.refused.iter().map(|refused| format!("reference on core {core}: {refused}")));
        }
        (references, refused)
    }
}

fn wake_up(core: u32, priority: u32, seconds_max: u64, stop: &AtomicBool) -> (Rights, Vec<Sample>) {
    let most = usize::try_from(seconds_max * 1_000_000_000 / PERIOD_NS).unwrap_or(usize::MAX);
    // Touched beforehand: a fault would be a stall of our own making.
    let mut samples = vec![Sample { due_ns: 1, late_ns: 1 }; most];
    samples.clear();
    let rights = Rights::of_thread(&RightsSettings { policy: PolicyWish::Fifo, priority, core: Some(core) });
    let mut due_ns = clock_monotonic_ns() + PERIOD_NS;
    while !stop.load(Ordering::Relaxed) && samples.len() < most {
        sleep_until_ns(due_ns);
        let late_ns = clock_monotonic_ns().saturating_sub(due_ns);
        samples.push(Sample { due_ns, late_ns });
        // Periods that have passed are left out: the stall stands in this sample.
        due_ns += PERIOD_NS * (1 + late_ns / PERIOD_NS);
    }
    (rights, samples)
}

/// Whether this machine grants the test what it needs; if not, what it refuses is said.
pub fn are_granted_here(cores: &[u32], priority: u32) -> bool {
    let (_, refused) = References::start(cores, priority, 1).finish();
    refused.iter().for_each(|refused| eprintln!("soleus-latency: {refused}"));
    if !refused.is_empty() {
        eprintln!("soleus-latency: SKIPPED, nothing was measured: the rights are missing");
    }
    refused.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lateness itself depends on the machine; that it is measured does not.
    #[test]
    fn a_reference_thread_measures_every_period_whatever_its_rights() {
        let references = References::start(&[0], 2, 60);
        sleep_until_ns(clock_monotonic_ns() + 20 * PERIOD_NS);
        let (seen, _) = references.finish();
        assert!(seen.len() == 1 && seen[0].core == 0 && seen[0].lateness.count() > 0, "{seen:?}");
    }
}
