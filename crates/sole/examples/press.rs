//! One foot pressed with 420 N on every level: `cargo run --profile bench -p sole --example press`.
//!
//! Sinkage under a centred load, roll with the ZMP 20 mm to the left, pitch with it 30 mm ahead, against quadratic hexahedra of scikit-fem
//! (14 x 8 x 3, all contact points stuck), and the time that the sole takes to build. Prints the table of `docs/performance.md`.
#![allow(clippy::print_stdout)]

use nalgebra::Vector2;
use sole::{EstimatorSettings, Foothold, Level, MeshSource, SoleModel, SoleSettings, StanceEstimator, StanceReference};
use spatial::{Vec3, so3};
use std::sync::Arc;
use std::time::Instant;

const LOAD_N: f64 = 420.0;
/// Of scikit-fem: sinkage (mm), roll (deg), pitch (deg).
const REFERENCE: [f64; 3] = [0.7015, 0.5996, 0.2820];

fn main() {
    println!(
        "| level | mesh | contacts | sinkage mm | roll deg | pitch deg | build s |\n|---|---|---|---|---|---|---|"
    );
    let [sinkage, roll, pitch] = REFERENCE;
    println!("| scikit-fem, quadratic hexahedra | 14 x 8 x 3 | | {sinkage} | {roll} | {pitch} | |");
    let linear = |cells| ("patches", Level::Patches { cells });
    let quadratic = |cells| ("quadratic-patches", Level::QuadraticPatches { cells });
    for (cells, (name, level)) in [
        ([12, 7, 3], ("fem", Level::Fem)),
        ([12, 7, 3], ("quadratic-fem", Level::QuadraticFem)),
        ([23, 13, 6], linear([6, 5])),
        ([23, 13, 6], linear([8, 7])),
        ([8, 7, 2], quadratic([8, 7])),
        ([12, 7, 3], quadratic([6, 5])),
        ([12, 7, 3], quadratic([8, 7])),
        ([16, 14, 3], quadratic([6, 5])),
        ([16, 14, 3], quadratic([8, 7])),
        ([16, 14, 3], quadratic([12, 7])),
    ] {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells };
        let start = Instant::now();
        let settings = SoleSettings { mesh, level, ..SoleSettings::default() };
        let model = Arc::new(SoleModel::build(&settings).expect("a sound sole"));
        let build_s = start.elapsed().as_secs_f64();
        let pressed = |x_m: f64, y_m: f64| {
            let mut estimator = StanceEstimator::new(Arc::clone(&model), EstimatorSettings::default());
            estimator.touch_down(Foothold::default());
            let report = estimator.step(&StanceReference::constant(Vec3::z() * LOAD_N, Vector2::new(x_m, y_m)));
            assert!(report.status.is_solved(), "{:?}", report.status);
            report.sole_pose
        };
        let angles = |pose: spatial::Transform| so3::roll_pitch_yaw(&pose.rotation).map(f64::to_degrees);
        let found = [
            -1e3 * pressed(0.0, 0.0).translation.z,
            angles(pressed(0.0, 0.020)).x.abs(),
            angles(pressed(0.030, 0.0)).y.abs(),
        ];
        let entry = |i: usize| format!("{:.4} ({:+.1} %)", found[i], 100.0 * (found[i] / REFERENCE[i] - 1.0));
        println!(
            "| {name}{} | {} | {} | {} | {} | {} | {build_s:.2} |",
            match level {
                Level::Patches { cells } | Level::QuadraticPatches { cells } => format!(" {} x {}", cells[0], cells[1]),
                _ => String::new(),
            },
            cells.map(|n| n.to_string()).join(" x "),
            model.contact_points().len(),
            entry(0),
            entry(1),
            entry(2)
        );
    }
}
