//! Periods, and limits that bind: at every tick of every walk here all limits hold as set and nothing is relaxed
//! (`Watch::look`), and no signal turns back again and again.

use crate::support::watch::Watch;
use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, start, walk};
use gait::GaitSettings;
use wholebody::{WholeBody, WholeBodySettings};

/// Turns of a signal within 20 periods, by more than 1 % of its limit: limits that begin or cease to bind pass the motion from
/// joint to joint. Chatter would be 10 to 20; it was, when joints were let into their limits in a single period.
const TURNS_MAX: usize = 6;

/// HRP-4's walking model with changed settings.
fn body(change: impl Fn(&mut WholeBodySettings)) -> WholeBody {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    change(&mut settings);
    WholeBody::new(model, settings).expect("settings fit the model")
}

/// Three steps of 0.1 m in 0.6 s each.
fn brisk() -> GaitSettings {
    let mut gait =
        GaitSettings { walk: gait::Walk::Straight { swings: 3, step_length_m: 0.1 }, ..GaitSettings::default() };
    gait.timing.single_support_s = 0.4;
    gait.timing.double_support_s = 0.2;
    gait
}

fn watched(plan: &Walk, body: &mut WholeBody, dt_s: f64) -> Watch {
    let mut watch = Watch::with_period(body, dt_s);
    walk(plan, body, dt_s, |tick, _, reference, report| watch.look(tick, reference, report));
    watch
}

#[test]
fn periods_from_1_to_20_ms_keep_every_limit_and_track() {
    assert_eq!(body(|_| {}).model().nv(), 28);
    let mut worst: f64 = 0.0;
    for period_s in [1e-3, 2e-3, 5e-3, 1e-2, 2e-2] {
        let watch = watched(&Walk::straight(2), &mut body(|_| {}), period_s);
        let said = format!("{period_s} s: {}", watch.figures());
        worst = worst.max(watch.com_error_m);
        assert!(watch.com_error_m < 3e-4, "{said}");
        // The soles' jerk is what constant accelerations cannot follow; at 20 ms it leaves a tenth of a millimetre.
        let allowed = if period_s > 5e-3 { 2e-4 } else { 1e-5 };
        assert!(watch.contact_error_m < allowed && watch.contact_error_rad < allowed, "{said}");
        assert!(watch.turns() <= TURNS_MAX, "{said}");
    }
    assert!(worst > 1e-5, "the figure is not empty");
}

#[test]
fn torques_at_45_percent_bind_and_hold_without_chatter() {
    // 80 mm lower than usual, bent knees: brisk steps ask the ankles' roll for 63 % of what its motor can do.
    let plan = || Walk { com_offset_m: -0.08, ..Walk::plan(&brisk()) };
    let free = watched(&plan(), &mut body(|_| {}), PERIOD_S);
    assert!(free.torque_used > 0.6, "{}", free.figures());
    let watch = watched(&plan(), &mut body(|s| s.constraints.torque_factor = 0.45), PERIOD_S);
    assert!(watch.torque_bound > 20, "{}", watch.figures());
    assert!(watch.turns() <= TURNS_MAX, "{}", watch.figures());
    assert!(watch.com_error_m < 1e-2, "{}", watch.figures());
}

#[test]
fn torques_at_25_percent_bind_and_hold_without_chatter() {
    // Unlimited, this walk uses up to 19 % at the knees and 32 % at the ankles' roll.
    let watch = watched(&Walk::straight(2), &mut body(|s| s.constraints.torque_factor = 0.25), PERIOD_S);
    assert!(watch.torque_bound > 50, "{}", watch.figures());
    assert!(watch.turns() <= TURNS_MAX, "{}", watch.figures());
    assert!(watch.com_error_m < 1e-3, "{}", watch.figures());
}

#[test]
fn knees_near_stretched_stop_before_their_limit_without_chatter_and_the_walk_goes_on() {
    let mut body = body(|_| {});
    let knees: Vec<usize> = ["L_KNEE_P", "R_KNEE_P"].map(|name| body.model().joint(name).expect("a knee").0).to_vec();
    let lowest = body.model().joints()[knees[0]].limits.lower + body.settings().constraints.position_margin_rad;
    // From the usual height the centre of mass is asked to rise by 60 mm: further than the legs are long.
    let plan = Walk::straight(2);
    let mut state = start(body.model(), body.settings(), &plan.reference(0.0));
    let mut nearest = f64::INFINITY;
    let mut watch = Watch::new(&body);
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let t_s = tick as f64 * PERIOD_S;
        let mut reference = plan.reference(t_s);
        reference.com_position.z += 0.06 * (t_s / 1.5).min(1.0);
        let report = body.step(&state, &reference, PERIOD_S);
        watch.look(tick, &reference, report);
        nearest = knees.iter().fold(nearest, |nearest: f64, &knee| nearest.min(report.q_next.joints[knee] - lowest));
        (state.q, state.v) = (report.q_next.clone(), report.v_next.clone());
    }
    assert!(nearest < 1e-4, "a knee reaches its limit: {nearest} rad");
    assert!(watch.turns() <= TURNS_MAX, "{}", watch.figures());
}

#[test]
fn half_of_the_speed_limits_hold_in_a_brisk_walk_without_chatter() {
    let mut body = body(|s| assert_eq!(s.constraints.velocity_factor, 0.5));
    let watch = watched(&Walk::plan(&brisk()), &mut body, PERIOD_S);
    assert!(watch.motion_bound > 50 && watch.speed_used > 0.999, "{}", watch.figures());
    assert!(watch.turns() <= TURNS_MAX, "{}", watch.figures());
}

#[test]
fn a_walk_too_hurried_for_half_of_the_speeds_still_keeps_every_limit() {
    let mut gait = brisk();
    gait.walk = gait::Walk::Straight { swings: 3, step_length_m: 0.12 };
    gait.timing.single_support_s = 0.32;
    for fraction in [1.0, 0.45] {
        let mut body = body(|s| s.constraints.torque_factor = fraction);
        let watch = watched(&Walk::plan(&gait), &mut body, PERIOD_S);
        assert!(watch.motion_bound > 50 && watch.torque_bound > 0, "{}", watch.figures());
        // Here up to ten limits bind at once, and take turns.
        assert!(watch.turns() <= 2 * TURNS_MAX, "{}", watch.figures());
    }
}

#[test]
fn what_a_foot_may_carry_vanishes_with_its_share_and_it_carries_no_more() {
    let mut body = body(|_| {});
    let weight_n = body.model().total_mass_kg() * body.model().gravity().norm();
    let plan = Walk::straight(1);
    let state = start(body.model(), body.settings(), &plan.reference(0.0));
    let margin = body.settings().constraints.load_margin;
    for share in [0.0, 1e-3, 0.1, 0.15, 0.3, 0.5] {
        let mut reference = plan.reference(0.0);
        // Planned is half of the weight on each foot: the limit is what keeps it from the left one.
        reference.feet[0].load_share = share;
        let report = body.step(&state, &reference, PERIOD_S);
        let most = (share + share.min(margin)) * weight_n;
        assert!((report.feet[0].load_max_n - most).abs() < 1e-9, "{share}: {} N", report.feet[0].load_max_n);
        assert!((report.feet[1].load_max_n - (0.5 + margin) * weight_n).abs() < 1e-9);
        let load = report.feet[0].wrench.force.z;
        assert!(load < most + 1e-6, "{share}: {load} N of {most} N");
        assert!(most > 0.4 * weight_n || load > most - 1e-6, "{share}: it carries what it may: {load} N of {most} N");
    }
}
