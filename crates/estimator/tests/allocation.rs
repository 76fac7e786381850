//! In real time no tick of the process allocates, whatever becomes of it.

use estimator::{EstimatorProcess, EstimatorSettings};
use gait::GaitSettings;
use messages::code::Outcome as Code;
use messages::{CONTROL_PERIOD_S, Header, RobotState, WalkStart, write_pattern};

#[test]
fn a_walk_a_restart_in_the_middle_late_ticks_and_feet_that_are_held_allocate_nothing() {
    #[derive(serde::Deserialize)]
    struct File {
        gait: GaitSettings,
    }
    let file: File = toml::from_str(include_str!("../../../config/planner.toml")).expect("it ships");
    let walk = gait::plan(&file.gait).expect("it can be planned").pattern;
    let ticks = (walk.duration_s() / CONTROL_PERIOD_S).ceil() as i64;
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/hrp4");
    // As it ships on few elements; too slippery for some loads; with work for no iteration at all.
    for (sole, solver, expected) in [
        ("", "", Code::Solved),
        ("friction = 0.02", "", Code::ReferenceOutside),
        ("", "real_time_megamultiplications_max = 0.001", Code::IterationLimit),
    ] {
        let text = format!("robot = {robot:?}\n[sole]\ncells = [4, 3, 1]\n{sole}\n[solver]\n{solver}\n");
        let settings: EstimatorSettings = toml::from_str(&text).expect("a configuration");
        let mut process = EstimatorProcess::new(&settings).expect("soles");
        process.bound_work();
        let (header, phases) = write_pattern(&walk, process.robot_fingerprint()).expect("a pattern");
        process.take_pattern(&header, &phases).expect("its own robot's");
        let mut seen = 0;
        let mut step = |tick: i64| {
            let header = Header::new(tick, process.robot_fingerprint());
            let said = process.step(&RobotState { header, ..RobotState::default() }).expect("there is a pattern");
            seen += u32::from(said.summary.status == expected.code());
        };
        let count = allocation_counter::measure(|| {
            step(-1);
        });
        assert_eq!(count.count_total, 0, "before time zero");
        process.take_start(&WalkStart { pattern_hash: header.pattern_hash, ..WalkStart::default() });
        let mut step = |tick: i64| {
            let header = Header::new(tick, process.robot_fingerprint());
            let said = process.step(&RobotState { header, ..RobotState::default() }).expect("there is a pattern");
            seen += u32::from(said.summary.status == expected.code());
        };
        let count = allocation_counter::measure(|| {
            (0..ticks + 3).for_each(&mut step);
            (ticks / 2..ticks).step_by(7).for_each(&mut step);
        });
        assert_eq!(count.count_total, 0, "{sole} {solver}");
        assert!(seen > 20, "{seen} ticks of {expected:?}");
    }
}
