//! A part of the recorded walking programs; all of them: `cargo bench -p qp --bench recorded -- FOLDER`.

use crate::recorded::{Tick, load};
use crate::{active_set, oracle};
use qp::Status;
use qp::dense::{ActiveSet, Interior, Solver};
use std::collections::HashMap;
use std::path::Path;

/// Violations in the units of the recordings (N, N m, m/s²), whose terms are up to 1e4.
const VIOLATION: f64 = 1e-10;

fn ticks(name: &str) -> Vec<Tick> {
    load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)).expect("recorded programs")
}

#[test]
fn recorded_walking_programs_are_solved_like_clarabel_does_and_nearly_without_changes() {
    for name in ["walk.npz", "walk_noisy.npz"] {
        let ticks = ticks(name);
        assert_eq!(ticks.len(), 30);
        let mut own: HashMap<usize, ActiveSet> = HashMap::new();
        let mut other: HashMap<usize, Interior> = HashMap::new();
        let mut changes = 0;
        for tick in &ticks {
            let problem = &tick.problem;
            let solver = own.entry(tick.phase).or_insert_with(|| active_set(problem));
            let outcome = solver.solve(problem);
            let label = format!("{name} tick {}", tick.number);
            assert_eq!(outcome.report.status, Status::Solved, "{label}");
            assert!(outcome.violation <= VIOLATION, "{label}: {:e}", outcome.violation);
            assert!(outcome.report.residuals.max() < 1e-12, "{label}: {:?}", outcome.report.residuals);
            changes += outcome.report.iterations;
            let clarabel = other.entry(tick.phase).or_insert_with(|| oracle(problem));
            let oracle = clarabel.solve(problem).report.objective;
            let difference = (outcome.report.objective - oracle).abs() / oracle.abs().max(1.0);
            assert!(difference < 1e-6, "{label}: {difference:e}");
            // Accelerations of the reference solution, itself good to 1e-5.
            let joints = 38;
            let far = (outcome.report.x.rows(0, joints) - tick.reference.rows(0, joints)).amax();
            assert!(far < 1e-3, "{label}: {far:e}");
        }
        assert!(changes < 4 * ticks.len() as u32, "{name}: {changes}");
    }
}

#[test]
fn data_updates_set_clarabel_up_once_per_phase() {
    let ticks = ticks("walk.npz");
    let phase: Vec<_> = ticks.iter().filter(|tick| tick.phase == 1).collect();
    let mut solver = oracle(&phase[0].problem);
    for tick in &phase {
        solver.solve(&tick.problem);
    }
    assert!(solver.setups() <= 2, "{}", solver.setups());
}
