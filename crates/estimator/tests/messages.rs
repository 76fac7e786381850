//! What the process publishes: every field from what it says it is, held feet, rigid soles, the end of the walk, bounded work.

use estimator::{EstimatorOutput, EstimatorProcess, EstimatorSettings};
use gait::GaitSettings;
use messages::code::{ContactState, Outcome as Code};
use messages::{CONTROL_PERIOD_S, FootDeformation, Header, RobotState, WalkStart, write_pattern};
use pattern::WalkPattern;
use spatial::{Vec3, Wrench};
use stance::{Outcome, StanceSettings, WalkOnSoles};
use std::sync::LazyLock;

/// Ticks of the robot at time zero of the walk.
const TICK_ZERO: i64 = 100;

/// The walk that ships.
static WALK: LazyLock<WalkPattern> = LazyLock::new(|| {
    #[derive(serde::Deserialize)]
    struct File {
        gait: GaitSettings,
    }
    let file: File = toml::from_str(include_str!("../../../config/planner.toml")).expect("it ships");
    gait::plan(&file.gait).expect("it can be planned").pattern
});

fn ticks() -> i64 {
    (WALK.duration_s() / CONTROL_PERIOD_S).ceil() as i64
}

/// A process that has the walk and its time zero; the sole has few elements.
fn process(sole: &str, solver: &str) -> EstimatorProcess {
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/hrp4");
    let text = format!("robot = {robot:?}\n[sole]\ncells = [4, 3, 1]\n{sole}\n[solver]\n{solver}\n");
    let settings: EstimatorSettings = toml::from_str(&text).expect("a configuration");
    started(EstimatorProcess::new(&settings).expect("soles"))
}

fn started(mut process: EstimatorProcess) -> EstimatorProcess {
    let (header, phases) = write_pattern(&WALK, process.robot_fingerprint()).expect("a pattern");
    process.take_pattern(&header, &phases).expect("its own robot's");
    let start = |pattern_hash, tick_zero| WalkStart { header: Header::new(0, 0), pattern_hash, tick_zero };
    process.take_start(&start(header.pattern_hash, TICK_ZERO));
    // Of another walk: not used.
    process.take_start(&start(header.pattern_hash ^ 1, TICK_ZERO + 50));
    process
}

fn step(process: &mut EstimatorProcess, walk_tick: i64) -> EstimatorOutput {
    let header = Header { clock_monotonic_ns: 77, ..Header::new(TICK_ZERO + walk_tick, process.robot_fingerprint()) };
    process.step(&RobotState { header, ..RobotState::default() }).expect("there is a pattern")
}

fn wrench(foot: &FootDeformation) -> Wrench {
    Wrench {
        force: Vec3::from_column_slice(&foot.wrench_n_nm[..3]),
        moment: Vec3::from_column_slice(&foot.wrench_n_nm[3..]),
    }
}

/// Moment about the planned ZMP.
fn about_zmp(foot: &FootDeformation) -> Wrench {
    let zmp = Vec3::new(foot.planned_zmp_m[0], foot.planned_zmp_m[1], 0.0);
    wrench(foot).about(&(zmp - Vec3::from(foot.sole_position_m)))
}

#[test]
fn each_foot_carries_its_plan_and_every_number_is_what_it_is_called() {
    let mut process = process("", "");
    let (mut single, mut double, mut slipping) = (0, 0, 0);
    let mut before: Option<EstimatorOutput> = None;
    for walk_tick in 0..ticks() / 3 {
        let said = step(&mut process, walk_tick);
        let deformation = &said.deformation;
        let header = deformation.header;
        assert_eq!((header.tick, header.clock_monotonic_ns), (TICK_ZERO + walk_tick, 77));
        assert_eq!(deformation.walk_time_s, walk_tick as f64 * CONTROL_PERIOD_S);
        assert_eq!(deformation.pattern_hash, WALK.content_hash());
        let loaded = deformation.feet.iter().filter(|foot| foot.loaded == 1).count();
        (single, double) = (single + usize::from(loaded == 1), double + usize::from(loaded == 2));
        for (k, foot) in deformation.feet.iter().enumerate() {
            let planned = WALK.evaluate(deformation.walk_time_s).feet[k];
            assert_eq!(foot.load_share, planned.share.value, "foot {k}, tick {walk_tick}");
            assert_eq!(Vec3::from(foot.planned_force_n), planned.force);
            let nodes = &said.contact.feet[k];
            if foot.loaded == 0 {
                assert_eq!((foot.status, nodes.count), (Code::None.code(), 0));
                assert_eq!((foot.wrench_n_nm, foot.compliance_m_rad_per_n_nm), ([0.0; 6], [0.0; 36]));
                // Rigid: the sole's origin moves as the ankle and the turn say.
                let (v, w) = foot.ankle_twist_m_rad_per_s.split_at(3);
                let arm = Vec3::from(foot.sole_position_m) - Vec3::from(foot.ankle_position_m);
                let speed = Vec3::from_column_slice(v) + Vec3::from_column_slice(w).cross(&arm);
                assert!((speed - Vec3::from_column_slice(&foot.sole_twist_m_rad_per_s[..3])).norm() < 1e-12);
                continue;
            }
            assert_eq!((foot.status, foot.age_ticks), (Code::Solved.code(), 0), "foot {k}, tick {walk_tick}");
            let load = planned.force.norm();
            let resultant = about_zmp(foot);
            assert!((resultant.force - planned.force).norm() < 1e-8 * load, "foot {k}, tick {walk_tick}");
            assert!(resultant.moment.norm() < 1e-9 * load, "foot {k}, tick {walk_tick}");
            // Node by node the same force, and as many of each state as said.
            let count = nodes.count as usize;
            assert_eq!(count, 20);
            let total: Vec3 = nodes.force_n[..count].iter().map(|f| Vec3::from(*f)).sum();
            assert!((total - wrench(foot).force).norm() < 1e-9 * load);
            let with =
                |state: ContactState| nodes.state[..count].iter().filter(|code| **code == state.code()).count() as u32;
            assert_eq!(
                (with(ContactState::Stick), with(ContactState::Slip)),
                (foot.nodes_sticking, foot.nodes_slipping)
            );
            for i in (0..count).filter(|i| nodes.state[*i] == ContactState::Open.code()) {
                assert_eq!(nodes.force_n[i], [0.0; 3]);
            }
            assert!(nodes.position_m[..count].iter().all(|p| p[2] > -1e-9), "on or above the ground");
            slipping += foot.nodes_slipping;
            assert!(foot.residual > 0.0 && foot.residual <= 1e-9);
        }
        let feet = &deformation.feet;
        assert_eq!(said.summary.iterations, feet[0].iterations + feet[1].iterations);
        assert_eq!(said.summary.residual, feet[0].residual.max(feet[1].residual));
        if let Some(before) = &before {
            rates(&before.deformation.feet, feet, walk_tick);
        }
        before = Some(said);
    }
    assert!(single > 100 && double > 100 && slipping > 10, "{single} {double} {slipping}");
}

/// Twists are the derivatives of the poses, whose rotations are row-major: a step of the walk by the trapezoidal rule. Nodes that change
/// state make the twists jump, by far less than this.
fn rates(before: &[FootDeformation; 2], now: &[FootDeformation; 2], walk_tick: i64) {
    const JUMP_M_PER_S: f64 = 0.03;
    for (k, (a, b)) in before.iter().zip(now).enumerate().filter(|(_, (a, b))| a.loaded == b.loaded) {
        for (what, p, q, v, w) in [
            ("ankle", a.ankle_position_m, b.ankle_position_m, a.ankle_twist_m_rad_per_s, b.ankle_twist_m_rad_per_s),
            ("sole", a.sole_position_m, b.sole_position_m, a.sole_twist_m_rad_per_s, b.sole_twist_m_rad_per_s),
        ] {
            for axis in 0..3 {
                let apart = (q[axis] - p[axis]) / CONTROL_PERIOD_S - 0.5 * (v[axis] + w[axis]);
                assert!(apart.abs() < JUMP_M_PER_S, "{what} {k}, tick {walk_tick}: {apart} m/s");
            }
        }
        let mean =
            0.5 * (a.ankle_acceleration_m_rad_per_s2[0] + b.ankle_acceleration_m_rad_per_s2[0]) * CONTROL_PERIOD_S;
        assert!(
            (b.ankle_twist_m_rad_per_s[0] - a.ankle_twist_m_rad_per_s[0] - mean).abs() < JUMP_M_PER_S,
            "foot {k}, tick {walk_tick}: {mean}"
        );
    }
}

#[test]
fn matrices_are_row_major() {
    let mut process = process("", "");
    let walk_tick = ticks() / 4;
    let said = step(&mut process, walk_tick);
    let foot = said.deformation.feet.iter().find(|foot| foot.loaded == 1).expect("one foot at least");
    // The ankle stands where the sole's own rotation puts it: p_WA = p_WS + R_WS p_SA.
    let k = usize::from(said.deformation.feet[0].loaded == 0);
    let arm = Vec3::new(-0.015, [-0.011, 0.011][k], 0.103);
    let r = |i: usize| Vec3::from_column_slice(&foot.sole_rotation[3 * i..3 * i + 3]).dot(&arm);
    let ankle = Vec3::from(foot.sole_position_m) + Vec3::new(r(0), r(1), r(2));
    assert!((ankle - Vec3::from(foot.ankle_position_m)).norm() < 1e-12, "{ankle}");
    assert!(
        foot.sole_rotation[1].abs().max(foot.sole_rotation[2].abs()) > 1e-4,
        "it is turned, else this says nothing"
    );
    // Pushed forward the sole moves forward and turns about y; rows are poses, columns wrenches. The tangent of a load is not symmetric.
    let c = |row: usize, column: usize| foot.compliance_m_rad_per_n_nm[6 * row + column];
    let asymmetry =
        (0..6).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| (c(i, j) - c(j, i)).abs()).fold(0.0, f64::max);
    assert!(asymmetry > 1e-8, "{asymmetry}");
    // The same tick with a little more of a vertical load answers which is which.
    let mut own = WalkOnSoles::new(WALK.clone(), own_soles(), &StanceSettings::default(), CONTROL_PERIOD_S);
    let estimate = own.at_tick(walk_tick, &[])[k];
    for i in 0..6 {
        for j in 0..6 {
            assert_eq!(c(i, j), estimate.compliance[(i, j)], "{i} {j}");
        }
    }
}

fn own_soles() -> [Option<sole::StanceEstimator>; 2] {
    let mesh = sole::MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [4, 3, 1] };
    let left = sole::SoleModel::build(&sole::SoleSettings { mesh, ..sole::SoleSettings::default() }).expect("a sole");
    let right = left.mirrored();
    let settings =
        sole::EstimatorSettings { iterations_max: 30, continuation_iterations_max: 400, ..Default::default() };
    [left, right].map(|model| Some(sole::StanceEstimator::new(model, settings)))
}

#[test]
fn a_foot_that_cannot_be_solved_is_held_at_rest_and_ages_until_it_can() {
    // So slippery that some of the walk's forces are beyond it.
    let mut process = process("friction = 0.02", "");
    let mut before = step(&mut process, 0).deformation.feet;
    let (mut held, mut recovered) = ([0, 0], 0);
    for walk_tick in 1..ticks() {
        let said = step(&mut process, walk_tick);
        let feet = said.deformation.feet;
        for (k, (was, is)) in before.iter().zip(&feet).enumerate() {
            if is.status == Code::ReferenceOutside.code() {
                held[k] += 1;
                assert_eq!(is.age_ticks, if was.loaded == 1 { was.age_ticks + 1 } else { 1 }, "tick {walk_tick}");
                if was.loaded == 1 {
                    assert_eq!((is.ankle_position_m, is.sole_position_m), (was.ankle_position_m, was.sole_position_m));
                }
                assert_eq!(
                    (is.ankle_twist_m_rad_per_s, is.ankle_acceleration_m_rad_per_s2, is.sole_twist_m_rad_per_s),
                    ([0.0; 6], [0.0; 6], [0.0; 6])
                );
                assert_eq!(is.loaded, 1);
            } else {
                assert_eq!(is.age_ticks, 0, "tick {walk_tick}");
                recovered += usize::from(was.age_ticks > 0 && is.status == Code::Solved.code());
            }
        }
        let worst = if feet[1].age_ticks > feet[0].age_ticks { 1 } else { 0 };
        assert_eq!((said.summary.age_ticks, said.summary.status), (feet[worst].age_ticks, feet[worst].status));
        before = feet;
    }
    assert!(held[0] > 20 && held[1] > 20 && recovered > 2, "{held:?} ticks held, {recovered} times solved again");
}

#[test]
fn without_friction_no_pose_is_the_only_one() {
    let said = step(&mut process("friction = 0.0", ""), 0);
    assert_eq!(said.summary.status, Code::Infeasible.code());
    assert!(said.deformation.feet.iter().all(|foot| foot.status == Code::Infeasible.code() && foot.age_ticks == 1));
}

#[test]
fn in_real_time_a_tick_has_so_much_work_and_no_more() {
    let megamultiplications = |max: &str| {
        let text = format!("real_time_megamultiplications_max = {max}");
        let mut process = process("", &text);
        process.bound_work();
        // The bound holds from the next pattern on.
        let mut turned = WALK.clone();
        turned.mass_kg += 1.0;
        let (header, phases) = write_pattern(&turned, process.robot_fingerprint()).expect("a pattern");
        process.take_pattern(&header, &phases).expect("the same robot");
        step(&mut process, 0).summary.status
    };
    assert_eq!(megamultiplications("0.001"), Code::IterationLimit.code());
    assert_eq!(megamultiplications("8.0"), Code::Solved.code());
}

#[test]
fn a_rigid_sole_carries_the_plan_and_the_end_of_the_walk_is_held() {
    let mut rigid = WalkOnSoles::new(WALK.clone(), [None, None], &StanceSettings::default(), CONTROL_PERIOD_S);
    for walk_tick in (0..=ticks()).step_by(7) {
        let reference = WALK.evaluate(walk_tick as f64 * CONTROL_PERIOD_S);
        for (foot, planned) in rigid.at_tick(walk_tick, &[]).iter().zip(&reference.feet).filter(|(foot, _)| foot.loaded)
        {
            let zmp = Vec3::new(planned.zmp.position.x, planned.zmp.position.y, 0.0);
            let resultant = foot.wrench.about(&(zmp - foot.sole.translation));
            assert_eq!(resultant.force, planned.force);
            assert!(resultant.moment.norm() < 1e-12 * planned.force.norm(), "tick {walk_tick}");
        }
    }
    let mut soft = WalkOnSoles::new(WALK.clone(), own_soles(), &StanceSettings::default(), CONTROL_PERIOD_S);
    let end = soft.at_tick(ticks(), &[]);
    assert!(end.iter().all(|foot| foot.loaded && foot.outcome == Outcome::Solved));
    // No tick passes for the soles after it: nothing creeps.
    assert_eq!(soft.at_tick(ticks() + 1, &[]), end);
    assert_eq!(soft.at_tick(ticks() + 1000, &[]), end);
    assert!(soft.stances().iter().all(Option::is_some));
    // In the air there is no contact to show.
    let lifted = (0..ticks()).find(|tick| soft.at_tick(*tick, &[]).iter().any(|foot| !foot.loaded)).expect("a swing");
    let feet = soft.at_tick(lifted, &[]);
    for (foot, stance) in feet.iter().zip(soft.stances()) {
        assert_eq!(stance.is_some(), foot.loaded);
    }
}
