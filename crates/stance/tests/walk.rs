//! The walk that ships, on its soles.

use gait::GaitSettings;
use pattern::{PhaseKind, SHIFT_INTERVALS, SHIFT_KNOTS, Side, WalkPattern};
use sole::{EstimatorSettings, SoleModel, SoleSettings, StanceEstimator, Status};
use spatial::so3;
use stance::{FootEstimate, Outcome, StanceSettings, WalkOnSoles, certify};

const PERIOD_S: f64 = 0.005;

/// Of the sole that ships (m).
const HALF_WIDTH_M: f64 = 0.065;

fn walk() -> WalkPattern {
    #[derive(serde::Deserialize)]
    struct File {
        gait: GaitSettings,
    }
    let text = include_str!("../../../config/planner.toml");
    let file: File = toml::from_str(text).expect("the configuration that ships can be read");
    gait::plan(&file.gait).expect("the walk that ships can be planned").pattern
}

fn soft() -> [Option<StanceEstimator>; 2] {
    let left = SoleModel::build(&SoleSettings::default()).expect("the default sole can be built");
    let right = left.mirrored();
    [left, right].map(|model| Some(StanceEstimator::new(model, EstimatorSettings::default())))
}

fn estimator(soles: [Option<StanceEstimator>; 2]) -> WalkOnSoles {
    WalkOnSoles::new(walk(), soles, &StanceSettings::default(), PERIOD_S)
}

fn ticks(pattern: &WalkPattern) -> i64 {
    (pattern.duration_s() / PERIOD_S).ceil() as i64
}

#[test]
fn every_tick_of_the_walk_carries_its_force_at_its_zmp() {
    let mut estimator = estimator(soft());
    let (mut sink, mut roll, mut pitch) = (0.0_f64, 0.0_f64, 0.0_f64);
    for tick in 0..=ticks(estimator.pattern()) {
        let feet = estimator.at_tick(tick, &[]);
        let reference = estimator.pattern().evaluate(tick as f64 * PERIOD_S);
        for (foot, planned) in feet.iter().zip(&reference.feet) {
            assert!(!matches!(foot.outcome, Outcome::Held(_)), "tick {tick}: {:?}", foot.outcome);
            if !foot.loaded {
                continue;
            }
            let force = foot.wrench.force;
            assert!((force - planned.force).norm() <= 1e-8 * planned.force.norm(), "tick {tick}");
            let about_zmp = foot.wrench.about(
                &(spatial::Vec3::new(planned.zmp.position.x, planned.zmp.position.y, 0.0) - foot.sole.translation),
            );
            assert!(about_zmp.moment.norm() <= 1e-8 * 0.1 * planned.force.norm(), "tick {tick}");
            sink = sink.max(-foot.sole.translation.z);
            let angles = so3::roll_pitch_yaw(&foot.sole.rotation);
            (roll, pitch) = (roll.max(angles.x.abs()), pitch.max(angles.y.abs()));
        }
    }
    // What is known of the original runs: sink 0.6-0.9 mm, roll up to 2.7 deg, pitch up to 0.6 deg; here the order of it.
    assert!((0.4e-3..2e-3).contains(&sink), "sink {sink} m");
    assert!(roll.to_degrees() < 5.0 && pitch.to_degrees() < 5.0, "roll {roll} rad, pitch {pitch} rad");
    assert!(roll.to_degrees() > 0.3, "roll {roll} rad");
}

#[test]
fn a_restart_in_mid_walk_agrees_to_the_bit() {
    let mut whole = estimator(soft());
    let all: Vec<[FootEstimate; 2]> = (0..=ticks(whole.pattern())).map(|tick| whole.at_tick(tick, &[])).collect();
    let mut restarted = estimator(soft());
    // Jumps forward and back, each into another part of the walk.
    for tick in [1500, 3, 900, 901, 902, 250, 2000] {
        assert_eq!(restarted.at_tick(tick, &[]), all[tick as usize], "tick {tick}");
    }
    // Ticks left out: a few within a stance, across touch-downs and lift-offs, and whole steps.
    for left_out in [1, 7, 90, 400] {
        for tick in (0..=ticks(restarted.pattern())).step_by(1 + left_out) {
            assert_eq!(restarted.at_tick(tick, &[]), all[tick as usize], "tick {tick}, {left_out} left out");
        }
    }
}

#[test]
fn ankles_are_continuous_and_their_velocities_are_the_derivatives() {
    let mut estimator = estimator(soft());
    let last = ticks(estimator.pattern());
    let mut before = estimator.at_tick(0, &[]);
    let mut jumps = 0;
    for tick in 1..=last {
        let now = estimator.at_tick(tick, &[]);
        for (a, b) in before.iter().zip(&now) {
            let moved = b.ankle.pose.translation - a.ankle.pose.translation;
            // Largest ankle speed of this walk is below 0.3 m/s: more would be a jump.
            assert!(moved.norm() < 0.3 * PERIOD_S, "tick {tick} moved {} m", moved.norm());
            let mean = 0.5 * (a.ankle.twist.linear + b.ankle.twist.linear);
            jumps += usize::from((moved / PERIOD_S - mean).norm() > 0.02);
        }
        before = now;
    }
    // Nodes that change state make the velocity jump; the trapezoidal rule sees that at few ticks.
    assert!(jumps * 20 < last as usize, "{jumps} of {last} ticks");
}

#[test]
fn a_rigid_sole_leaves_the_ankles_at_their_footholds() {
    let mut estimator = estimator([None, None]);
    for tick in 0..=ticks(estimator.pattern()) {
        let feet = estimator.at_tick(tick, &[]);
        let reference = estimator.pattern().evaluate(tick as f64 * PERIOD_S);
        for (foot, planned) in feet.iter().zip(&reference.feet).filter(|(foot, _)| foot.loaded) {
            assert_eq!(foot.ankle.pose, estimator.pattern().ankle_pose(&planned.ankle_foothold));
        }
    }
}

/// The walk with a body that adds up to `outward_m` in the middle of its second single support, away from the other foot: a bump of
/// `sin^2`. Also when that support begins and ends (s), and its foot.
fn pushed_outward(outward_m: f64) -> (WalkPattern, [f64; 2], Side) {
    let mut walk = walk();
    let singles = walk.phases.iter().enumerate().filter(|(_, phase)| phase.kind == PhaseKind::SingleSupport);
    let (index, foot_in_air) =
        singles.map(|(index, phase)| (index, phase.foot_1)).nth(2).expect("a walk of several steps");
    let phase = &mut walk.phases[index];
    let (start_s, duration_s) = (phase.start_s, phase.duration_s);
    let (foot, outward_m) = match foot_in_air {
        Side::Right => (Side::Left, outward_m),
        Side::Left => (Side::Right, -outward_m),
    };
    for knot in 0..SHIFT_KNOTS {
        let rate = std::f64::consts::PI / duration_s;
        let (sin, cos) = (std::f64::consts::TAU * knot as f64 / SHIFT_INTERVALS as f64).sin_cos();
        let bump = [0.5 * (1.0 - cos), rate * sin, 2.0 * rate * rate * cos];
        phase.zmp_shift.0[1][knot] = bump.map(|value| outward_m * value);
    }
    (walk, [start_s, start_s + duration_s], foot)
}

/// What the body adds is checked on the sole as the plan's own ZMP is: it is refused with time and foot before the edge is reached, where the
/// sole folds, and beyond it by name.
#[test]
fn a_shift_that_a_sole_cannot_carry_is_refused_with_time_and_foot() {
    let (mut carried, mut tilts) = (Vec::new(), Vec::new());
    for outward_mm in [0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 60.0, 80.0, 120.0] {
        let (walk, [start_s, end_s], foot) = pushed_outward(1e-3 * outward_mm);
        let middle = walk.evaluate(0.5 * (start_s + end_s)).feet[usize::from(foot == Side::Right)];
        let planned_m = (middle.zmp.position.y - middle.sole_foothold.y_m).abs();
        let mut feet = WalkOnSoles::new(walk, soft(), &StanceSettings::default(), PERIOD_S);
        match certify(&mut feet) {
            Ok(found) => {
                carried.push(outward_mm);
                tilts.push(found.tilt_rad.value);
            }
            Err(refused) => {
                assert_eq!(refused.foot, foot, "{outward_mm} mm: {refused:?}");
                assert!((start_s..end_s).contains(&refused.time_s), "{outward_mm} mm: {refused:?}");
                if 1e-3 * outward_mm - planned_m > HALF_WIDTH_M {
                    let outside = matches!(refused.status, Status::ZmpOutsideSole { .. } | Status::Fold { .. });
                    assert!(outside, "{outward_mm} mm: {refused:?}");
                }
            }
        }
    }
    // A centimetre more is carried, at a larger tilt; no ZMP outside of the sole ever is.
    assert!(carried.contains(&10.0) && !carried.contains(&120.0), "{carried:?}");
    assert!(carried.is_sorted() && tilts.is_sorted(), "{carried:?} {tilts:?}");
}
