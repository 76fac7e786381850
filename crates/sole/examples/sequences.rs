//! What the slowest ticks cost: `cargo run --profile bench -p sole --example sequences`.
//!
//! Runs the estimator over seeded random sequences that no smooth walk has: loads that drop within a tick, light and heavy loads in turn,
//! first ticks under light loads, foams at the ends of what there is. Prints for each family how many ticks are solved, what the others
//! are called, and the work (millions of multiplications) and time of the slowest.
#![allow(clippy::print_stdout)]

#[path = "../tests/suite/families.rs"]
mod families;

use families::FAMILIES;
use sole::{EstimatorSettings, Foothold, StanceEstimator};
use std::collections::BTreeMap;
use std::time::Instant;

fn main() {
    let seeds: u64 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(3);
    let only = std::env::args().nth(2).unwrap_or_default();
    let slow = std::env::args().nth(3).is_some();
    println!("{:<44} {:>5} {:>6}  {:>9} {:>9}  others", "family", "ticks", "solved", "most 1e6", "most ms");
    for family in FAMILIES.iter().filter(|family| family.name.contains(&only)) {
        let model = family.sole();
        let (mut ticks, mut solved, mut most, mut most_ms) = (0, 0, 0, 0.0_f64);
        let mut others = BTreeMap::new();
        for seed in 0..seeds {
            let mut estimator = StanceEstimator::new(model.clone(), EstimatorSettings::default());
            for (lands, load) in family.loads(seed) {
                if lands {
                    estimator.touch_down(Foothold::default());
                }
                let start = Instant::now();
                let report = estimator.step(&load);
                most_ms = most_ms.max(1e3 * start.elapsed().as_secs_f64());
                ticks += 1;
                if slow && report.slow {
                    println!(
                        "  seed {seed} tick {ticks}: {:.1} N at {:.3}, {:.3} m: {} iterations, {:.1}e6, {:?}",
                        load.force.norm(),
                        load.zmp[0].x,
                        load.zmp[0].y,
                        report.iterations,
                        1e-6 * report.multiplications as f64,
                        report.status
                    );
                }
                most = most.max(report.multiplications);
                if report.status.is_solved() {
                    solved += 1;
                } else {
                    let status = format!("{:?}", report.status);
                    let name = status.split([' ', '(']).next().unwrap_or_default().to_owned();
                    *others.entry(name).or_insert(0) += 1;
                }
            }
        }
        let others: Vec<String> = others.iter().map(|(name, count)| format!("{count} {name}")).collect();
        println!(
            "{:<44} {ticks:>5} {solved:>6}  {:>9.1} {most_ms:>9.1}  {}",
            family.name,
            1e-6 * most as f64,
            others.join(", ")
        );
    }
}
