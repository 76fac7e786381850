//! A step allocates nothing, and the guard that says so works.
#![allow(non_snake_case)] // monogram notation

#[path = "support/mod.rs"]
mod support;

use nalgebra::DVector;
use spatial::Vec3;
use support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use wholebody::observer::{BaseObserver, FootAnchor, Measurement, ObserverSettings, YawSource};
use wholebody::{AnsweredBy, FeedbackRates, Integration, RobotState, StateIntegrator, StepStatus, WholeBody};

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

#[test]
fn observing_the_base_and_drawing_the_own_state_towards_it_allocates_nothing() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let reference = Walk::straight(1).reference(0.0);
    let state = start(&model, &settings, &reference);
    let observer_settings = ObserverSettings {
        imu_link: "imu".to_owned(),
        ankle_links: settings.feet.each_ref().map(|foot| foot.ankle_link.clone()),
        yaw: YawSource::Legs,
        bias_time_s: 5.0,
        velocity_time_s: 0.01,
        delay_s: 0.02,
    };
    let mut observer = BaseObserver::new(model.clone(), observer_settings).expect("names fit");
    let rates = FeedbackRates { base_pose: 5.0, base_twist: 5.0, joints: 1.0 };
    let mut integrator = StateIntegrator::new(Integration::Feedback(rates), state.clone());
    let joint_rates = DVector::zeros(model.joint_count());
    let mut measured: RobotState = state.clone();
    let count = allocations(|| {
        for _ in 0..10 {
            let estimate = observer.update(
                &Measurement {
                    joints: &state.q.joints,
                    joint_rates: &joint_rates,
                    imu_rotation: state.q.base.rotation,
                    gyro: Vec3::zeros(),
                    feet: reference.feet.map(|foot| FootAnchor {
                        in_contact: foot.in_contact,
                        load_share: foot.load_share,
                        ankle_pose: foot.ankle_pose,
                        ankle_twist: foot.ankle_twist,
                    }),
                },
                PERIOD_S,
            );
            measured.q.base = estimate.pose;
            integrator.begin(&model, Some(&measured), PERIOD_S);
        }
    });
    assert_eq!(count, 0);
    assert!(integrator.distance().base_m < 1e-6, "the observed base is that of the start");
}
