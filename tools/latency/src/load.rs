//! Ordinary programs beside the walk.

use clap::ValueEnum;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// What runs beside the walk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Load {
    /// Nothing of ours.
    None,
    /// Two busy threads per core, and one that shovels memory: as `stress-ng --cpu 2N --vm 1`.
    Stress,
}

/// More than the last cache of a processor (bytes).
const SHOVELLED: usize = 256 << 20;

/// A load that runs until it is dropped.
pub struct Running {
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<u64>>,
}

impl Load {
    /// Starts it.
    pub fn start(self) -> Running {
        let stop = Arc::new(AtomicBool::new(false));
        let mut threads = Vec::new();
        if self == Self::Stress {
            let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
            for seed in 0..2 * cores as u64 {
                let stop = Arc::clone(&stop);
                threads.push(std::thread::spawn(move || compute(seed, &stop)));
            }
            let stop = Arc::clone(&stop);
            threads.push(std::thread::spawn(move || shovel(&stop)));
        }
        Running { stop, threads }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // What it computed is of no interest.
            let _ = thread.join();
        }
    }
}

fn compute(seed: u64, stop: &AtomicBool) -> u64 {
    let mut x = seed | 1;
    while !stop.load(Ordering::Relaxed) {
        for _ in 0..100_000 {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
        }
        std::hint::black_box(x);
    }
    x
}

fn shovel(stop: &AtomicBool) -> u64 {
    let mut memory = vec![0_u64; SHOVELLED / 8];
    let mut round = 0;
    while !stop.load(Ordering::Relaxed) {
        round += 1;
        memory.iter_mut().for_each(|word| *word = word.wrapping_add(round));
        std::hint::black_box(&memory);
    }
    round
}
