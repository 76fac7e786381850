//! What the simulated robot costs: thread CPU time of its tick within a walk, and what it did.
//!
//! ```text
//! cargo run --release -p closed_loop --example plant_cost -- SCENARIO OUT.csv [KEY=VALUE]...
//! cargo run --release -p closed_loop --example plant_cost -- compare A.csv B.csv
//! ```
//! The second form holds two walks against each other: two builds, step lengths or kinds of sole.
#![allow(clippy::print_stdout)]

use anyhow::Context;
use closed_loop::ClosedLoop;
use messages::Truth;
use scenario::{Scenario, Setting};
use std::fmt::Write;
use std::path::Path;

/// Columns of the file, in order: centre of mass and ZMP, heights of the soles, vertical forces, energies.
fn row(truth: &Truth) -> [f64; 13] {
    let (com, zmp, sole) = (truth.com_position_m, truth.zmp_m, truth.sole_position_m);
    let force = truth.foot_wrench_n_nm;
    let [x_m, y_m, z_m] = com;
    let [left, right] = sole;
    let (loads_n, stored_j) = ([force[0][2], force[1][2]], truth.elastic_energy_j);
    let bodies = [truth.walk_time_s, x_m, y_m, z_m, zmp[0], zmp[1], left[0], left[2], right[0], right[2]];
    let mut row = [0.0; 13];
    row[..10].copy_from_slice(&bodies);
    row[10..].copy_from_slice(&[loads_n[0], loads_n[1], stored_j]);
    row
}

fn thread_cpu_ns() -> u64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is valid for the duration of the call.
    #[allow(unsafe_code)]
    unsafe {
        libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut t);
    }
    t.tv_sec as u64 * 1_000_000_000 + t.tv_nsec as u64
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [first, second, rest @ ..] = arguments.as_slice() else {
        anyhow::bail!("SCENARIO OUT.csv [KEY=VALUE]..., or compare A.csv B.csv");
    };
    if first == "compare" {
        return compare(Path::new(second), Path::new(rest.first().context("a second file")?));
    }
    let settings = rest.iter().map(|text| text.parse::<Setting>()).collect::<Result<Vec<_>, _>>()?;
    let scenario = Scenario::load(Path::new(first), &settings)?;
    let mut walk = ClosedLoop::new(&scenario)?;
    let mut spent_ns = Vec::new();
    let mut rows = String::new();
    let (mut newton, mut sliding, mut touching) = (0, 0, 0);
    let mut numerical_j = f64::MIN;
    let begun_ns = thread_cpu_ns();
    loop {
        let around = |simulator: &mut simulator::SimulatorProcess| {
            let before_ns = thread_cpu_ns();
            let output = simulator.advance();
            spent_ns.push(thread_cpu_ns() - before_ns);
            output
        };
        let Some(tick) = walk.step_around(|_| {}, around)? else { break };
        let plant = walk.simulator().plant();
        newton += plant.truth().integration.newton_steps;
        numerical_j = numerical_j.max(plant.truth().energies.numerical_j());
        for foot in 0..2 {
            let states = plant.contact(foot).map_or(&[][..], |report| &report.node_states);
            let count = |wanted: &str| states.iter().filter(|state| format!("{state:?}") == wanted).count();
            sliding = sliding.max(count("Slip"));
            touching = touching.max(states.len() - count("Open"));
        }
        let values = row(&tick.truth).map(|x| format!("{x:.17e}"));
        writeln!(rows, "{},{}", values.join(","), spent_ns.last().copied().unwrap_or_default())?;
    }
    let all_s = (thread_cpu_ns() - begun_ns) as f64 * 1e-9;
    std::fs::write(second, rows)?;
    let figures = walk.figures();
    let millimetres = |metres: Option<f64>| 1e3 * metres.unwrap_or(f64::NAN);
    let energies = walk.simulator().plant().truth().energies;
    println!(
        "{first} {}: {:?}, {} ticks, COM error rms {:.3} max {:.3} mm, ZMP error rms {:.3} max {:.3} mm, unconverged {}",
        rest.join(" "),
        walk.over(),
        spent_ns.len(),
        millimetres(figures.com_error_rms_m),
        millimetres(figures.com_error_max_m),
        millimetres(figures.zmp_error_rms_m),
        millimetres(figures.zmp_error_max_m),
        figures.periods_unconverged
    );
    let sum_ns: u64 = spent_ns.iter().sum();
    let (ticks, walked_s) = (spent_ns.len() as f64, spent_ns.len() as f64 * 5e-3);
    let mean_ms = sum_ns as f64 * 1e-6 / ticks;
    spent_ns.sort_unstable();
    let quantile_ms = |part: f64| spent_ns[((ticks - 1.0) * part) as usize] as f64 * 1e-6;
    println!(
        "  plant: CPU ms per tick median {:.3} p90 {:.3} p99 {:.3} max {:.3} mean {mean_ms:.3}; Newton steps per tick {:.2}; at most {touching} points touch, {sliding} slide",
        quantile_ms(0.5),
        quantile_ms(0.9),
        quantile_ms(0.99),
        quantile_ms(1.0),
        newton as f64 / ticks
    );
    println!("  all processes: {:.1} s of walking per CPU second", walked_s / all_s);
    println!(
        "  work (J): {:?}, integrator {:.5} (never above {numerical_j:.2e})",
        energies.flows,
        energies.numerical_j()
    );
    Ok(())
}

/// Largest and mean square difference of each column over the ticks that both have.
fn compare(a: &Path, b: &Path) -> anyhow::Result<()> {
    let read = |path: &Path| -> anyhow::Result<Vec<Vec<f64>>> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        text.lines().map(|line| line.split(',').map(|x| Ok(x.parse()?)).collect()).collect()
    };
    let (a, b) = (read(a)?, read(b)?);
    let ticks = a.len().min(b.len());
    let group = |name: &str, unit: f64, columns: &[usize]| {
        let (mut largest, mut sum) = (0.0_f64, 0.0);
        for (a, b) in a.iter().zip(&b) {
            let square: f64 = columns.iter().map(|i| (a[*i] - b[*i]).powi(2)).sum();
            largest = largest.max(square.sqrt());
            sum += square;
        }
        println!("  {name}: rms {:.3e}, max {:.3e}", unit * (sum / ticks as f64).sqrt(), unit * largest);
    };
    println!("{} and {} ticks, {ticks} compared", a.len(), b.len());
    group("COM (m)", 1.0, &[1, 2, 3]);
    group("ZMP (m)", 1.0, &[4, 5]);
    group("sole heights (m)", 1.0, &[7, 9]);
    group("vertical forces (N)", 1.0, &[10, 11]);
    Ok(())
}
