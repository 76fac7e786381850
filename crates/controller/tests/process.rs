//! The process's written answers to inputs that are missing, wrong or impossible, on a robot that does as it is told.

use controller::{ControllerOutput, ControllerProcess, ControllerSettings};
use gait::GaitSettings;
use messages::code::{Mode, Outcome, Reason};
use messages::missing::{HOLD_AFTER_TICKS, brought_to_rest};
use messages::{CONTROL_PERIOD_S, Header, RobotState, SoleDeformation, write_pattern};
use pattern::WalkPattern;
use std::path::Path;

/// A robot without dynamics: its joints are at their references, its feet carry their plan. Soles are rigid.
struct World {
    controller: ControllerProcess,
    walk: WalkPattern,
    tick: i64,
    tick_zero: Option<i64>,
    state: RobotState,
}

fn planned(y_m: f64) -> WalkPattern {
    let walk = gait::Walk::Straight { swings: 2, step_length_m: 0.05 };
    let mut gait = GaitSettings { walk, ..GaitSettings::default() };
    gait.start.y_m = y_m;
    gait::plan(&gait).expect("a feasible walk").pattern
}

impl World {
    fn new(changes: &[&str]) -> Self {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/controller.toml");
        let changes: Vec<_> = changes.iter().map(|text| text.parse().expect("a setting")).collect();
        let settings: ControllerSettings = scenario::load(&file, &changes).expect("it ships");
        let controller = ControllerProcess::new(&settings).expect("it ships");
        let state = RobotState { imu_orientation_xyzw: [0.0, 0.0, 0.0, 1.0], ..RobotState::default() };
        let mut world = Self { controller, walk: planned(0.0), tick: 0, tick_zero: None, state };
        world.take(planned(0.0));
        world
    }

    fn take(&mut self, walk: WalkPattern) {
        let (header, phases) = write_pattern(&walk, self.controller.robot_fingerprint()).expect("a pattern");
        self.controller.take_pattern(&header, &phases).expect("its own robot's");
        self.walk = walk;
    }

    /// Both feet flat on the ground: before the first swing.
    fn deformation(&self) -> SoleDeformation {
        let t_s = self.tick_zero.map_or(0.0, |zero| (self.tick - zero).max(0) as f64 * CONTROL_PERIOD_S);
        let now = self.walk.evaluate(t_s);
        let mut said = SoleDeformation { pattern_hash: self.walk.content_hash(), ..Default::default() };
        said.header = Header::new(self.tick, self.controller.robot_fingerprint());
        for (foot, planned) in said.feet.iter_mut().zip(&now.feet) {
            assert!(planned.swing.is_none(), "{t_s} s are in the first double support");
            let ankle = self.walk.ankle_pose(&planned.ankle_foothold);
            (foot.loaded, foot.load_share) = (1, planned.share.value);
            foot.ankle_position_m = ankle.translation.into();
            foot.ankle_rotation.copy_from_slice(ankle.rotation.transpose().as_slice());
            foot.planned_force_n = planned.force.into();
            foot.planned_zmp_m = planned.zmp.position.into();
        }
        said
    }

    fn step_with(&mut self, deformation: Option<SoleDeformation>) -> ControllerOutput {
        self.state.header = Header::new(self.tick, self.controller.robot_fingerprint());
        let t_s = self.tick_zero.map_or(0.0, |zero| (self.tick - zero).max(0) as f64 * CONTROL_PERIOD_S);
        for (measured, planned) in self.state.foot_wrench_n_nm.iter_mut().zip(&self.walk.evaluate(t_s).feet) {
            measured[2] = planned.force.z;
        }
        let said = self.controller.step(&self.state, deformation.as_ref()).expect("it can walk").expect("a pattern");
        self.state.joint_count = said.command.joint_count;
        self.state.joint_position_rad = said.command.joint_position_reference_rad;
        self.tick_zero = self.tick_zero.or(said.start.map(|start| start.tick_zero));
        self.tick += 1;
        said
    }

    fn step(&mut self) -> ControllerOutput {
        self.step_with(Some(self.deformation()))
    }

    /// Up to a time of the walk (s).
    fn walk_to(&mut self, t_s: f64) -> ControllerOutput {
        loop {
            let said = self.step();
            assert!(self.tick < 1000, "it settles");
            if said.start.is_none() && self.tick_zero.is_some() && said.command.walk_time_s > t_s {
                return said;
            }
        }
    }
}

fn fastest(said: &ControllerOutput) -> f64 {
    said.command.joint_velocity_reference_rad_per_s.iter().fold(0.0, |s: f64, x| s.max(x.abs()))
}

#[test]
fn time_zero_is_where_it_was_announced_and_the_walk_begins_there() {
    let mut world = World::new(&[]);
    let mut announced = None;
    let first_walking = loop {
        let said = world.step();
        if let Some(start) = said.start {
            assert_eq!(announced.replace(start.tick_zero), None, "once");
            // Decided by what was measured at this tick, and in time for the next ones: `settle.lead_ticks`.
            assert_eq!((start.header.tick, start.tick_zero), (world.tick - 1, world.tick - 1 + 20));
        }
        if said.command.mode == Mode::Walking.code() {
            break said.command;
        }
        assert_eq!(said.command.mode, Mode::Standing.code());
        assert!(world.tick < 1000, "it settles");
    };
    assert_eq!(Some(first_walking.header.tick), announced);
    assert_eq!(first_walking.walk_time_s, CONTROL_PERIOD_S);
}

#[test]
fn a_missing_deformation_is_bridged_for_nine_ticks_then_the_posture_is_held_for_good() {
    let mut world = World::new(&[]);
    let before = world.walk_to(0.2);
    assert_eq!(before.summary.deformation_missing, 0);
    let speed = fastest(&before);
    assert!(speed > 0.01, "it moves: {speed} rad/s");
    let (mut other_robot, mut other_walk, mut broken) = (world.deformation(), world.deformation(), world.deformation());
    other_robot.header.robot_fingerprint ^= 1;
    other_walk.pattern_hash ^= 1;
    broken.feet[1].ankle_position_m[0] = f64::NAN;
    // What is not ours is as good as nothing.
    let bad = [None, Some(other_robot), Some(other_walk), Some(broken)];
    let mut last = before.command;
    for age_ticks in 1..=HOLD_AFTER_TICKS + 7 {
        let said = world.step_with(bad[age_ticks as usize % bad.len()]);
        assert_eq!(i64::from(said.command.deformation_age_ticks), age_ticks);
        assert_eq!(said.summary.deformation_missing, age_ticks as u64);
        if age_ticks < HOLD_AFTER_TICKS {
            assert_eq!((said.command.mode, said.command.status), (Mode::Walking.code(), Outcome::Solved.code()));
            assert_eq!(said.summary.holding, None);
            last = said.command;
        } else {
            assert_eq!((said.command.mode, said.command.status), (Mode::Holding.code(), Outcome::Held.code()));
            assert_eq!(said.summary.holding, Some(Reason::InputMissing));
            let at_rest = brought_to_rest(&last, said.command.header.tick - last.header.tick);
            assert_eq!(said.command.joint_position_reference_rad, at_rest.joint_position_reference_rad);
            assert_eq!(said.command.plan, at_rest.plan);
            assert_eq!(said.command.feed_forward_torque_nm, last.feed_forward_torque_nm, "who stands needs them");
        }
    }
    let again = world.step();
    assert_eq!((again.command.mode, again.summary.holding), (Mode::Holding.code(), Some(Reason::InputMissing)));
    assert_eq!(fastest(&again), 0.0);
}

#[test]
fn a_robot_walks_off_only_when_it_is_told_to_where_it_must_be() {
    let mut world = World::new(&[]);
    world.controller.wait_for_start();
    // Longer than settle.time_max_s: who waits to be told has all the time.
    for _ in 0..2500 {
        let said = world.step();
        assert_eq!((said.command.mode, said.start), (Mode::Standing.code(), None));
    }
    world.controller.start();
    let said = world.step();
    let start = said.start.expect("it stands still already");
    assert!(start.tick_zero > said.command.header.tick);
    // The word may be taken back until the walk has begun; then the step is completed.
    world.controller.stop();
    let mut said = world.step();
    while said.command.walk_time_s < 0.1 {
        said = world.step();
    }
    assert_eq!((said.command.mode, said.summary.holding), (Mode::Holding.code(), Some(Reason::Asked)));
    assert!(said.summary.stopped && fastest(&said) == 0.0);
}

/// A sole that falls away faster than any robot can follow: nothing may give way, so there is no solution.
fn impossible(world: &World) -> SoleDeformation {
    let mut deformation = world.deformation();
    deformation.feet[0].ankle_acceleration_m_rad_per_s2[2] = -1e5;
    deformation
}

#[test]
fn after_ten_steps_in_a_row_without_a_solution_the_posture_is_held_for_good_and_not_before() {
    let mut world = World::new(&["relaxation.order=[]"]);
    world.walk_to(0.2);
    let mut held = 0;
    for in_a_row in [9, 9, 1, 10] {
        for _ in 0..in_a_row {
            let said = world.step_with(Some(impossible(&world)));
            held += 1;
            assert_eq!((said.command.status, said.summary.held), (Outcome::Held.code(), held));
            assert_eq!((said.command.mode, said.summary.holding), (Mode::Walking.code(), None));
        }
        let said = world.step();
        let for_good = in_a_row == 10;
        let expected = if for_good { Mode::Holding } else { Mode::Walking };
        assert_eq!(said.command.mode, expected.code(), "after {in_a_row} in a row");
        assert_eq!(said.summary.holding, for_good.then_some(Reason::SolverFailed));
    }
    for _ in 0..5 {
        assert_eq!(world.step().command.mode, Mode::Holding.code());
    }
}

#[test]
fn a_state_that_is_no_number_is_counted_and_walked_through() {
    let mut world = World::new(&[]);
    world.walk_to(0.1);
    let sound = world.state;
    for count in 1..=3 {
        world.state.joint_position_rad[3] = f64::NAN;
        let said = world.step();
        world.state = sound;
        assert_eq!((said.summary.state_refused, said.command.status), (count, Outcome::Solved.code()));
    }
    assert_eq!(world.step().summary.state_refused, 3);
}

#[test]
fn another_pattern_before_the_start_begins_anew_and_one_after_it_is_not_used() {
    let mut world = World::new(&[]);
    world.step();
    let elsewhere_y_m = 2.0;
    let here = world.deformation();
    world.take(planned(elsewhere_y_m));
    // The soles of the walk before say nothing.
    world.state.header.tick = world.tick;
    assert!(world.controller.step(&world.state, Some(&here)).expect("it can walk").is_none());
    let said = world.step();
    assert!((said.command.plan.base_position_m[1] - elsewhere_y_m).abs() < 0.05);
    world.walk_to(0.1);
    let (now, hash) = (world.walk.clone(), world.walk.content_hash());
    world.take(planned(5.0));
    world.walk = now;
    let said = world.step();
    assert_eq!((said.command.pattern_hash, said.command.mode), (hash, Mode::Walking.code()));
}
