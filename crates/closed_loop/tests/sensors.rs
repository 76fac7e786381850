//! Walks with what real sensors have: noise and biases.

use closed_loop::ClosedLoop;
use messages::code::{Outcome, Reason};
use report::WalkFigures;
use scenario::{Scenario, Setting};
use std::path::Path;

/// Three swings with sensors as told; an error says why the walk was not walked.
fn walk(sensors: &[&str]) -> anyhow::Result<WalkFigures> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/flat.toml");
    let short = "planner.gait.walk.swings=3".to_string();
    let sensors = sensors.iter().map(|text| format!("simulator.plant.sensors.{text}"));
    let settings: Vec<Setting> = sensors.chain([short]).map(|text| text.parse().expect("a setting")).collect();
    let scenario = Scenario::load(&path, &settings).expect("the scenarios that ship can be loaded");
    let mut run = ClosedLoop::new(&scenario).expect("it can be built");
    while let Some(tick) = run.step()? {
        assert_eq!(tick.command.status, Outcome::Solved.code(), "tick {}", tick.state.header.tick);
    }
    assert_eq!(run.over(), Some(Reason::Finished));
    let figures = run.figures();
    assert!(
        (figures.distance_m.expect("truth") - 0.1).abs() < 0.005,
        "walked {} m",
        figures.distance_m.expect("truth")
    );
    Ok(figures)
}

#[test]
fn a_walk_with_noisy_sensors_goes_as_well_as_one_without() {
    let com_rms_m = |sensors: &[&str]| walk(sensors).expect("it walks").com_error_rms_m.expect("truth");
    let noisy_m = ["seed=1", "seed=2", "seed=3", "seed=4"].map(|seed| {
        com_rms_m(&[
            seed,
            "orientation_noise_rad=1e-3",
            "gyro_noise_rad_per_s=5e-3",
            "joint_noise_rad=1e-4",
            "joint_rate_noise_rad_per_s=0.01",
            "foot_force_noise_n=2",
        ])
    });
    let exact_m = com_rms_m(&[]);
    // In the mean: noise decides when the robot counts as standing, and one walk in four is half as far off again for it.
    let mean_m = noisy_m.iter().sum::<f64>() / 4.0;
    assert!(mean_m < 1.5 * exact_m, "{noisy_m:?} m with noise, {exact_m} m without");
}

#[test]
fn a_walk_with_a_biased_gyro_or_force_sensor_is_walked() {
    // 0.01 rad/s, taken for a turn about the ankles, are 7 mm/s of the centre of mass: 2 mm of its divergent component.
    let gyro = walk(&["gyro_bias_rad_per_s=[0.01, 0, 0]"]).expect("it walks");
    assert!(
        gyro.com_error_max_m.expect("truth") < 0.01,
        "centre of mass off by {} m",
        gyro.com_error_max_m.expect("truth")
    );
    // 15 N, a twelfth of what a foot carries, lean the robot by at most 15 N / 390 N of the 0.16 m between the feet: 6 mm.
    let force = walk(&["foot_force_bias_n=[[0, 0, 15], [0, 0, 0]]"]).expect("it walks");
    assert!(
        force.com_error_max_m.expect("truth") < 0.01,
        "centre of mass off by {} m",
        force.com_error_max_m.expect("truth")
    );
}

#[test]
fn a_robot_that_does_not_settle_says_what_is_in_the_way() {
    let error = walk(&["foot_force_bias_n=[[0, 0, 60], [0, 0, 0]]"]).expect_err("a sixth of the weight is too much");
    let error = format!("{error:#}");
    for said in ["controller", "not still for 0.5 s within 10 s", "share of the load", "settle.load_share_error_max"] {
        assert!(error.contains(said), "no `{said}` in {error}");
    }
}
