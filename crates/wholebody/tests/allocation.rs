//! A step allocates nothing, and the guard that says so works.
#![allow(non_snake_case)] // monogram notation

#[path = "support/mod.rs"]
mod support;

use support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use wholebody::{AnsweredBy, StepStatus, WholeBody};

fn allocations(work: impl FnOnce()) -> u64 {
    allocation_counter::measure(work).count_total
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
        // The backup, Clarabel, allocates; it is asked only when the active set has failed.
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
