//! Speed against error of the sole's models: `cargo run --profile bench -p sole --example speed_against_error [-- OUT.svg]`.
//!
//! A walking stance (the tests' own: heel to toe, 383 N, horizontal force to 0.3 of the vertical) is run on every model. The error is the
//! distance from the finest model's answer, rms and maximum over the ticks above 5 N: of the ankle's position and orientation, and of the
//! pressure, as the way by which the vertical force would have to be moved along the sole to lie where the finest model has it (the
//! first Wasserstein distance of the two distributions along the sole's length, each row of nodes spread over the strip it stands for).
//! Times are the thread's own CPU time per tick; memory is counted by the allocator. Prints a table and draws it.
#![allow(clippy::print_stdout)]
#![allow(clippy::disallowed_methods)] // it measures time

#[path = "../tests/suite/walking_stance.rs"]
mod walking_stance;

use sole::{ContactSet, EstimatorSettings, Foothold, Level, MeshSource, SoleModel, SoleSettings, StanceEstimator};
use spatial::{Transform, so3};
use std::alloc::{GlobalAlloc, Layout, System};
use std::fmt::Write as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Bytes in use, and the most there were.
static USED: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call is passed on to the system's allocator unchanged; the counts beside it do not allocate.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let used = USED.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        MOST.fetch_max(used, Ordering::Relaxed);
        // SAFETY: the caller's promise is the system allocator's precondition.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        USED.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

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
    /// While the model was built, and of model and estimator after it.
    build_mb: f64,
    kept_mb: f64,
    answers: Vec<Option<Answer>>,
    times_us: Vec<f64>,
}

/// A tick's.
struct Answer {
    ankle: Transform,
    /// Part of the vertical force that is behind each of [`PLACES`] places along the sole.
    behind: Vec<f64>,
}

/// Places at which the pressures are compared, from heel to toe: every 0.46 mm.
const PLACES: usize = 501;
const LENGTH_M: f64 = 0.23;
/// Contact points in one row across the sole are this near to each other along it (m).
const ROW_M: f64 = 1e-3;

/// The rows of contact points across the sole: of each point the row, and of each row where its strip begins and ends (m).
fn rows(x_m: &[f64]) -> (Vec<usize>, Vec<[f64; 2]>) {
    let mut sorted = x_m.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup_by(|next, kept| *next - *kept < ROW_M);
    let nearest = |x: &f64| (0..sorted.len()).min_by(|a, b| (sorted[*a] - x).abs().total_cmp(&(sorted[*b] - x).abs()));
    let row_of = x_m.iter().map(|x| nearest(x).expect("there are points")).collect();
    let last = sorted.len() - 1;
    let between = |a: usize, b: usize| 0.5 * (sorted[a] + sorted[b]);
    let strip = |row: usize| {
        let begin = if row == 0 { -0.5 * LENGTH_M } else { between(row - 1, row) };
        let end = if row == last { 0.5 * LENGTH_M } else { between(row, row + 1) };
        [begin, end]
    };
    (row_of, (0..=last).map(strip).collect())
}

/// [`Answer::behind`] of forces spread evenly over their strips.
fn behind(row_of: &[usize], strips: &[[f64; 2]], vertical_n: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut rows_n = vec![0.0; strips.len()];
    for (row, force) in row_of.iter().zip(vertical_n) {
        rows_n[*row] += force;
    }
    let total: f64 = rows_n.iter().sum();
    let at = |place: usize| {
        let x = LENGTH_M * (place as f64 / (PLACES - 1) as f64 - 0.5);
        let part = |([begin, end], force): (&[f64; 2], &f64)| force * ((x - begin) / (end - begin)).clamp(0.0, 1.0);
        strips.iter().zip(&rows_n).map(part).sum::<f64>() / total
    };
    (0..PLACES).map(at).collect()
}

impl Run {
    fn time_us(&self, quantile: f64) -> f64 {
        let mut sorted = self.times_us.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[((sorted.len() - 1) as f64 * quantile).round() as usize]
    }
}

fn run(name: &str, family: &'static str, cells: [usize; 3], level: Level, contact: ContactSet, tolerance: f64) -> Run {
    let before = USED.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let start = Instant::now();
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells };
    let settings = SoleSettings { mesh, level, contact, ..SoleSettings::default() };
    let model = Arc::new(SoleModel::build(&settings).expect("a sound sole"));
    let build_s = start.elapsed().as_secs_f64();
    let build_mb = 1e-6 * (MOST.load(Ordering::Relaxed) - before) as f64;
    let x_m: Vec<f64> = model.contact_points().iter().map(|p| p.x).collect();
    let (row_of, strips) = rows(&x_m);
    let settings = EstimatorSettings { tolerance, ..EstimatorSettings::default() };
    let mut estimator = StanceEstimator::new(model, settings);
    let kept_mb = 1e-6 * (USED.load(Ordering::Relaxed) - before) as f64;
    let (mut answers, mut times_us) = (Vec::new(), Vec::new());
    for repeat in 0..3 {
        estimator.touch_down(Foothold::default());
        for tick in 0..walking_stance::TICKS {
            let reference = walking_stance::reference(tick, false);
            let start = thread_time_s();
            let report = estimator.step(&reference);
            times_us.push(1e6 * (thread_time_s() - start));
            if repeat == 0 {
                let counted = report.status.is_solved() && reference.force.z > LOAD_COUNTED_N;
                answers.push(counted.then(|| {
                    let behind = behind(&row_of, &strips, report.node_forces.iter().map(|f| f.z));
                    Answer { ankle: report.ankle_pose, behind }
                }));
            }
        }
    }
    Run { name: name.to_owned(), family, contacts: x_m.len(), build_s, build_mb, kept_mb, answers, times_us }
}

/// How far (m) the one force would have to be moved, on average, to lie where the other does: the area between the two curves.
fn moved_m(one: &[f64], other: &[f64]) -> f64 {
    let apart: f64 = one.iter().zip(other).map(|(a, b)| (a - b).abs()).sum();
    apart * LENGTH_M / (PLACES - 1) as f64
}

/// Root mean square and maximum over the ticks of ankle distance (mm), rotation (deg) and way of the pressure (mm), and ticks without an
/// answer.
fn errors(run: &Run, reference: &Run) -> ([[f64; 2]; 3], usize) {
    let (mut square, mut worst, mut count, mut lost) = ([0.0; 3], [0.0_f64; 3], 0.0, 0);
    for (answer, truth) in run.answers.iter().zip(&reference.answers) {
        let Some(truth) = truth else { continue };
        let Some(answer) = answer else {
            lost += 1;
            continue;
        };
        let away = 1e3 * (answer.ankle.translation - truth.ankle.translation).norm();
        let turned = so3::log(&(answer.ankle.rotation.transpose() * truth.ankle.rotation)).norm().to_degrees();
        let moved = 1e3 * moved_m(&answer.behind, &truth.behind);
        for (i, e) in [away, turned, moved].into_iter().enumerate() {
            square[i] += e * e;
            worst[i] = worst[i].max(e);
        }
        count += 1.0;
    }
    ([0, 1, 2].map(|i| [(square[i] / count).sqrt(), worst[i]]), lost)
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
        "{:<28} {:>8} {:>9} {:>9} {:>16} {:>16} {:>12} {:>7} {:>8} {:>8} {:>5}",
        "model",
        "contacts",
        "median us",
        "p99 us",
        "ankle mm",
        "rotation deg",
        "pressure mm",
        "build s",
        "build MB",
        "kept MB",
        "lost"
    );
    let mut points = Vec::new();
    for r in std::iter::once(&reference).chain(&runs) {
        let (e, lost) = errors(r, &reference);
        println!(
            "{:<28} {:>8} {:>9.1} {:>9.1} {:>7.4} /{:>7.4} {:>7.4} /{:>7.4} {:>5.2} /{:>5.2} {:>7.2} {:>8.1} {:>8.1} {:>5}",
            r.name,
            r.contacts,
            r.time_us(0.5),
            r.time_us(0.99),
            e[0][0],
            e[0][1],
            e[1][0],
            e[1][1],
            e[2][0],
            e[2][1],
            r.build_s,
            r.build_mb,
            r.kept_mb,
            lost
        );
        if r.family != "reference" && r.family != "tolerance" {
            points.push((r.time_us(0.5), e[0][0], r.family, r.name.clone()));
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
