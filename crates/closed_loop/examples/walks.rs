//! Walks scenarios one after the other and prints a table: `cargo run --release -p closed_loop --example walks -- FILE`.
//!
//! Each line of FILE is a walk: a name, a colon, a scenario's file and any number of KEY=VALUE; `#` begins a remark. `held` counts the
//! foot's ticks whose deformation could not be solved; `bits` is one hash over every number of commands and truth. No number is a time, so
//! that a table is the same on every machine. `cargo xtask walks` writes the tables of `docs/walks/` into `docs/walks.md`.
#![allow(clippy::print_stdout)]

use anyhow::Context;
use closed_loop::{ClosedLoop, NumberHash, Shared, Tick};
use scenario::{Scenario, Setting};
use std::path::Path;

/// What one walk comes to.
struct Row {
    end: String,
    ticks: u64,
    /// Ticks of a foot whose deformation could not be solved.
    held: usize,
    bits: NumberHash,
}

fn main() -> anyhow::Result<()> {
    let file = std::env::args().nth(1).context("the file of walks")?;
    let text = std::fs::read_to_string(&file).with_context(|| file.clone())?;
    println!("| walk | end | distance m | COM rms, max mm | ZMP rms, max mm | tilt deg | held | ticks | bits |");
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut shared = Shared::default();
    for line in text.lines().map(|line| line.split('#').next().unwrap_or_default().trim()) {
        let Some((name, rest)) = line.split_once(':') else { continue };
        let mut words = rest.split_whitespace();
        let path = words.next().with_context(|| format!("{name}: no scenario"))?;
        let settings = words.map(str::parse).collect::<Result<Vec<Setting>, _>>()?;
        match walk(Path::new(path), &settings, &mut shared) {
            Ok((row, figures)) => {
                println!("| {name} | {} | {figures} | {} | {} | {} |", row.end, row.held, row.ticks, row.bits)
            }
            Err(error) => println!("| {name} | refused: {} | | | | | | | |", error.root_cause()),
        }
    }
    Ok(())
}

fn walk(path: &Path, settings: &[Setting], shared: &mut Shared) -> anyhow::Result<(Row, String)> {
    let mut walk = ClosedLoop::sharing(&Scenario::load(path, settings)?, shared)?;
    let mut row = Row { end: String::new(), ticks: 0, held: 0, bits: NumberHash::default() };
    while let Some(Tick { truth, command, deformation, .. }) = walk.step()? {
        row.ticks += 1;
        row.held += deformation.feet.iter().filter(|foot| foot.age_ticks > 0).count();
        row.bits.take(&command);
        row.bits.take(&truth);
    }
    row.end = walk.over().map_or_else(String::new, |reason| format!("{reason:?}"));
    let f = walk.figures();
    let mm = |length_m: Option<f64>| 1e3 * length_m.unwrap_or(f64::NAN);
    let figures = format!(
        "{:.3} | {:.2}, {:.2} | {:.2}, {:.2} | {:.2}",
        f.distance_m.unwrap_or(f64::NAN),
        mm(f.com_error_rms_m),
        mm(f.com_error_max_m),
        mm(f.zmp_error_rms_m),
        mm(f.zmp_error_max_m),
        f.base_tilt_max_rad.unwrap_or(f64::NAN).to_degrees()
    );
    Ok((row, figures))
}
