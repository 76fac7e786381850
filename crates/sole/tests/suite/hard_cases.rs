//! The hard cases: friction, load, lift-off, foam, size and number of ticks at their ends.

use crate::edge::honest;
use crate::stances::{laws_hold, small, sole, tight};
use crate::walking_stance::{self, TICKS, WEIGHT_N};
use nalgebra::Vector2;
use sole::{
    EstimatorSettings, Foothold, Level, Material, MeshSource, NestedEstimator, NestedSettings, SoleModel, SoleSettings,
    StanceEstimator, StanceReference, Status,
};
use spatial::{Vec3, Vec6, so3};
use std::sync::Arc;

/// Friction from none to rubber on dry concrete.
#[test]
fn friction_from_slippery_to_sticky() {
    let frictionless = Arc::new(small().as_ref().clone().with_friction(vec![0.0; 30]).expect("no friction"));
    let mut estimator = StanceEstimator::new(frictionless, EstimatorSettings::default());
    estimator.touch_down(Foothold::default());
    let status = estimator.step(&StanceReference::constant(Vec3::new(0.0, 0.0, 383.0), Vector2::zeros())).status;
    assert_eq!(status, Status::Indeterminate);
    for mu in [0.05, 0.1, 1.5] {
        let model = Arc::new(small().as_ref().clone().with_friction(vec![mu; 30]).expect("friction"));
        let mut estimator = StanceEstimator::new(Arc::clone(&model), EstimatorSettings::default());
        estimator.touch_down(Foothold::default());
        for tick in 0..TICKS {
            let mut reference = walking_stance::reference(tick, false);
            // Horizontal forces up to 0.9 of the friction that there is, or as planned.
            let scale = f64::min(1.0, 0.9 * mu / 0.3);
            for f in [&mut reference.force, &mut reference.force_rate, &mut reference.force_acceleration] {
                f.x *= scale;
                f.y *= scale;
            }
            let report = estimator.step(&reference).clone();
            assert!(report.status.is_solved(), "mu {mu}, tick {tick}: {:?}", report.status);
            laws_hold(&model, &report, reference.force.norm());
        }
    }
}

#[test]
fn loads_from_a_tenth_of_a_newton_to_five_kilonewtons() {
    let model = sole([5, 4, 2], 0.03, Level::Fem);
    for load in [0.1, 1.0, 20.0, 383.0, 2000.0, 5000.0] {
        for zmp in [Vector2::zeros(), Vector2::new(0.03, -0.015)] {
            let mut estimator = StanceEstimator::new(Arc::clone(&model), tight());
            estimator.touch_down(Foothold::default());
            for push in [0.0, 0.15, 0.3] {
                let reference = StanceReference::constant(Vec3::new(push * load, -0.1 * push * load, load), zmp);
                let report = estimator.step(&reference).clone();
                assert!(report.status.is_solved(), "{load} N at {zmp}: {:?}", report.status);
                laws_hold(&model, &report, load);
            }
        }
    }
}

#[test]
fn heel_toe_side_and_corner_lift_one_after_the_other() {
    let model = small();
    let mut estimator = StanceEstimator::new(Arc::clone(&model), tight());
    estimator.touch_down(Foothold::default());
    let corners = [(0.0, 0.0), (-0.085, 0.0), (0.085, 0.0), (0.0, 0.045), (0.0, -0.045), (0.06, 0.03), (-0.06, -0.03)];
    for (from, to) in corners.iter().zip(corners.iter().skip(1)) {
        for step in 1..=10 {
            let s = f64::from(step) / 10.0;
            let zmp = Vector2::new(from.0 + s * (to.0 - from.0), from.1 + s * (to.1 - from.1));
            let report = estimator.step(&StanceReference::constant(Vec3::new(10.0, 5.0, WEIGHT_N), zmp)).clone();
            assert!(report.status.is_solved(), "{zmp}: {:?}", report.status);
            laws_hold(&model, &report, WEIGHT_N);
        }
        assert!(estimator.report().open > 0, "{to:?} lifts a part of the sole");
    }
}

#[test]
fn soft_hard_thick_thin_and_nearly_incompressible_soles() {
    let shapes: [(f64, f64, f64); 7] = [
        (0.021, 0.02e6, 0.31),
        (0.021, 0.32e6, 0.31),
        (0.021, 50e6, 0.31),
        (0.006, 0.32e6, 0.31),
        (0.060, 0.32e6, 0.31),
        (0.021, 0.32e6, 0.49),
        (0.012, 0.32e6, 0.47),
    ];
    for (height, young_modulus_pa, poisson_ratio) in shapes {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, height], cells: [6, 4, 2] };
        let material = Material { young_modulus_pa, poisson_ratio };
        let model =
            Arc::new(SoleModel::build(&SoleSettings { mesh, material, ..SoleSettings::default() }).expect("a sole"));
        let mut estimator = StanceEstimator::new(Arc::clone(&model), EstimatorSettings::default());
        estimator.touch_down(Foothold::default());
        for tick in (0..TICKS).step_by(2) {
            let reference = walking_stance::reference(tick, false);
            let report = estimator.step(&reference).clone();
            let name = format!("{height} m, {young_modulus_pa} Pa, nu {poisson_ratio}, tick {tick}");
            assert!(report.status.is_solved(), "{name}: {:?}", report.status);
            laws_hold(&model, &report, reference.force.norm());
        }
    }
}

fn nearly_incompressible(height: f64, cells: [usize; 3], friction: f64) -> Arc<SoleModel> {
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, height], cells };
    let material = Material { young_modulus_pa: 0.32e6, poisson_ratio: 0.49 };
    Arc::new(
        SoleModel::build(&SoleSettings { mesh, material, friction, ..SoleSettings::default() }).expect("a sound sole"),
    )
}

#[test]
fn nearly_incompressible_soles_carry_nearly_any_first_load() {
    // The states of their points run in circles under several of these loads, and which way out is found depends on the last bits of the
    // compliance, other on another processor: two of forty loads may be left, but never with a wrong answer.
    for (height, cells, mu) in [
        (0.021, [6, 4, 2], 0.3),
        (0.021, [6, 4, 2], 1.0),
        (0.021, [12, 7, 3], 0.65),
        (0.021, [12, 7, 3], 1.0),
        (0.03, [10, 5, 5], 0.65),
    ] {
        let model = nearly_incompressible(height, cells, mu);
        let loads = walking_stance::scattered_loads(mu);
        let mut unsolved = Vec::new();
        for (k, load) in loads.iter().enumerate() {
            let mut estimator = StanceEstimator::new(Arc::clone(&model), EstimatorSettings::default());
            estimator.touch_down(Foothold::default());
            let report = estimator.step(load);
            if report.status.is_solved() {
                laws_hold(&model, report, load.force.norm());
            } else {
                unsolved.push((k, report.status));
            }
        }
        assert!(20 * unsolved.len() <= loads.len(), "{cells:?}, mu {mu}: {unsolved:?}");
    }
}

#[test]
fn friction_on_nearly_incompressible_soles_allows_several_poses_and_the_same_one_is_always_taken() {
    let model = nearly_incompressible(0.021, [6, 4, 2], 0.65);
    let (mut same, mut other) = (0, 0);
    for load in walking_stance::scattered_loads(0.65) {
        let answer = || {
            let mut estimator = StanceEstimator::new(Arc::clone(&model), tight());
            estimator.touch_down(Foothold::default());
            estimator.step(&load).clone()
        };
        let taken = answer();
        assert_eq!(taken, answer());
        // The paper's scheme goes another way, now and then to another solution of the same equations.
        let settings = NestedSettings { tolerance: 1e-11, ..NestedSettings::default() };
        let nested = NestedEstimator::touch_down(Arc::clone(&model), settings, Foothold::default()).step(&load);
        if taken.status.is_solved() && nested.converged {
            laws_hold(&model, &taken, load.force.norm());
            let (a, b) = (taken.sole_pose.translation, nested.sole_pose.translation);
            let apart = (a - b).norm() / a.norm();
            same += usize::from(apart <= 1e-7);
            other += usize::from(apart >= 1e-4);
        }
    }
    // Which loads part the two ways depends on the last bits of the compliance; that some do and some do not, on the equations.
    assert!(same > 0 && other > 0, "{same} the same, {other} others");
}

#[test]
fn on_very_rough_ground_the_sole_is_glued_until_a_row_lifts_and_every_step_to_the_edge_is_solved() {
    for (cells, sign) in [([5, 4, 2], 1.0), ([5, 4, 2], -1.0), ([12, 7, 3], 1.0), ([12, 7, 3], -1.0)] {
        let model = sole(cells, 0.021, Level::Fem);
        let n = model.contact_points().len();
        let model = Arc::new(model.as_ref().clone().with_friction(vec![100.0; n]).expect("friction"));
        let glued = model.bonded_stiffness().lu();
        let mut estimator = StanceEstimator::new(Arc::clone(&model), EstimatorSettings::default());
        estimator.touch_down(Foothold::default());
        let (mut stuck, mut lifted) = (0, 0);
        for step in 0..=95 {
            let x_m = sign * 0.115 * 0.01 * f64::from(step);
            let report = estimator
                .step(&StanceReference::constant(Vec3::new(0.0, 0.0, WEIGHT_N), Vector2::new(x_m, 0.0)))
                .clone();
            assert!(report.status.is_solved(), "{cells:?}, {x_m}: {:?}", report.status);
            laws_hold(&model, &report, WEIGHT_N);
            if report.sticking == n {
                stuck += 1;
                // One spring, linear: what is left is the way of the points themselves, which moves the moment's arm.
                let linear = glued.solve(&-Vec6::new(0.0, 0.0, WEIGHT_N, 0.0, -x_m * WEIGHT_N, 0.0)).expect("stiff");
                let turned = so3::log(&report.sole_pose.rotation);
                let away = (turned - Vec3::new(linear[3], linear[4], linear[5])).norm();
                assert!(away < 0.01 * linear[4].abs() + 1e-9, "{cells:?}, {x_m}: {turned} instead of {linear}");
                assert!((report.sole_pose.translation.z / linear[2] - 1.0).abs() < 1e-3);
            }
            lifted += usize::from(report.open > 0);
        }
        // Glued inside the middle third, as any footing without tension.
        assert!((28..40).contains(&stuck) && stuck + lifted >= 95, "{stuck} {lifted}");
    }
}

fn foam(young_modulus_pa: f64, cells: [usize; 3]) -> Arc<SoleModel> {
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells };
    let material = Material { young_modulus_pa, poisson_ratio: 0.31 };
    Arc::new(SoleModel::build(&SoleSettings { mesh, material, ..SoleSettings::default() }).expect("a sole"))
}

#[test]
fn foam_pressed_to_half_its_thickness_is_solved_and_said_to_be_doubtful() {
    // Linear elasticity keeps its one solution branch however large the strain; what ends is its validity.
    for cells in [[6, 4, 2], [12, 7, 3]] {
        let model = foam(0.02e6, cells);
        let mut estimator = StanceEstimator::new(Arc::clone(&model), EstimatorSettings::default());
        estimator.touch_down(Foothold::default());
        let (mut doubtful, mut most) = (0, 0.0_f64);
        for tick in 0..TICKS {
            let reference = walking_stance::reference(tick, false);
            let report = estimator.step(&reference).clone();
            laws_hold(&model, &report, reference.force.norm());
            assert_eq!(report.status, honest(&report), "{cells:?}, tick {tick}");
            doubtful += usize::from(report.status != Status::Converged);
            most = most.max(report.compression);
        }
        // All but the ramps' ends, under 65 N coming and 38 N going.
        assert_eq!(doubtful, 182, "{cells:?}");
        assert!((0.75..0.9).contains(&most), "{cells:?}: {most}");
    }
    // Without any tilt it is the compression that speaks: 10 mm of 21 under a centred load.
    let mut estimator = StanceEstimator::new(foam(0.02e6, [6, 4, 2]), EstimatorSettings::default());
    estimator.touch_down(Foothold::default());
    let status = estimator.step(&StanceReference::constant(Vec3::new(0.0, 0.0, WEIGHT_N), Vector2::zeros())).status;
    assert!(matches!(status, Status::DoubtfulCompression { part } if (part - 0.48).abs() < 0.03), "{status:?}");
}

#[test]
fn foam_pressed_beyond_its_thickness_folds_with_the_reason_and_recovers_when_the_load_falls() {
    let mut estimator = StanceEstimator::new(foam(0.005e6, [6, 4, 2]), EstimatorSettings::default());
    for _ in 0..2 {
        estimator.touch_down(Foothold::default());
        let (mut solved, mut shown, mut folds) = (0, 0, Vec::new());
        for tick in 0..TICKS {
            let reference = walking_stance::reference(tick, false);
            let before = estimator.report().compression;
            let model = estimator.model().clone();
            let report = estimator.step(&reference);
            match report.status {
                Status::Fold { fraction, .. } => {
                    assert!(before > 1.0 && (0.0..1.0).contains(&fraction), "tick {tick}: {before} {fraction}");
                    folds.push(tick);
                    shown += 1;
                }
                // Where the curve of equilibria is lost before it turns back.
                Status::NotFound { .. } => {
                    assert!(before > 1.0, "tick {tick}: {before}");
                    folds.push(tick);
                }
                status => {
                    assert!(status.is_solved(), "tick {tick}: {status:?}");
                    laws_hold(&model, report, reference.force.norm());
                    solved += 1;
                }
            }
        }
        assert!(
            solved > 60 && folds.len() > 60 && shown > 0,
            "{solved} solved, {shown} of {} folds shown",
            folds.len()
        );
        // Twice, and each time from the history of the last load carried: when the ZMP comes back from the heel, and, at the toe, when
        // an eighth of the load is left.
        let returns: Vec<usize> =
            folds.windows(2).filter(|w| w[1] > w[0] + 1).map(|w| w[0]).chain(folds.last().copied()).collect();
        assert!(
            returns.len() == 2 && (50..65).contains(&returns[0]) && (180..195).contains(&returns[1]),
            "{returns:?}"
        );
        estimator.lift_off();
    }
}

#[test]
fn a_mesh_of_24000_elements_walks_with_all_its_627_contacts() {
    // Ankle positions of a whole stance.
    let walk = |cells, level, contacts: usize| {
        let model = sole(cells, 0.021, level);
        assert_eq!(model.contact_points().len(), contacts);
        let mut estimator = StanceEstimator::new(Arc::clone(&model), EstimatorSettings::default());
        estimator.touch_down(Foothold::default());
        let ankle = |tick: usize| {
            let reference = walking_stance::reference(tick, false);
            let report = estimator.step(&reference).clone();
            assert_eq!(report.status, Status::Converged, "{cells:?} {level:?}, tick {tick}");
            laws_hold(&model, &report, reference.force.norm());
            report.ankle_pose.translation
        };
        (model.statistics().tetrahedra, (0..TICKS).map(ankle).collect::<Vec<Vec3>>())
    };
    let apart_mm = |a: &[Vec3], b: &[Vec3]| {
        let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum();
        1e3 * (squares / a.len() as f64).sqrt()
    };
    let (tetrahedra, finest) = walk([32, 18, 7], Level::Fem, 33 * 19);
    assert_eq!(tetrahedra, 24192);
    // 42 patches of the same mesh stand for its 627 contacts within 0.02 mm of 3.8 mm (rms), an eighth of what 1512 elements miss
    // on 104 contacts against a sole without the stiffness of linear elements.
    let (_, patches) = walk([32, 18, 7], Level::Patches { cells: [6, 5] }, 42);
    assert!(apart_mm(&patches, &finest) < 0.02, "patches {} mm", apart_mm(&patches, &finest));
    // That stiffness falls with the size of the elements: first order, because of the edges of clamping and contact.
    let (_, truth) = walk([12, 7, 3], Level::QuadraticFem, 13 * 8);
    let (_, coarse) = walk([12, 7, 3], Level::Fem, 13 * 8);
    let (_, fine) = walk([23, 13, 6], Level::Fem, 24 * 14);
    let [coarse, fine, finest] = [coarse, fine, finest].map(|ankles| apart_mm(&ankles, &truth));
    assert!(coarse < 0.12 && fine < 0.05 && finest < 0.03, "{coarse} {fine} {finest} mm");
    for (of, order) in [
        ("1512 to 10764", (coarse / fine).ln() / (23.0_f64 / 12.0).ln()),
        ("to 24192", (fine / finest).ln() / (32.0_f64 / 23.0).ln()),
    ] {
        assert!((0.9..1.6).contains(&order), "order {order} from {of} elements");
    }
}

#[test]
fn a_hundred_thousand_ticks_do_not_drift() {
    // K_c is updated some hundred thousand times. What the estimator promises: laws, checked from the compliance, off by no more
    // than its tolerance (anything more is repaired in the tick), but not less than 1e-11 of the load. Seen: the tolerance met to
    // all but the last digits at 1e-9, where the iteration stops as soon as it may, and 1.4e-12 at 1e-12, in the first ten
    // thousand ticks as in the last.
    let [coarse, fine] = [1e-9, 1e-12].map(hundred_thousand_ticks);
    assert!(coarse.worst[0].max(coarse.worst[1]) <= 1e-9, "{:?}", coarse.worst);
    assert!(fine.worst[0].max(fine.worst[1]) <= 1e-11, "{:?}", fine.worst);
    assert!(fine.worst[1] < 1.5 * fine.worst[0], "rounding has piled up: {:?}", fine.worst);
    // The foot has crept by centimetres; a tolerance of 1e-9 changes that by nanometres.
    let (a, b) = (coarse.end, fine.end);
    assert!((0.01..0.05).contains(&b.norm()) && (a - b).norm() < 1e-8, "{a} {b}");
}

struct Endurance {
    /// Largest violation of the laws over the load, in the first and the last tenth.
    worst: [f64; 2],
    end: Vec3,
}

fn hundred_thousand_ticks(tolerance: f64) -> Endurance {
    let model = sole([4, 3, 1], 0.021, Level::Fem);
    let settings = EstimatorSettings { tolerance, ..EstimatorSettings::default() };
    let mut estimator = StanceEstimator::new(Arc::clone(&model), settings);
    estimator.touch_down(Foothold::default());
    let mut worst = [0.0_f64; 10];
    for tick in 0..100_000_u32 {
        let t = f64::from(tick) * 0.005;
        // The foot creeps under such a load, by metres in the end: the ZMP stays under it.
        let zmp =
            estimator.report().sole_pose.point(&Vec3::new(0.06 * (1.3 * t).sin(), 0.03 * (2.1 * t).sin(), 0.0)).xy();
        let force = Vec3::new(60.0 * (1.7 * t).sin(), 40.0 * (0.9 * t).cos(), 350.0 + 100.0 * (3.1 * t).sin());
        let report = estimator.step(&StanceReference::constant(force, zmp));
        assert!(report.status.is_solved(), "tick {tick}: {:?}", report.status);
        let tenth = &mut worst[(tick / 10_000) as usize];
        *tenth = tenth.max(report.law_violation_n / force.norm());
    }
    let most = worst.iter().copied().fold(0.0, f64::max);
    assert!(most <= 1e-11_f64.max(tolerance), "the contact laws are off by {most} of the load");
    Endurance { worst: [worst[0], worst[9]], end: estimator.report().sole_pose.translation }
}
