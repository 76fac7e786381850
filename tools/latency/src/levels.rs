//! Speed against error by the clock: one walk per level, one table.

use crate::criteria::quantiles;
use crate::threads::References;
use crate::ticks::{Cycles, LOOP};
use crate::walk::{Walk, Walked};
use crate::{Levels, UNUSABLE, machine, progress, threads};
use anyhow::Context;
use lateness::judge::median;
use lateness::reference::Excused;
use messages::code::Process;
use std::fmt::Write;

/// What is varied: a name, and the keys that make it.
const LEVELS: [(&str, &[&str]); 13] = [
    ("as shipped", &[]),
    ("estimator: rigid (none)", &["estimator.sole.level=rigid"]),
    ("estimator: lumped", &["estimator.sole.level=lumped"]),
    ("estimator: winkler 6 x 5", &["estimator.sole.level=winkler"]),
    ("estimator: patches 8 x 7", &["estimator.sole.patch_cells=[8, 7]"]),
    ("estimator: patches 10 x 8", &["estimator.sole.patch_cells=[10, 8]"]),
    ("estimator: fem, 1512 tets", &["estimator.sole.level=fem", "estimator.sole.cells=[12, 7, 3]"]),
    ("estimator: quadratic-fem, 432 tets", &["estimator.sole.level=quadratic-fem", "estimator.sole.cells=[8, 3, 3]"]),
    ("plant: patches 6 x 5", &["simulator.sole.patch_cells=[6, 5]"]),
    ("plant: patches 10 x 9", &["simulator.sole.patch_cells=[10, 9]"]),
    ("plant: winkler 8 x 7", &["simulator.sole.level=winkler"]),
    ("controller: 8 edges of the cone", &["controller.constraints.generators_per_point=8"]),
    ("controller: 16 edges of the cone", &["controller.constraints.generators_per_point=16"]),
];

/// Walks all levels; the exit code.
pub fn run(wanted: &Levels) -> anyhow::Result<u8> {
    let facts = machine::tell();
    let swings = format!("planner.gait.walk.swings={}", wanted.swings);
    let base = Walk::of("flat", &[], true).set(&swings)?;
    let (cores, priority) = (base.cores()?, base.priority()? + 1);
    if !threads::are_granted_here(&cores, priority) {
        return Ok(UNUSABLE);
    }
    std::fs::create_dir_all(&wanted.out).with_context(|| format!("cannot make {}", wanted.out.display()))?;
    let mut table = HEAD.to_string();
    let mut told = String::new();
    for (number, (name, settings)) in LEVELS.iter().enumerate() {
        progress(name);
        let mut walk = base.clone();
        for setting in *settings {
            walk = walk.set(setting)?;
        }
        let row = level(wanted, number, &walk, &cores, priority);
        match row {
            Ok(row) => table += &row.markdown(name),
            // A level that this sole cannot have, or a walk that is refused, is a result.
            Err(why) => writeln!(told, "{name}: {why:#}")?,
        }
    }
    let facts: String = facts.iter().map(|(name, value)| format!("{name}: {value}; ")).collect();
    let text = format!("{facts}{} walks of {} swings each\n\n{table}\n{told}", wanted.walks, wanted.swings);
    node::say(&text)?;
    let path = wanted.out.join("levels.md");
    std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(0)
}

const HEAD: &str = "| level | missing (excused) of | stale | slips | chain p50 / p99 / max us | simulator p99 / max ms | estimator p99 / max ms \
                    | controller p99 / max ms | COM max mm (lock-step) | ZMP max mm (lock-step) |\n|---|---|---|---|---|---|---|---|---|---|\n";

/// What the walks of a level were like.
struct Row {
    missing: Excused,
    stale: u64,
    slips: usize,
    cycles: [Cycles; 3],
    errors_mm: [[f64; 2]; 2],
    fallen: bool,
}

fn level(wanted: &Levels, number: usize, walk: &Walk, cores: &[u32], priority: u32) -> anyhow::Result<Row> {
    let folder = |what: &str| wanted.out.join(format!("{number}-{what}"));
    let lock_step = Walk { real_time: false, ..walk.clone() }.walk(&folder("lock-step"))?;
    let errors = |walked: &Walked| {
        let mm = |metres: Option<f64>| 1e3 * metres.unwrap_or(f64::NAN);
        [mm(walked.figures.com_error_max_m), mm(walked.figures.zmp_error_max_m)]
    };
    let (mut row, mut by_the_clock) = (
        Row {
            missing: Excused::default(),
            stale: 0,
            slips: 0,
            cycles: Default::default(),
            errors_mm: [errors(&lock_step); 2],
            fallen: false,
        },
        Vec::new(),
    );
    for repeat in 1..=wanted.walks {
        let references = References::start(cores, priority, 120);
        let walked = walk.walk(&folder(&format!("clock-{repeat}")));
        let (references, _) = references.finish();
        let walked = walked?;
        row.missing.add(&walked.ticks.missing(&references));
        row.stale += walked.ticks.stale_deformations().iter().sum::<u64>();
        row.slips += walked.ticks.slips().len();
        row.fallen |= walked.figures.fallen == Some(true);
        for (pooled, process) in row.cycles.iter_mut().zip(LOOP) {
            pooled.add(&walked.ticks.of(process));
        }
        by_the_clock.push(errors(&walked));
    }
    for (axis, error_mm) in row.errors_mm[0].iter_mut().enumerate() {
        let all: Vec<f64> = by_the_clock.iter().map(|errors| errors[axis]).collect();
        *error_mm = median(&all).unwrap_or(f64::NAN);
    }
    for (process, cycles) in LOOP.iter().zip(&row.cycles) {
        eprintln!("{:<22} {}", format!("{process}, processor"), quantiles(&cycles.processor));
    }
    Ok(row)
}

impl Row {
    fn markdown(&self, name: &str) -> String {
        let or = |ns: Option<u64>, scale: f64, digits: usize| {
            ns.map_or("-".to_string(), |ns| format!("{:.digits$}", ns as f64 * scale))
        };
        let chain = &self.cycles[position(Process::Controller)].published;
        let processor = |process: Process| {
            let processor = &self.cycles[position(process)].processor;
            format!("{} / {}", or(processor.quantile_ns(0.99), 1e-6, 2), or(Some(processor.max_ns()), 1e-6, 2))
        };
        let [clock, lock_step] = self.errors_mm;
        format!(
            "| {name}{} | {} ({}) of {} | {} | {} | {} / {} / {} | {} | {} | {} | {:.1} ({:.1}) | {:.1} ({:.1}) |\n",
            if self.fallen { ", **fell**" } else { "" },
            self.missing.bad,
            self.missing.excused,
            self.missing.all,
            self.stale,
            self.slips,
            or(chain.quantile_ns(0.5), 1e-3, 0),
            or(chain.quantile_ns(0.99), 1e-3, 0),
            or(Some(chain.max_ns()), 1e-3, 0),
            processor(Process::Simulator),
            processor(Process::Estimator),
            processor(Process::Controller),
            clock[0],
            lock_step[0],
            clock[1],
            lock_step[1],
        )
    }
}

fn position(process: Process) -> usize {
    LOOP.iter().position(|other| *other == process).expect("of the loop")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walk::root;
    use scenario::Setting;

    /// What the table varies must exist: a key that was renamed would be refused by the process, hours into the table.
    #[test]
    fn every_level_is_made_of_keys_that_the_shipped_configuration_shows() {
        for (name, settings) in LEVELS {
            for setting in settings {
                let setting: Setting = setting.parse().expect("a setting");
                let [process, table, key] = &setting.key[..] else { panic!("{name}: {setting}") };
                let path = root().join("config").join(process).with_extension("toml");
                let text = std::fs::read_to_string(path).expect("it ships");
                let below = text.split_once(&format!("\n[{table}]")).expect(name).1;
                let below = below.split_once("\n[").map_or(below, |(table, _)| table);
                let shown = |line: &str| line.trim_start_matches("# ").starts_with(&format!("{key} = "));
                assert!(below.lines().any(shown), "{name}: {setting}");
            }
        }
    }

    #[test]
    fn a_row_has_as_many_columns_as_the_head() {
        let row = Row {
            missing: Excused { all: 100, bad: 2, excused: 1 },
            stale: 3,
            slips: 0,
            cycles: Default::default(),
            errors_mm: [[1.0, 2.0], [3.0, 4.0]],
            fallen: true,
        };
        let columns = |line: &str| line.matches('|').count();
        let text = row.markdown("x");
        assert_eq!(columns(&text), columns(HEAD.lines().next().expect("a head")));
        assert!(
            text.starts_with("| x, **fell** | 2 (1) of 100 |") && text.ends_with("| 1.0 (3.0) | 2.0 (4.0) |\n"),
            "{text}"
        );
    }
}
