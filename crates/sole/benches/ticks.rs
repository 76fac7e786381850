//! Time per solve and per tick on the thread's own clock: `cargo bench -p sole`. Medians, 99th percentiles, maxima.
#![allow(clippy::print_stdout)]
#![allow(clippy::needless_range_loop)] // indices are those of the formulas

#[path = "../tests/suite/walking_stance.rs"]
mod walking_stance;

use friction::{ContactProblem, Settings, Workspace, gauss_seidel, newton};
use nalgebra::{DMatrix, DVector, Vector2};
use sole::{
    ContactSet, EstimatorSettings, Foothold, Level, MeshSource, NestedEstimator, NestedSettings, Plane,
    PoseDrivenContact, PoseDrivenSettings, SoleModel, SoleSettings, StanceEstimator, StanceReference,
};
use spatial::{Transform, Vec3, so3};
use std::sync::Arc;

/// CPU time of this thread (s): the machine is shared, wall time would measure the neighbours.
fn thread_time_s() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a live timespec; the call writes it and touches nothing else.
    #[allow(unsafe_code)]
    unsafe {
        libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut t);
    }
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

fn line(name: &str, times_s: &mut [f64], note: &str) {
    times_s.sort_by(f64::total_cmp);
    let at = |q: f64| 1e6 * times_s[((times_s.len() - 1) as f64 * q).round() as usize];
    println!("{name:<46} {:>8.1} {:>8.1} {:>8.1}   {note}", at(0.5), at(0.99), at(1.0));
}

fn sole(cells: [usize; 3], height: f64, level: Level) -> Arc<SoleModel> {
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, height], cells };
    let settings = SoleSettings { mesh, level, contact: ContactSet::Bottom, ..SoleSettings::default() };
    Arc::new(SoleModel::build(&settings).expect("a sound sole"))
}

/// Eight poses of a block: flat, hard press, heel, toe and twist, twist, partial slip, full slide, barely touching.
fn poses() -> [(&'static str, Transform, Vec3); 8] {
    let pose = |roll: f64, pitch: f64, yaw: f64, z: f64| {
        Transform::new(so3::from_roll_pitch_yaw(roll, pitch, yaw), Vec3::new(0.0, 0.0, z))
    };
    let slip = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    [
        ("flat", pose(0.0, 0.0, 0.0, -0.001), slip(0.0, 0.0)),
        ("hard press", pose(0.01, 0.01, 0.0, -0.004), slip(2e-4, 0.0)),
        ("heel", pose(0.0, -0.04, 0.0, 0.003), slip(0.0, 0.0)),
        ("toe and twist", pose(0.01, 0.03, 0.02, 0.001), slip(1e-4, 0.0)),
        ("twist", pose(0.0, 0.0, 0.03, -0.001), slip(0.0, 0.0)),
        ("partial slip", pose(0.005, 0.01, 0.0, -0.001), slip(1.2e-3, 3e-4)),
        ("full slide", pose(0.0, 0.005, 0.0, -0.001), slip(8e-3, -3e-3)),
        ("barely touching", pose(0.02, 0.02, 0.0, 0.0033), slip(1e-4, 0.0)),
    ]
}

/// The contact problem of a sole moved from its undeformed position by a pose and a slip.
fn problem(model: &SoleModel, pose: &Transform, slip: &Vec3, mu: f64) -> ContactProblem {
    let (points, c) = (model.contact_points(), model.compliance());
    let n = points.len();
    let mut delassus = DMatrix::zeros(3 * n, 3 * n);
    let mut free = DVector::zeros(3 * n);
    for b in 0..n {
        for a in 0..n {
            let block = pose.rotation * c.fixed_view::<3, 3>(3 * a, 3 * b) * pose.rotation.transpose();
            delassus.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(&block);
        }
        let p = pose.point(&points[b]);
        let from = Vec3::new(points[b].x, points[b].y, 0.0);
        free.fixed_rows_mut::<3>(3 * b).copy_from(&(p - from + slip));
    }
    ContactProblem::of_model(delassus, free, vec![mu; n]).expect("a sound problem")
}

fn friction_table() {
    println!("friction, cold start, scaled residual 1e-8 (us)        median      p99      max   sweeps or iterations");
    for (name, cells) in [("66 contacts", [10, 5, 5]), ("104 contacts", [12, 7, 3])] {
        let model = sole(cells, 0.03, Level::Fem);
        let (mut sweeps, mut steps) = (Vec::new(), Vec::new());
        let (mut times, mut newton_times) = (Vec::new(), Vec::new());
        for mu in [0.3, 0.8] {
            for (pose_name, pose, slip) in poses() {
                let problem = problem(&model, &pose, &slip, mu);
                let settings = Settings::default();
                let mut workspace = Workspace::new(problem.contact_count());
                workspace.reserve_newton();
                for repeat in 0..30 {
                    workspace.reset();
                    let start = thread_time_s();
                    let report = gauss_seidel(&problem, &mut workspace, &settings);
                    times.push(thread_time_s() - start);
                    if report.residual.relative > 1e-8 {
                        println!("  {pose_name} mu {mu}: {:?} {:e}", report.status, report.residual.relative);
                    }
                    if repeat == 0 {
                        sweeps.push(report.iterations);
                    }
                    if repeat < 3 {
                        workspace.reset();
                        let start = thread_time_s();
                        let report = newton(&problem, &mut workspace, &settings);
                        newton_times.push(thread_time_s() - start);
                        if repeat == 0 {
                            steps.push(report.iterations);
                            if report.residual.relative > 1e-8 {
                                println!(
                                    "  newton {pose_name} mu {mu}: {:?} {:e}",
                                    report.status, report.residual.relative
                                );
                            }
                        }
                    }
                }
            }
        }
        sweeps.sort_unstable();
        steps.sort_unstable();
        let note = |v: &[usize]| format!("{} median, {} most", v[v.len() / 2], v[v.len() - 1]);
        line(&format!("  Gauss-Seidel, {name}"), &mut times, &note(&sweeps));
        line(&format!("  Newton, {name}"), &mut newton_times, &note(&steps));
    }
}

fn stance_table() {
    println!("estimator, one foot, walking stance (us per tick)      median      p99      max   iterations per tick");
    let fine = [23, 13, 6];
    for (name, cells, level) in [
        ("  240 tets, 30 contacts", [5, 4, 2], Level::Fem),
        ("  1500 tets, 66 contacts", [10, 5, 5], Level::Fem),
        ("  1512 tets, 104 contacts", [12, 7, 3], Level::Fem),
        ("  5 x 3 patches, 24 contacts", fine, Level::Patches { cells: [5, 3] }),
        ("  6 x 5 patches, 42 contacts", fine, Level::Patches { cells: [6, 5] }),
        ("  8 x 7 patches, 72 contacts", fine, Level::Patches { cells: [8, 7] }),
    ] {
        let model = sole(cells, 0.021, level);
        for tolerance in [1e-6, 1e-12] {
            let settings = EstimatorSettings { tolerance, ..EstimatorSettings::default() };
            let mut estimator = StanceEstimator::new(Arc::clone(&model), settings);
            let (mut times, mut iterations, mut most, mut failed) = (Vec::new(), 0, 0, 0);
            for _ in 0..10 {
                estimator.touch_down(Foothold::default());
                for tick in 0..walking_stance::TICKS {
                    let reference = walking_stance::reference(tick, false);
                    let start = thread_time_s();
                    let report = estimator.step(&reference);
                    times.push(thread_time_s() - start);
                    iterations += report.iterations;
                    most = most.max(report.iterations);
                    if !report.status.is_solved() {
                        failed += 1;
                        if failed == 1 {
                            println!("    tick {tick}: {:?}", report.status);
                        }
                    }
                }
            }
            let mean = iterations as f64 / times.len() as f64;
            line(
                &format!("{name}, {tolerance:e}"),
                &mut times,
                &format!("{mean:.1} mean, {most} most, {failed} failed"),
            );
        }
    }
}

/// Double support: one foot takes over the load (right at its touch-down) while the other gives it up, both ticks timed together.
fn double_support_table() {
    println!("estimator, both feet in double support (us per tick)    median      p99      max");
    let left = sole([12, 7, 3], 0.021, Level::Fem);
    let right = Arc::new(left.mirrored());
    let settings = EstimatorSettings { tolerance: 1e-6, ..EstimatorSettings::default() };
    let mut landing = StanceEstimator::new(left, settings);
    let mut leaving = StanceEstimator::new(right, settings);
    let mut times = Vec::new();
    let ramp = walking_stance::RAMP_TICKS;
    for _ in 0..10 {
        leaving.touch_down(Foothold::default());
        for tick in 0..walking_stance::TICKS - ramp {
            leaving.step(&walking_stance::reference(tick, true));
        }
        landing.touch_down(Foothold::default());
        for tick in 0..ramp {
            let taken = walking_stance::reference(tick, false);
            let given = walking_stance::reference(walking_stance::TICKS - ramp + tick, true);
            let start = thread_time_s();
            landing.step(&taken);
            leaving.step(&given);
            times.push(thread_time_s() - start);
        }
    }
    line("  1512 tets each, 1e-6", &mut times, "");
}

/// Loads that leap from each other as no walk's do, and first ticks that fold: the work of a tick is bounded or not.
fn leaps_table() {
    println!("estimator, one foot, leaps of the load (us per tick)    median      p99      max   not solved");
    let model = sole([12, 7, 3], 0.021, Level::Fem);
    for (name, bound) in [
        ("  1512 tets, 2 million multiplications", Some(2_000_000)),
        ("  1512 tets, 4 million multiplications", Some(4_000_000)),
        ("  1512 tets, 8 million multiplications", Some(8_000_000)),
        ("  1512 tets, unbounded, as in lock-step", None),
    ] {
        let settings = EstimatorSettings { iterations_max: 30, continuation_iterations_max: 400, ..Default::default() };
        let mut estimator = StanceEstimator::new(Arc::clone(&model), settings);
        if let Some(multiplications) = bound {
            estimator.bound_work(multiplications);
        }
        let (mut times, mut failed) = (Vec::new(), 0);
        let folds = (0..40).map(|k| {
            let zmp = Vector2::new(0.108 + 1e-4 * f64::from(k), 0.0);
            (true, StanceReference::constant(Vec3::z() * 383.0, zmp))
        });
        let leaps = walking_stance::scattered_loads(0.65).into_iter().enumerate().map(|(k, load)| (k == 0, load));
        // A walking stance within the same bound.
        estimator.touch_down(Foothold::default());
        let walks = |tick| estimator.step(&walking_stance::reference(tick, false)).status.is_solved();
        let walked = (0..walking_stance::TICKS).map(walks).filter(|solved| *solved).count();
        for (lands, load) in leaps.chain(folds) {
            if lands {
                estimator.touch_down(Foothold::default());
            }
            let start = thread_time_s();
            let report = estimator.step(&load);
            times.push(thread_time_s() - start);
            failed += usize::from(!report.status.is_solved());
        }
        let note =
            format!("{failed} of {}; {walked} of {} ticks of walking solved", times.len(), walking_stance::TICKS);
        line(name, &mut times, &note);
    }
}

/// The paper's scheme on the same stance, once: it is slow.
fn nested_table() {
    println!(
        "nested scheme (Newton on the pose, Gauss-Seidel inside), us   median      p99      max   outer iterations"
    );
    for (name, cells) in
        [("  1500 tets, 66 contacts, 1e-6", [10, 5, 5]), ("  1512 tets, 104 contacts, 1e-6", [12, 7, 3])]
    {
        let model = sole(cells, 0.021, Level::Fem);
        let settings = NestedSettings { tolerance: 1e-6, ..NestedSettings::default() };
        let mut nested = NestedEstimator::touch_down(model, settings, Foothold::default());
        let (mut times, mut iterations, mut failed) = (Vec::new(), 0, 0);
        for tick in 0..walking_stance::TICKS {
            let reference = walking_stance::reference(tick, false);
            let start = thread_time_s();
            let report = nested.step(&reference);
            times.push(thread_time_s() - start);
            iterations += report.iterations;
            failed += usize::from(!report.converged);
        }
        let mean = iterations as f64 / times.len() as f64;
        line(name, &mut times, &format!("{mean:.1} mean, {failed} failed"));
    }
}

fn plant_table() {
    println!("pose-driven contact, warm, 1 ms steps (us)              median      p99      max   iterations");
    for (name, cells, level) in [
        ("  8 x 7 patches, 72 contacts", [23, 13, 6], Level::Patches { cells: [8, 7] }),
        ("  1512 tets, 104 contacts", [12, 7, 3], Level::Fem),
    ] {
        let model = sole(cells, 0.021, level);
        let settings = PoseDrivenSettings { viscosity_time_s: 0.02, ..PoseDrivenSettings::default() };
        let mut contact = PoseDrivenContact::new(model, settings);
        let (mut times, mut iterations, mut most) = (Vec::new(), 0, 0);
        for step in 0..3000 {
            let t = 1e-3 * f64::from(step);
            let pose = Transform::new(
                so3::from_roll_pitch_yaw(0.01 * (5.0 * t).sin(), 0.015 * (3.0 * t).sin(), 0.002 * t.sin()),
                Vec3::new(1e-3 * (4.0 * t).sin(), 0.0, 1.2e-3 * (2.0 * t).cos() - 0.6e-3),
            );
            let start = thread_time_s();
            let report = contact.evaluate(&pose, &Plane, 1e-3);
            times.push(thread_time_s() - start);
            iterations += report.iterations;
            most = most.max(report.iterations);
            contact.commit();
        }
        let mean = f64::from(u32::try_from(iterations).expect("few")) / times.len() as f64;
        line(name, &mut times, &format!("{mean:.1} mean, {most} most"));
    }
}

fn main() {
    friction_table();
    stance_table();
    double_support_table();
    leaps_table();
    nested_table();
    plant_table();
}
