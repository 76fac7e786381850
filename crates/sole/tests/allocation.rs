//! The tick does not allocate.

#[path = "suite/walking_stance.rs"]
mod walking_stance;

use nalgebra::Vector2;
use sole::{
    EstimatorSettings, Foothold, Plane, PoseDrivenContact, PoseDrivenSettings, SoleModel, SoleSettings,
    StanceEstimator, StanceReference, Status,
};
use spatial::{Transform, Vec3, so3};
use std::sync::Arc;

fn allocations(work: impl FnOnce()) -> u64 {
    allocation_counter::measure(work).count_total
}

#[test]
fn the_guard_fires() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![1_u8; 100]))), 1);
}

#[test]
fn a_stance_of_the_estimator_does_not_allocate() {
    let model = Arc::new(SoleModel::build(&SoleSettings::default()).expect("a sole"));
    let estimator = StanceEstimator::new(model, EstimatorSettings::default());
    // A clone has the room that its original was made with.
    let mut estimator = estimator.clone();
    for mirror in [false, true] {
        let references: Vec<_> =
            (0..walking_stance::TICKS).map(|tick| walking_stance::reference(tick, mirror)).collect();
        let count = allocations(|| {
            estimator.touch_down(Foothold::default());
            for reference in &references {
                assert!(estimator.step(reference).status.is_solved());
            }
            estimator.lift_off();
        });
        assert_eq!(count, 0);
    }
}

#[test]
fn with_its_work_bounded_the_estimator_does_not_allocate_where_it_fails_either() {
    let model = Arc::new(SoleModel::build(&SoleSettings::default()).expect("a sole"));
    let settings = EstimatorSettings::default();
    let mut estimator = StanceEstimator::new(model, settings);
    // No bound that a tick could reach: what is left out are the slow ways.
    estimator.bound_work(u64::MAX);
    let load = |newtons: f64, x_m: f64| StanceReference::constant(Vec3::z() * newtons, Vector2::new(x_m, 0.0));
    let (centred, beyond_the_fold, outside) = (load(380.0, 0.0), load(380.0, 0.113), load(380.0, 0.2));
    let mut broken = centred;
    broken.force.x = f64::NAN;
    let mut seen = [Status::InAir; 5];
    let count = allocations(|| {
        estimator.touch_down(Foothold::default());
        let ticks = [&beyond_the_fold, &centred, &beyond_the_fold, &outside, &broken];
        for (seen, reference) in seen.iter_mut().zip(ticks) {
            let report = estimator.step(reference);
            assert!(!report.slow && report.iterations <= 2 * settings.iterations_max);
            *seen = report.status;
        }
    });
    assert_eq!(count, 0);
    let [fold, solved, leap, outside, broken] = seen;
    assert_eq!((solved, broken), (Status::Converged, Status::InvalidInput));
    assert!(
        matches!(fold, Status::NotFound { .. }),
        "the slow ways, which would show that it folds, are left out: {fold:?}"
    );
    assert!(matches!(leap, Status::NotFound { .. }), "by far more than Newton follows in one go: {leap:?}");
    assert!(matches!(outside, Status::ZmpOutsideSole { .. }));
}

#[test]
fn whatever_is_asked_within_bounded_work_does_not_allocate() {
    let sole = SoleModel::build(&SoleSettings::default()).expect("a sole");
    let points = sole.contact_points().len();
    let frictionless = sole.clone().with_friction(vec![0.0; points]).expect("no friction");
    let load =
        |x_n: f64, z_n: f64, y_m: f64| StanceReference::constant(Vec3::new(x_n, 0.0, z_n), Vector2::new(0.0, y_m));
    let mut asked = walking_stance::scattered_loads(0.65);
    // Tilted little by little by more than five degrees, pressed by more than a tenth, pulled, pushed aside, and light again.
    asked.extend([0.0, 0.03, 0.04, 0.045, 0.05, 0.053, 0.055, 0.056].map(|y_m| load(0.0, 383.0, y_m)));
    asked.extend([load(0.0, 3000.0, 0.0), load(0.0, -1.0, 0.0), load(300.0, 383.0, 0.0)]);
    asked.extend([load(0.0, 0.1, 0.0), load(0.0, 1e8, 0.0)]);
    let mut seen = std::collections::BTreeSet::new();
    let mut names: Vec<Status> = Vec::with_capacity(1000);
    for (model, multiplications) in [(&sole, u64::MAX), (&sole, 8_000_000), (&sole, 1), (&frictionless, 8_000_000)] {
        let mut estimator = StanceEstimator::new(model.clone(), EstimatorSettings::default());
        estimator.bound_work(multiplications);
        let count = allocations(|| {
            names.push(estimator.step(&asked[0]).status);
            for every_load_lands in [true, false] {
                for reference in &asked {
                    if every_load_lands || names.len().is_multiple_of(50) {
                        estimator.lift_off();
                        estimator.touch_down(Foothold { x_m: 0.1, y_m: -0.2, yaw_rad: 0.3 });
                        estimator.touch_down(Foothold::default());
                    }
                    names.push(estimator.step(reference).status);
                }
            }
        });
        assert_eq!(count, 0, "{multiplications}");
    }
    seen.extend(names.iter().map(|status| format!("{status:?}").split(' ').next().unwrap_or_default().to_owned()));
    for status in ["Converged", "DoubtfulTilt", "DoubtfulCompression", "Indeterminate", "InAir", "NoLoad", "NotFound"] {
        assert!(seen.contains(status), "{status} is not among {seen:?}");
    }
    assert!(seen.contains("OutsideFrictionCone"), "{seen:?}");
}

#[test]
fn the_plant_s_contact_does_not_allocate() {
    let model = SoleModel::build(&SoleSettings::default()).expect("a sole");
    let settings = PoseDrivenSettings { viscosity_time_s: 0.02, ..PoseDrivenSettings::default() };
    let mut contact = PoseDrivenContact::new(model, settings).clone();
    let count = allocations(|| {
        for step in 0..300 {
            let t = 0.005 * f64::from(step);
            let pose = Transform::new(
                so3::from_roll_pitch_yaw(0.01 * (5.0 * t).sin(), 0.015 * (3.0 * t).sin(), 0.0),
                Vec3::new(1e-3 * (4.0 * t).sin(), 0.0, 1.2e-3 * (2.0 * t).cos() - 0.3e-3),
            );
            if step % 2 == 0 {
                contact.evaluate(&pose, &Plane, 1e-3);
            } else {
                contact.attempt(&pose, &Plane, 1e-3);
                contact.tangent();
                contact.complete();
            }
            contact.commit();
        }
    });
    assert_eq!(count, 0);
}
