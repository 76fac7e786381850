//! Periods, and limits that bind.

use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, walk};
use gait::GaitSettings;
use wholebody::{ConstraintId, StepStatus, WholeBody};

#[test]
fn periods_from_1_to_20_ms_are_stable_and_track() {
    let robot = robot();
    for (period_s, allowed_m) in [(1e-3, 1e-3), (2e-3, 1e-3), (5e-3, 1e-3), (1e-2, 2e-3), (2e-2, 8e-3)] {
        let model = model(&robot, Joints::Legs);
        let settings = settings(&robot, &model);
        let mut body = WholeBody::new(model, settings).expect("settings fit the model");
        let mut worst: f64 = 0.0;
        let mut fastest: f64 = 0.0;
        walk(&Walk::straight(2), &mut body, period_s, |tick, _, _, report| {
            assert_ne!(report.status, StepStatus::Held, "{period_s} s, tick {tick}: {:?}", report.contradiction);
            worst = worst.max(report.body_error.fixed_rows::<3>(0).norm());
            fastest = fastest.max(report.v_next.amax());
        });
        assert!(worst < allowed_m, "{period_s} s: centre of mass off by {worst} m");
        assert!(fastest < 3.0, "{period_s} s: {fastest} rad/s");
    }
}

#[test]
fn torques_at_45_percent_bind_and_hold_without_chatter() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    // At this pace they come within a third of binding; the next test lowers them until they do.
    settings.constraints.torque_fraction = 0.45;
    let limits: Vec<f64> = model.joints().iter().map(|joint| 0.45 * joint.limits.effort).collect();
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let mut used: f64 = 0.0;
    let mut last: Option<nalgebra::DVector<f64>> = None;
    let mut jump: f64 = 0.0;
    walk(&Walk::straight(3), &mut body, PERIOD_S, |tick, _, _, report| {
        assert_eq!(report.status, StepStatus::Solved, "tick {tick}");
        for (tau, limit) in report.torques.iter().zip(&limits) {
            used = used.max(tau.abs() / limit);
            assert!(tau.abs() < limit + 1e-6, "tick {tick}");
        }
        if let Some(last) = &last {
            jump = jump.max((&report.torques - last).amax());
        }
        last = Some(report.torques.clone());
    });
    assert!(used > 0.6, "{used}");
    assert!(jump < 15.0, "torques jump by {jump} N m in a period");
}

#[test]
fn torque_limits_that_bind_are_kept_and_reported() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    // Unlimited, this walk uses up to 19 % at the knees and 32 % at the ankles' roll.
    settings.constraints.torque_fraction = 0.25;
    let limits: Vec<f64> = model.joints().iter().map(|joint| 0.25 * joint.limits.effort).collect();
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let (mut active, mut solved, mut total) = (0, 0, 0);
    let plan = Walk::straight(2);
    let mut worst: f64 = 0.0;
    walk(&plan, &mut body, PERIOD_S, |_, _, _, report| {
        total += 1;
        if report.status == StepStatus::Solved {
            solved += 1;
            for (tau, limit) in report.torques.iter().zip(&limits) {
                worst = worst.max(tau.abs() - limit);
            }
        }
        active += usize::from(report.active.iter().any(|active| matches!(active.id, ConstraintId::Torque(_))));
    });
    assert!(worst < 1e-6, "a torque limit is passed by {worst} N m");
    assert!(active > 20, "limits bind in {active} of {total} steps");
    assert!(solved * 10 > total * 9, "{solved} of {total} solved");
}

#[test]
fn knees_near_stretched_stop_before_their_limit_and_the_walk_goes_on() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let knees: Vec<usize> = ["L_KNEE_P", "R_KNEE_P"].map(|name| model.joint(name).expect("a knee").0).to_vec();
    let lowest = model.joints()[knees[0]].limits.lower + settings.constraints.position_margin_rad;
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    // From the usual height the centre of mass is asked to rise by 60 mm: further than the legs are long.
    let plan = Walk::straight(2);
    let mut state = crate::support::start(body.model(), body.settings(), &plan.reference(0.0));
    let mut nearest = f64::INFINITY;
    let mut speeds: Vec<f64> = Vec::new();
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let t_s = tick as f64 * PERIOD_S;
        let mut reference = plan.reference(t_s);
        reference.com_position.z += 0.06 * (t_s / 1.5).min(1.0);
        let report = body.step(&state, &reference, PERIOD_S);
        assert_ne!(report.status, StepStatus::Held, "tick {tick}: {:?}", report.contradiction);
        for &knee in &knees {
            let at = report.q_next.joints[knee];
            assert!(at > lowest - 1e-6, "tick {tick}: {at} below {lowest}");
            nearest = nearest.min(at - lowest);
        }
        speeds.push(report.v_next[6 + knees[0]]);
        (state.q, state.v) = (report.q_next.clone(), report.v_next.clone());
    }
    assert!(nearest < 0.1, "the knee comes near its limit: {nearest} rad");
    // Chatter would show as sign changes of the acceleration in every period.
    let turns = speeds
        .windows(3)
        .filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0 && (w[1] - w[0]).abs().min((w[2] - w[1]).abs()) > 0.05)
        .count();
    assert!(turns < speeds.len() / 20, "{turns} reversals in {} steps", speeds.len());
}

#[test]
fn half_of_the_speed_limits_hold_in_a_hurried_walk() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    assert_eq!(settings.constraints.velocity_fraction, 0.5);
    let limits: Vec<f64> = model.joints().iter().map(|joint| 0.5 * joint.limits.velocity).collect();
    let mut gait =
        GaitSettings { walk: gait::Walk::Straight { swings: 3, step_length_m: 0.12 }, ..GaitSettings::default() };
    gait.timing.single_support_s = 0.32;
    gait.timing.double_support_s = 0.2;
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let mut bound = 0;
    walk(&Walk::plan(&gait), &mut body, PERIOD_S, |tick, _, _, report| {
        assert_ne!(report.status, StepStatus::Held, "tick {tick}: {:?}", report.contradiction);
        for (i, limit) in limits.iter().enumerate() {
            let widened: f64 = report
                .relaxed
                .iter()
                .filter(|r| r.id == ConstraintId::JointMotion(i))
                .map(|r| r.amount * PERIOD_S)
                .sum();
            assert!(report.v_next[6 + i].abs() < limit + widened + 1e-9, "tick {tick} joint {i}");
        }
        bound += usize::from(report.active.iter().any(|active| matches!(active.id, ConstraintId::JointMotion(_))));
    });
    assert!(bound > 0, "the walk is hurried enough for a speed limit to bind");
}
