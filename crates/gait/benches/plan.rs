//! Time to build and to solve a walk, and what it buys: against the number of swings, the samples per polynomial, the
//! solver's tolerance.
//!
//! ```text
//! cargo bench -p gait --bench plan                 # or, without compiling everything once more:
//! cargo bench --profile dev -p gait --bench plan
//! ```
//!
//! Times are CPU times of the thread: median and minimum over repeats. Errors are measured on a grid of 1 ms,
//! against the same walk with 41 samples, respectively with tolerance 1e-12.
#![allow(clippy::print_stdout)]

use gait::{GaitSettings, PatternProblem, Plan, Quantity, Walk, check};

/// CPU time of this thread (ms).
#[allow(unsafe_code)] // clock_gettime has no safe wrapper in std; it writes the one struct it is given
fn thread_time_ms() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is valid for the call, the clock exists on Linux.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    assert_eq!(status, 0);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

struct Timed {
    plan: Plan,
    build_ms: [f64; 2],
    solve_ms: [f64; 2],
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
    let summary = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        [times[times.len() / 2], times[0]]
    };
    Timed { plan: plan.expect("at least one repeat"), build_ms: summary(build), solve_ms: summary(solve) }
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
    println!("processor: {}\n", processor());

    println!("swings: straight, 0.05 m, lambda 0.6, mu 15; times in ms, median (minimum)");
    println!("|    N | unknowns | rows | iterations | build | solve | all / N=10 |\n|---|---|---|---|---|---|---|");
    let mut ten = f64::NAN;
    for (swings, repeats) in [(10, 31), (1, 31), (11, 31), (100, 11), (1000, 5)] {
        let t = timed(&straight(swings), repeats);
        let sum = |f: fn(&gait::ProgramReport) -> usize| t.plan.report.programs.iter().map(f).sum::<usize>();
        let all = t.build_ms[0] + t.solve_ms[0];
        if swings == 10 {
            ten = all;
        }
        let iterations: Vec<_> = t.plan.report.programs.iter().map(|p| p.iterations.to_string()).collect();
        println!(
            "| {swings} | {} | {} | {} | {:.2} ({:.2}) | {:.2} ({:.2}) | {:.1} |",
            sum(|p| p.variables),
            sum(|p| p.equalities + p.inequalities),
            iterations.join(" + "),
            t.build_ms[0],
            t.build_ms[1],
            t.solve_ms[0],
            t.solve_ms[1],
            all / ten
        );
    }

    println!("\nsamples per polynomial: N = 11, worst lambda for the ZMP (1)");
    println!("| samples | rows | solve | ZMP outside between samples (mm) | cost error |\n|---|---|---|---|---|");
    let sampled = |samples: u32| {
        let mut settings = straight(11);
        settings.cost.lambda = 1.0;
        settings.discretisation.samples_per_polynomial = samples;
        settings
    };
    let reference = timed(&sampled(41), 1).plan.report.objective;
    for samples in [3, 5, 7, 11, 15, 21, 41] {
        let settings = sampled(samples);
        let t = timed(&settings, 11);
        let outside = check(&t.plan, &settings, 1e-3, None).value(Quantity::ZmpOutsidePolygon);
        println!(
            "| {samples} | {} | {:.2} ({:.2}) | {:.3} | {:.1e} |",
            t.plan.report.programs.iter().map(|p| p.inequalities).sum::<usize>(),
            t.solve_ms[0],
            t.solve_ms[1],
            1e3 * outside.max(0.0),
            (t.plan.report.objective - reference).abs() / reference
        );
    }

    println!("\ntolerance: N = 11, lambda 0.6");
    println!(
        "| tolerance | iterations | solve | KKT | cost error | COM error (m) | ZMP error (m) |\n|---|---|---|---|---|---|---|"
    );
    let tolerant = |tolerance: f64| {
        let mut settings = straight(11);
        settings.solver.tolerance = tolerance;
        settings
    };
    let reference = timed(&tolerant(1e-12), 1).plan;
    for exponent in [3, 4, 6, 8, 10, 12] {
        let t = timed(&tolerant(10.0_f64.powi(-exponent)), 11);
        let (com, zmp) = distances(&t.plan, &reference);
        let kkt = t.plan.report.programs.iter().map(|p| p.residuals.max()).fold(0.0, f64::max);
        let iterations: Vec<_> = t.plan.report.programs.iter().map(|p| p.iterations.to_string()).collect();
        println!(
            "| 1e-{exponent} | {} | {:.2} ({:.2}) | {kkt:.1e} | {:.1e} | {com:.1e} | {zmp:.1e} |",
            iterations.join(" + "),
            t.solve_ms[0],
            t.solve_ms[1],
            (t.plan.report.objective - reference.report.objective).abs() / reference.report.objective
        );
    }

    println!("\nother shapes, N = 11 (11 samples, tolerance 1e-10)");
    println!("| walk | programs | iterations | build | solve |\n|---|---|---|---|---|");
    for (name, walk) in [
        ("straight", Walk::Straight { swings: 11, step_length_m: 0.05 }),
        ("circle of 0.9 m", Walk::Circle { swings: 11, step_length_m: 0.05, radius_m: 0.9 }),
        ("free footholds", Walk::Free { swings: 11, distance_m: 0.5 }),
    ] {
        let t = timed(&GaitSettings { walk, ..GaitSettings::default() }, 11);
        let iterations: Vec<_> = t.plan.report.programs.iter().map(|p| p.iterations.to_string()).collect();
        println!(
            "| {name} | {} | {} | {:.2} ({:.2}) | {:.2} ({:.2}) |",
            t.plan.report.programs.len(),
            iterations.join(" + "),
            t.build_ms[0],
            t.build_ms[1],
            t.solve_ms[0],
            t.solve_ms[1]
        );
    }
}
