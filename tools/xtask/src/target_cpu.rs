//! `cargo xtask target-cpu`: what the choice of `target-cpu` costs, on the hot paths of the whole workspace.
//!
//! Builds the benchmarks once per choice, each in a target folder of its own, then runs them in turn, so that a change of the
//! machine's pace meets all choices alike. Of every figure the best round counts: the others were disturbed. Takes half an hour.

use crate::metadata::{Metadata, cargo};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What every x86-64 has, what those since 2013 have (AVX2, FMA), and all that this machine has.
const CHOICES: [&str; 3] = ["x86-64", CHOSEN, "native"];
/// What `.cargo/config.toml` says.
const CHOSEN: &str = "x86-64-v3";
/// How often everything is measured.
const ROUNDS: usize = 3;

/// A package whose benchmark is run, its benchmark, and what that is told.
const BENCHES: [(&str, &str, &[&str]); 4] = [
    ("multibody", "algorithms", &["--output-format", "bencher", "soleus/HRP-4"]),
    ("sole", "ticks", &[]),
    ("wholebody", "step", &[]),
    ("gait", "plan", &[]),
];

/// One number among what a benchmark prints.
struct Figure {
    package: &'static str,
    name: &'static str,
    unit: &'static str,
    /// How its line begins.
    line: &'static str,
    /// Which of the numbers that follow it is.
    number: usize,
}

const fn figure(
    package: &'static str,
    name: &'static str,
    unit: &'static str,
    line: &'static str,
    number: usize,
) -> Figure {
    Figure { package, name, unit, line, number }
}

const FIGURES: [Figure; 15] = [
    figure("multibody", "whole-body bundle", "ns", "test whole-body terms/soleus/HRP-4 ", 0),
    figure("multibody", "RNEA", "ns", "test RNEA/soleus/HRP-4 ", 0),
    figure("multibody", "CRBA", "ns", "test CRBA/soleus/HRP-4 ", 0),
    figure("multibody", "ABA", "ns", "test ABA/soleus/HRP-4 ", 0),
    figure("sole", "Gauss-Seidel, 104 contacts", "us", "  Gauss-Seidel, 104 contacts ", 0),
    figure("sole", "Newton, 104 contacts", "us", "  Newton, 104 contacts ", 0),
    figure("sole", "estimator, one foot", "us", "  1512 tets, 104 contacts, 1e-6 ", 0),
    figure("sole", "estimator, double support", "us", "  1512 tets each, 1e-6 ", 0),
    figure("sole", "plant's contact, 72 patches", "us", "  8 x 7 patches, 72 contacts ", 0),
    figure("wholebody", "step, single support", "us", "| HRP-4 walking |", 1),
    figure("wholebody", "step, double support", "us", "| HRP-4 walking |", 2),
    figure("wholebody", "the same by Clarabel", "us", "| HRP-4 walking, Clarabel 1e-6 |", 1),
    // Of a straight walk's two programs, x and y, each has its number of iterations.
    figure("gait", "pattern, 11 swings: build", "ms", "| 0.6 | 11 | 201 |", 4),
    figure("gait", "pattern, 11 swings: solve", "ms", "| 0.6 | 11 | 201 |", 7),
    figure("gait", "pattern, 1000 swings: solve", "ms", "| 0.6 | 1000 | 21 |", 7),
];

/// Measures all choices and prints the table.
pub fn compare() -> anyhow::Result<()> {
    let metadata = Metadata::read()?;
    let mut programs = Vec::new();
    for choice in CHOICES {
        eprintln!("== building for {choice}");
        programs.push(build(choice, &metadata.target.join("target-cpu").join(choice))?);
    }
    let mut best = [[f64::INFINITY; CHOICES.len()]; FIGURES.len()];
    for round in 1..=ROUNDS {
        for (package, bench, arguments) in BENCHES {
            for (column, choice) in CHOICES.iter().enumerate() {
                eprintln!("== round {round} of {ROUNDS}: {package} for {choice}");
                let program = programs[column].get(bench).with_context(|| format!("cargo built no {bench}"))?;
                let printed = run(program, &metadata.root.join("crates").join(package), arguments)?;
                for (figure, best) in FIGURES.iter().zip(&mut best).filter(|(figure, _)| figure.package == package) {
                    let found = number(&printed, figure)
                        .with_context(|| format!("{package}'s benchmark prints no `{}`:\n{printed}", figure.line))?;
                    best[column] = best[column].min(found);
                }
            }
        }
    }
    print(&best);
    Ok(())
}

/// The benchmarks for a processor, by name.
fn build(choice: &str, target: &Path) -> anyhow::Result<BTreeMap<String, PathBuf>> {
    let mut command = cargo();
    command.args(["bench", "--no-run", "--locked", "--message-format", "json-render-diagnostics"]);
    for (package, bench, _) in BENCHES {
        command.args(["--package", package, "--bench", bench]);
    }
    command.env("RUSTFLAGS", format!("-C target-cpu={choice}")).env("CARGO_TARGET_DIR", target);
    let output = command.stderr(Stdio::inherit()).output().context("cannot run cargo")?;
    ensure!(output.status.success(), "the build for {choice} failed");
    let mut programs = BTreeMap::new();
    for line in String::from_utf8(output.stdout)?.lines() {
        let message: Value = serde_json::from_str(line)?;
        if let (Some(name), Some(program)) = (message["target"]["name"].as_str(), message["executable"].as_str()) {
            programs.insert(name.to_owned(), PathBuf::from(program));
        }
    }
    Ok(programs)
}

fn run(program: &Path, folder: &Path, arguments: &[&str]) -> anyhow::Result<String> {
    let mut command = Command::new(program);
    command.arg("--bench").args(arguments).current_dir(folder).stderr(Stdio::null());
    let output = command.output().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(output.status.success(), "{command:?} failed");
    Ok(String::from_utf8(output.stdout)?)
}

/// A figure's number in what its benchmark printed; criterion writes thousands with a comma.
fn number(printed: &str, figure: &Figure) -> Option<f64> {
    let rest = printed.lines().find_map(|line| line.strip_prefix(figure.line))?;
    rest.split_whitespace().filter_map(|word| word.replace(',', "").parse().ok()).nth(figure.number)
}

#[allow(clippy::print_stdout)] // its result
fn print(best: &[[f64; CHOICES.len()]]) {
    let chosen = CHOICES.iter().position(|choice| *choice == CHOSEN).expect("one of them is chosen");
    println!("| figure | {CHOSEN} | {} |", CHOICES.map(|choice| format!("{choice} / {CHOSEN}")).join(" | "));
    println!("|---|---|{}", "---|".repeat(CHOICES.len()));
    for (figure, times) in FIGURES.iter().zip(best) {
        let ratios = times.map(|time| format!("{:.2}", time / times[chosen])).join(" | ");
        println!("| {}: {} | {:.4} {} | {ratios} |", figure.package, figure.name, times[chosen], figure.unit);
    }
    let mean = |column: usize| {
        let logarithms = best.iter().map(|times| (times[column] / times[chosen]).ln());
        (logarithms.sum::<f64>() / best.len() as f64).exp()
    };
    let means: Vec<String> = (0..CHOICES.len()).map(|column| format!("{:.2}", mean(column))).collect();
    println!("| geometric mean | | {} |", means.join(" | "));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_in_every_format_that_benchmarks_print() {
        let printed = "test RNEA/soleus/HRP-4 ... bench:        1,962 ns/iter (+/- 5)\n\
            \x20 1512 tets, 104 contacts, 1e-6                      75.1     90.2    120.5   3.1 mean, 7 most, 0 failed\n\
            | 0.6 | 11 | 201 | 474 | 1012 | 14 + 15 | 0.41 / 0.52 / 0.81 | 3.21 / 3.40 / 4.05 | 1.1 | 0.000 | 1.2e-5 |";
        let of = |line, index| number(printed, &figure("", "", "", line, index));
        assert_eq!(of("test RNEA/soleus/HRP-4 ", 0), Some(1962.0));
        assert_eq!(of("  1512 tets, 104 contacts, 1e-6 ", 0), Some(75.1));
        assert_eq!((of("| 0.6 | 11 | 201 |", 4), of("| 0.6 | 11 | 201 |", 7)), (Some(0.41), Some(3.21)));
        assert_eq!(of("| 0.6 | 12 |", 0), None);
    }
}
