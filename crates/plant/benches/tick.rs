//! One control period (5 ms, five integration steps) of HRP-4 on its default soles: median, 99th percentile and maximum.
//!
//! `cargo bench -p plant` prints a table; the machine is the reader's.
#![allow(non_snake_case, clippy::print_stdout)]
#![allow(clippy::disallowed_methods)] // it measures time

#[path = "../tests/suite/robot.rs"]
#[allow(dead_code)]
mod robot;

use plant::disturbance::Push;
use plant::{Plant, PlantSettings};
use spatial::Vec3;
use std::time::Instant;

const TICKS: usize = 2000;

fn main() {
    println!("{:<44} {:>9} {:>9} {:>9} {:>14}", "scene", "median us", "p99 us", "max us", "Newton/step");
    let still = robot::settings();
    let mut shaken = robot::settings();
    // A shove every half second keeps the soles working.
    for i in 0..20 {
        let force = if i % 2 == 0 { 30.0 } else { -30.0 };
        let (start_s, duration_s) = (0.5 * f64::from(i), 0.1);
        shaken.pushes.push(Push {
            link: "torso".to_owned(),
            force_n: [force, force, 0.0],
            start_s,
            duration_s,
            ..Push::default()
        });
    }
    report("both feet, still", still.clone(), [0.5, 0.5]);
    report("both feet, shoved", shaken.clone(), [0.5, 0.5]);
    report("left foot, still", still, [1.0, 0.0]);
    report("left foot, shoved", shaken, [1.0, 0.0]);
}

fn report(name: &str, settings: PlantSettings, loads: [f64; 2]) {
    let model = robot::model();
    let mut ankles = robot::flat_ankles(if loads[1] > 0.0 { 4e-4 } else { 8e-4 });
    let mut com = Vec3::new(0.0, 0.0, 0.78);
    if loads[1] == 0.0 {
        ankles[1].translation.z += 0.04;
        com.y = ankles[0].translation.y;
    }
    let q = robot::stand(&model, &ankles, com);
    let plan = robot::resting_plan(&model, &q, &ankles, com, loads);
    let command = robot::command(&model, &q, &plan);
    let mut plant = Plant::new(settings, model, robot::soles(), &robot::frames()).expect("the default plant");
    plant.place(&q);
    plant.start_clock();
    let mut newton_steps = 0;
    let mut times_us: Vec<f64> = (0..TICKS)
        .map(|_| {
            let start = Instant::now();
            plant.tick(&command);
            let time_us = start.elapsed().as_secs_f64() * 1e6;
            newton_steps += plant.truth().integration.newton_steps;
            time_us
        })
        .collect();
    assert_eq!(plant.fallen(), None, "{name}");
    times_us.sort_by(f64::total_cmp);
    let [median, p99, max] = [TICKS / 2, TICKS * 99 / 100, TICKS - 1].map(|i| times_us[i]);
    let per_step = newton_steps as f64 / (5 * TICKS) as f64;
    println!("{name:<44} {median:>9.0} {p99:>9.0} {max:>9.0} {per_step:>14.2}");
}
