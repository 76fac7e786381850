//! The controller's own feedback on the simulated robot: internal state blended with what is measured, feet that give way as their soles do.

use closed_loop::{ClosedLoop, Tick};
use messages::code::{Outcome, Reason};
use messages::{Plain, RobotState};
use report::WalkFigures;
use scenario::{Scenario, Setting};
use state::Refused;
use std::path::Path;

const SHORT: &str = "planner.gait.walk.swings=3";
/// 60 N sideways for 0.1 s in the third swing.
const PUSH: &str = "simulator.plant.pushes=[{link='torso', point_in_link_m=[0.0, 0.0, 0.1], force_n=[0.0, 60.0, 0.0], \
                    start_s=3.0, duration_s=0.1}]";

fn built(name: &str, settings: &[&str]) -> ClosedLoop {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios").join(name);
    let settings: Vec<Setting> = settings.iter().map(|text| text.parse().expect("a setting")).collect();
    let scenario = Scenario::load(&path, &settings).expect("the scenarios that ship can be loaded");
    ClosedLoop::new(&scenario).expect("it can be built")
}

/// Walks to the end with sensors that fail as told.
fn walk(mut run: ClosedLoop, mut fault: impl FnMut(&mut RobotState), mut see: impl FnMut(&Tick)) -> ClosedLoop {
    while let Some(tick) = run.step_measuring(&mut fault).expect("the controller goes on") {
        see(&tick);
    }
    run
}

/// Walks to the end, all steps solved, all measurements used.
fn walked(name: &str, settings: &[&str]) -> WalkFigures {
    let run = walk(
        built(name, settings),
        |_| {},
        |tick| assert_eq!(tick.command.status, Outcome::Solved.code(), "tick {}", tick.state.header.tick),
    );
    assert_eq!(run.over(), Some(Reason::Finished));
    assert_eq!(run.controller().summary().measurements_refused, 0);
    run.figures()
}

/// A hash of all commands, to the bit.
fn commands(run: ClosedLoop, fault: impl FnMut(&mut RobotState)) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    walk(run, fault, |tick| {
        let mut bytes = Vec::new();
        tick.command.write_bytes(&mut bytes);
        for byte in bytes {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    });
    hash
}

/// Where the estimator's soles are the real ones, the plan alone is as good; what feedback is for is a foam misjudged.
#[test]
fn feedback_keeps_a_misjudged_foam_nearer_to_the_plan() {
    let stiffer = [SHORT, "simulator.sole.young_modulus_factor=1.2"];
    let open = walked("no-stabiliser.toml", &stiffer);
    let closed = walked("feedback.toml", &stiffer);
    assert!(closed.com_error_max_m.expect("truth") < 0.6 * open.com_error_max_m.expect("truth"), "{closed:?} {open:?}");
    assert!(closed.zmp_error_rms_m.expect("truth") < 0.5 * open.zmp_error_rms_m.expect("truth"), "{closed:?} {open:?}");
    assert!((closed.distance_m.expect("truth") - 0.1).abs() < 0.005, "walked {} m", closed.distance_m.expect("truth"));
}

#[test]
fn a_push_that_fells_the_plan_alone_does_not_fell_feedback() {
    let settings = ["planner.gait.walk.swings=4", PUSH];
    let open = walk(built("no-stabiliser.toml", &settings), |_| {}, |_| {});
    assert_eq!(open.over(), Some(Reason::Fallen));
    let closed = walked("feedback.toml", &settings);
    assert!(closed.com_error_max_m.expect("truth") > 0.01, "it was pushed: {closed:?}");
}

#[test]
fn noise_a_delay_of_20_ms_and_a_unit_that_faces_backwards_cost_millimetres() {
    let exact = walked("feedback.toml", &[SHORT]);
    let noisy = walked(
        "feedback.toml",
        &[
            SHORT,
            "simulator.plant.sensors.orientation_noise_rad=1e-3",
            "simulator.plant.sensors.gyro_noise_rad_per_s=5e-3",
            "simulator.plant.sensors.gyro_bias_rad_per_s=[0.01, -0.01, 0.01]",
            "simulator.plant.sensors.joint_noise_rad=1e-4",
            "simulator.plant.sensors.joint_rate_noise_rad_per_s=0.01",
            "simulator.plant.sensors.orientation_bias_rad=[0.0, 0.0, 3.14159]",
            "simulator.plant.sensors.delay_ticks=4",
            "controller.integration.measurement_delay_ticks=4",
        ],
    );
    assert!(
        noisy.com_error_max_m.expect("truth") < exact.com_error_max_m.expect("truth") + 0.003,
        "{noisy:?} {exact:?}"
    );
}

#[test]
fn feedback_twice_gives_the_same_bits_and_without_usable_measurements_and_yielding_soles_it_is_open_loop() {
    let short = "planner.gait.walk.swings=1";
    let feedback = ["controller.integration.mode=feedback", short];
    let [once, twice] = [0, 1].map(|_| commands(built("flat.toml", &feedback), |_| {}));
    assert_eq!(once, twice);
    let stiff = [feedback[0], short, "controller.integration.compliance_feed_forward=0.0"];
    let blind = commands(built("flat.toml", &stiff), |state| state.fault_bits = 1);
    let open = commands(built("flat.toml", &[short]), |_| {});
    assert_eq!(blind, open);
    assert_ne!(once, open);
}

#[test]
fn measurements_that_fail_in_mid_walk_are_counted_with_their_reason_and_the_walk_goes_on() {
    type Fault = fn(&mut RobotState);
    // Each for a fifth of a second, from this walk time on.
    let faults: [(f64, Fault, Refused); 4] = [
        (1.0, |state| state.joint_position_rad[7] = f64::NAN, Refused::NotFinite),
        (1.6, |state| state.imu_orientation_xyzw = [0.0; 4], Refused::Orientation),
        (2.2, |state| state.joint_velocity_rad_per_s = [1e3; messages::MAX_JOINTS], Refused::Joint),
        (2.8, |state| state.imu_orientation_xyzw = [1.0, 0.0, 0.0, 0.0], Refused::Distance),
    ];
    let lasting_ticks = 40;
    let mut run = built("feedback.toml", &[SHORT]);
    let (mut zero, mut spoilt) = (i64::MAX, 0);
    loop {
        let mut at_work = None;
        let tick = run.step_measuring(|state| {
            let tick = state.header.tick;
            for (from_s, fault, reason) in &faults {
                let first = zero.saturating_add((from_s / 0.005) as i64);
                if (first..first.saturating_add(lasting_ticks)).contains(&tick) {
                    fault(state);
                    (at_work, spoilt) = (Some(*reason), spoilt + 1);
                }
            }
        });
        let Some(tick) = tick.expect("the controller goes on") else { break };
        zero = tick.start.map_or(zero, |start| start.tick_zero);
        assert_eq!(tick.command.status, Outcome::Solved.code(), "tick {}", tick.state.header.tick);
        let summary = run.controller().summary();
        assert_eq!(summary.measurements_refused, spoilt, "tick {}", tick.state.header.tick);
        if let Some(reason) = at_work {
            assert_eq!(summary.last_refused, Some(reason));
        }
    }
    assert_eq!(run.over(), Some(Reason::Finished));
    assert_eq!(spoilt, 4 * lasting_ticks as u64);
    let figures = run.figures();
    assert!(figures.com_error_max_m.expect("truth") < 0.02, "{figures:?}");
}
