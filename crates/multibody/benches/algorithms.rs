//! Every algorithm on HRP-4 (nv = 40) and on a random robot of 38 degrees of freedom.
//!
//! `cargo bench -p multibody`; for the comparison with Pinocchio's C++ see `tools/oracles/speed.py`. With your own robot
//! instead, its frames by name (an absolute path: cargo starts benchmarks in the package's folder):
//!
//! ```sh
//! BENCH_URDF=$PWD/robot.urdf BENCH_FRAMES="left_foot right_foot torso" cargo bench -p multibody
//! ```
#![allow(missing_docs)] // criterion's macros make undocumented functions

#[path = "../tests/multibody/random_robot.rs"]
#[allow(dead_code)] // shared with the tests
mod random_robot;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use multibody::*;
use nalgebra::{DMatrix, DVector};
use random_robot::{Random, configuration};
use std::hint::black_box;

/// States to cycle through, so that nothing is learnt from the last call.
const STATES: usize = 64;

struct State {
    q: Configuration,
    v: DVector<f64>,
    a: DVector<f64>,
}

/// Name, URDF, and frames whose Jacobians a walking controller would ask for.
fn robots() -> Vec<(String, String, Vec<String>)> {
    let Ok(path) = std::env::var("BENCH_URDF") else { return own_robots() };
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("BENCH_URDF={path}: {error}"));
    let frames = std::env::var("BENCH_FRAMES").unwrap_or_default();
    let name = std::path::Path::new(&path).file_stem().expect("a file has a name").to_string_lossy().into_owned();
    vec![(name, text, frames.split_whitespace().map(str::to_owned).collect())]
}

fn own_robots() -> Vec<(String, String, Vec<String>)> {
    let hrp4 = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/hrp4/hrp4.urdf");
    let text = std::fs::read_to_string(hrp4).expect("the shipped robot");
    let frames = ["l_ankle", "r_ankle", "l_wrist", "r_wrist", "torso"].map(str::to_owned).to_vec();
    let joints = |text: &str| Model::from_urdf(text, &ModelOptions::default()).expect("a robot").joint_count();
    let random = (0..).map(|seed| random_robot::urdf(seed, 38)).find(|text| joints(text) == 32).expect("some seed");
    let links = ["l38", "l34", "l29", "l21", "l11"].map(str::to_owned).to_vec();
    vec![("HRP-4".to_owned(), text, frames), ("random, nv = 38".to_owned(), random, links)]
}

fn algorithms(c: &mut Criterion) {
    for (name, text, links) in robots() {
        let options = ModelOptions { inertia: InertiaCheck::Tolerant, ..ModelOptions::default() };
        let model = Model::from_urdf(&text, &options).unwrap_or_else(|error| panic!("{name}: {error}"));
        let frame = |link: &String| model.frame(link).unwrap_or_else(|error| panic!("{name}: {error}"));
        let frames: Vec<FrameIndex> = links.iter().map(frame).collect();
        if let Some(joint) = model.massless_joint() {
            panic!("{name}: M is singular, for joint `{}` moves nothing", model.joints()[joint.0].name);
        }
        let nv = model.nv();
        let mut random = Random(1);
        let states: Vec<State> = (0..STATES)
            .map(|_| State { q: configuration(&model, &mut random), v: random.list(nv, 1.0), a: random.list(nv, 1.0) })
            .collect();
        let (mut ws, mut terms) = (Workspace::new(&model), WholeBodyTerms::new(&model, &frames));
        let (mut vector, mut matrix) = (DVector::zeros(nv), DMatrix::zeros(nv, nv));
        let (mut jacobian, mut factor) = (DMatrix::zeros(6, nv), MassFactor::new(&model));
        let mut mass_matrix = DMatrix::zeros(nv, nv);
        crba(&model, &mut ws, &states[0].q, &mut mass_matrix);
        let mut bench = |algorithm: &str, call: &mut dyn FnMut(&State)| {
            let mut next = states.iter().cycle();
            c.bench_with_input(BenchmarkId::new(algorithm, &name), &(), |b, ()| {
                b.iter(|| call(next.next().expect("endless")));
            });
        };
        bench("forward kinematics", &mut |s| {
            black_box(forward_kinematics(&model, &mut ws, &s.q));
        });
        bench("RNEA", &mut |s| rnea(&model, &mut ws, &s.q, &s.v, &s.a, black_box(&mut vector)));
        bench("bias forces", &mut |s| bias_forces(&model, &mut ws, &s.q, &s.v, black_box(&mut vector)));
        bench("CRBA", &mut |s| crba(&model, &mut ws, &s.q, black_box(&mut matrix)));
        bench("ABA", &mut |s| aba(&model, &mut ws, &s.q, &s.v, &s.a, black_box(&mut vector)));
        bench("Jacobians", &mut |s| {
            let mut placed = forward_kinematics(&model, &mut ws, &s.q);
            frames.iter().for_each(|frame| placed.jacobian(*frame, black_box(&mut jacobian)));
        });
        bench("ABA, refined", &mut |s| {
            black_box(aba_refined(&model, &mut ws, &s.q, &s.v, &s.a, black_box(&mut vector)));
        });
        bench("whole-body terms", &mut |s| {
            whole_body_terms(&model, &mut ws, &s.q, &s.v, black_box(&mut terms));
        });
        bench("Cholesky of M", &mut |_| factor.factor(black_box(&mass_matrix)).expect("every joint carries mass"));
    }
}

criterion_group! {
    name = benches;
    // Shared machines: many short samples; criterion reports the median of them.
    config = Criterion::default().sample_size(100).measurement_time(std::time::Duration::from_secs(1)).warm_up_time(std::time::Duration::from_millis(300));
    targets = algorithms
}
criterion_main!(benches);
