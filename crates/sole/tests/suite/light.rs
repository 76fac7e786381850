//! Light loads, soles with side faces as contact points, and what is no load or no place at all.

use crate::stances::{laws_hold, sole};
use nalgebra::Vector2;
use sole::{
    Cause, ContactSet, EstimatorSettings, Foothold, Level, Material, MeshSource, SoleModel, SoleSettings,
    StanceEstimator, StanceReference, Status,
};
use spatial::Vec3;
use std::sync::Arc;

fn vertical(load_n: f64, x_m: f64, y_m: f64) -> StanceReference {
    StanceReference::constant(load_n * Vec3::z(), Vector2::new(x_m, y_m))
}

fn first_tick(model: &Arc<SoleModel>, load: &StanceReference) -> sole::StanceReport {
    let mut estimator = StanceEstimator::new(Arc::clone(model), EstimatorSettings::default());
    estimator.touch_down(Foothold::default());
    estimator.step(load).clone()
}

#[test]
fn side_faces_in_the_air_change_nothing_at_any_load() {
    let with = |contact| {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [6, 4, 3] };
        Arc::new(SoleModel::build(&SoleSettings { mesh, contact, ..SoleSettings::default() }).expect("a sole"))
    };
    let (bottom, all) = (with(ContactSet::Bottom), with(ContactSet::All));
    assert!(all.contact_points().len() > bottom.contact_points().len());
    for load_n in [1e-3, 0.05, 0.5, 2.0, 20.0, 383.0, 1500.0] {
        for (x_m, y_m) in [(0.0, 0.0), (0.03, -0.02), (-0.07, 0.01)] {
            let load = vertical(load_n, x_m, y_m);
            let [a, b] = [&bottom, &all].map(|model| first_tick(model, &load));
            assert!(a.status.is_solved() && b.status.is_solved(), "{load_n} N: {:?} {:?}", a.status, b.status);
            assert!(
                b.slow == a.slow && b.iterations <= a.iterations + 3,
                "{load_n} N: {} {}",
                a.iterations,
                b.iterations
            );
            let apart = (a.sole_pose.translation - b.sole_pose.translation).norm();
            assert!(apart < 1e-9 * (1.0 + load_n), "{load_n} N at {x_m}, {y_m}: {apart} m");
        }
    }
}

#[test]
fn a_load_below_rounding_is_told_and_one_above_is_exact() {
    let model = sole([5, 4, 2], 0.021, Level::Fem);
    for load_n in [1e-12, 1e-9, 5e-324, f64::MIN_POSITIVE] {
        match first_tick(&model, &vertical(load_n, 0.01, 0.0)).status {
            Status::TooLight { normal_n, least_n } => {
                assert!(normal_n == load_n && (1e-9..1e-6).contains(&least_n), "{least_n}");
            }
            other => panic!("{load_n} N: {other:?}"),
        }
    }
    // Linear but for the moment's arm: what a newton sinks over a newton.
    let heavy = first_tick(&model, &vertical(1.0, 0.01, 0.0));
    for load_n in [1e-6, 1e-4, 0.01] {
        let light = first_tick(&model, &vertical(load_n, 0.01, 0.0));
        assert_eq!(light.status, Status::Converged, "{load_n} N");
        assert!(light.residual <= 1e-3 && (light.wrench.force.z / load_n - 1.0).abs() < 1e-3, "{load_n} N");
        let ratio = light.sole_pose.translation.z / heavy.sole_pose.translation.z / load_n;
        assert!((ratio - 1.0).abs() < 0.01, "{load_n} N: {ratio}");
    }
}

#[test]
fn whole_turns_of_the_heading_change_nothing_and_no_place_is_told() {
    let model = sole([5, 4, 2], 0.021, Level::Fem);
    let land = |yaw_rad: f64, x_m: f64| {
        let mut estimator = StanceEstimator::new(Arc::clone(&model), EstimatorSettings::default());
        estimator.touch_down(Foothold { x_m, y_m: 0.0, yaw_rad });
        estimator.step(&vertical(100.0, 0.02, 0.01)).clone()
    };
    let straight = land(1.0, 0.0);
    for turns in [1.0, -3.0, 1000.0, 1e7] {
        let turned = land(1.0 + turns * std::f64::consts::TAU, 0.0);
        assert_eq!(turned.status, Status::Converged, "{turns} turns");
        let apart = (turned.sole_pose.rotation - straight.sole_pose.rotation).norm();
        assert!(apart < 1e-8, "{turns} turns: {apart}");
    }
    assert_eq!(land(1e4, 0.0).status, Status::Converged);
    for (yaw_rad, x_m) in [(f64::NAN, 0.0), (0.0, f64::INFINITY), (1e300, 0.0), (0.0, -1e12)] {
        assert_eq!(land(yaw_rad, x_m).status, Status::InvalidInput, "{yaw_rad} {x_m}");
    }
}

#[test]
fn what_is_not_found_is_not_called_a_fold_and_the_other_way_round() {
    // Nearly incompressible: the states run in circles, and where no way leads on, it is said which of the two it is.
    let soft = |poisson_ratio, young_modulus_pa| {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [6, 4, 2] };
        let material = Material { young_modulus_pa, poisson_ratio };
        Arc::new(SoleModel::build(&SoleSettings { mesh, material, ..SoleSettings::default() }).expect("a sole"))
    };
    let model = soft(0.4999, 0.32e6);
    let mut seen = 0;
    for load in crate::walking_stance::scattered_loads(0.65) {
        let report = first_tick(&model, &load);
        match report.status {
            Status::NotFound { cause } => {
                assert!(matches!(cause, Cause::Circling | Cause::Steps | Cause::Work | Cause::Laws), "{cause:?}");
                seen += 1;
            }
            // Friction folds the curve here and there.
            Status::Fold { fraction, .. } => assert!((0.0..1.0).contains(&fraction), "{fraction}"),
            status => {
                assert!(status.is_solved(), "{status:?}");
                laws_hold(&model, &report, load.force.norm());
            }
        }
    }
    assert!(seen < 40, "some are found");
    // So soft that it is pressed to a multiple of its thickness: flat, the equations have a solution, and it is found.
    let mush = first_tick(&soft(0.31, 1e3), &vertical(383.0, 0.0, 0.0));
    assert!(matches!(mush.status, Status::DoubtfulCompression { part } if part > 5.0), "{:?}", mush.status);
    // Beyond the fold of the first tick there is none, and that is shown.
    let fold = first_tick(&sole([10, 5, 5], 0.03, Level::Fem), &vertical(383.0, 0.95 * 0.115, 0.0));
    match fold.status {
        Status::Fold { fraction, .. } => assert!((fraction * 0.95 - 0.910).abs() < 0.002, "{fraction}"),
        other => panic!("{other:?}"),
    }
}
