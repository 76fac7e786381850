//! Time to build and to solve a walk, and what it buys: against the number of swings, the samples per polynomial, the
//! solver's tolerance.
//!
//! ```text
//! cargo bench -p gait --bench plan
//! ```
//!
//! Times are CPU times of the thread: median, 99th percentile and maximum over the repeats said in the first column (below 100 the
//! last two are the same). "outside" is the largest violation of a constraint on a grid of 1 ms. Costs are compared with those of the
//! same walk with 41 samples; in the table of tolerances with those at 1e-12.
#![allow(clippy::print_stdout)]

use gait::{GaitSettings, PatternProblem, Plan, Walk, check};

/// CPU time of this thread (ms).
#[allow(unsafe_code)] // clock_gettime has no safe wrapper in std; it writes the one struct it is given
fn thread_time_ms() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is valid for the call, the clock exists on Linux.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    assert_eq!(status, 0);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

/// Times of one stage (ms).
struct Times {
    median: f64,
    p99: f64,
    max: f64,
}

impl Times {
    fn of(mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        let last = times.len() - 1;
        Self { median: times[last / 2], p99: times[(0.99 * last as f64).ceil() as usize], max: times[last] }
    }
}

impl std::fmt::Display for Times {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.2} / {:.2} / {:.2}", self.median, self.p99, self.max)
    }
}

struct Timed {
    plan: Plan,
    build: Times,
    solve: Times,
    /// Largest violation of a constraint on a 1 ms grid (m).
    outside_m: f64,
}

impl Timed {
    fn all_ms(&self) -> f64 {
        self.build.median + self.solve.median
    }

    fn iterations(&self) -> String {
        let each: Vec<_> = self.plan.report.programs.iter().map(|p| p.iterations.to_string()).collect();
        each.join(" + ")
    }

    fn sum(&self, of: fn(&gait::ProgramReport) -> usize) -> usize {
        self.plan.report.programs.iter().map(of).sum()
    }

    fn cost_error(&self, reference: &Plan) -> f64 {
        (self.plan.report.objective - reference.report.objective).abs() / reference.report.objective
    }

    fn outside_mm(&self) -> f64 {
        1e3 * self.outside_m.max(0.0)
    }
}

fn timed(settings: &GaitSettings, repeats: usize) -> Timed {
    let (mut build, mut solve, mut plan) = (Vec::new(), Vec::new(), None);
    for _ in 0..repeats {
        let start = thread_time_ms();
        let problem = PatternProblem::build(settings).expect("feasible");
        let built = thread_time_ms();
        plan = Some(problem.solve().expect("feasible"));
        solve.push(thread_time_ms() - built);
        build.push(built - start);
    }
    let plan = plan.expect("at least one repeat");
    let outside_m = check(&plan, settings, 1e-3, None).largest_violation().expect("polygons are checked").value;
    Timed { plan, build: Times::of(build), solve: Times::of(solve), outside_m }
}

/// The same walk with as many samples as any here.
fn reference(settings: &GaitSettings) -> Plan {
    let mut settings = settings.clone();
    settings.discretisation.samples_per_polynomial = 41;
    gait::plan(&settings).expect("feasible")
}

fn straight(swings: u32) -> GaitSettings {
    GaitSettings { walk: Walk::Straight { swings, step_length_m: 0.05 }, ..GaitSettings::default() }
}

/// Largest distance between two COMs, and between two ZMPs, in time (m).
fn distances(a: &Plan, b: &Plan) -> (f64, f64) {
    let (mut com, mut zmp) = (0.0_f64, 0.0_f64);
    for i in 0..=(a.pattern.duration_s() * 1e3) as u64 {
        let (x, y) = (a.pattern.evaluate(i as f64 * 1e-3), b.pattern.evaluate(i as f64 * 1e-3));
        com = com.max((x.com.position - y.com.position).amax());
        zmp = zmp.max((x.zmp.position - y.zmp.position).amax());
    }
    (com, zmp)
}

fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or("unknown");
    name.trim_start_matches(['\t', ' ', ':']).to_string()
}

fn main() {
    println!("processor: {}; times in ms: median / p99 / max\n", processor());
    println!(
        "peer, quoted and not measured here: the authors' public MATLAB planner takes about 3 s to build and 0.24 s \
         to solve (Clarabel) 11 swings\n"
    );
    swings();
    samples();
    tolerances();
    shapes();
}

fn swings() {
    println!("swings: straight, 0.05 m, mu 15, 11 samples, tolerance 1e-10");
    println!(
        "| lambda | N | runs | unknowns | rows | iterations | build | solve | all / N=10 | outside (mm) | cost error |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for (lambda, counts) in [(0.6, &[10, 1, 11, 100, 1000][..]), (1.0, &[10, 100, 1000])] {
        let mut ten = f64::NAN;
        for swings in counts {
            let repeats = match swings {
                1..=11 => 201,
                12..=100 => 101,
                _ => 21,
            };
            let mut settings = straight(*swings);
            settings.cost.lambda = lambda;
            let t = timed(&settings, repeats);
            if *swings == 10 {
                ten = t.all_ms();
            }
            println!(
                "| {lambda} | {swings} | {repeats} | {} | {} | {} | {} | {} | {:.1} | {:.3} | {:.1e} |",
                t.sum(|p| p.variables),
                t.sum(|p| p.equalities + p.inequalities),
                t.iterations(),
                t.build,
                t.solve,
                t.all_ms() / ten,
                t.outside_mm(),
                t.cost_error(&reference(&settings)),
            );
        }
    }
}

fn samples() {
    println!("\nsamples per polynomial: N = 11, lambda 1, tolerance 1e-10, 101 runs");
    println!(
        "| samples | rows | iterations | build | solve | outside (mm) | cost error |\n|---|---|---|---|---|---|---|"
    );
    let mut settings = straight(11);
    settings.cost.lambda = 1.0;
    let reference = reference(&settings);
    for samples in [3, 5, 7, 11, 15, 21, 41] {
        settings.discretisation.samples_per_polynomial = samples;
        let t = timed(&settings, 101);
        println!(
            "| {samples} | {} | {} | {} | {} | {:.3} | {:.1e} |",
            t.sum(|p| p.inequalities),
            t.iterations(),
            t.build,
            t.solve,
            t.outside_mm(),
            t.cost_error(&reference)
        );
    }
}

fn tolerances() {
    println!("\ntolerance: N = 11, lambda 0.6, 11 samples, 101 runs");
    println!(
        "| tolerance | iterations | build | solve | KKT | outside (mm) | cost error | COM error (m) | ZMP error (m) |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let tolerant = |tolerance: f64| {
        let mut settings = straight(11);
        settings.solver.tolerance = tolerance;
        settings
    };
    let reference = gait::plan(&tolerant(1e-12)).expect("feasible");
    for exponent in [3, 4, 6, 8, 10, 12] {
        let t = timed(&tolerant(10.0_f64.powi(-exponent)), 101);
        let (com, zmp) = distances(&t.plan, &reference);
        let kkt = t.plan.report.programs.iter().map(|p| p.residuals.max()).fold(0.0, f64::max);
        println!(
            "| 1e-{exponent} | {} | {} | {} | {kkt:.1e} | {:.4} | {:.1e} | {com:.1e} | {zmp:.1e} |",
            t.iterations(),
            t.build,
            t.solve,
            t.outside_mm(),
            t.cost_error(&reference)
        );
    }
}

fn shapes() {
    println!("\nother shapes, N = 11, lambda 0.6 (11 samples, tolerance 1e-10), 101 runs");
    println!(
        "| walk | programs | iterations | build | solve | outside (mm) | cost error |\n|---|---|---|---|---|---|---|"
    );
    for (name, walk) in [
        ("straight", Walk::Straight { swings: 11, step_length_m: 0.05 }),
        ("circle of 0.9 m", Walk::Circle { swings: 11, step_length_m: 0.05, radius_m: 0.9 }),
        ("free footholds", Walk::Free { swings: 11, distance_m: 0.5 }),
    ] {
        let settings = GaitSettings { walk, ..GaitSettings::default() };
        let t = timed(&settings, 101);
        println!(
            "| {name} | {} | {} | {} | {} | {:.3} | {:.1e} |",
            t.plan.report.programs.len(),
            t.iterations(),
            t.build,
            t.solve,
            t.outside_mm(),
            t.cost_error(&reference(&settings))
        );
    }
}
