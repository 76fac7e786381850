//! Walks that nobody walked: recordings of a few seconds with everything a page can show.
#![allow(dead_code, reason = "each test program uses a part")]

use messages::code::{Mode, Outcome, Process, Reason, State};
use messages::{
    Header, Health, PatternHeader, PatternPhase, RobotCommand, RobotState, SoleDeformation, Truth, WalkStart, topic,
};
use recording::{Recording, RunInfo, ViewerSettings, Writer};
use std::path::{Path, PathBuf};

/// Ticks of the whole recording, and the tick of time zero.
pub const TICKS: i64 = 1600;
pub const TICK_ZERO: i64 = 100;
/// Distance that is planned and walked (m).
pub const DISTANCE_M: f64 = 0.4;
/// Largest distance of the ZMP from its plan (m), at one tick.
pub const ZMP_ERROR_M: f64 = 0.025;

/// What is special about a walk.
#[derive(Debug, Clone)]
pub struct Kind {
    pub title: String,
    pub falls: bool,
    pub ends_early: bool,
    pub has_truth: bool,
    pub is_pushed: bool,
    pub zmp_error_m: f64,
}

impl Default for Kind {
    fn default() -> Self {
        let title = "A walk of a test".to_string();
        Self { title, falls: false, ends_early: false, has_truth: true, is_pushed: false, zmp_error_m: ZMP_ERROR_M }
    }
}

const ONE: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Records one.
pub fn record(folder: &Path, kind: &Kind) -> PathBuf {
    let path = folder.join("walk.mcap");
    let mut writer = Writer::create(&path, &info(kind), viewer()).expect("writable");
    let header = PatternHeader { duration_s: 6.0, pattern_hash: 7, phase_count: 3, ..PatternHeader::default() };
    writer.record_pattern(&header, &phases()).expect("room");
    let start = WalkStart { header: Header::new(80, 7), pattern_hash: 7, tick_zero: TICK_ZERO };
    writer.record(topic::WALK_START, &start).expect("room");
    let end = if kind.ends_early { 700 } else { TICKS };
    for tick in 0..end {
        let header = Header::new(tick, 7);
        let walk_time_s = 0.005 * (tick - TICK_ZERO) as f64;
        let fallen = kind.falls && tick >= 900;
        writer.record(topic::ROBOT_COMMAND, &command(header, walk_time_s)).expect("room");
        writer.record(topic::SOLE_DEFORMATION, &deformation(header, walk_time_s)).expect("room");
        writer.record(topic::ROBOT_STATE, &state(header)).expect("room");
        if kind.has_truth {
            writer.record(topic::TRUTH_ROBOT, &truth(header, walk_time_s, kind, fallen)).expect("room");
        }
        for process in [Process::Estimator, Process::Controller, Process::Simulator, Process::Recorder] {
            if process != Process::Simulator || kind.has_truth {
                writer.record(topic::health(process), &health(process, header, walk_time_s)).expect("room");
            }
        }
        if fallen {
            break;
        }
    }
    writer.finish().expect("room")
}

/// Records one and opens it.
pub fn recorded(folder: &Path, kind: &Kind) -> Recording {
    Recording::open(&record(folder, kind)).expect("finished")
}

fn viewer() -> ViewerSettings {
    ViewerSettings { base_link: "body".to_string(), scene_every_ticks: 1000, ..ViewerSettings::default() }
}

fn info(kind: &Kind) -> RunInfo {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let read = |name: &str| std::fs::read(root.join(name)).expect("it ships");
    let planner = String::from_utf8(read("config/planner.toml")).expect("text");
    let title = toml::Value::String(kind.title.clone());
    RunInfo {
        facts: [("commit", "abc"), ("host", "<b>here</b>")].map(|(a, b)| (a.to_string(), b.to_string())).into(),
        files: vec![
            ("config/scenario.toml".to_string(), format!("title = {title}").into_bytes()),
            ("config/planner.toml".to_string(), format!("test_only = 3\n{planner}").into_bytes()),
            ("robot/robot.toml".to_string(), read("robots/hrp4/robot.toml")),
            ("robot/hrp4.urdf".to_string(), read("robots/hrp4/hrp4.urdf")),
            ("robot/sole.toml".to_string(), read("robots/hrp4/sole.toml")),
        ],
        ..RunInfo::default()
    }
}

fn phases() -> [PatternPhase; 3] {
    let mut phases = [PatternPhase::default(); 3];
    for (index, phase) in phases.iter_mut().enumerate() {
        (phase.start_s, phase.duration_s) = (2.0 * index as f64, 2.0);
        for (foot, said) in phase.feet.iter_mut().enumerate() {
            let x = DISTANCE_M * index as f64 / 2.0;
            said.ankle_foothold = [x, 0.08 - 0.16 * foot as f64, 0.0];
        }
    }
    let swing = &mut phases[1].feet[0];
    (swing.in_the_air, swing.swing_start_s, swing.swing_end_s) = (1, 2.0, 4.0);
    phases
}

/// Where the middle of the feet is (m).
fn along_m(walk_time_s: f64) -> f64 {
    DISTANCE_M * (walk_time_s / 6.0).clamp(0.0, 1.0)
}

fn command(header: Header, walk_time_s: f64) -> RobotCommand {
    let mode = if walk_time_s > 6.0 { Mode::Finished } else { Mode::Walking };
    let mut command = RobotCommand {
        header,
        walk_time_s: walk_time_s + 0.005,
        mode: mode.code(),
        joint_count: 34,
        status: Outcome::Solved.code(),
        solver_iterations: 2 + (header.tick % 3) as u32,
        solver_residual: 1e-12,
        ..RobotCommand::default()
    };
    // What the drives reach two ticks later is where the truth is then.
    let x = along_m(walk_time_s + 0.010);
    command.plan.com_position_m = [x, 0.0, 0.78];
    command.plan.zmp_m = [x, 0.0];
    command.plan.base_position_m = [x, 0.0, 0.8];
    command.plan.base_rotation = ONE;
    command
}

fn truth(header: Header, walk_time_s: f64, kind: &Kind, fallen: bool) -> Truth {
    let x = along_m(walk_time_s);
    let mut truth = Truth {
        header,
        walk_time_s,
        time_s: 0.005 * header.tick as f64,
        joint_count: 34,
        fallen: u32::from(fallen),
        fall_tick: if fallen { header.tick } else { 0 },
        fall_cause: if fallen { 2 } else { 0 },
        base_position_m: [x, 0.0, 0.8],
        base_rotation: ONE,
        com_position_m: [x + 0.001, 0.0, 0.78],
        zmp_m: [x + if header.tick == 500 { kind.zmp_error_m } else { 0.0 }, 0.0],
        sole_rotation: [ONE; 2],
        ..Truth::default()
    };
    truth.sole_position_m = [[x, 0.08, -0.0005], [x, -0.08, -0.0005]];
    truth.foot_wrench_n_nm = [[0.0, 0.0, 190.0, 0.0, 0.0, 0.0]; 2];
    truth.joint_position_rad[3] = 0.3 + 0.2 * (2.0 * walk_time_s).sin();
    truth.joint_torque_nm[3] = 20.0;
    if kind.is_pushed && (600..640).contains(&header.tick) {
        (truth.push_force_n, truth.push_point_m) = ([0.0, 80.0, 0.0], [x, 0.0, 1.0]);
    }
    truth
}

fn state(header: Header) -> RobotState {
    let mut state = RobotState { header, joint_count: 34, ..RobotState::default() };
    state.foot_wrench_n_nm = [[0.0, 0.0, 190.0, 0.0, 0.0, 0.0]; 2];
    state
}

fn deformation(header: Header, walk_time_s: f64) -> SoleDeformation {
    let mut deformation = SoleDeformation { header, walk_time_s, ..SoleDeformation::default() };
    for (foot, said) in deformation.feet.iter_mut().enumerate() {
        (said.loaded, said.status, said.iterations) = (1, Outcome::Solved.code(), 3);
        said.load_share = 0.5;
        said.planned_force_n = [0.0, 0.0, 190.0];
        said.sole_position_m = [along_m(walk_time_s), 0.08 - 0.16 * foot as f64, -0.0004];
        said.sole_rotation = ONE;
        said.planned_zmp_m = [along_m(walk_time_s), 0.08 - 0.16 * foot as f64];
    }
    deformation
}

fn health(process: Process, header: Header, walk_time_s: f64) -> Health {
    let mut health = Health::new(process, State::Running, Reason::None);
    health.header = header;
    health.cycles = header.tick as u64 + 1;
    health.compute_time_ns = 100_000 + 1000 * (header.tick as u64 % 50);
    health.compute_time_max_ns = 150_000;
    health.compute_time_sum_ns = 120_000 * health.cycles;
    health.cycle_time_ns = 1_000_000;
    health.walk_time_s = walk_time_s;
    health.walk_duration_s = 6.0;
    health
}
