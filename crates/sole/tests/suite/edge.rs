//! The zero-moment point on its way to the sole's edge: where is there no pose?
//!
//! It depends on what holds the contact points. At the first tick (35) their references are the tilted undeformed sole's projections
//! about the foothold: a tilt theta draws the loaded edge in by `L/2 (1 - cos theta)` and the ZMP reached passes a maximum: a fold. At
//! all later ticks the points stay where they stick, so the sole rolls about an edge that does not move and there is no fold before the
//! edge itself; what ends is the validity of linear elasticity. Walking starts a stance at 0.05 N, where nothing tilts: the fold at
//! full load is one of the first tick alone.

use nalgebra::Vector2;
use sole::{
    EstimatorSettings, Foothold, MeshSource, SoleModel, SoleSettings, StanceEstimator, StanceReference, StanceReport,
    Status,
};
use spatial::{Mat6, Transform, Vec3, so3};
use std::sync::Arc;

const HALF_LENGTH_M: f64 = 0.115;
const LOAD_N: f64 = 383.0;

fn sole_of(cells: [usize; 3], friction: f64) -> Arc<SoleModel> {
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.03], cells };
    Arc::new(SoleModel::build(&SoleSettings { mesh, friction, ..SoleSettings::default() }).expect("a sole"))
}

fn sole() -> Arc<SoleModel> {
    sole_of([10, 5, 5], 0.65)
}

/// The load with its ZMP at this part of the half-length.
fn at(part: f64, load_n: f64) -> StanceReference {
    StanceReference::constant(Vec3::new(0.0, 0.0, load_n), Vector2::new(part * HALF_LENGTH_M, 0.0))
}

fn landed(model: &Arc<SoleModel>) -> StanceEstimator {
    let mut estimator = StanceEstimator::new(Arc::clone(model), EstimatorSettings::default());
    estimator.touch_down(Foothold::default());
    estimator
}

fn tilt_rad(estimator: &StanceEstimator) -> f64 {
    estimator.report().sole_pose.rotation[(2, 2)].acos()
}

/// What a solved tick must say of itself under the default limits.
pub fn honest(report: &StanceReport) -> Status {
    let settings = EstimatorSettings::default();
    let (tilt_rad, part) = (report.sole_pose.rotation[(2, 2)].acos(), report.compression);
    if tilt_rad > settings.tilt_doubtful_rad {
        Status::DoubtfulTilt { tilt_rad }
    } else if part > settings.compression_doubtful {
        Status::DoubtfulCompression { part }
    } else {
        Status::Converged
    }
}

fn front_edge_m(estimator: &StanceEstimator) -> f64 {
    estimator.report().node_positions.iter().map(|p| p.x).fold(f64::MIN, f64::max)
}

/// Smallest singular value of the tangent about a fixed point at fixed references, angles in units of 1/(0.1 m) (N/m).
fn smallest_stiffness(estimator: &StanceEstimator) -> f64 {
    let report = estimator.report();
    let mut fixed = report.tangent;
    let mut lower = fixed.fixed_view_mut::<3, 3>(3, 0);
    lower -= so3::skew(&report.wrench.force);
    let unit = |i: usize| if i < 3 { 1.0 } else { 0.1 };
    Mat6::from_fn(|i, j| fixed[(i, j)] / (unit(i) * unit(j))).singular_values().min()
}

#[test]
fn at_the_first_tick_the_tilt_draws_the_edge_in_and_the_zmp_folds() {
    let model = sole();
    let parts = [0.906, 0.908, 0.910];
    let reached = parts.map(|part| {
        let mut estimator = landed(&model);
        let status = estimator.step(&at(part, LOAD_N)).status;
        assert!(matches!(status, Status::DoubtfulTilt { .. }), "{part}: {status:?}");
        // The references follow the tilt: the edge comes in by L/2 (1 - cos) (the foam bulges the other way, by less than 0.5 mm).
        let drawn_in = HALF_LENGTH_M * (1.0 - tilt_rad(&estimator).cos());
        assert!((HALF_LENGTH_M - front_edge_m(&estimator) - drawn_in).abs() < 5e-4, "{part}: by {drawn_in} m");
        tilt_rad(&estimator)
    });
    // Near a fold the tilt goes like the square root of the way left: ever faster.
    let faster = (reached[2] - reached[1]) / (reached[1] - reached[0]);
    assert!(faster > 1.3, "tilts {reached:?}");
    for part in [0.92, 0.95, 0.99] {
        match landed(&model).step(&at(part, LOAD_N)).status {
            // The limit is the same whatever was asked for: 0.909 to 0.911.
            Status::Fold { reached_zmp_m, .. } => {
                assert!((reached_zmp_m.x / HALF_LENGTH_M - 0.910).abs() < 0.002, "{part}: {reached_zmp_m}");
            }
            other => panic!("{part}: {other:?}"),
        }
    }
}

#[test]
fn a_standing_sole_rolls_about_its_edge_and_does_not_fold() {
    let model = sole();
    let mut estimator = landed(&model);
    let (mut before, mut stiffness_at_092) = (0.0, 0.0);
    // Steps of a tenth of a millimetre.
    let steps = 1139;
    for step in 0..=steps {
        let part = f64::from(step) * 1e-4 / HALF_LENGTH_M;
        let status = estimator.step(&at(part, LOAD_N)).status;
        let tilt = tilt_rad(&estimator);
        assert_eq!(status, honest(estimator.report()), "{part}");
        // One branch: the tilt grows steadily, half a degree per tenth of a millimetre at most.
        assert!(tilt > before - 1e-6 && tilt < before + 0.5_f64.to_radians(), "{part}: from {before} to {tilt} rad");
        before = tilt;
        // The edge holds its place: friction moves it by less than half a millimetre.
        assert!((front_edge_m(&estimator) - HALF_LENGTH_M).abs() < 5e-4, "{part}");
        // No singular tangent: it falls when a row of points lifts, not towards a limit.
        let stiffness = smallest_stiffness(&estimator);
        if (part - 0.92).abs() < 5e-4 {
            stiffness_at_092 = stiffness;
        }
        assert!(part < 0.92 || stiffness > 0.6 * stiffness_at_092, "{part}: {stiffness} N/m of {stiffness_at_092}");
    }
    assert!(before > 23.0_f64.to_radians(), "{before}");
    // Past the edge there is nothing to stand on, and that is what is said.
    match estimator.step(&at(1.01, LOAD_N)).status {
        // Measured across the sole's edge, which has turned a little, from the point furthest out.
        Status::ZmpOutsideSole { by_m } => assert!(by_m > 0.0 && by_m <= 0.01 * HALF_LENGTH_M, "{by_m}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_way_to_the_edge_but_the_first_tick_s_ends_at_the_same_tilt() {
    let model = sole();
    for part in [0.85, 0.95, 0.99] {
        let mut steps = landed(&model);
        for step in 0..=500 {
            assert!(steps.step(&at(part * f64::from(step) / 500.0, LOAD_N)).status.is_solved());
        }
        let mut leap = landed(&model);
        leap.step(&at(0.0, LOAD_N));
        assert!(leap.step(&at(part, LOAD_N)).status.is_solved());
        // Cold, but with references held where the undeformed points are, as at every later tick.
        let mut held = landed(&model);
        let previous: Vec<_> = model.contact_points().iter().map(Vec3::xy).collect();
        held.resume(Transform::identity(), &previous);
        assert!(held.step(&at(part, LOAD_N)).status.is_solved());
        // Cold, as in walking: the ZMP is at the edge from touch-down on and the load grows from 0.05 N.
        let mut ramp = landed(&model);
        let mut load_n = 0.05;
        while load_n < LOAD_N {
            assert!(ramp.step(&at(part, load_n)).status.is_solved(), "{part}: {load_n} N");
            load_n = f64::min(1.1 * load_n, load_n + 4.0);
        }
        assert!(ramp.step(&at(part, LOAD_N)).status.is_solved());
        // One tick from standing and one tick from held references: nothing has slid before, so the same problem.
        assert!((tilt_rad(&leap) - tilt_rad(&held)).abs() < 1e-8, "{part}");
        // The others differ by what slid on the way (friction has a history): 2 % of the tilt.
        for other in [&steps, &ramp] {
            let difference = tilt_rad(other) / tilt_rad(&leap) - 1.0;
            assert!(difference.abs() < 0.02, "{part}: {difference}");
        }
    }
}

#[test]
fn friction_does_not_decide_whether_there_is_a_fold() {
    // Without a net horizontal force nothing draws the edge in, however slippery the ground: the sole's centre moves out instead.
    for mu in [0.02, 0.1, 0.3, 1.5] {
        let mut estimator = landed(&sole_of([10, 5, 5], mu));
        for step in 0..=990 {
            let status = estimator.step(&at(f64::from(step) * 1e-3, LOAD_N)).status;
            assert!(status.is_solved(), "friction {mu}, step {step}: {status:?}");
        }
        assert!(estimator.report().sole_pose.translation.x > 0.005);
        assert!((20.0..26.0).contains(&tilt_rad(&estimator).to_degrees()), "friction {mu}: {}", tilt_rad(&estimator));
    }
}

#[test]
fn the_tilt_at_the_edge_is_a_matter_of_the_mesh() {
    // The pressed strip is narrower than any element: P1 tetrahedra twice as fine answer with almost twice the tilt.
    let tilt_deg = |cells| {
        let mut estimator = landed(&sole_of(cells, 0.65));
        estimator.step(&at(0.0, LOAD_N));
        let status = estimator.step(&at(0.99, LOAD_N)).status;
        assert!(matches!(status, Status::DoubtfulTilt { .. }), "{cells:?}: {status:?}");
        tilt_rad(&estimator).to_degrees()
    };
    let (coarse, fine) = (tilt_deg([10, 5, 5]), tilt_deg([23, 13, 6]));
    assert!((23.0..26.0).contains(&coarse) && (42.0..46.0).contains(&fine), "{coarse} {fine}");
}
