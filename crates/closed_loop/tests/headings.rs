//! Where a walk begins, which way it faces and whether it turns.

use closed_loop::{ClosedLoop, Tick};
use messages::Truth;
use messages::code::{Outcome, Reason};
use scenario::{Scenario, Setting};
use std::f64::consts::TAU;
use std::path::Path;

/// Walks to the end, showing every tick to `see`.
fn walk(name: &str, settings: &[&str], mut see: impl FnMut(&Tick)) -> ClosedLoop {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios").join(name);
    let settings: Vec<Setting> = settings.iter().map(|text| text.parse().expect("a setting")).collect();
    let scenario = Scenario::load(&path, &settings).expect("the scenarios that ship can be loaded");
    let mut run = ClosedLoop::new(&scenario).expect("it can be built");
    while let Some(tick) = run.step().expect("the controller goes on") {
        see(&tick);
    }
    assert_eq!(run.over(), Some(Reason::Finished));
    run
}

/// Heading of a rotation, row-major (rad).
fn yaw_rad(rotation: &[f64; 9]) -> f64 {
    rotation[3].atan2(rotation[0])
}

/// The same turn between minus and plus half a round.
fn short_way(turn_rad: f64) -> f64 {
    turn_rad - TAU * (turn_rad / TAU).round()
}

#[test]
fn a_walk_that_begins_elsewhere_and_faces_elsewhere_is_the_same_walk() {
    /// Contact problems are solved to 1e-9 of the load, which sinks a foot by a millimetre: 1e-12 m at every step, which the closed loop
    /// carries on. Measured: 7e-12 m, 1.1e-11 rad and, by the drives' stiffness, 6.5e-6 N m. A processor that sums in another order
    /// rounds otherwise, so a hundred times these and more are left; an error of a frame would be millimetres.
    const APART_MAX_M: f64 = 1e-8;
    const APART_MAX_RAD: f64 = 1e-8;
    const APART_MAX_NM: f64 = 1e-3;
    const YAW_RAD: f64 = 2.1;
    const START_M: [f64; 2] = [3.0, -2.0];
    let start = [
        format!("planner.gait.start.yaw_rad={YAW_RAD}"),
        "planner.gait.start.x_m=3.0".into(),
        "planner.gait.start.y_m=-2.0".into(),
    ];
    let gather = |settings: &[&str]| {
        let mut truths: Vec<Truth> = Vec::new();
        let run =
            walk("flat.toml", &[&["planner.gait.walk.swings=3"], settings].concat(), |tick| truths.push(tick.truth));
        (truths, run.figures())
    };
    let (here, figures) = gather(&[]);
    let (there, figures_there) = gather(&start.each_ref().map(|text| text.as_str()));
    assert_eq!(here.len(), there.len());
    let (sin, cos) = YAW_RAD.sin_cos();
    let moved = |p: [f64; 3]| [START_M[0] + cos * p[0] - sin * p[1], START_M[1] + sin * p[0] + cos * p[1], p[2]];
    let largest = |differences: &mut dyn Iterator<Item = f64>| differences.fold(0.0, |a: f64, b| a.max(b.abs()));
    let (mut apart_m, mut apart_nm, mut turned_rad) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (a, b) in here.iter().zip(&there) {
        for (p, q) in [(a.com_position_m, b.com_position_m), (a.sole_position_m[0], b.sole_position_m[0])] {
            apart_m = apart_m.max(largest(&mut moved(p).iter().zip(q).map(|(p, q)| p - q)));
        }
        apart_nm = apart_nm.max(largest(&mut a.joint_torque_nm.iter().zip(b.joint_torque_nm).map(|(a, b)| a - b)));
        let turned = short_way(yaw_rad(&b.base_rotation) - yaw_rad(&a.base_rotation) - YAW_RAD);
        turned_rad = turned_rad.max(turned.abs());
    }
    assert!(apart_m < APART_MAX_M, "{apart_m:e} m");
    assert!(apart_nm < APART_MAX_NM, "{apart_nm:e} N m");
    assert!(turned_rad < APART_MAX_RAD, "{turned_rad:e} rad");
    // What is reported of both is the same, too.
    for (a, b) in [
        (figures.distance_m.expect("truth"), figures_there.distance_m.expect("truth")),
        (figures.com_error_max_m.expect("truth"), figures_there.com_error_max_m.expect("truth")),
        (figures.zmp_error_rms_m.expect("truth"), figures_there.zmp_error_rms_m.expect("truth")),
        (figures.base_tilt_max_rad.expect("truth"), figures_there.base_tilt_max_rad.expect("truth")),
    ] {
        assert!((a - b).abs() < APART_MAX_M, "{a} {b}");
    }
}

#[test]
fn around_a_circle_the_body_turns_with_the_feet() {
    let (mut turned_rad, mut last_rad) = (0.0, None);
    let (mut behind_rad, mut plan_error_rad) = (0.0_f64, 0.0_f64);
    let run = walk("circle.toml", &[], |tick| {
        assert_eq!(tick.command.status, Outcome::Solved.code(), "tick {}", tick.state.header.tick);
        let now_rad = yaw_rad(&tick.truth.base_rotation);
        turned_rad += short_way(now_rad - last_rad.unwrap_or(now_rad));
        last_rad = Some(now_rad);
        if tick.truth.sole_position_m.iter().all(|sole| sole[2] < 1e-3) {
            let [left, right] = tick.truth.sole_rotation.each_ref().map(yaw_rad);
            let between = left + 0.5 * short_way(right - left);
            behind_rad = behind_rad.max(short_way(now_rad - between).abs());
        }
        let planned_rad = yaw_rad(&tick.command.plan.base_rotation);
        plan_error_rad = plan_error_rad.max(short_way(planned_rad - now_rad).abs());
    });
    let figures = run.figures();
    // Steps of 0.05 m on 0.4 m; the last swing only closes. Soles creep a little.
    assert!((turned_rad - 23.0 * 0.05 / 0.4).abs() < 0.02, "turned by {turned_rad} rad");
    assert!(behind_rad < 0.005, "{behind_rad} rad away from between the feet");
    assert!(plan_error_rad < 0.01, "{plan_error_rad} rad away from the plan");
    assert!(
        figures.com_error_max_m.expect("truth") < 0.01,
        "centre of mass off by {} m",
        figures.com_error_max_m.expect("truth")
    );
    assert!(figures.zmp_error_max_m.expect("truth") < 0.03, "ZMP off by {} m", figures.zmp_error_max_m.expect("truth"));
    assert_eq!(figures.periods_unconverged, 0);
}
