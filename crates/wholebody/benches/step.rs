//! The whole step, by the thread's CPU time, against Clarabel with data updates on recorded walking programs in the same
//! run; and speed against error: joints modelled, generators per point, solver and tolerance.
//!
//! ```text
//! cargo bench -p wholebody --bench step [-- walk.npz]
//! ```
//!
//! Without an argument the yardstick runs on the part of the recording that is kept with `qp`'s tests. With your own robot as
//! well (absolute paths: cargo starts benchmarks in the package's folder); what the second file must say is in `jvrc1.toml`:
//!
//! ```sh
//! BENCH_URDF=$PWD/robot.urdf BENCH_ROBOT=$PWD/crates/wholebody/benches/jvrc1.toml cargo bench -p wholebody --bench step
//! ```
#![allow(clippy::print_stdout)]
#![allow(non_snake_case)] // monogram notation

mod any_robot;
#[path = "../../qp/tests/support/recorded.rs"]
mod recorded;
#[path = "../tests/support/mod.rs"]
mod support;

use multibody::{Model, ModelOptions};
use nalgebra::DVector;
use qp::dense::{Interior, InteriorSettings, Solver};
use robot::Robot;
use spatial::{Mat6, Vec3, Vec6};
use state::observer::{BaseObserver, FootAnchor, Measurement, ObserverSettings, YawSource};
use state::{IntegrationMode, IntegrationSettings, InternalState};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use wholebody::{
    Backend, ComplianceFeedForward, ComplianceSettings, LoadedSole, SolverSettings, StepStatus, Timings, WholeBody,
    WholeBodySettings,
};

/// Repeats of each walk.
const REPEATS: usize = 5;

/// CPU time of this thread in nanoseconds.
#[allow(unsafe_code)] // clock_gettime has no safe wrapper in std; it writes the one struct it is given
fn thread_time_ns() -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is valid for the call, the clock exists on Linux.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    assert_eq!(status, 0);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * q).round() as usize]
}

/// Median over ticks of Clarabel with data updates at 1e-8 on recorded programs (us).
fn yardstick(archive: &Path) -> f64 {
    let ticks = recorded::load(archive).unwrap_or_else(|error| panic!("{}: {error}", archive.display()));
    let mut times = vec![Vec::new(); ticks.len()];
    for _ in 0..REPEATS {
        let mut solvers: HashMap<usize, Interior> = HashMap::new();
        for (tick, times) in ticks.iter().zip(&mut times) {
            let size = tick.problem.size();
            let solver = solvers.entry(tick.phase).or_insert_with(|| Interior::new(size, InteriorSettings::default()));
            let start = thread_time_ns();
            solver.solve(&tick.problem);
            times.push((thread_time_ns() - start) as f64 * 1e-3);
        }
    }
    let medians: Vec<f64> = times.iter().map(|t| quantile(t, 0.5)).collect();
    quantile(&medians, 0.5)
}

struct Run {
    single: Vec<f64>,
    double: Vec<f64>,
    stages: [Vec<f64>; 5],
    com_error_m: f64,
    torque_difference: f64,
    torques: Vec<DVector<f64>>,
    other: usize,
}

fn run(model: &Model, settings: &WholeBodySettings, plan: &Walk, compare: Option<&[DVector<f64>]>) -> Run {
    let ticks = (plan.duration_s() / PERIOD_S) as usize;
    let mut times = vec![Vec::new(); ticks];
    let mut stages = [(); 5].map(|()| vec![Vec::new(); ticks]);
    let mut out = Run {
        single: Vec::new(),
        double: Vec::new(),
        stages: [(); 5].map(|()| Vec::new()),
        com_error_m: 0.0,
        torque_difference: 0.0,
        torques: Vec::new(),
        other: 0,
    };
    let references: Vec<_> = (0..ticks).map(|tick| plan.reference(tick as f64 * PERIOD_S)).collect();
    for repeat in 0..REPEATS {
        let mut body = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
        body.set_clock(thread_time_ns);
        let mut state = start(model, settings, &references[0]);
        for (tick, reference) in references.iter().enumerate() {
            let begin = thread_time_ns();
            let report = body.step(&state, reference, PERIOD_S);
            times[tick].push((thread_time_ns() - begin) as f64 * 1e-3);
            let Timings { terms_ns, collision_ns, assembly_ns, solve_ns, output_ns } = report.timings;
            for (stage, ns) in stages.iter_mut().zip([terms_ns, collision_ns, assembly_ns, solve_ns, output_ns]) {
                stage[tick].push(ns as f64 * 1e-3);
            }
            if repeat == 0 {
                out.com_error_m = out.com_error_m.max(report.body_error.fixed_rows::<3>(0).norm());
                out.other += usize::from(report.status != StepStatus::Solved);
                if let Some(torques) = compare {
                    out.torque_difference = out.torque_difference.max((&torques[tick] - &report.torques).amax());
                }
                out.torques.push(report.torques.clone());
            }
            state.q.clone_from(&report.q_next);
            state.v.clone_from(&report.v_next);
        }
    }
    for (tick, reference) in references.iter().enumerate() {
        let median = quantile(&times[tick], 0.5);
        let both = reference.feet.iter().all(|foot| foot.in_contact);
        if both {
            out.double.push(median)
        } else {
            out.single.push(median)
        }
        for (all, stage) in out.stages.iter_mut().zip(&stages) {
            all.push(quantile(&stage[tick], 0.5));
        }
    }
    out
}

/// What feedback adds to a period (us, per tick): the observer, blending the internal state with it, both soles.
fn feedback(robot: &Robot, model: &Model, settings: &WholeBodySettings, plan: &Walk) -> Vec<f64> {
    let observer_settings = ObserverSettings {
        imu_link: robot.description.imu_frame.clone(),
        ankle_links: settings.feet.each_ref().map(|foot| foot.ankle_link.clone()),
        yaw: YawSource::Legs,
        bias_time_s: 5.0,
        velocity_time_s: 0.01,
        delay_s: PERIOD_S,
    };
    let integration = IntegrationSettings { mode: IntegrationMode::Feedback, ..IntegrationSettings::default() };
    let mut body = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
    let mut observer = BaseObserver::new(model.clone(), observer_settings).expect("names fit the model");
    let mut soles = [ComplianceFeedForward::new(ComplianceSettings { part: 0.5, time_s: 0.03 }); 2];
    // About HRP-4's soles: 1 mm under 500 N, 1 degree under 10 N m.
    let compliance = Mat6::from_diagonal(&Vec6::new(-2e-6, -2e-6, -2e-6, -2e-3, -2e-3, -2e-3));
    let mut times = Vec::new();
    let start = start(model, settings, &plan.reference(0.0));
    let mut own = InternalState::new(&integration, start.clone(), 1);
    let mut measured = start;
    let mut joint_rates = DVector::zeros(model.joint_count());
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let mut reference = plan.reference(tick as f64 * PERIOD_S);
        joint_rates.copy_from(&own.state().v.rows(model.base_dofs(), model.joint_count()));
        measured.q.joints.copy_from(&own.state().q.joints);
        let measurement = Measurement {
            joints: &measured.q.joints,
            joint_rates: &joint_rates,
            imu_rotation: own.state().q.base.rotation,
            gyro: Vec3::zeros(),
            feet: reference.feet.each_ref().map(|foot| FootAnchor {
                in_contact: foot.in_contact,
                load_share: foot.load_share,
                ankle_pose: foot.ankle_pose,
                ankle_twist: foot.ankle_twist,
            }),
        };
        let begin = thread_time_ns();
        let estimate = observer.update(&measurement, PERIOD_S);
        measured.q.base = estimate.pose;
        measured.v.rows_mut(0, model.base_dofs()).copy_from(&estimate.twist.to_vector());
        own.begin(model, Some(&measured), PERIOD_S);
        for (i, foot) in reference.feet.iter_mut().enumerate() {
            let origin = Vec3::new(foot.zmp.x, foot.zmp.y, 0.0);
            let sole = foot.in_contact.then_some(LoadedSole { origin, wrench: foot.wrench, compliance });
            let computed = &body.report().feet[i].wrench;
            foot.ankle_pose = soles[i].update(sole.as_ref(), computed, &foot.ankle_pose, PERIOD_S);
        }
        times.push((thread_time_ns() - begin) as f64 * 1e-3);
        own.advance(body.step(own.state(), &reference, PERIOD_S));
    }
    times
}

fn show(name: &str, dofs: usize, run: &Run, yardstick_us: f64) {
    let all: Vec<f64> = run.single.iter().chain(&run.double).copied().collect();
    let median = quantile(&all, 0.5);
    println!(
        "| {name} | {dofs} | {:.1} | {:.1} | {:.4} | {:.2} | {:.1} | {:.2} | {:.1e} | {} |",
        quantile(&run.single, 0.5),
        quantile(&run.double, 0.5),
        median / yardstick_us,
        quantile(&all, 0.99) / median,
        quantile(&all, 1.0),
        run.com_error_m * 1e3,
        run.torque_difference,
        run.other,
    );
}

fn main() {
    let archive = std::env::args()
        .skip(1)
        .find(|argument| argument.ends_with(".npz"))
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../qp/tests/data/walk.npz"), PathBuf::from);
    let robot = robot();
    let plan = Walk::straight(4);
    let yardstick_us = yardstick(&archive);
    println!("Clarabel with data updates at 1e-8 on {}: median {yardstick_us:.0} us\n", archive.display());
    println!(
        "| model | dofs | single us | double us | ratio | p99/median | max us | COM error mm | torque diff. N m | not solved |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut stages = Vec::new();
    for (name, joints) in
        [("HRP-4 legs, chest", Joints::Legs), ("HRP-4 walking", Joints::Walking), ("HRP-4 full", Joints::Full)]
    {
        let model = model(&robot, joints);
        let settings = settings(&robot, &model);
        let run = run(&model, &settings, &plan, None);
        show(name, model.nv(), &run, yardstick_us);
        stages.push((name, run.stages.map(|stage| quantile(&stage, 0.5))));
    }
    {
        let locked = ["R_HAND_J0", "L_HAND_J0"].map(|name| (name.to_owned(), 0.0)).to_vec();
        let options = ModelOptions { locked_joints: locked, ..ModelOptions::default() };
        let model = Model::from_urdf(&robot.urdf, &options).expect("readable");
        let settings = settings(&robot, &model);
        show("HRP-4, thumbs locked", model.nv(), &run(&model, &settings, &plan, None), yardstick_us);
    }
    if let (Some(urdf), Some(file)) = (std::env::var_os("BENCH_URDF"), std::env::var_os("BENCH_ROBOT")) {
        let (name, model, settings, plan) = any_robot::read(Path::new(&urdf), Path::new(&file));
        let run = run(&model, &settings, &plan, None);
        let name = format!("{name}, {} pairs", settings.collision.pairs.len());
        show(&name, model.nv(), &run, yardstick_us);
    }
    let model = model(&robot, Joints::Walking);
    let base = settings(&robot, &model);
    let reference = run(&model, &base, &plan, None);
    for generators_per_point in [8, 16] {
        let mut settings = base.clone();
        settings.constraints.generators_per_point = generators_per_point;
        let name = format!("HRP-4 walking, {generators_per_point} generators per point");
        show(&name, model.nv(), &run(&model, &settings, &plan, Some(&reference.torques)), yardstick_us);
    }
    {
        let mut settings = base.clone();
        settings.collision.pairs.clear();
        show(
            "HRP-4 walking, no collision pairs",
            model.nv(),
            &run(&model, &settings, &plan, Some(&reference.torques)),
            yardstick_us,
        );
    }
    for tolerance in [1e-6, 1e-8] {
        let solver = SolverSettings { backend: Backend::Interior, interior_tolerance: tolerance, ..base.solver };
        let settings = WholeBodySettings { solver, ..base.clone() };
        let name = format!("HRP-4 walking, Clarabel {tolerance:e}");
        show(&name, model.nv(), &run(&model, &settings, &plan, Some(&reference.torques)), yardstick_us);
    }
    println!("\nStages (median us): terms | collision | assembly | solve | output");
    for (name, [terms, collision, assembly, solve, output]) in stages {
        println!("| {name} | {terms:.1} | {collision:.1} | {assembly:.1} | {solve:.1} | {output:.1} |");
    }
    let runs: Vec<_> = (0..REPEATS).map(|_| feedback(&robot, &model, &base, &plan)).collect();
    let times: Vec<f64> =
        (0..runs[0].len()).map(|tick| quantile(&runs.iter().map(|run| run[tick]).collect::<Vec<_>>(), 0.5)).collect();
    println!(
        "\nFeedback, HRP-4 walking (us): median {:.1}, p99 {:.1}, max {:.1}",
        quantile(&times, 0.5),
        quantile(&times, 0.99),
        quantile(&times, 1.0)
    );
}
