//! The whole chain in one thread, on the scenarios that ship.

use closed_loop::{ClosedLoop, Tick};
use messages::Plain;
use messages::code::{Mode, Outcome, Reason};
use scenario::{Scenario, Setting};
use std::path::Path;

fn scenario(name: &str, settings: &[&str]) -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios").join(name);
    let settings: Vec<Setting> = settings.iter().map(|text| text.parse().expect("a setting")).collect();
    Scenario::load(&path, &settings).expect("the scenarios that ship can be loaded")
}

/// Walks to the end, showing every tick to `see`.
fn walk(name: &str, settings: &[&str], mut see: impl FnMut(&Tick)) -> ClosedLoop {
    let mut run = ClosedLoop::new(&scenario(name, settings)).expect("the scenarios that ship can be built");
    while let Some(tick) = run.step().expect("the controller goes on") {
        see(&tick);
    }
    run
}

/// A hash of everything that was said at a tick, to the bit.
fn fold(mut hash: u64, tick: &Tick) -> u64 {
    let mut bytes = Vec::new();
    tick.state.write_bytes(&mut bytes);
    tick.truth.write_bytes(&mut bytes);
    tick.deformation.write_bytes(&mut bytes);
    tick.contact.write_bytes(&mut bytes);
    tick.command.write_bytes(&mut bytes);
    for byte in bytes {
        hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
    }
    hash
}

#[test]
fn eleven_swings_on_soft_soles_go_half_a_metre() {
    let weight_n = 39.0 * 9.81;
    let (mut ticks, mut carried, mut starts) = (0_u32, 0.0, 0);
    let run = walk("flat.toml", &[], |tick| {
        ticks += 1;
        starts += u32::from(tick.start.is_some());
        if tick.start.is_some() {
            // Standing still for half a second the soles are springs: half the wrench times the way and the turn that it has made.
            let by_spring = |foot: usize| {
                let (w, r) = (tick.truth.foot_wrench_n_nm[foot], tick.truth.sole_rotation[foot]);
                let (sink_m, roll_rad, pitch_rad) = (tick.truth.sole_position_m[foot][2], r[7], -r[6]);
                -0.5 * (w[2] * sink_m + w[3] * roll_rad + w[4] * pitch_rad)
            };
            let spring_j = by_spring(0) + by_spring(1);
            // What the feet push sideways against each other is left out.
            let part = tick.truth.elastic_energy_j / spring_j;
            assert!(spring_j > 0.05 && (part - 1.0).abs() < 0.02, "{} J of {spring_j}", tick.truth.elastic_energy_j);
        }
        carried += tick.truth.foot_wrench_n_nm[0][2] + tick.truth.foot_wrench_n_nm[1][2];
        assert_eq!(tick.command.status, Outcome::Solved.code(), "tick {}", tick.state.header.tick);
        for foot in &tick.deformation.feet {
            assert_eq!(foot.age_ticks, 0, "tick {}", tick.state.header.tick);
            assert!(foot.residual < 1e-8);
        }
        // What the soles carry is what moves the robot: Newton's law for the whole body, from contact to acceleration.
        let vertical = tick.truth.foot_wrench_n_nm[0][2] + tick.truth.foot_wrench_n_nm[1][2];
        let needed = 39.0 * (tick.truth.com_acceleration_m_per_s2[2] + 9.81);
        assert!((vertical - needed).abs() < 1e-3 * weight_n, "{vertical} N carried, {needed} N needed");
    });
    assert_eq!(run.over(), Some(Reason::Finished));
    assert_eq!(starts, 1);
    let figures = run.figures();
    assert!((figures.distance_m.expect("truth") - 0.5).abs() < 0.01, "walked {} m", figures.distance_m.expect("truth"));
    // The sole gives way by millimetres where the estimator expects it: what remains is small against a foot's half width.
    assert!(
        figures.com_error_max_m.expect("truth") < 0.02,
        "centre of mass off by {} m",
        figures.com_error_max_m.expect("truth")
    );
    assert_eq!(figures.periods_unconverged, 0);
    let mean_n = carried / f64::from(ticks);
    assert!((mean_n - weight_n).abs() < 0.005 * weight_n, "{mean_n} N carried on average");
}

#[test]
fn a_walk_a_kilometre_away_is_the_walk_at_the_origin() {
    let offset_m = [800.0, -600.0];
    let near = ["planner.gait.walk.swings=3"];
    let far = [near[0], "planner.gait.start.x_m=800.0", "planner.gait.start.y_m=-600.0"];
    let commands = |settings: &[&str]| {
        let mut commands = Vec::new();
        let run = walk("flat.toml", settings, |tick| {
            assert_eq!(tick.command.status, Outcome::Solved.code(), "tick {}", tick.state.header.tick);
            assert!(tick.deformation.feet.iter().all(|foot| foot.age_ticks == 0));
            commands.push((tick.command, tick.truth));
        });
        assert_eq!((run.over(), run.figures().periods_unconverged), (Some(Reason::Finished), 0));
        commands
    };
    let (near, far) = (commands(&near), commands(&far));
    assert_eq!(near.len(), far.len());
    let (mut torque_nm, mut com_m) = (0.0_f64, 0.0_f64);
    for ((command, truth), (far_command, far_truth)) in near.iter().zip(&far) {
        for (a, b) in command.feed_forward_torque_nm.iter().zip(&far_command.feed_forward_torque_nm) {
            torque_nm = torque_nm.max((a - b).abs());
        }
        for (axis, offset_m) in offset_m.iter().enumerate() {
            let moved = far_truth.com_position_m[axis] - offset_m;
            com_m = com_m.max((moved - truth.com_position_m[axis]).abs());
        }
    }
    // A position has 1e-13 m of digits there; a robot that walks in closed loop makes some of it. Measured: 8e-9 N m, 9e-9 m.
    assert!(torque_nm < 1e-7, "torques differ by {torque_nm} N m");
    assert!(com_m < 1e-7, "the COM by {com_m} m");
}

#[test]
fn the_estimator_keeps_the_robot_upright_where_rigid_geometry_lets_it_fall() {
    // No stabiliser: the plan meets the soft sole alone, as in the paper's figure 10.
    let alone = ["simulator.plant.stabiliser.enabled=false"];
    let with = walk("flat.toml", &alone, |_| {});
    assert_eq!(with.over(), Some(Reason::Finished));
    let without = walk("no-estimator.toml", &alone, |_| {});
    assert_eq!(without.over(), Some(Reason::Fallen));
}

#[test]
fn the_same_scenario_twice_gives_the_same_bits() {
    let short = ["planner.gait.walk.swings=2"];
    let run = || {
        let mut hash = 0xcbf2_9ce4_8422_2325;
        let end = walk("flat.toml", &short, |tick| hash = fold(hash, tick));
        (end.over(), hash)
    };
    assert_eq!(run(), run());
}

#[test]
fn the_walk_is_over_when_the_controller_says_so() {
    let mut modes = Vec::new();
    let run = walk("flat.toml", &["planner.gait.walk.swings=1"], |tick| {
        if modes.last() != Some(&tick.command.mode) {
            modes.push(tick.command.mode);
        }
    });
    assert_eq!(run.over(), Some(Reason::Finished));
    assert_eq!(modes, [Mode::Standing, Mode::Walking, Mode::Finished].map(Mode::code));
}

#[test]
fn a_gait_that_cannot_be_is_refused_with_step_and_number() {
    let error = |setting: &str| {
        let built = ClosedLoop::new(&scenario("flat.toml", &[setting]));
        format!("{:#}", built.err().expect("such a walk is refused"))
    };
    let long = error("planner.gait.walk.step_length_m=0.5");
    assert!(long.contains("0.3") && long.contains("step"), "{long}");
    let narrow = error("planner.gait.start.ankle_distance_m=0.1");
    assert!(narrow.contains("0.03"), "{narrow}");
    let unknown = error("planner.gait.walk.stride_m=0.1");
    assert!(unknown.contains("stride_m"), "{unknown}");
}

#[test]
fn a_foot_of_another_size_is_refused() {
    let built = ClosedLoop::new(&scenario("flat.toml", &["planner.gait.sole.length_m=0.3"]));
    let error = format!("{:#}", built.err().expect("planner and robot disagree"));
    assert!(error.contains("sole.length_m") && error.contains("0.23"), "{error}");
}
