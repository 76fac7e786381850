//! Walks in which messages do not come in time: what the clock does, without a clock.

use closed_loop::{ClosedLoop, Lost, Shared};
use estimator::{EstimatorProcess, EstimatorSettings};
use messages::code::{Mode, Reason};
use messages::missing::STOP_AFTER_TICKS;
use messages::{CONTROL_PERIOD_S, Header, RobotCommand, RobotState, WalkStart};
use planner::PlannerSettings;
use report::WalkFigures;
use scenario::{Scenario, Setting};
use soles::Store;
use std::path::Path;

fn scenario(name: &str, settings: &[&str]) -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios").join(name).with_extension("toml");
    let settings: Vec<Setting> = settings.iter().map(|text| text.parse().expect("a setting")).collect();
    Scenario::load(&path, &settings).expect("the scenarios that ship can be loaded")
}

/// The tick from which messages get lost: the robot stands, and is about to walk.
const FROM: i64 = 600;

/// Walks to the end; `lost` says of a tick, counted from [`FROM`], what does not come.
fn walk(name: &str, shared: &mut Shared, lost: impl Fn(i64) -> Lost) -> (Option<Reason>, WalkFigures) {
    let mut run = ClosedLoop::sharing(&scenario(name, &[]), shared).expect("it ships");
    for tick in 0.. {
        let lost = if tick < FROM { NOTHING } else { lost(tick - FROM) };
        if run.step_losing(lost).expect("the controller goes on").is_none() {
            break;
        }
    }
    (run.over(), run.figures())
}

/// One of `n` and no two in a row, at no fixed distance: with a fixed one the walk's own period would choose.
fn one_in(n: i64) -> impl Fn(i64) -> bool {
    move |k| {
        let mut random = fastrand::Rng::with_seed((k / n) as u64);
        k % n == random.i64(0..n - 1)
    }
}

/// What a twentieth of the messages may cost: largest errors of ZMP and COM against those of the whole walk.
const WORSE_MAX: f64 = 1.1;
/// Horizontal speed of a centre of mass that has come to rest two seconds ago (m/s). On soft soles the body still sways at 1.3 Hz; in
/// `feedback`, where no stabiliser damps it, by a millimetre: 8 mm/s.
const REST_MAX_M_PER_S: f64 = 0.01;

const NOTHING: Lost = Lost { deformation: false, command: false, state: false };
const COMMAND: Lost = Lost { command: true, ..NOTHING };
const DEFORMATION: Lost = Lost { deformation: true, ..NOTHING };

#[test]
fn a_message_in_twenty_that_does_not_come_is_hardly_seen() {
    let mut shared = Shared::default();
    for name in ["flat", "feedback"] {
        let (over, whole) = walk(name, &mut shared, |_| NOTHING);
        assert_eq!(over, Some(Reason::Finished));
        for (what, lost) in [("commands", COMMAND), ("deformations", DEFORMATION)] {
            let is_lost = one_in(20);
            let (over, figures) = walk(name, &mut shared, |k| if is_lost(k) { lost } else { NOTHING });
            assert_eq!(over, Some(Reason::Finished), "{name}: {what}");
            let zmp_m = [&figures, &whole].map(|figures| figures.zmp_error_max_m.expect("truth"));
            let com_m = [&figures, &whole].map(|figures| figures.com_error_max_m.expect("truth"));
            // Measured: 1.04 and 1.04 for `flat`, 1.00 for `feedback`.
            assert!(zmp_m[0] <= WORSE_MAX * zmp_m[1], "{name}: {what} lost: ZMP {zmp_m:?} m");
            assert!(com_m[0] <= WORSE_MAX * com_m[1], "{name}: {what} lost: COM {com_m:?} m");
        }
    }
}

/// Each tick of a walk, estimated without and with the bound of work that real time has. Messages are the same to the bit.
#[test]
fn no_tick_of_a_shipped_walk_meets_the_bound_of_work() {
    let mut store = Store::in_memory();
    let fem: &[&str] = &["estimator.sole.level=fem"];
    for (name, settings) in [("flat", &[][..]), ("flat", fem), ("circle", &[]), ("rounded-sole", &[])] {
        let scenario = scenario(name, settings);
        let plan: PlannerSettings = scenario.config("planner").expect("there").parse().expect("it ships");
        let planned = planner::plan_with_store(&plan, &mut store).expect("it can be walked");
        let settings: EstimatorSettings = scenario.config("estimator").expect("there").parse().expect("it ships");
        let mut build = |bounded: bool| {
            let mut process = EstimatorProcess::with_store(&settings, &mut store).expect("it builds");
            if bounded {
                process.bound_work();
            }
            process.take_pattern(&planned.header, &planned.phases).expect("its own");
            let (header, pattern_hash) = (Header::new(0, process.robot_fingerprint()), planned.header.pattern_hash);
            process.take_start(&WalkStart { header, pattern_hash, tick_zero: 0 });
            process
        };
        let (mut free, mut bounded) = (build(false), build(true));
        for tick in 0..(planned.header.duration_s / CONTROL_PERIOD_S) as i64 {
            let state = RobotState { header: Header::new(tick, free.robot_fingerprint()), ..RobotState::default() };
            let said = [&mut free, &mut bounded].map(|process| process.step(&state).expect("a pattern").deformation);
            assert!(said[1].feet.iter().all(|foot| foot.age_ticks == 0), "{name}: held at tick {tick}");
            assert_eq!(said[0], said[1], "{name}: tick {tick}");
        }
    }
}

/// Walks, and from a tick on something happens for good; what was said last.
fn walk_until(
    name: &str,
    settings: &[&str],
    shared: &mut Shared,
    mut happen: impl FnMut(&mut ClosedLoop, i64) -> Lost,
) -> (ClosedLoop, Vec<(RobotCommand, [f64; 3])>) {
    let mut run = ClosedLoop::sharing(&scenario(name, settings), shared).expect("it ships");
    let mut said = Vec::new();
    for tick in 0.. {
        let lost = happen(&mut run, tick);
        match run.step_losing(lost).expect("the controller goes on") {
            Some(tick) => said.push((tick.command, tick.truth.com_position_m)),
            None => break,
        }
    }
    (run, said)
}

/// Tick zero of the walk and ticks after it at which both feet carry, about the middle of each double support between two steps.
fn double_supports(name: &str, shared: &mut Shared) -> Vec<i64> {
    let (_, said) = walk_until(name, &[], shared, |_, _| NOTHING);
    let carries = |command: &RobotCommand| command.plan.feet.iter().all(|foot| foot.loaded == 1);
    let walks = |command: &RobotCommand| command.mode == Mode::Walking.code();
    let mut middles = Vec::new();
    let mut since = None;
    for (command, _) in &said {
        let tick = command.header.tick;
        match (walks(command) && carries(command), since) {
            (true, None) => since = Some(tick),
            (false, Some(first)) => {
                middles.push((first + tick) / 2);
                since = None;
            }
            _ => {}
        }
    }
    middles
}

#[test]
fn a_robot_whose_controller_dies_in_double_support_stands_until_the_run_is_over() {
    let mut shared = Shared::default();
    let middles = double_supports("flat", &mut shared);
    assert!(middles.len() > 10, "{middles:?}");
    for died in [middles[1], middles[4], middles[7]] {
        let (run, said) = walk_until("flat", &[], &mut shared, |_, tick| Lost { command: tick >= died, ..NOTHING });
        assert_eq!(run.over(), Some(Reason::Deadline), "died at tick {died}");
        assert_eq!(run.simulator().figures().fallen, 0);
        let last = said.last().expect("ticks").0.header.tick;
        assert_eq!(last, died + STOP_AFTER_TICKS - 1, "the state after it is the last one");
    }
}

#[test]
fn a_walk_that_is_stopped_at_any_time_ends_standing_on_both_feet() {
    let mut shared = Shared::default();
    for (name, times) in [("flat", 7), ("feedback", 3), ("no-stabiliser", 3), ("circle", 2)] {
        let supports = double_supports(name, &mut shared);
        let (first, last) = (supports[1], supports[supports.len() - 2]);
        for k in 0..times {
            // Once in each part of the walk, at another moment of the step each time.
            let asked = first + (last - first) * k / times + 13 * k;
            // Two seconds of standing.
            let mut until = None;
            let mut run = ClosedLoop::sharing(&scenario(name, &[]), &mut shared).expect("it ships");
            let mut stood = None;
            for tick in 0.. {
                if tick == asked {
                    run.stop();
                }
                let Some(now) = run.step().expect("the controller goes on") else { break };
                if now.command.mode == Mode::Holding.code() && until.is_none() {
                    assert!(now.command.plan.feet.iter().all(|foot| foot.loaded == 1), "{name}: on both feet");
                    until = Some(tick + (2.0 / CONTROL_PERIOD_S) as i64);
                }
                stood = until.map(|_| now.truth.com_velocity_m_per_s);
                if until == Some(tick) {
                    break;
                }
            }
            let velocity = stood.unwrap_or_else(|| panic!("{name}: stopped at {asked}, never held"));
            assert_eq!(run.over(), None, "{name}: stopped at tick {asked}");
            let speed = velocity[0].hypot(velocity[1]);
            assert!(speed < REST_MAX_M_PER_S, "{name}: stopped at tick {asked}, still moves at {speed} m/s");
        }
    }
}
