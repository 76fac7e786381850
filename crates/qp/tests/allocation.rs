//! The active set allocates nothing after it is made, and the guard that says so works.

#[path = "support/recorded.rs"]
mod recorded;

use qp::dense::{ActiveSet, ActiveSetSettings, Interior, InteriorSettings, Solver};
use std::path::Path;

fn allocations(work: impl FnOnce()) -> u64 {
    allocation_counter::measure(work).count_total
}

#[test]
fn the_guard_fires_on_a_single_allocation() {
    assert_eq!(allocations(|| drop(std::hint::black_box(Box::new(1)))), 1);
    assert_eq!(allocations(|| {}), 0);
}

#[test]
fn recorded_programs_are_solved_without_allocating_warm_and_cold_feasible_and_not() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/walk_noisy.npz");
    let ticks = recorded::load(&path).expect("recorded programs");
    for phase in 0..3 {
        let ticks: Vec<_> = ticks.iter().filter(|tick| tick.phase == phase).collect();
        let mut solver = ActiveSet::new(ticks[0].problem.size(), ActiveSetSettings::default());
        for tick in &ticks {
            let mut impossible = tick.problem.clone();
            impossible.b[8] = -1e9; // the ground cannot pull the foot down
            let mut usable = true;
            let count = allocations(|| {
                usable &= solver.solve(&tick.problem).report.status.has_solution();
                solver.forget();
                usable &= solver.solve(&tick.problem).report.status.has_solution();
                usable &= !solver.solve(&impossible).report.status.has_solution();
            });
            assert!(usable, "tick {}", tick.number);
            assert_eq!(count, 0, "tick {}", tick.number);
        }
    }
}

#[test]
fn clarabel_with_data_updates_allocates_a_few_times_per_solve() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/walk.npz");
    let ticks = recorded::load(&path).expect("recorded programs");
    let ticks: Vec<_> = ticks.iter().filter(|tick| tick.phase == 1).collect();
    let mut solver = Interior::new(ticks[0].problem.size(), InteriorSettings::default());
    for tick in &ticks {
        solver.solve(&tick.problem);
    }
    let last = ticks[ticks.len() - 1];
    let count = allocations(|| {
        solver.solve(&last.problem);
    });
    // Clarabel's own, and the vectors with which the residuals are computed.
    assert!((1..40).contains(&count), "{count}");
}
