//! What the estimator's constants are worth: `cargo run --profile bench -p sole --example hard_cases [-- FILE]`.
//!
//! Runs the estimator over its hard cases (soft, thin, thick, nearly incompressible, slippery; the ZMP at the edge, the force at the
//! friction cone, large random loads from one tick to the next) and prints iterations, unsolved ticks and time of each. The first run
//! writes all answers to FILE; later ones say how many differ from them: halve or double a constant and run again. The numbers in the
//! constants' comments come from here.
#![allow(clippy::print_stdout)]
#![allow(clippy::disallowed_methods)] // it measures time

#[path = "../tests/suite/walking_stance.rs"]
#[allow(dead_code)]
mod walking_stance;

use nalgebra::Vector2;
use sole::{
    EstimatorSettings, Foothold, Material, MeshSource, SoleModel, SoleSettings, StanceEstimator, StanceReference,
};
use spatial::Vec3;
use std::sync::Arc;
use std::time::Instant;
use walking_stance::{TICKS, WEIGHT_N, reference};

/// Answers further apart than this count as different (m).
const SAME_M: f64 = 1e-6;
const FOAM_PA: f64 = 0.32e6;
const RUBBER: f64 = 0.65;

/// Ankle position (m), or that there was no answer.
type Answer = Option<Vec3>;

struct Suite {
    answers: Vec<Answer>,
    iterations: usize,
    started: (usize, usize),
}

impl Suite {
    fn step(&mut self, estimator: &mut StanceEstimator, reference: &StanceReference) {
        let report = estimator.step(reference);
        self.iterations += report.iterations;
        self.answers.push(report.status.is_solved().then_some(report.ankle_pose.translation));
    }

    fn part(&mut self, name: &str, run: impl FnOnce(&mut Self)) {
        self.started = (self.answers.len(), self.iterations);
        let start = Instant::now();
        run(self);
        let ticks = &self.answers[self.started.0..];
        println!(
            "{name:<34} {:>5} ticks {:>4} unsolved {:>6} iterations {:>8.1} ms",
            ticks.len(),
            ticks.iter().filter(|a| a.is_none()).count(),
            self.iterations - self.started.1,
            1e3 * start.elapsed().as_secs_f64()
        );
    }

    fn total(&self, name: &str) {
        let unsolved = self.answers.iter().filter(|a| a.is_none()).count();
        println!("{name}: {} ticks, {unsolved} unsolved, {} iterations", self.answers.len(), self.iterations);
    }
}

fn sole(height_m: f64, young_modulus_pa: f64, poisson_ratio: f64, friction: f64, cells: [usize; 3]) -> Arc<SoleModel> {
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, height_m], cells };
    let material = Material { young_modulus_pa, poisson_ratio };
    let settings = SoleSettings { mesh, material, friction, ..SoleSettings::default() };
    Arc::new(SoleModel::build(&settings).expect("a sound sole"))
}

fn landed(model: &Arc<SoleModel>) -> StanceEstimator {
    let settings = EstimatorSettings { friction_use_max: 1.0, ..EstimatorSettings::default() };
    let mut estimator = StanceEstimator::new(Arc::clone(model), settings);
    estimator.touch_down(Foothold::default());
    estimator
}

fn constant(force: Vec3, x_m: f64, y_m: f64) -> StanceReference {
    StanceReference::constant(force, Vector2::new(x_m, y_m))
}

fn walk(suite: &mut Suite, model: &Arc<SoleModel>, every: usize) {
    let mut estimator = landed(model);
    for tick in (0..TICKS).step_by(every) {
        suite.step(&mut estimator, &reference(tick, false));
    }
}

fn main() {
    let mut suite = Suite { answers: Vec::new(), iterations: 0, started: (0, 0) };
    let paper = sole(0.021, FOAM_PA, 0.31, RUBBER, [12, 7, 3]);
    let thick = sole(0.03, FOAM_PA, 0.31, RUBBER, [10, 5, 5]);
    let small = |height_m, young_modulus_pa, poisson_ratio, friction| {
        sole(height_m, young_modulus_pa, poisson_ratio, friction, [6, 4, 2])
    };
    suite.part("walk, 1512 elements", |s| walk(s, &paper, 1));
    suite.part("walk, every tenth tick", |s| walk(s, &paper, 10));
    suite.part("walk, other shapes and foams", |s| {
        for (height_m, young_modulus_pa, poisson_ratio) in [
            (0.021, 0.02e6, 0.31),
            (0.021, 50e6, 0.31),
            (0.006, FOAM_PA, 0.31),
            (0.060, FOAM_PA, 0.31),
            (0.021, FOAM_PA, 0.49),
            (0.012, FOAM_PA, 0.47),
        ] {
            walk(s, &small(height_m, young_modulus_pa, poisson_ratio, RUBBER), 2);
        }
    });
    suite.part("walk, friction 0.05, 0.1, 1.5", |s| {
        for mu in [0.05, 0.1, 1.5] {
            let mut estimator = landed(&small(0.021, FOAM_PA, 0.31, mu));
            for tick in 0..TICKS {
                let mut reference = reference(tick, false);
                let scale = f64::min(1.0, 0.9 * mu / 0.3);
                for f in [&mut reference.force, &mut reference.force_rate, &mut reference.force_acceleration] {
                    f.x *= scale;
                    f.y *= scale;
                }
                s.step(&mut estimator, &reference);
            }
        }
    });
    suite.part("walk, foam that folds", |s| walk(s, &small(0.021, 0.005e6, 0.31, RUBBER), 1));
    let vertical = Vec3::new(0.0, 0.0, 383.0);
    suite.part("ZMP at the edge, first tick", |s| {
        for part in [0.8, 0.85, 0.88, 0.9, 0.905, 0.908, 0.91, 0.92, 0.95, 0.99] {
            s.step(&mut landed(&thick), &constant(vertical, 0.115 * part, 0.0));
        }
    });
    suite.part("ZMP at the edge, from standing", |s| {
        for part in [0.8, 0.85, 0.88, 0.9, 0.92, 0.95, 0.97, 0.99, 0.999] {
            let mut estimator = landed(&thick);
            s.step(&mut estimator, &constant(vertical, 0.0, 0.0));
            s.step(&mut estimator, &constant(vertical, 0.115 * part, 0.0));
        }
    });
    suite.part("force at the friction cone", |s| {
        for part in [0.9, 0.95, 0.99, 0.995, 0.999] {
            for k in 0..4 {
                let (sine, cosine) = (0.7 * f64::from(k)).sin_cos();
                let force = 383.0 * Vec3::new(part * RUBBER * cosine, part * RUBBER * sine, 1.0);
                s.step(&mut landed(&paper), &constant(force, 0.02, 0.01));
            }
        }
    });
    let mut seed = 2024_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as f64 / f64::from(1u32 << 31) * 2.0 - 1.0
    };
    // 12 to 383 N, to 0.95 of the friction cone, ZMP to 0.85 of the half size.
    let mut load = || {
        let normal_n = 383.0 * 10f64.powf(-1.5 * random().abs());
        let (use_of_friction, (sine, cosine)) =
            (0.95 * RUBBER * random().abs(), (std::f64::consts::PI * random()).sin_cos());
        let force = normal_n * Vec3::new(use_of_friction * cosine, use_of_friction * sine, 1.0);
        constant(force, 0.1 * random(), 0.055 * random())
    };
    suite.part("random load, first tick", |s| {
        for k in 0..150 {
            s.step(&mut landed(if k % 2 == 0 { &paper } else { &thick }), &load());
        }
    });
    suite.part("random loads, tick after tick", |s| {
        for k in 0..10 {
            let mut estimator = landed(if k % 2 == 0 { &paper } else { &thick });
            s.step(&mut estimator, &constant(Vec3::new(0.0, 0.0, WEIGHT_N), 0.0, 0.0));
            for _ in 0..30 {
                s.step(&mut estimator, &load());
            }
        }
    });
    suite.total("all");
    if let Some(path) = std::env::args().nth(1) {
        compare(&path, &suite.answers);
    }
    nearly_incompressible();
}

/// First ticks where normal and tangential forces of neighbours are strongly coupled, and friction may allow several solutions.
fn nearly_incompressible() {
    let mut suite = Suite { answers: Vec::new(), iterations: 0, started: (0, 0) };
    for (poisson_ratio, height_m, cells) in [
        (0.31, 0.021, [12, 7, 3]),
        (0.45, 0.021, [12, 7, 3]),
        (0.47, 0.012, [6, 4, 2]),
        (0.49, 0.021, [6, 4, 2]),
        (0.49, 0.021, [12, 7, 3]),
        (0.49, 0.030, [10, 5, 5]),
        (0.49, 0.060, [10, 5, 5]),
        (0.499, 0.021, [6, 4, 2]),
    ] {
        for mu in [0.1, 0.3, 0.65, 1.0, 1.5, 5.0] {
            let model = sole(height_m, FOAM_PA, poisson_ratio, mu, cells);
            let name = format!(
                "nu {poisson_ratio}, {:.0} mm, {}, mu {mu}",
                1e3 * height_m,
                cells.map(|c| c.to_string()).join(" x ")
            );
            suite.part(&name, |s| {
                for load in walking_stance::scattered_loads(mu) {
                    s.step(&mut landed(&model), &load);
                }
            });
        }
    }
    suite.total("nearly incompressible, first ticks");
}

/// With the answers kept in a file, or keeps them there.
fn compare(path: &str, answers: &[Answer]) {
    let numbers = |answer: &Answer| answer.map_or([f64::NAN; 3], Into::into);
    let Ok(bytes) = std::fs::read(path) else {
        let bytes: Vec<u8> = answers.iter().flat_map(numbers).flat_map(f64::to_le_bytes).collect();
        std::fs::write(path, bytes).expect("the answers can be written");
        return println!("answers kept in {path}");
    };
    let before: Vec<f64> =
        bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect();
    let (mut lost, mut found, mut other) = (0, 0, 0);
    for (answer, before) in answers.iter().zip(before.chunks_exact(3)) {
        match (answer, before[0].is_nan()) {
            (None, false) => lost += 1,
            (Some(_), true) => found += 1,
            (Some(p), false) if (p - Vec3::from_column_slice(before)).norm() > SAME_M => other += 1,
            _ => {}
        }
    }
    println!("against {path}: {lost} lost, {found} found, {other} other answers");
}
