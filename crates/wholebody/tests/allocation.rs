//! A step allocates nothing, and the guard that says so works.
#![allow(unsafe_code)] // an allocator is unsafe by its trait; this one counts and passes on
#![allow(non_snake_case)] // monogram notation

#[path = "support/mod.rs"]
mod support;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use wholebody::{AnsweredBy, StepStatus, WholeBody};

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
}

#[test]
fn a_walk_with_contact_changes_and_a_contradiction_allocates_nothing() {
    let robot = robot();
    let model = model(&robot, Joints::Full);
    let settings = settings(&robot, &model);
    let plan = Walk::straight(2);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let mut state = start(body.model(), body.settings(), &plan.reference(0.0));
    let (mut count, mut relaxed) = (0, 0);
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let mut reference = plan.reference(tick as f64 * PERIOD_S);
        if tick % 100 == 50 {
            // The ground falls away under one foot: limits have to give way.
            reference.feet[0].ankle_acceleration.linear.z = -200.0;
        }
        let here = allocations(|| {
            body.step(&state, &reference, PERIOD_S);
        });
        let report = body.report();
        // The reserve, Clarabel, allocates; it is asked only when the active set has failed.
        if report.answered_by == AnsweredBy::Solver {
            count += here;
            relaxed += usize::from(report.status == StepStatus::Relaxed);
        }
        if tick % 100 != 50 {
            state.q.clone_from(&body.report().q_next);
            state.v.copy_from(&body.report().v_next);
        }
    }
    assert_eq!(count, 0);
    assert!(relaxed > 0, "the fallback was reached");
}
