//! How much work the estimator needs at a tick: the walk of a scenario under several bounds of it, and how many estimates each holds.
//!
//! ```text
//! cargo run --release -p closed_loop --example bounded_work -- SCENARIO [KEY=VALUE]...
//! ```
//! The bound that ships (`estimator.solver.real_time_megamultiplications_max`) has to hold none; the largest time of a tick (thread CPU)
//! says what it may cost where a tick needs all of it.
#![allow(clippy::print_stdout)]

use anyhow::Context;
use estimator::{EstimatorProcess, EstimatorSettings};
use messages::{CONTROL_PERIOD_S, Header, RobotState, WalkStart};
use planner::PlannerSettings;
use scenario::{Scenario, Setting};
use soles::Store;
use std::path::Path;

/// Bounds (millions of multiplications per foot and tick).
const BOUNDS: [f64; 12] = [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0];

fn thread_cpu_s() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is valid for the duration of the call.
    #[allow(unsafe_code)]
    unsafe {
        libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut t);
    }
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (path, settings) = arguments.split_first().context("SCENARIO [KEY=VALUE]...")?;
    let settings = settings.iter().map(|text| text.parse::<Setting>()).collect::<Result<Vec<_>, _>>()?;
    let mut store = Store::in_memory();
    let plan: PlannerSettings = Scenario::load(Path::new(path), &settings)?.config("planner")?.parse()?;
    let planned = planner::plan_with_store(&plan, &mut store)?;
    let ticks = (planned.header.duration_s / CONTROL_PERIOD_S) as i64;
    println!("{:>10} {:>6} {:>6} {:>10} {:>10}", "megamult", "ticks", "held", "mean us", "max us");
    for bound in BOUNDS {
        let mut settings = settings.clone();
        settings.push(format!("estimator.solver.real_time_megamultiplications_max={bound}").parse()?);
        let settings: EstimatorSettings = Scenario::load(Path::new(path), &settings)?.config("estimator")?.parse()?;
        let mut process = EstimatorProcess::with_store(&settings, &mut store)?;
        process.bound_work();
        process.take_pattern(&planned.header, &planned.phases)?;
        let robot = process.robot_fingerprint();
        let (header, pattern_hash) = (Header::new(0, robot), planned.header.pattern_hash);
        process.take_start(&WalkStart { header, pattern_hash, tick_zero: 0 });
        let (mut held, mut sum_s, mut max_s) = (0, 0.0, 0.0_f64);
        for tick in 0..=ticks {
            let state = RobotState { header: Header::new(tick, robot), ..RobotState::default() };
            let before_s = thread_cpu_s();
            let said = process.step(&state).context("it has a pattern")?;
            let spent_s = thread_cpu_s() - before_s;
            (sum_s, max_s) = (sum_s + spent_s, max_s.max(spent_s));
            held += said.deformation.feet.iter().filter(|foot| foot.age_ticks > 0).count();
        }
        let mean_us = 1e6 * sum_s / (ticks + 1) as f64;
        println!("{bound:>10} {ticks:>6} {held:>6} {mean_us:>10.1} {:>10.0}", 1e6 * max_s);
    }
    Ok(())
}
