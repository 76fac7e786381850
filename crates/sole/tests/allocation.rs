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
    let mut estimator = StanceEstimator::new(model, EstimatorSettings::default());
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
    assert_eq!((fold, solved, broken), (Status::NotConverged, Status::Converged, Status::InvalidInput));
    assert_eq!(leap, Status::NotConverged, "by far more than Newton follows in one go");
    assert!(matches!(outside, Status::ZmpOutsideSole { .. }));
}

#[test]
fn the_plant_s_contact_does_not_allocate() {
    let model = SoleModel::build(&SoleSettings::default()).expect("a sole");
    let settings = PoseDrivenSettings { viscosity_time_s: 0.02, ..PoseDrivenSettings::default() };
    let mut contact = PoseDrivenContact::new(model, settings);
    let count = allocations(|| {
        for step in 0..300 {
            let t = 0.005 * f64::from(step);
            let pose = Transform::new(
                so3::from_roll_pitch_yaw(0.01 * (5.0 * t).sin(), 0.015 * (3.0 * t).sin(), 0.0),
                Vec3::new(1e-3 * (4.0 * t).sin(), 0.0, 1.2e-3 * (2.0 * t).cos() - 0.3e-3),
            );
            contact.evaluate(&pose, &Plane, 1e-3);
            contact.commit();
        }
    });
    assert_eq!(count, 0);
}
