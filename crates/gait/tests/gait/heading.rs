//! Where the body faces.

use gait::{GaitSettings, Walk};
use pattern::{Scalar, WalkPattern};

fn walk(walk: Walk, yaw_rad: f64) -> WalkPattern {
    let mut gait = GaitSettings { walk, ..GaitSettings::default() };
    gait.start.yaw_rad = yaw_rad;
    gait::plan(&gait).expect("a feasible walk").pattern
}

fn headings(walk: &WalkPattern) -> Vec<Scalar> {
    let ticks = (walk.duration_s() / PERIOD_S) as usize;
    (0..=ticks).map(|tick| walk.evaluate(tick as f64 * PERIOD_S).body_heading()).collect()
}

const PERIOD_S: f64 = 1e-3;

#[test]
fn on_a_circle_the_body_turns_with_the_feet_and_its_derivatives_are_those_of_its_heading() {
    // 0.05 m on a radius of 0.4 m are an eighth of a radian; the last swing only closes.
    let circle = walk(Walk::Circle { swings: 6, step_length_m: 0.05, radius_m: 0.4 }, 0.0);
    let all = headings(&circle);
    assert_eq!(all[0].value, 0.0);
    let last = circle.evaluate(circle.duration_s());
    let [left, right] = last.feet.map(|foot| foot.ankle_foothold.yaw_rad);
    assert!((left - right).abs() < 1e-12 && left > 0.5, "the feet have turned: {left} {right}");
    assert!((all.last().expect("there are some").value - left).abs() < 1e-12);
    let (mut rate_max, mut acceleration_max) = (0.0_f64, 0.0_f64);
    for three in all.windows(3) {
        let [a, b, c] = [three[0], three[1], three[2]];
        let rate = (c.value - a.value) / (2.0 * PERIOD_S);
        let acceleration = (c.rate - a.rate) / (2.0 * PERIOD_S);
        // Central differences: h^2/6 of a third derivative of at most 60 turn / T^3 = 15 rad/s^3, and its jump where a swing ends.
        assert!((rate - b.rate).abs() < 1e-5, "{rate} {}", b.rate);
        assert!((acceleration - b.acceleration).abs() < 15.0 * PERIOD_S, "{acceleration} {}", b.acceleration);
        (rate_max, acceleration_max) = (rate_max.max(b.rate.abs()), acceleration_max.max(b.acceleration.abs()));
    }
    assert!(rate_max > 0.1 && acceleration_max > 0.3, "it turns: {rate_max} rad/s, {acceleration_max} rad/s^2");
}

#[test]
fn a_turned_start_turns_the_heading_and_nothing_else() {
    let circle = || Walk::Circle { swings: 4, step_length_m: 0.05, radius_m: 0.4 };
    // Beyond half a round the planner may say the same heading in another way.
    for yaw_rad in [2.1, 3.1, -3.1, 7.0] {
        for (here, there) in headings(&walk(circle(), 0.0)).iter().zip(headings(&walk(circle(), yaw_rad))) {
            assert!(short_way(there.value - here.value - yaw_rad).abs() < 1e-9);
            assert!((there.rate - here.rate).abs() < 1e-9);
        }
    }
}

/// The same turn, at most half a round.
fn short_way(turn_rad: f64) -> f64 {
    turn_rad.sin().atan2(turn_rad.cos())
}
