//! The active set allocates nothing after it is made, and the guard that says so works.
#![allow(unsafe_code)] // an allocator is unsafe by its trait; this one counts and passes on

#[path = "support/recorded.rs"]
mod recorded;

use qp::dense::{ActiveSet, ActiveSetSettings, Interior, InteriorSettings, Solver};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;

struct Counting;

thread_local! {
    /// Only this thread's allocations count: the test harness has its own.
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

fn note() {
    // During a thread's end the counter is gone; nothing is measured then.
    let _ = COUNT.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call goes to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note();
        // SAFETY: the caller's promise is passed on.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(work: impl FnOnce()) -> u64 {
    let before = COUNT.with(Cell::get);
    work();
    COUNT.with(Cell::get) - before
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
