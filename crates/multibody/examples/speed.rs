//! Time per call of every algorithm, as JSON; `tools/oracles/speed.py` runs it interleaved with Pinocchio.
//!
//! `cargo run --release -p multibody --example speed -- ROBOT.urdf FRAME...`
#![allow(clippy::print_stdout)] // its result
#![allow(clippy::disallowed_methods)] // it measures time

use multibody::*;
use nalgebra::{DMatrix, DVector};
use spatial::{Transform, Vec3, so3};
use std::hint::black_box;
use std::time::Instant;

/// Different states, so that nothing is learnt from the last call.
const STATES: usize = 64;
/// Batches of [`STATES`] calls; the fastest counts, for the others were interrupted.
const BATCHES: usize = 200;

struct State {
    q: Configuration,
    v: DVector<f64>,
    a: DVector<f64>,
    tau: DVector<f64>,
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().expect("the first argument is a URDF");
    let text = std::fs::read_to_string(&path).expect("the URDF is readable");
    let options = ModelOptions { inertia: InertiaCheck::Tolerant, ..ModelOptions::default() };
    let model = Model::from_urdf(&text, &options).expect("the URDF is a robot");
    let frames: Vec<FrameIndex> = arguments.map(|name| model.frame(&name).expect("a frame of the robot")).collect();
    let nv = model.nv();
    let mut seed = 1_u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let states: Vec<State> = (0..STATES)
        .map(|_| State {
            q: Configuration {
                base: Transform::new(
                    so3::exp(&Vec3::new(random(), random(), random())),
                    Vec3::new(random(), random(), random()),
                ),
                joints: DVector::from_fn(model.joint_count(), |_, _| 3.0 * random()),
            },
            v: DVector::from_fn(nv, |_, _| random()),
            a: DVector::from_fn(nv, |_, _| random()),
            tau: DVector::from_fn(nv, |_, _| 10.0 * random()),
        })
        .collect();
    let mut ws = Workspace::new(&model);
    let mut vector = DVector::zeros(nv);
    let mut matrix = DMatrix::zeros(nv, nv);
    let mut jacobian = DMatrix::zeros(6, nv);
    let mut terms = WholeBodyTerms::new(&model, &frames);
    let mut results: Vec<String> = vec![format!("\"nv\": {nv}")];
    let mut time = |name: &str, call: &mut dyn FnMut(&State)| {
        let batch = |call: &mut dyn FnMut(&State)| {
            let start = Instant::now();
            states.iter().for_each(&mut *call);
            start.elapsed().as_secs_f64() / STATES as f64
        };
        let fastest = (0..BATCHES).map(|_| batch(call)).fold(f64::INFINITY, f64::min);
        results.push(format!("\"{name}\": {:.1}", fastest * 1e9));
    };
    time("forward kinematics", &mut |s| {
        black_box(forward_kinematics(&model, &mut ws, &s.q));
    });
    time("RNEA", &mut |s| rnea(&model, &mut ws, &s.q, &s.v, &s.a, black_box(&mut vector)));
    time("bias forces", &mut |s| bias_forces(&model, &mut ws, &s.q, &s.v, black_box(&mut vector)));
    time("CRBA", &mut |s| crba(&model, &mut ws, &s.q, black_box(&mut matrix)));
    time("ABA", &mut |s| aba(&model, &mut ws, &s.q, &s.v, &s.tau, black_box(&mut vector)));
    time("Jacobians of the frames", &mut |s| {
        let mut placed = forward_kinematics(&model, &mut ws, &s.q);
        for frame in &frames {
            placed.jacobian(*frame, black_box(&mut jacobian));
        }
    });
    time("whole-body terms", &mut |s| {
        whole_body_terms(&model, &mut ws, &s.q, &s.v, black_box(&mut terms));
    });
    println!("{{{}}}", results.join(", "));
}
