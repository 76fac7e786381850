//! Results of an independent NumPy implementation (`tests/data/sole_cases.json`, conventions inside). Its stiffness matrices were
//! checked against scikit-fem, its contact solvers against each other to 6e-15, its pose solvers to 1e-12.

use nalgebra::Vector2;
use serde_json::Value;
use sole::{
    ContactState, EstimatorSettings, Foothold, Level, Material, MeshSource, SoleModel, SoleSettings, StanceEstimator,
    StanceReference, Status,
};
use spatial::{Transform, Vec3, so3};
use std::sync::Arc;

/// The reference is converged to 1e-11 relative and asks to be compared at 1e-9.
const AGREEMENT: f64 = 1e-9;

pub fn cases() -> Value {
    serde_json::from_str(include_str!("../data/sole_cases.json")).expect("the reference file is JSON")
}

pub fn number(v: &Value) -> f64 {
    v.as_f64().expect("a number")
}

pub fn vector(v: &Value) -> Vec3 {
    Vec3::new(number(&v[0]), number(&v[1]), number(&v[2]))
}

pub fn pair(v: &Value) -> Vector2<f64> {
    Vector2::new(number(&v[0]), number(&v[1]))
}

/// The sole of a reference case.
pub fn model(all: &Value, case: &Value) -> SoleModel {
    let mesh = &all["meshes"][case["mesh"].as_str().expect("a mesh name")];
    let cells = [0, 1, 2].map(|i| mesh["n"][i].as_u64().expect("a count") as usize);
    let settings = SoleSettings {
        mesh: MeshSource::Box { size_m: vector(&mesh["box"]).into(), cells },
        material: Material { young_modulus_pa: number(&case["E"]), poisson_ratio: number(&case["nu"]) },
        friction: case.get("mu").map_or(0.8, number),
        ankle_in_sole_m: vector(&all["defaults"]["ankle"]),
        level: Level::Fem,
        ..SoleSettings::default()
    };
    SoleModel::build(&settings).expect("a sound sole")
}

#[test]
fn compliances_agree_entry_by_entry() {
    let all = cases();
    for case in all["compliance"].as_array().expect("a list") {
        let model = model(&all, case);
        let c = model.compliance();
        let close = |ours: f64, theirs: &Value, scale: f64, what: &str| {
            assert!((ours - number(theirs)).abs() < AGREEMENT * scale, "{what} of {}: {ours} {theirs}", case["mesh"]);
        };
        close(c.trace(), &case["trace"], c.trace(), "trace");
        close(c.norm(), &case["frobenius"], c.norm(), "norm");
        let last = c.ncols() - 3;
        for i in 0..3 {
            for j in 0..3 {
                close(c[(i, j)], &case["block_00"][i][j], c.amax(), "first block");
                close(c[(i, last + j)], &case["block_0_last"][i][j], c.amax(), "corner block");
            }
        }
        let eigenvalues = c.clone().symmetric_eigenvalues();
        let condition = eigenvalues.max() / eigenvalues.min();
        close(condition, &case["cond"], condition, "condition");
    }
}

pub fn estimator(model: Arc<SoleModel>) -> StanceEstimator {
    // The reference goes up to 0.999 of the friction cone.
    StanceEstimator::new(
        model,
        EstimatorSettings { tolerance: 1e-12, friction_use_max: 1.0, ..EstimatorSettings::default() },
    )
}

fn compare(name: &str, report: &sole::StanceReport, result: &Value, near_limit: bool) {
    let tolerance = if near_limit { 10.0 * AGREEMENT } else { AGREEMENT };
    assert!(report.status.is_solved(), "{name}: {:?}", report.status);
    let o = vector(&result["O"]);
    assert!((report.sole_pose.translation - o).norm() < tolerance, "{name}: {} {o}", report.sole_pose.translation);
    let angles = Vec3::new(number(&result["phi"]), number(&result["theta"]), number(&result["psi"]));
    let ours = so3::roll_pitch_yaw(&report.sole_pose.rotation);
    assert!((ours - angles).norm() < tolerance, "{name}: {ours} {angles}");
    assert!((report.ankle_pose.translation - vector(&result["ankle"])).norm() < tolerance, "{name}: ankle");
    let load = vector(&result["force"]).norm();
    assert!((report.wrench.force - vector(&result["force"])).norm() < tolerance * load, "{name}: force");
    assert!((report.zmp - pair(&result["zmp"])).norm() < tolerance, "{name}: ZMP");
    let (forces, positions) = (&result["node_force"], &result["node_position"]);
    // Some cases give resultants only.
    let given = forces.as_array().map_or(0, Vec::len);
    assert!(given == 0 || given == report.node_forces.len(), "{name}: {given} forces");
    for point in 0..given {
        assert!(
            (report.node_forces[point] - vector(&forces[point])).norm() < tolerance * load,
            "{name}: force {point}"
        );
        let away = report.node_positions[point] - vector(&positions[point]);
        assert!(away.norm() < tolerance, "{name}: position of {point} by {}", away.norm());
    }
}

#[test]
fn static_loads_give_the_reference_poses_forces_and_positions() {
    let all = cases();
    let mut models: Vec<(String, Arc<SoleModel>)> = Vec::new();
    for case in all["static"].as_array().expect("a list") {
        let name = case["name"].as_str().expect("a name");
        let key = format!("{} {} {} {}", case["mesh"], case["E"], case["nu"], case["mu"]);
        let model = models.iter().find(|(k, _)| *k == key).map(|(_, m)| Arc::clone(m)).unwrap_or_else(|| {
            models.push((key, Arc::new(model(&all, case))));
            Arc::clone(&models[models.len() - 1].1)
        });
        let mut estimator = estimator(model);
        let history = &case["hist"];
        if let Some(previous) = history.get("prev") {
            let before: Vec<_> = previous.as_array().expect("a list").iter().map(pair).collect();
            estimator.resume(Transform::identity(), &before);
        } else {
            let p = pair(&history["O_init"]);
            estimator.touch_down(Foothold { x_m: p.x, y_m: p.y, yaw_rad: number(&history["psi_init"]) });
        }
        let report = estimator.step(&StanceReference::constant(vector(&case["Fd"]), pair(&case["Pd"])));
        let near_limit = name.contains("0.999") || name.contains("0.99 ");
        compare(name, report, &case["result"], near_limit);
        let load = vector(&case["Fd"]).norm();
        assert!(report.law_violation_n < 1e-9 * load.max(0.01), "{name}: laws off by {} N", report.law_violation_n);
        let counted = ["n_free", "n_stick", "n_slip"].map(|k| case["result"][k].as_u64().expect("a count") as usize);
        // A point at a threshold is classed by rounding: two such points per case were seen.
        assert!(report.open.abs_diff(counted[0]) + report.slipping.abs_diff(counted[2]) <= 4, "{name}: {counted:?}");
    }
}

#[test]
fn loads_without_a_solution_are_refused_with_the_reason() {
    let all = cases();
    for case in all["infeasible"].as_array().expect("a list") {
        let name = case["name"].as_str().expect("a name");
        let mut estimator = estimator(Arc::new(model(&all, case)));
        estimator.touch_down(Foothold::default());
        let status = estimator.step(&StanceReference::constant(vector(&case["Fd"]), pair(&case["Pd"]))).status;
        if let Some(why) = case["why"]
            .as_str()
            .expect("a reason")
            .strip_prefix("no solution found; continuation from the centred load stops at ")
        {
            let theirs: f64 = why.split(' ').next().and_then(|x| x.parse().ok()).expect("a fraction");
            match status {
                Status::Fold { fraction, .. } => {
                    assert!((fraction - theirs).abs() < 2e-3, "{name}: fold at {fraction}, reference {theirs}");
                }
                other => panic!("{name}: {other:?}"),
            }
        } else {
            assert!(matches!(status, Status::OutsideFrictionCone { .. } | Status::NoLoad { .. }), "{name}: {status:?}");
        }
    }
}

#[test]
fn node_states_are_consistent_with_the_forces() {
    let all = cases();
    let case = &all["static"][20];
    let mut estimator = estimator(Arc::new(model(&all, case)));
    estimator.touch_down(Foothold::default());
    let mu = number(&case["mu"]);
    let report = estimator.step(&StanceReference::constant(vector(&case["Fd"]), pair(&case["Pd"])));
    for (state, force) in report.node_states.iter().zip(&report.node_forces) {
        match state {
            ContactState::Open => assert_eq!(*force, Vec3::zeros()),
            ContactState::Stick => assert!(force.xy().norm() <= mu * force.z + 1e-9),
            ContactState::Slip => assert!((force.xy().norm() - mu * force.z).abs() < 1e-9),
        }
    }
}
