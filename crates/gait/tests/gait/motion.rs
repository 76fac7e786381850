//! The references as functions of time.

use crate::support::{BETWEEN_SAMPLES_M, planned, straight};
use gait::{GaitSettings, Walk, ankle_pose, plan};
use nalgebra::Vector2;
use pattern::{PhaseKind, Reference, WalkPattern};

fn walks() -> Vec<WalkPattern> {
    let turning =
        GaitSettings { walk: Walk::Circle { swings: 6, step_length_m: 0.1, radius_m: 0.8 }, ..GaitSettings::default() };
    [straight(4), turning].iter().map(|settings| plan(settings).expect("feasible").pattern).collect()
}

#[test]
fn the_default_walk_is_the_papers_slow_one() {
    let plan = planned("default", &GaitSettings::default(), BETWEEN_SAMPLES_M);
    assert_eq!(plan.pattern.phases.len(), 34, "m = 3 n + 4 with n = 10");
    assert!((plan.pattern.duration_s() - 14.42).abs() < 1e-12);
    for (q, (_, landing)) in (1..).zip(&plan.landings) {
        assert!((landing.x_m - 0.05 * f64::from(q.min(10))).abs() < 1e-15);
    }
    let end = plan.pattern.evaluate(100.0);
    assert!((end.com.position - Vector2::new(0.5, 0.0)).amax() < 1e-12);
    assert!(end.com.acceleration.amax() < 1e-9 && end.com.velocity.amax() < 1e-9);
    assert!((end.feet[0].share.value - 0.5).abs() < 1e-12);
    // Plausible beside the robot's own run: 0.22 m/s and 0.49 m/s^2 sideways.
    let fastest = samples(&plan.pattern).map(|r| r.com.velocity.y.abs()).fold(0.0, f64::max);
    let hardest = samples(&plan.pattern).map(|r| r.com.acceleration.y.abs()).fold(0.0, f64::max);
    assert!((0.1..0.3).contains(&fastest) && (0.2..1.0).contains(&hardest), "{fastest} m/s, {hardest} m/s^2");
}

fn samples(pattern: &WalkPattern) -> impl Iterator<Item = Reference> + '_ {
    (0..=(pattern.duration_s() / 0.005) as u32).map(|i| pattern.evaluate(f64::from(i) * 0.005))
}

#[test]
fn every_derivative_is_the_derivative() {
    // Central differences over 2 h: error h^2/6 times a third derivative (up to 1e4 /s^3 in a ZMP that crosses a foot in 0.4 s).
    let h = 1e-5;
    for pattern in walks() {
        for (i, phase) in pattern.phases.iter().enumerate() {
            for j in 1..8 {
                let t = phase.duration_s * f64::from(j) / 8.0;
                let [before, now, after] = [t - h, t, t + h].map(|t| pattern.evaluate_phase(i, t));
                let close = |what: &str, b: Vector2<f64>, a: Vector2<f64>, rate: Vector2<f64>| {
                    let error = ((a - b) / (2.0 * h) - rate).amax();
                    let scale = 1.0 + rate.amax();
                    assert!(error < 1e-5 * scale, "{what} of phase {i} at {t}: off by {error:e} of {rate}");
                };
                let (b, n, a) = (&before.com, &now.com, &after.com);
                close("COM", b.position, a.position, n.velocity);
                close("COM velocity", b.velocity, a.velocity, n.acceleration);
                close("COM acceleration", b.acceleration, a.acceleration, n.jerk);
                close("COM jerk", b.jerk, a.jerk, n.snap);
                close("ZMP", before.zmp.position, after.zmp.position, now.zmp.velocity);
                close("ZMP velocity", before.zmp.velocity, after.zmp.velocity, now.zmp.acceleration);
                for foot in 0..2 {
                    let [b, n, a] = [&before.feet[foot], &now.feet[foot], &after.feet[foot]];
                    close("foot ZMP", b.zmp.position, a.zmp.position, n.zmp.velocity);
                    close("foot ZMP velocity", b.zmp.velocity, a.zmp.velocity, n.zmp.acceleration);
                    close("force", b.force.xy(), a.force.xy(), n.force_rate.xy());
                    close("force rate", b.force_rate.xy(), a.force_rate.xy(), n.force_acceleration.xy());
                    let z = |v: &spatial::Vec3| Vector2::new(v.z, 0.0);
                    close("load", z(&b.force), z(&a.force), z(&n.force_rate));
                    close("load rate", z(&b.force_rate), z(&a.force_rate), z(&n.force_acceleration));
                }
            }
        }
    }
}

#[test]
fn load_and_zmp_of_the_landing_foot_are_regular_at_both_ends() {
    for pattern in walks() {
        for (i, phase) in pattern.phases.iter().enumerate() {
            if phase.kind == PhaseKind::SingleSupport {
                continue;
            }
            let two = phase.foot_1.other().index();
            if phase.load.cancelled_power == 3 {
                let at = pattern.evaluate_phase(i, 0.0).feet[two];
                assert_eq!((at.share.value, at.share.rate, at.share.acceleration), (0.0, 0.0, 0.0));
                // Every instant after the landing, however early, continues what is said about the landing itself.
                for t in [1e-15, 1e-12, 1e-9, 1e-6] {
                    let soon = pattern.evaluate_phase(i, t).feet[two];
                    assert!((soon.zmp.position - at.zmp.position).amax() < 1e2 * t + 1e-13, "phase {i}, {t} s");
                    assert!((soon.zmp.velocity - at.zmp.velocity).amax() < 1e4 * t + 1e-11, "phase {i}, {t} s");
                    assert!((soon.zmp.acceleration - at.zmp.acceleration).amax() < 1e6 * t + 1e-9, "phase {i}, {t} s");
                }
            }
            if phase.kind == PhaseKind::Start && i > 0 || phase.kind == PhaseKind::DoubleSupport {
                let end = pattern.evaluate_phase(i, phase.duration_s);
                let share = end.feet[two].share;
                assert!(
                    (share.value - 1.0).abs() < 1e-12 && share.rate.abs() < 1e-11 && share.acceleration.abs() < 1e-9
                );
                assert!((end.feet[two].zmp.position - end.zmp.position).amax() < 1e-12);
                assert!((end.feet[two].zmp.velocity - end.zmp.velocity).amax() < 1e-10);
                assert!((end.feet[two].zmp.acceleration - end.zmp.acceleration).amax() < 1e-8);
            }
        }
    }
}

/// ZMP1 and ZMP2 are C2 wherever a foot stays loaded: inside start and stop, where a foot that carried everything becomes foot 1,
/// and where foot 2 has taken over.
#[test]
fn each_foots_own_zmp_goes_on_with_two_derivatives_at_every_joint() {
    for pattern in walks() {
        let (mut inner, mut changing) = (0, 0);
        for i in 1..pattern.phases.len() {
            let (before, after) = (pattern.evaluate_phase(i - 1, f64::INFINITY), pattern.evaluate_phase(i, 0.0));
            let same_part = before.kind == after.kind && before.kind != PhaseKind::SingleSupport;
            for (b, a) in before.feet.iter().zip(&after.feet).filter(|(b, a)| b.in_contact && a.in_contact) {
                if same_part {
                    inner += 1
                } else {
                    changing += 1
                }
                assert!((a.zmp.position - b.zmp.position).amax() < 1e-12, "joint {i}");
                assert!((a.zmp.velocity - b.zmp.velocity).amax() < 1e-10, "joint {i}");
                assert!((a.zmp.acceleration - b.zmp.acceleration).amax() < 1e-8, "joint {i}");
                let shares = [(a.share.value, b.share.value), (a.share.rate, b.share.rate)];
                assert!(shares.iter().all(|(a, b)| (a - b).abs() < 1e-11), "joint {i}: {shares:?}");
                assert!((a.share.acceleration - b.share.acceleration).abs() < 1e-9, "joint {i}");
            }
        }
        assert_eq!(inner, 4, "both feet, inside start and stop");
        assert_eq!(changing, pattern.phases.len() - 3, "the standing foot at all others");
    }
}

#[test]
fn start_and_stop_begin_and_end_over_the_ankles() {
    for pattern in walks() {
        for r in [pattern.evaluate(0.0), pattern.evaluate(pattern.duration_s())] {
            let mut middle = Vector2::zeros();
            for foot in &r.feet {
                assert!((foot.zmp.position - foot.ankle_foothold.position()).amax() < 1e-12);
                assert!(foot.zmp.velocity.amax() < 1e-10 && foot.zmp.acceleration.amax() < 1e-8);
                assert!((foot.share.value - 0.5).abs() < 1e-14);
                middle += 0.5 * foot.ankle_foothold.position();
            }
            assert!((r.com.position - middle).amax() < 1e-12 && (r.zmp.position - middle).amax() < 1e-12);
        }
    }
}

#[test]
fn forces_add_up_to_the_cart_tables() {
    for pattern in walks() {
        for r in samples(&pattern) {
            let sum = r.feet[0].force + r.feet[1].force;
            let weight = pattern.mass_kg * pattern.gravity_m_per_s2;
            assert!((sum.z - weight).abs() < 1e-10);
            assert!((sum.xy() - pattern.mass_kg * r.com.acceleration).amax() < 1e-10);
            assert!(r.feet.iter().all(|foot| foot.in_contact || foot.force.norm() == 0.0));
            assert!(r.feet.iter().all(|foot| (-1e-14..=1.0 + 1e-14).contains(&foot.share.value)));
        }
    }
}

#[test]
fn contact_times_and_footholds_tell_one_story() {
    for pattern in walks() {
        let mut before: Option<Reference> = None;
        for r in samples(&pattern) {
            for (i, foot) in r.feet.iter().enumerate() {
                if let Some(swing) = foot.swing {
                    assert!(swing.t_start_s <= r.t_s && r.t_s < swing.t_end_s);
                    assert_eq!(foot.contact_since_s, swing.t_end_s);
                    assert_eq!(foot.ankle_foothold, swing.to_foothold);
                    if let Some(b) = before.filter(|b| b.feet[i].in_contact) {
                        assert_eq!(b.feet[i].ankle_foothold, swing.from_foothold);
                    }
                } else {
                    assert!(foot.contact_since_s <= r.t_s);
                    let sole = pattern.sole_foothold(i, &foot.ankle_foothold);
                    assert_eq!(foot.sole_foothold, sole);
                    let (dx, dy) = (sole.x_m - foot.ankle_foothold.x_m, sole.y_m - foot.ankle_foothold.y_m);
                    let (sin, cos) = sole.yaw_rad.sin_cos();
                    let outward = if i == 0 { 0.011 } else { -0.011 };
                    assert!((cos * dx + sin * dy - 0.015).abs() < 1e-15);
                    assert!((cos * dy - sin * dx - outward).abs() < 1e-15);
                }
            }
            before = Some(r);
        }
    }
}

#[test]
fn the_swing_foot_leaves_and_lands_flat_and_clears_the_ground_by_the_apex() {
    for apex_m in [0.04, 0.07] {
        let mut settings = GaitSettings::default();
        settings.swing.apex_m = apex_m;
        let pattern = plan(&settings).expect("feasible").pattern;
        let mut highest = 0.0_f64;
        let mut before: Option<[spatial::Transform; 2]> = None;
        for r in samples(&pattern) {
            let poses = [0, 1].map(|foot| ankle_pose(&pattern, &r.feet[foot], r.t_s));
            for (foot, pose) in r.feet.iter().zip(&poses) {
                highest = highest.max(pose.translation.z);
                assert!(pose.translation.z >= pattern.ankle_height_m - 1e-12);
                if foot.in_contact {
                    let at = foot.ankle_foothold;
                    assert_eq!((pose.translation.x, pose.translation.y), (at.x_m, at.y_m));
                }
            }
            // 0.1 m in 0.8 s, by a quintic at most 1.9 times as fast as on average: no foot moves farther within 5 ms.
            if let Some(before) = before {
                for (a, b) in before.iter().zip(&poses) {
                    assert!((a.translation - b.translation).xy().norm() < 1.9 * 0.1 / 0.8 * 0.005, "at {} s", r.t_s);
                }
            }
            before = Some(poses);
        }
        assert!((highest - pattern.ankle_height_m - apex_m).abs() < 1e-4, "{highest}");
    }
}

/// A double support prepares the swing that follows it, the stop follows the last one.
#[test]
fn every_phase_knows_its_swing() {
    for pattern in walks() {
        let mut swing = 0;
        for (i, phase) in pattern.phases.iter().enumerate().rev() {
            if phase.kind == PhaseKind::SingleSupport {
                let landing = phase.feet[phase.foot_1.index()].ankle_foothold;
                let next = pattern.phases[i + 1].feet[phase.foot_1.index()].ankle_foothold;
                assert_eq!(landing, next);
                swing = phase.step;
            } else if phase.kind != PhaseKind::Stop {
                assert_eq!(phase.step, swing, "phase {i}");
                assert_eq!(pattern.phases[i + 1].foot_1, phase.foot_1, "phase {i}");
            }
        }
        assert_eq!(swing, 1);
    }
}

#[test]
fn a_plan_survives_being_written_and_read() {
    for pattern in walks() {
        let text = toml::to_string(&pattern).expect("serialisable");
        let read: WalkPattern = toml::from_str(&text).expect("readable");
        assert_eq!(read, pattern);
        assert_eq!(read.content_hash(), pattern.content_hash());
        let mut other = read.clone();
        other.phases[3].zmp[1].0[2] += 1e-12;
        assert_ne!(other.content_hash(), pattern.content_hash());
    }
}
