//! The simulator behind its messages: which command moves the robot when, what is said of it, and when the run is over. The robot falls
//! from two metres without touching anything, so that every number is known.
#![allow(non_snake_case)] // monogram notation

use messages::code::{Fall, Mode, Reason};
use messages::{CONTROL_PERIOD_S, Header, RobotCommand, Truth, WalkStart};
use multibody::{Configuration, Workspace, forward_kinematics};
use plant::disturbance::Push;
use robot::Robot;
use robot_model::walking_model;
use simulator::{SimulatorProcess, SimulatorSettings};
use spatial::{Mat3, Transform, Vec3, so3};
use std::path::Path;

const GRAVITY: f64 = 9.81;
const HEIGHT_M: f64 = 2.0;
const ONE: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
/// Rounding of sums over some hundred steps.
const ROUNDING: f64 = 1e-9;

/// Hard feet, which need no finite elements, and no stabiliser.
fn settings() -> SimulatorSettings {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/simulator.toml");
    let changes = ["sole.level=rigid", "plant.stabiliser.enabled=false"].map(|text| text.parse().expect("a setting"));
    scenario::load(&file, &changes).expect("it ships")
}

fn robot() -> Robot {
    Robot::load(&settings().robot).expect("it ships")
}

/// In the air at half-sitting, as a command that asks for it.
fn hovering(simulator: &SimulatorProcess) -> RobotCommand {
    let robot = robot();
    let joints = &robot.description.joints;
    let header = Header::new(-1, simulator.robot_fingerprint());
    let mut command = RobotCommand { header, joint_count: joints.len() as u32, ..RobotCommand::default() };
    for (reference, joint) in command.joint_position_reference_rad.iter_mut().zip(joints) {
        *reference = robot.description.half_sitting_rad(joint);
    }
    command.plan.base_rotation = ONE;
    command.plan.base_position_m = [0.3, -0.2, HEIGHT_M];
    command.plan.com_position_m = [0.3, -0.2, HEIGHT_M];
    for foot in &mut command.plan.feet {
        foot.ankle_rotation = ONE;
    }
    command
}

fn at(command: &RobotCommand, tick: i64) -> RobotCommand {
    RobotCommand { header: Header::new(tick, command.header.robot_fingerprint), ..*command }
}

fn start(tick_zero: i64) -> WalkStart {
    WalkStart { tick_zero, ..WalkStart::default() }
}

/// Placed, and the truth of tick 0.
fn placed(
    settings: SimulatorSettings,
    edit: impl FnOnce(&mut RobotCommand),
) -> (SimulatorProcess, RobotCommand, Truth) {
    let mut simulator = SimulatorProcess::new(settings).expect("it builds");
    let mut command = hovering(&simulator);
    edit(&mut command);
    let truth = simulator.place(&command).expect("a place").truth;
    (simulator, command, truth)
}

/// Index in the interface and position in the model of a joint that the scene moves.
const KNEE: &str = "L_KNEE_P";

fn knee() -> usize {
    robot().description.joints.iter().position(|joint| joint == KNEE).expect("HRP-4 has knees")
}

#[test]
fn what_is_said_of_a_robot_in_free_fall_is_mechanics() {
    let (mut simulator, command, first) = placed(settings(), |_| ());
    let mass_kg = simulator.plant().model().total_mass_kg();
    assert_eq!((first.header.tick, first.time_s, first.joint_count), (0, 0.0, 34));
    assert_eq!(first.base_position_m, command.plan.base_position_m);
    let mut last = first;
    for tick in 1..=40 {
        let output = simulator.advance();
        simulator.take_command(&at(&command, tick - 1));
        last = output.truth;
        let t_s = tick as f64 * CONTROL_PERIOD_S;
        assert_eq!((output.state.header.tick, last.header.tick), (tick, tick));
        assert_eq!(last.header.robot_fingerprint, simulator.robot_fingerprint());
        assert!(
            (last.time_s - t_s).abs() < ROUNDING && (last.com_velocity_m_per_s[2] + GRAVITY * t_s).abs() < ROUNDING
        );
        assert!((last.com_acceleration_m_per_s2[2] + GRAVITY).abs() < ROUNDING);
        assert!((last.linear_momentum_kg_m_per_s[2] + mass_kg * GRAVITY * t_s).abs() < mass_kg * ROUNDING);
        assert!((last.kinetic_energy_j - 0.5 * mass_kg * (GRAVITY * t_s).powi(2)).abs() < 1e-6);
        assert!(last.servo_work_j.abs() < 1e-6, "nothing holds anything: {} J", last.servo_work_j);
        assert!(output.state.accelerometer_m_per_s2.iter().all(|a| a.abs() < 1e-6), "weightless");
    }
    assert!(
        (last.potential_energy_j - first.potential_energy_j + last.kinetic_energy_j).abs()
            < 0.02 * last.kinetic_energy_j
    );
    // Joints that the scene locks are reported where they rest.
    let hand = robot().description.joints.iter().position(|joint| joint == "R_ELBOW_P").expect("an elbow");
    assert!((last.joint_position_rad[hand] + 30_f64.to_radians()).abs() < 1e-3);
}

#[test]
fn truth_and_state_agree_with_the_kinematics_of_the_robot() {
    // Shoved beside its centre of mass it turns about all axes.
    let mut settings = settings();
    settings.plant.pushes = vec![Push {
        link: "torso".to_owned(),
        point_in_link_m: [0.1, 0.15, 0.2],
        force_n: [80.0, 60.0, 20.0],
        duration_s: 0.05,
        ..Push::default()
    }];
    let (mut simulator, _, _) = placed(settings, |_| ());
    simulator.take_start(&start(3));
    let mut spin = Vec3::zeros();
    for tick in 1..=40 {
        let output = simulator.advance();
        let (truth, state) = (output.truth, output.state);
        assert!((truth.walk_time_s - (tick - 3) as f64 * CONTROL_PERIOD_S).abs() < ROUNDING, "{}", truth.walk_time_s);
        let impulse_share = (truth.walk_time_s.clamp(0.0, 0.05)) / 0.05;
        assert!(
            (truth.linear_momentum_kg_m_per_s[0] - impulse_share * 80.0 * 0.05).abs() < 1e-6,
            "{}",
            truth.linear_momentum_kg_m_per_s[0]
        );
        let R_WB = Mat3::from_row_slice(&truth.base_rotation);
        let w_W = Vec3::from_column_slice(&truth.base_twist_m_rad_per_s[3..]);
        // The inertial unit is not turned against the base.
        assert!((Vec3::from(state.gyro_rad_per_s) - R_WB.transpose() * w_W).norm() < ROUNDING);
        let [x, y, z, w] = state.imu_orientation_xyzw;
        assert!((so3::from_quaternion(w, &Vec3::new(x, y, z)) - R_WB).norm() < ROUNDING);
        assert_eq!(state.joint_position_rad, truth.joint_position_rad);
        let angular = Vec3::from(truth.angular_momentum_kg_m2_per_s);
        if truth.walk_time_s > 0.051 {
            assert!((angular - spin).norm() < 1e-6, "nothing turns it any more");
        }
        spin = angular;
    }
    assert!(spin.norm() > 0.3, "{spin}");

    let truth = simulator.advance().truth;
    let (model, map) = walking_model(&robot()).expect("it ships");
    let mut q = Configuration {
        base: Transform::new(Mat3::from_row_slice(&truth.base_rotation), Vec3::from(truth.base_position_m)),
        ..model.neutral()
    };
    map.from_interface(&truth.joint_position_rad, q.joints.as_mut_slice());
    let mut ws = Workspace::new(&model);
    let robot_there = forward_kinematics(&model, &mut ws, &q);
    for (foot, name) in ["l_ankle", "r_ankle"].into_iter().enumerate() {
        let ankle = robot_there.pose(model.frame(name).expect("a frame"));
        assert!((ankle.translation - Vec3::from(truth.ankle_position_m[foot])).norm() < ROUNDING);
        assert!((ankle.rotation - Mat3::from_row_slice(&truth.sole_rotation[foot])).norm() < ROUNDING);
        let below = ankle.point(&-Vec3::from(robot().sole.foot.ankle_in_sole_m(foot)));
        assert!((below - Vec3::from(truth.sole_position_m[foot])).norm() < ROUNDING);
    }
    let moved = Vec3::from(truth.sole_position_m[0]) + Vec3::from(truth.sole_position_m[1]);
    let (_, _, first) = placed(self::settings(), |_| ());
    let was = Vec3::from(first.sole_position_m[0]) + Vec3::from(first.sole_position_m[1]);
    let distance_m = 0.5 * (moved - was).xy().norm();
    assert!((simulator.figures().distance_m - distance_m).abs() < ROUNDING && distance_m > 1e-3);
}

#[test]
fn a_command_that_does_not_come_fades_the_torque_and_is_counted() {
    let torque_nm = 20.0;
    let with_torque =
        |share: f64| move |command: &mut RobotCommand| command.feed_forward_torque_nm[knee()] = share * torque_nm;
    let (mut waiting, command, _) = placed(settings(), with_torque(1.0));
    let (mut told, _, _) = placed(settings(), with_torque(1.0));
    // Told nothing after commands 0 and 10; the other is told at every tick what that comes to.
    let shares = |missing: i64| [1.0, 1.0, 1.0, 0.75, 0.5, 0.25, 0.0][missing.min(6) as usize];
    let mut last_command = -1;
    for tick in 0..20 {
        let missing = tick - last_command - 1;
        let mut in_force = at(&command, tick - 1);
        in_force.feed_forward_torque_nm[knee()] = shares(missing) * torque_nm;
        told.take_command(&in_force);
        let (waited, mut expected) = (waiting.advance().truth, told.advance().truth);
        // Whose command acts is the one thing that differs: the old one's, or that of the tick.
        assert_eq!(expected.command_tick, tick - 1);
        assert_eq!(waited.command_tick, last_command);
        expected.command_tick = waited.command_tick;
        assert_eq!(waited, expected, "tick {tick}");
        if tick == 0 {
            assert!(waited.joint_torque_nm[knee()].abs() > 0.1, "the drive is heard of");
        }
        if tick == 0 || tick == 10 {
            waiting.take_command(&at(&command, tick));
            last_command = tick;
        }
    }
    assert_eq!((told.late(), waiting.late()), (0, 9 + 8), "ticks 2 to 10 and 12 to 19");
}

#[test]
fn commands_of_the_past_and_of_another_robot_are_not_used() {
    let (mut plain, command, _) = placed(settings(), |_| ());
    let (mut confused, _, _) = placed(settings(), |_| ());
    for tick in 0..10 {
        assert_eq!(plain.advance().truth, confused.advance().truth, "tick {tick}");
        for simulator in [&mut plain, &mut confused] {
            simulator.take_command(&at(&command, tick));
        }
        let mut wrong = at(&command, tick);
        wrong.joint_position_reference_rad[knee()] += 0.2;
        assert_eq!(confused.take_command(&wrong), None, "a second answer to the same state");
        assert_eq!(confused.take_command(&at(&wrong, tick - 1)), None, "an older one");
        wrong.header = Header::new(tick + 1, command.header.robot_fingerprint + 1);
        assert_eq!(confused.take_command(&wrong), None, "another robot's");
    }
    let mut next = at(&command, 10);
    next.joint_position_reference_rad[knee()] += 0.02;
    confused.take_command(&next);
    plain.advance();
    confused.advance();
    assert_ne!(plain.advance().truth, confused.advance().truth, "a newer one is");
}

#[test]
fn impossible_commands_are_explained_once_and_all_are_counted() {
    let (mut simulator, command, _) = placed(settings(), |_| ());
    let mut impossible = at(&command, 5);
    impossible.plan.feet[0].load_share = 7.0;
    let said: Vec<bool> = (0..3).map(|_| simulator.take_command(&impossible).is_some()).collect();
    assert_eq!((said, simulator.figures().commands_refused), (vec![true, false, false], 3));
}

#[test]
fn the_run_ends_some_time_after_the_walk_or_when_none_begins() {
    let mut short = settings();
    (short.run.after_walk_s, short.run.settle_time_max_s) = (0.05, 0.1);
    let ticks_until_over = |begins: bool, finished_at: i64| {
        let (mut simulator, command, _) = placed(short.clone(), |_| ());
        if begins {
            simulator.take_start(&start(0));
        }
        (1..60).find_map(|tick| {
            let over = simulator.advance().over;
            let mode = if tick > finished_at { Mode::Finished.code() } else { command.mode };
            simulator.take_command(&RobotCommand { mode, ..at(&command, tick - 1) });
            over.map(|reason| (tick, reason))
        })
    };
    // The command that says so is taken at tick 6 and rules from there on: 10 ticks more.
    assert_eq!(ticks_until_over(true, 5), Some((16, Reason::Finished)));
    assert_eq!(ticks_until_over(false, 1000), Some((20, Reason::NotSettled)));
    assert_eq!(ticks_until_over(true, 1000), None);
}

#[test]
fn a_fall_ends_the_run_and_is_told_with_its_tick_and_cause() {
    let (mut simulator, _, _) = placed(settings(), |_| ());
    // It lands on its feet after half a second, and stiff as it is does not stay on them.
    let mut first = None;
    for tick in 1..600 {
        let output = simulator.advance();
        assert_eq!(output.over == Some(Reason::Fallen), output.truth.fallen == 1);
        if output.truth.fallen == 1 {
            let (since, cause) = *first.get_or_insert((tick, output.truth.fall_cause));
            assert_eq!((output.truth.fall_tick, output.truth.fall_cause), (since, cause), "as it was at first");
        }
    }
    let (tick, cause) = first.expect("it falls");
    assert!((100..500).contains(&tick), "tick {tick}");
    assert!([Fall::BaseLow, Fall::Tilted, Fall::BodyContact].map(Fall::code).contains(&cause), "{cause}");
}

#[test]
fn the_zero_moment_point_of_a_robot_in_the_air_is_the_last_one_it_had() {
    // Pressed a millimetre into hard ground it is thrown up: once nothing carries, the last point stands.
    let robot = robot();
    let (model, map) = walking_model(&robot).expect("it ships");
    let (mut simulator, command, _) = placed(settings(), |_| ());
    let mut q = model.neutral();
    map.from_interface(&command.joint_position_reference_rad, q.joints.as_mut_slice());
    let mut ws = Workspace::new(&model);
    let placed = forward_kinematics(&model, &mut ws, &q);
    let ankle = placed.pose(model.frame("l_ankle").expect("a frame")).translation;
    let mut low = command;
    low.plan.base_position_m = [0.0, 0.0, robot.sole.foot.ankle_in_sole_m(0)[2] - ankle.z - 2e-3];
    let mut last = simulator.place(&low).expect("a place").truth;
    assert!(last.foot_wrench_n_nm[0][2] > 100.0, "{:?}", last.foot_wrench_n_nm);
    let mut in_the_air = 0;
    for _ in 0..30 {
        let now = simulator.advance().truth;
        if now.foot_wrench_n_nm.iter().all(|wrench| wrench[2] == 0.0) {
            assert_eq!(now.zmp_m, last.zmp_m);
            assert!(now.zmp_m != [0.0; 2]);
            in_the_air += 1;
        }
        last = now;
    }
    assert!(in_the_air > 3, "{in_the_air} ticks");
}
