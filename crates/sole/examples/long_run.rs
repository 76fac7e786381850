//! Ten minutes on the spot: `cargo run --profile bench -p sole --example long_run [-- MINUTES]`.
//!
//! One estimator goes through stance after stance of a walk (`tests/suite/walking_stance.rs`) and one stands for as long. Printed: how far
//! `K_c`, updated at every landing and lift-off, is off the inverse of the compliance, the contact laws checked from the compliance, and
//! whether an estimator that is started anew for the last stance agrees to the bit. `tests/suite/long_run.rs` is the short form.
#![allow(clippy::print_stdout)]

#[path = "../tests/suite/long_run.rs"]
mod long_run;
#[path = "../tests/suite/walking_stance.rs"]
#[allow(dead_code)]
mod walking_stance;

use long_run::{on_one_foot, on_the_spot};
use sole::{Level, MeshSource, SoleModel, SoleSettings};
use std::sync::Arc;

fn main() {
    let minutes: f64 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(10.0);
    let ticks = (minutes * 60.0 / walking_stance::PERIOD_S) as usize;
    println!("{:<28} {:<12} {:>7} {:>12} {:>12}  restart", "sole", "walk", "ticks", "K_c C - 1", "laws / load");
    for (name, cells, level) in
        [("1512 elements", [12, 7, 3], Level::Fem), ("6 x 5 patches", [23, 13, 6], Level::Patches { cells: [6, 5] })]
    {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells };
        let settings = SoleSettings { mesh, level, ..SoleSettings::default() };
        let model = Arc::new(SoleModel::build(&settings).expect("a sound sole"));
        for (walk, run) in [("on the spot", on_the_spot(&model, ticks)), ("on one foot", on_one_foot(&model, ticks))] {
            let same = if run.restart_is_same { "the same to the bit" } else { "DIFFERENT" };
            println!(
                "{name:<28} {walk:<12} {:>7} {:>12.1e} {:>12.1e}  {same}",
                run.ticks, run.stiffness_error, run.law_violation
            );
        }
    }
}
