//! Recorded walking programs: own active set against Clarabel with data updates, in one run, by the thread's CPU time.
//!
//! ```text
//! cargo bench -p qp --bench recorded -- FOLDER_OR_NPZ...
//! ```
//!
//! Prints, per archive: time per tick (median over repeats, then median, p99 and maximum over ticks), the ratio to Clarabel,
//! active-set changes, the largest violation, the objective's difference from Clarabel at 1e-9, and failures. Exits with
//! code 1 when any tick is not solved.
#![allow(clippy::print_stdout)]

#[path = "../tests/support/recorded.rs"]
mod recorded;

use qp::Status;
use qp::dense::{ActiveSet, ActiveSetSettings, Interior, InteriorSettings, Size, Solver};
use recorded::Tick;
use std::collections::HashMap;
use std::path::PathBuf;

/// Repeats of the whole sequence, solvers taking turns.
const REPEATS: usize = 7;

/// CPU time of this thread in microseconds.
#[allow(unsafe_code)] // clock_gettime has no safe wrapper in std; it writes the one struct it is given
fn thread_time_us() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is valid for the call, the clock exists on Linux.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    assert_eq!(status, 0);
    time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
}

#[derive(Default)]
struct Tally {
    times_us: Vec<Vec<f64>>,
    objectives: Vec<f64>,
    iterations: Vec<f64>,
    violation: f64,
    residual: f64,
    failures: usize,
}

fn quantile(sorted: &[f64], q: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * q).round() as usize]
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

type Make<'a> = Box<dyn Fn(Size) -> Box<dyn Solver> + 'a>;

fn main() {
    let arguments: Vec<PathBuf> =
        std::env::args().skip(1).filter(|a| !a.starts_with("--")).map(PathBuf::from).collect();
    let mut archives = Vec::new();
    for path in &arguments {
        if path.is_dir() {
            let entries = std::fs::read_dir(path).expect("readable folder");
            let mut found: Vec<_> = entries
                .filter_map(|entry| Some(entry.ok()?.path()))
                .filter(|path| path.extension().is_some_and(|e| e == "npz"))
                .collect();
            found.sort();
            archives.extend(found);
        } else {
            archives.push(path.clone());
        }
    }
    if archives.is_empty() {
        let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data"));
        archives.extend(["walk.npz", "walk_noisy.npz"].map(|name| folder.join(name)));
    }
    let mut failed = false;
    for archive in archives {
        let ticks = recorded::load(&archive).unwrap_or_else(|error| panic!("{}: {error}", archive.display()));
        println!("\n{} ({} ticks)", archive.display(), ticks.len());
        failed |= compare(&ticks) > 0;
    }
    std::process::exit(i32::from(failed));
}

fn compare(ticks: &[Tick]) -> usize {
    let interior = |tolerance: f64| -> Make {
        Box::new(move |size| {
            Box::new(Interior::new(size, InteriorSettings { tolerance, ..InteriorSettings::default() }))
        })
    };
    let makers: Vec<(&str, Make, bool)> = vec![
        ("Clarabel update 1e-8", interior(1e-8), false),
        ("active set, warm", Box::new(|size| Box::new(ActiveSet::new(size, ActiveSetSettings::default()))), false),
        ("active set, cold", Box::new(|size| Box::new(ActiveSet::new(size, ActiveSetSettings::default()))), true),
        ("Clarabel update 1e-9", interior(1e-9), false),
    ];
    let mut tallies: Vec<Tally> = makers.iter().map(|_| Tally::default()).collect();
    for _ in 0..REPEATS {
        for ((_, make, cold), tally) in makers.iter().zip(&mut tallies) {
            let mut solvers: HashMap<usize, Box<dyn Solver>> = HashMap::new();
            tally.times_us.resize(ticks.len(), Vec::new());
            (tally.failures, tally.objectives, tally.iterations) = (0, Vec::new(), Vec::new());
            for (k, tick) in ticks.iter().enumerate() {
                let solver = solvers.entry(tick.phase).or_insert_with(|| make(tick.problem.size()));
                if *cold {
                    solver.forget();
                }
                let start = thread_time_us();
                let outcome = solver.solve(&tick.problem);
                tally.times_us[k].push(thread_time_us() - start);
                tally.failures += usize::from(outcome.report.status != Status::Solved);
                tally.objectives.push(outcome.report.objective);
                tally.iterations.push(f64::from(outcome.report.iterations));
                tally.violation = tally.violation.max(outcome.violation);
                tally.residual = tally.residual.max(outcome.report.residuals.max());
            }
        }
    }
    let times: Vec<Vec<f64>> = tallies
        .iter()
        .map(|tally| sorted(tally.times_us.iter().map(|t| quantile(&sorted(t.clone()), 0.5)).collect()))
        .collect();
    let yardstick = quantile(&times[0], 0.5);
    let oracle = tallies.last().expect("four solvers").objectives.clone();
    println!(
        "{:<22}{:>9}{:>9}{:>9}{:>9}{:>11}{:>9}{:>11}{:>11}{:>13}{:>6}",
        "solver",
        "median us",
        "p99",
        "max",
        "ratio",
        "p99/median",
        "changes",
        "violation",
        "KKT rel.",
        "objective",
        "fail"
    );
    for (((name, ..), tally), times) in makers.iter().zip(&tallies).zip(&times) {
        let median = quantile(times, 0.5);
        let difference =
            tally.objectives.iter().zip(&oracle).map(|(a, b)| (a - b).abs() / b.abs().max(1.0)).fold(0.0, f64::max);
        println!(
            "{name:<22}{median:>9.1}{:>9.1}{:>9.1}{:>9.4}{:>11.2}{:>9.1}{:>11.1e}{:>11.1e}{difference:>13.1e}{:>6}",
            quantile(times, 0.99),
            times.last().copied().unwrap_or(f64::NAN),
            median / yardstick,
            quantile(times, 0.99) / median,
            tally.iterations.iter().sum::<f64>() / tally.iterations.len() as f64,
            tally.violation,
            tally.residual,
            tally.failures,
        );
    }
    tallies[1].failures + tallies[2].failures
}
