//! Rates, compliance and Jacobian that the estimator reports, against differences of what it answers and an independent code.

use crate::reference_cases::{cases, estimator, model, number, pair, vector};
use crate::walking_stance;
use nalgebra::{Matrix6, SMatrix, Vector2};
use sole::{
    EstimatorSettings, Foothold, MeshSource, SoleModel, SoleSettings, StanceEstimator, StanceReference, StanceReport,
};
use spatial::{Transform, Vec3, Vec6, so3};
use std::sync::Arc;

fn sole() -> Arc<SoleModel> {
    let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [5, 4, 2] };
    let ankle_in_sole_m = [0.03, -0.01, 0.1];
    let settings = SoleSettings { mesh, ankle_in_sole_m: Vec3::from(ankle_in_sole_m), ..SoleSettings::default() };
    Arc::new(SoleModel::build(&settings).expect("a sound sole"))
}

/// After the ticks of a walking stance before `stop`.
fn on_the_way(stop: usize) -> StanceEstimator {
    let settings = EstimatorSettings { tolerance: 1e-12, ..EstimatorSettings::default() };
    let mut estimator = StanceEstimator::new(sole(), settings);
    estimator.touch_down(Foothold::default());
    for tick in 0..stop {
        estimator.step(&walking_stance::reference(tick, false));
    }
    estimator
}

/// What a copy answers.
fn answer(estimator: &StanceEstimator, reference: &StanceReference) -> StanceReport {
    let mut copy = estimator.clone();
    let report = copy.step(reference).clone();
    assert!(report.status.is_solved(), "{:?}", report.status);
    report
}

/// From one pose to another: way of the origin, rotation vector in the world.
fn difference(from: &Transform, to: &Transform) -> Vec6 {
    let turn = so3::log(&(to.rotation * from.rotation.transpose()));
    let way = to.translation - from.translation;
    Vec6::new(way.x, way.y, way.z, turn.x, turn.y, turn.z)
}

/// Lengths count as over 0.1 m.
fn scaled_norm(v: &Vec6) -> f64 {
    (10.0 * v.fixed_rows::<3>(0)).norm().hypot(v.fixed_rows::<3>(3).norm())
}

#[test]
fn the_ankles_twist_and_both_accelerations_are_derivatives_of_the_poses() {
    for stop in [60, 110, 178] {
        let estimator = on_the_way(stop);
        let base = walking_stance::reference(stop, false);
        let at = |t: f64| {
            let mut moved = base;
            moved.force = base.force + t * base.force_rate + 0.5 * t * t * base.force_acceleration;
            moved.zmp[0] = base.zmp[0] + t * base.zmp[1] + 0.5 * t * t * base.zmp[2];
            answer(&estimator, &moved)
        };
        // Rounding, 1e-15 over the square of the step, and what the fourth derivative leaves out, its square, are both small here.
        let h = 2e-4;
        let (before, here, after) = (at(-h), at(0.0), at(h));
        let same = before.node_states == after.node_states && before.node_states == here.node_states;
        assert!(same, "stop {stop}: choose a tick whose states do not change");
        for (what, pose, twist, acceleration) in [
            ("sole", [&before, &here, &after].map(|r| r.sole_pose), here.twist, here.acceleration),
            ("ankle", [&before, &here, &after].map(|r| r.ankle_pose), here.ankle_twist, here.ankle_acceleration),
        ] {
            let (to, from) = (difference(&pose[1], &pose[2]), difference(&pose[0], &pose[1]));
            let velocity = (to + from) / (2.0 * h);
            let error = scaled_norm(&(velocity - twist_of(&twist))) / scaled_norm(&twist_of(&twist));
            assert!(error < 1e-4, "{what}, stop {stop}: twist off by {error}");
            let second = (to - from) / (h * h);
            let error = scaled_norm(&(second - twist_of(&acceleration))) / scaled_norm(&twist_of(&acceleration));
            assert!(error < 1e-3, "{what}, stop {stop}: acceleration off by {error}");
        }
    }
}

/// Linear before angular.
fn twist_of(twist: &spatial::Twist) -> Vec6 {
    let (v, w) = (twist.linear, twist.angular);
    Vec6::new(v.x, v.y, v.z, w.x, w.y, w.z)
}

#[test]
fn the_compliance_is_the_change_of_pose_with_the_wrench() {
    for stop in [60, 110, 178] {
        let estimator = on_the_way(stop);
        let mut base = walking_stance::reference(stop, false);
        (base.force_rate, base.force_acceleration) = (Vec3::zeros(), Vec3::zeros());
        let here = answer(&estimator, &base);
        let identity = here.compliance * here.tangent;
        assert!((identity - Matrix6::identity()).amax() < 1e-9, "stop {stop}: {identity}");
        let load = base.force.norm();
        let changes = [
            (Vec3::new(1e-5 * load, 0.0, 0.0), Vector2::zeros()),
            (Vec3::new(0.0, 1e-5 * load, 0.0), Vector2::zeros()),
            (Vec3::new(0.0, 0.0, 1e-5 * load), Vector2::zeros()),
            (Vec3::zeros(), Vector2::new(1e-6, 0.0)),
            (Vec3::zeros(), Vector2::new(0.0, 1e-6)),
        ];
        for (k, (force, zmp)) in changes.into_iter().enumerate() {
            let at = |sign: f64| {
                let mut moved = base;
                moved.force += sign * force;
                moved.zmp[0] += sign * zmp;
                answer(&estimator, &moved)
            };
            let (minus, plus) = (at(-1.0), at(1.0));
            assert!(minus.node_states == plus.node_states, "stop {stop}: choose a smaller change");
            let wrench = plus.wrench.to_vector() - minus.wrench.to_vector();
            let moved = difference(&minus.sole_pose, &plus.sole_pose);
            let error = scaled_norm(&(here.compliance * wrench - moved)) / scaled_norm(&moved);
            assert!(error < 1e-5, "stop {stop}, change {k}: {error}");
        }
    }
}

#[test]
fn the_independent_codes_jacobians_follow_from_the_tangent() {
    let all = cases();
    for case in all["jacobian"].as_array().expect("a list") {
        let mut estimator = estimator(Arc::new(model(&all, case)));
        let p = pair(&case["hist"]["O_init"]);
        estimator.touch_down(Foothold { x_m: p.x, y_m: p.y, yaw_rad: number(&case["hist"]["psi_init"]) });
        // The same load again: at the second tick the references stand still, as in the reference.
        let zmp = pair(&case["Pd"]);
        let load = StanceReference::constant(vector(&case["Fd"]), zmp);
        estimator.step(&load);
        let report = estimator.step(&load);
        assert!(report.status.is_solved(), "{:?}", report.status);
        let theirs = |key: &str| SMatrix::<f64, 6, 6>::from_fn(|i, j| number(&case[key][i][j]));
        assert!(
            so3::log(&report.sole_pose.rotation).norm() < 1e-12,
            "Euler rates are the turn's rates where it is zero"
        );
        let force = report.wrench.force;
        assert!(force.xy().norm() < 1e-9 * force.z, "else the moving ZMP would enter below");
        // Moment about the wanted ZMP, where it is zero: dM_P = dM_O + dO x F + (O - P) x dF.
        let arm = report.sole_pose.translation - Vec3::new(zmp.x, zmp.y, 0.0);
        let mut moment = report.tangent;
        let by_force = so3::skew(&arm) * moment.fixed_view::<3, 6>(0, 0).into_owned();
        let mut rows = moment.fixed_view_mut::<3, 6>(3, 0);
        rows += by_force;
        let mut columns = moment.fixed_view_mut::<3, 3>(3, 0);
        columns -= so3::skew(&force);
        let mut paper = moment;
        paper.set_row(3, &(-moment.row(4) / force.z));
        paper.set_row(4, &(moment.row(3) / force.z));
        for (what, ours, theirs) in [("J_moment", moment, theirs("J_moment")), ("J_paper", paper, theirs("J_paper"))] {
            for row in 0..6 {
                let error = (ours.row(row) - theirs.row(row)).norm() / theirs.row(row).norm();
                assert!(error < 1e-9, "{what}, row {row}: {error}");
            }
        }
    }
}
