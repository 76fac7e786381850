//! What each part of the loop costs: `cargo run --release -p closed_loop --example costs -- [FILE]`
//!
//! Walks the beginning of `config/scenarios/flat.toml` with a part on and off and prints one table: microseconds per tick, median and 99th
//! percentile of the process that the part belongs to. With a file, the table replaces what stands there between the lines
//! `<!-- costs -->` and `<!-- end of costs -->`.
#![allow(clippy::print_stdout)]

use anyhow::Context;
use closed_loop::{ClosedLoop, Part};
use messages::topic;
use recorder::{Recorder, RecorderSettings};
use scenario::{Scenario, Setting};
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

/// Ticks of a run: it settles, then takes its first two steps.
const TICKS: usize = 900;
/// Runs with and without, in turn: the machine may be slower for a while.
const RUNS: usize = 3;

const NOISE: [&str; 5] = [
    "simulator.plant.sensors.joint_noise_rad=1e-5",
    "simulator.plant.sensors.acceleration_noise_m_per_s2=0.05",
    "simulator.plant.sensors.gyro_noise_rad_per_s=0.002",
    "simulator.plant.sensors.orientation_noise_rad=1e-4",
    "simulator.plant.sensors.foot_force_noise_n=1.0",
];
/// A hard foot needs a softer stabiliser.
const HARD: [&str; 4] = [
    "simulator.sole.level=rigid",
    "simulator.plant.stabiliser.roll_damping_nm_s_per_rad=200.0",
    "simulator.plant.stabiliser.pitch_damping_nm_s_per_rad=400.0",
    "simulator.plant.stabiliser.vertical_damping_n_s_per_m=1e5",
];

/// A part, the process whose time counts, and the settings with it and without.
const ROWS: [(&str, Part, &[&str], &[&str]); 10] = [
    ("estimator: sole, contact patches (as shipped)", Part::Estimator, &[], &["estimator.sole.level=rigid"]),
    (
        "estimator: sole, the paper's 1512 tetrahedra",
        Part::Estimator,
        &["estimator.sole.level=fem", "estimator.sole.cells=[12,7,3]"],
        &["estimator.sole.level=rigid"],
    ),
    (
        "controller: feedback",
        Part::Controller,
        &["controller.integration.mode=feedback", "controller.tasks.com.stiffness_per_s2=20.0"],
        &["controller.tasks.com.stiffness_per_s2=20.0"],
    ),
    ("controller: collision pairs", Part::Controller, &[], &["controller.collision.on=false"]),
    ("controller: least torques", Part::Controller, &["controller.tasks.torque_weight=1e-3"], &[]),
    (
        "controller: angular momentum",
        Part::Controller,
        &["controller.tasks.angular_momentum={weight=10.0,rate_per_s=10.0}"],
        &[],
    ),
    (
        "controller: stabiliser, where the robot has none",
        Part::Controller,
        &["simulator.plant.stabiliser.enabled=false", "controller.stabiliser.enabled=true"],
        &["simulator.plant.stabiliser.enabled=false"],
    ),
    ("plant: soft soles (off: hard corners)", Part::Plant, &[], &HARD),
    ("plant: stabiliser", Part::Plant, &[], &["simulator.plant.stabiliser.enabled=false"]),
    ("plant: sensor noise", Part::Plant, &NOISE, &[]),
];

fn main() -> anyhow::Result<()> {
    let mut table = String::from("| part | on, us | off, us | on, p99 | off, p99 |\n|---|---|---|---|---|\n");
    for (name, part, on, off) in ROWS {
        let (mut with, mut without) = (Vec::new(), Vec::new());
        for _ in 0..RUNS {
            with.extend(run(on, part)?);
            without.extend(run(off, part)?);
        }
        row(&mut table, name, &mut with, Some(&mut without))?;
    }
    row(&mut table, "recorder: a tick's messages stored", &mut recorded()?, None)?;
    print!("{table}");
    match std::env::args().nth(1) {
        Some(file) => replace(Path::new(&file), &table),
        None => Ok(()),
    }
}

fn row(table: &mut String, name: &str, on: &mut [f64], off: Option<&mut Vec<f64>>) -> anyhow::Result<()> {
    let [on, on_p99] = quantiles(on);
    let [off, off_p99] = off.map_or([0.0; 2], |off| quantiles(off));
    writeln!(table, "| {name} | {on:.1} | {off:.1} | {on_p99:.1} | {off_p99:.1} |")?;
    Ok(())
}

fn quantiles(times_us: &mut [f64]) -> [f64; 2] {
    times_us.sort_by(f64::total_cmp);
    [0.5, 0.99].map(|part| times_us[((times_us.len() - 1) as f64 * part) as usize])
}

fn scenario(settings: &[&str]) -> anyhow::Result<Scenario> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/flat.toml");
    let settings = settings.iter().map(|text| text.parse::<Setting>()).collect::<Result<Vec<_>, _>>()?;
    Ok(Scenario::load(&path, &settings)?)
}

/// Times of a process, tick by tick (us).
fn run(settings: &[&str], part: Part) -> anyhow::Result<Vec<f64>> {
    let mut walk = ClosedLoop::new(&scenario(settings)?)?;
    let mut times_us = Vec::with_capacity(TICKS);
    for _ in 0..TICKS {
        let mut since = Instant::now();
        let tick = walk.step_probed(|done| {
            let now = Instant::now();
            if done == part {
                times_us.push((now - since).as_secs_f64() * 1e6);
            }
            since = now;
        })?;
        tick.with_context(|| format!("the run is over early: {:?}", walk.over()))?;
    }
    Ok(times_us)
}

/// Times of the recorder, tick by tick (us).
fn recorded() -> anyhow::Result<Vec<f64>> {
    let folder = tempfile::tempdir()?;
    let output = format!("recorder.output_file={}", folder.path().join("walk.mcap").display());
    let scenario = scenario(&[&output])?;
    let mut settings: RecorderSettings = scenario.config("recorder")?.parse()?;
    settings.read_robot()?;
    let mut recorder = Recorder::create(&settings, settings.run_info(&[])?)?;
    let mut walk = ClosedLoop::new(&scenario)?;
    let mut times_us = Vec::with_capacity(TICKS);
    for _ in 0..TICKS {
        let tick = walk.step()?.with_context(|| format!("the run is over early: {:?}", walk.over()))?;
        let begin = Instant::now();
        recorder.store(topic::ROBOT_STATE, &tick.state);
        recorder.store(topic::SOLE_DEFORMATION, &tick.deformation);
        recorder.store(topic::SOLE_CONTACT, &tick.contact);
        recorder.store(topic::ROBOT_COMMAND, &tick.command);
        recorder.store(topic::TRUTH_ROBOT, &tick.truth);
        times_us.push(begin.elapsed().as_secs_f64() * 1e6);
    }
    Ok(times_us)
}

/// Puts the table between the marks of a file.
fn replace(file: &Path, table: &str) -> anyhow::Result<()> {
    const MARKS: [&str; 2] = ["<!-- costs -->\n", "<!-- end of costs -->"];
    let text = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
    let no_mark = || format!("{} has no line {}", file.display(), MARKS[0].trim());
    let (before, rest) = text.split_once(MARKS[0]).with_context(no_mark)?;
    let (_, after) = rest.split_once(MARKS[1]).with_context(no_mark)?;
    std::fs::write(file, format!("{before}{}{table}{}{after}", MARKS[0], MARKS[1]))?;
    Ok(())
}
