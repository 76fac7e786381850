//! A stance far from the world's origin is the stance at the origin.

use crate::walking_stance::{self, TICKS};
use nalgebra::Vector2;
use sole::{EstimatorSettings, Foothold, MeshSource, SoleModel, SoleSettings, StanceEstimator, StanceReport, Status};
use spatial::{Vec3, so3};
use std::sync::Arc;

const YAW_RAD: f64 = 0.7;

/// Every tick of a walking stance at a foothold.
fn stance(model: &Arc<SoleModel>, x_m: f64, y_m: f64) -> Vec<StanceReport> {
    let settings = EstimatorSettings { tolerance: 1e-12, ..EstimatorSettings::default() };
    let mut estimator = StanceEstimator::new(Arc::clone(model), settings);
    estimator.touch_down(Foothold { x_m, y_m, yaw_rad: YAW_RAD });
    let turn = so3::about_z(YAW_RAD);
    let step = |tick| {
        let mut reference = walking_stance::reference(tick, false);
        for z in &mut reference.zmp {
            *z = (turn * Vec3::new(z.x, z.y, 0.0)).xy();
        }
        reference.zmp[0] += Vector2::new(x_m, y_m);
        estimator.step(&reference).clone()
    };
    (0..TICKS).map(step).collect()
}

#[test]
fn a_stance_ten_kilometres_away_is_the_same_down_to_the_digits_a_position_has_there() {
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [12, 7, 3] };
    let model = Arc::new(SoleModel::build(&SoleSettings { mesh, ..SoleSettings::default() }).expect("a sound sole"));
    let offset = Vec3::new(8000.0, -6000.0, 0.0);
    // The wanted ZMP is rounded to the digits a position has there (half a unit in the last place of each coordinate).
    let digits_m = f64::EPSILON * offset.norm();
    let (here, there) = (stance(&model, 0.0, 0.0), stance(&model, offset.x, offset.y));
    for (tick, (here, there)) in here.iter().zip(&there).enumerate() {
        assert_eq!((here.status, there.status), (Status::Converged, Status::Converged), "tick {tick}");
        let moved = there.sole_pose.translation - offset;
        // A ZMP that moves by a digit moves the pose by about as much, at the edge more; the answer is rounded once again.
        let apart = (moved - here.sole_pose.translation).norm();
        assert!(apart < 10.0 * digits_m, "tick {tick}: apart by {apart} m");
        let turned = so3::log(&(there.sole_pose.rotation * here.sole_pose.rotation.transpose())).norm();
        assert!(turned < 10.0 * digits_m / 0.021, "tick {tick}: turned by {turned} rad");
        let load = here.wrench.force.norm();
        for (a, b) in here.node_forces.iter().zip(&there.node_forces) {
            assert!((a - b).norm() < 1e-9 * load, "tick {tick}: {} N of {load}", (a - b).norm());
        }
    }
}

#[test]
fn the_room_before_solving_is_said() {
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [6, 4, 2] };
    let model = SoleModel::build(&SoleSettings { mesh, ..SoleSettings::default() }).expect("a sound sole");
    let friction = model.friction()[0];
    let toe = model.contact_points().iter().map(|p| p.x).fold(f64::MIN, f64::max);
    let mut estimator = StanceEstimator::new(model, EstimatorSettings::default());
    estimator.touch_down(Foothold { x_m: 3.0, y_m: -2.0, yaw_rad: 0.0 });
    assert_eq!((estimator.report().zmp_margin_m, estimator.report().friction_use), (None, None));
    let ask = |estimator: &mut StanceEstimator, inside_m: f64, use_: f64| {
        let zmp = Vector2::new(3.0 + toe - inside_m, -2.0);
        let force = Vec3::new(0.0, use_ * friction * 300.0, 300.0);
        let report = estimator.step(&sole::StanceReference::constant(force, zmp)).clone();
        let (margin_m, used) = (report.zmp_margin_m.expect("asked"), report.friction_use.expect("asked"));
        assert!((margin_m - inside_m).abs() < 1e-12, "{margin_m}");
        assert!((used - use_).abs() < 1e-12, "{used}");
        report.status
    };
    // Nothing is solved by the first two, so that the sole stands where it landed.
    assert!(matches!(ask(&mut estimator, -0.01, 0.1), Status::ZmpOutsideSole { by_m } if (by_m - 0.01).abs() < 1e-12));
    assert!(matches!(ask(&mut estimator, 0.03, 1.2), Status::OutsideFrictionCone { .. }));
    assert!(ask(&mut estimator, 0.05, 0.1).is_solved());
}
