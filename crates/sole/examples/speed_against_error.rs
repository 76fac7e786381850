//! Speed against error of the sole's models: `cargo run --release -p sole --example speed_against_error [-- OUT.svg]`.
//!
//! A walking stance (the tests' own: heel to toe, 383 N, horizontal force to 0.3 of the vertical) is run on every model; the error
//! is the distance of ankle position, orientation and node forces' resultant from the finest model's, rms and maximum over the ticks
//! above 5 N. Times are the thread's own CPU time per tick. Prints a table and draws it.
#![allow(clippy::print_stdout)]

#[path = "../tests/suite/walking_stance.rs"]
mod walking_stance;

use sole::{ContactSet, EstimatorSettings, Foothold, Level, MeshSource, SoleModel, SoleSettings, StanceEstimator};
use spatial::{Transform, so3};
use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Instant;

/// Below this load the pose is that of a foot in the air for all that it matters.
const LOAD_COUNTED_N: f64 = 5.0;

fn thread_time_s() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a live timespec; the call writes it and touches nothing else.
    #[allow(unsafe_code)]
    unsafe {
        libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut t);
    }
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

struct Run {
    name: String,
    family: &'static str,
    contacts: usize,
    build_s: f64,
    memory_mb: f64,
    poses: Vec<Option<Transform>>,
    times_us: Vec<f64>,
}

impl Run {
    fn time_us(&self, quantile: f64) -> f64 {
        let mut sorted = self.times_us.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[((sorted.len() - 1) as f64 * quantile).round() as usize]
    }
}

fn run(name: &str, family: &'static str, cells: [usize; 3], level: Level, contact: ContactSet, tolerance: f64) -> Run {
    let start = Instant::now();
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells };
    let settings = SoleSettings { mesh, level, contact, ..SoleSettings::default() };
    let model = Arc::new(SoleModel::build(&settings).expect("a sound sole"));
    let build_s = start.elapsed().as_secs_f64();
    let contacts = model.contact_points().len();
    let settings = EstimatorSettings { tolerance, ..EstimatorSettings::default() };
    let mut estimator = StanceEstimator::new(model, settings);
    let (mut poses, mut times_us) = (Vec::new(), Vec::new());
    for repeat in 0..3 {
        estimator.touch_down(Foothold::default());
        for tick in 0..walking_stance::TICKS {
            let reference = walking_stance::reference(tick, false);
            let start = thread_time_s();
            let report = estimator.step(&reference);
            times_us.push(1e6 * (thread_time_s() - start));
            if repeat == 0 {
                let counted = report.status.is_solved() && reference.force.z > LOAD_COUNTED_N;
                poses.push(counted.then_some(report.ankle_pose));
            }
        }
    }
    // Compliance, its inverse and K_c (3n x 3n), and what couples up to n sliding points (2n x 2n), 8 bytes each; the rest is linear
    // in the number of contacts.
    let memory_mb = 8.0 * ((3 * 9 + 4) * contacts * contacts) as f64 / 1e6;
    Run { name: name.to_owned(), family, contacts, build_s, memory_mb, poses, times_us }
}

/// (rms, max) of ankle distance (mm) and rotation (deg), and ticks without an answer.
fn errors(run: &Run, reference: &Run) -> ([f64; 4], usize) {
    let (mut square, mut worst, mut count, mut lost) = ([0.0; 2], [0.0_f64; 2], 0.0, 0);
    for (pose, truth) in run.poses.iter().zip(&reference.poses) {
        let Some(truth) = truth else { continue };
        let Some(pose) = pose else {
            lost += 1;
            continue;
        };
        let away = 1e3 * (pose.translation - truth.translation).norm();
        let turned = so3::log(&(pose.rotation.transpose() * truth.rotation)).norm().to_degrees();
        for (i, e) in [away, turned].into_iter().enumerate() {
            square[i] += e * e;
            worst[i] = worst[i].max(e);
        }
        count += 1.0;
    }
    ([(square[0] / count).sqrt(), worst[0], (square[1] / count).sqrt(), worst[1]], lost)
}

fn main() {
    let bottom = ContactSet::Bottom;
    let fine = [23, 13, 6];
    let cell = |n: usize, m: usize| [n, m];
    println!("finest: 10764 quadratic tetrahedra (about 70,000 unknowns) on 336 contacts ...");
    let reference = run("quadratic 10764 tets", "reference", fine, Level::QuadraticFem, bottom, 1e-9);
    let mut runs = vec![
        run("rigid", "spring", [12, 7, 3], Level::Rigid, bottom, 1e-9),
        run("lumped, 4 springs", "spring", [12, 7, 3], Level::Lumped, bottom, 1e-9),
        run("Winkler 6x3", "spring", [12, 7, 3], Level::Winkler { cells: cell(6, 3) }, bottom, 1e-9),
        run("Winkler 10x5", "spring", [12, 7, 3], Level::Winkler { cells: cell(10, 5) }, bottom, 1e-9),
        run("FEM 432 tets", "fem", [8, 3, 3], Level::Fem, bottom, 1e-9),
        run("FEM 720 tets", "fem", [10, 6, 2], Level::Fem, bottom, 1e-9),
        run("FEM 1512 tets", "fem", [12, 7, 3], Level::Fem, bottom, 1e-9),
        run("FEM 3456 tets", "fem", [16, 9, 4], Level::Fem, bottom, 1e-9),
        run("FEM 10764 tets", "fem", fine, Level::Fem, bottom, 1e-9),
        run("FEM 24192 tets", "fem", [32, 18, 7], Level::Fem, bottom, 1e-9),
        run("FEM 1512, all free nodes", "fem", [12, 7, 3], Level::Fem, ContactSet::All, 1e-9),
        run("quadratic 432 tets", "quadratic", [8, 3, 3], Level::QuadraticFem, bottom, 1e-9),
        run("quadratic 1512 tets", "quadratic", [12, 7, 3], Level::QuadraticFem, bottom, 1e-9),
    ];
    for (n, m) in [(5, 3), (6, 5), (8, 7), (12, 7)] {
        let name = format!("{n}x{m} patches of 10764 tets");
        runs.push(run(&name, "patches", fine, Level::Patches { cells: [n, m] }, bottom, 1e-9));
    }
    runs.push(run("6x5 patches of 24192 tets", "patches", [32, 18, 7], Level::Patches { cells: [6, 5] }, bottom, 1e-9));
    for tolerance in [1e-3, 1e-4, 1e-6, 1e-12] {
        runs.push(run(
            &format!("FEM 1512, tolerance {tolerance:e}"),
            "tolerance",
            [12, 7, 3],
            Level::Fem,
            bottom,
            tolerance,
        ));
    }
    println!(
        "{:<28} {:>8} {:>9} {:>9} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>5}",
        "model", "contacts", "median us", "p99 us", "mm rms", "mm max", "deg rms", "deg max", "build s", "MB", "lost"
    );
    let mut points = Vec::new();
    for r in std::iter::once(&reference).chain(&runs) {
        let (e, lost) = errors(r, &reference);
        println!(
            "{:<28} {:>8} {:>9.1} {:>9.1} {:>8.4} {:>8.4} {:>8.4} {:>8.4} {:>8.2} {:>8.2} {:>5}",
            r.name,
            r.contacts,
            r.time_us(0.5),
            r.time_us(0.99),
            e[0],
            e[1],
            e[2],
            e[3],
            r.build_s,
            r.memory_mb,
            lost
        );
        if r.family != "reference" && r.family != "tolerance" {
            points.push((r.time_us(0.5), e[0], r.family, r.name.clone()));
        }
    }
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(&path, plot(&points)).expect("the plot can be written");
        println!("plot: {path}");
    }
}

/// Both axes logarithmic: median time per tick (us) to the right, ankle error rms (mm) upwards.
fn plot(points: &[(f64, f64, &str, String)]) -> String {
    const WIDTH: f64 = 900.0;
    const HEIGHT: f64 = 560.0;
    const MARGIN: f64 = 70.0;
    let x = |t: f64| MARGIN + (t.log10()) / 4.0 * (WIDTH - 2.0 * MARGIN);
    let y = |e: f64| MARGIN + (1.0 - e.log10()) / 4.0 * (HEIGHT - 2.0 * MARGIN);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\">\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for decade in 0..=4 {
        let (gx, gy) = (x(10f64.powi(decade)), y(10f64.powi(decade - 3)));
        let _ = writeln!(
            svg,
            "<line x1=\"{gx}\" x2=\"{gx}\" y1=\"{MARGIN}\" y2=\"{}\" stroke=\"#ddd\"/><text x=\"{gx}\" y=\"{}\" text-anchor=\"middle\">{} us</text>\
             <line x1=\"{MARGIN}\" x2=\"{}\" y1=\"{gy}\" y2=\"{gy}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{}\" text-anchor=\"end\">{} mm</text>",
            HEIGHT - MARGIN,
            HEIGHT - MARGIN + 20.0,
            10f64.powi(decade),
            WIDTH - MARGIN,
            MARGIN - 6.0,
            gy + 4.0,
            10f64.powi(decade - 3)
        );
    }
    for (time, error, family, name) in points {
        let colour = match *family {
            "spring" => "#888",
            "fem" => "#1f77b4",
            "quadratic" => "#2ca02c",
            _ => "#d62728",
        };
        let (px, py) = (x(time.max(1.0)), y(error.max(1e-3)));
        let _ = writeln!(
            svg,
            "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"5\" fill=\"{colour}\"/><text x=\"{:.1}\" y=\"{:.1}\">{name}</text>",
            px + 8.0,
            py + 4.0
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"30\" text-anchor=\"middle\" font-size=\"16\">Ankle error (rms over a stance) against time per tick</text></svg>",
        WIDTH / 2.0
    );
    svg
}
