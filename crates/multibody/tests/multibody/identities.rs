//! Algorithms against each other and against the laws of mechanics.

use crate::random_robot::{Random, configuration, coupled_model, model};
use multibody::*;
use nalgebra::{DMatrix, DVector};
use spatial::{Transform, Twist, Vec3, Vec6, Wrench, so3};

/// Rounding of recursions over some twenty bodies, relative to the largest entry.
const ROUNDING: f64 = 1e-11;
/// Central differences with [`STEP`] are this accurate, relative to the largest entry.
const DIFFERENCES: f64 = 1e-7;
const STEP: f64 = 1e-5;
const SEEDS: u64 = 6;

fn robots() -> impl Iterator<Item = (Model, Random)> {
    (0..SEEDS).flat_map(|seed| {
        [Base::Floating, Base::Fixed].into_iter().flat_map(move |base| {
            let options = ModelOptions { base, gravity: Vec3::new(0.7, -0.4, -9.81), ..ModelOptions::default() };
            [model(seed, &options), coupled_model(seed, &options)].map(|model| (model, Random(1000 + seed)))
        })
    })
}

fn close(name: &str, found: &DVector<f64>, expected: &DVector<f64>, tolerance: f64) {
    let error = (found - expected).amax() / (1.0 + expected.amax());
    assert!(error < tolerance, "{name}: relative error {error:e}");
}

fn close_matrix(name: &str, found: &DMatrix<f64>, expected: &DMatrix<f64>, tolerance: f64) {
    close(
        name,
        &DVector::from_column_slice(found.as_slice()),
        &DVector::from_column_slice(expected.as_slice()),
        tolerance,
    );
}

struct Case {
    model: Model,
    ws: Workspace,
    q: Configuration,
    v: DVector<f64>,
    a: DVector<f64>,
    random: Random,
}

fn cases() -> impl Iterator<Item = Case> {
    robots().map(|(model, mut random)| {
        let q = configuration(&model, &mut random);
        let (v, a) = (random.list(model.nv(), 2.0), random.list(model.nv(), 5.0));
        Case { ws: Workspace::new(&model), model, q, v, a, random }
    })
}

#[test]
fn inverse_dynamics_invert_forward_dynamics() {
    for Case { model, mut ws, q, v, a, mut random } in cases() {
        let nv = model.nv();
        let frame = FrameIndex(model.frames().len() - 1);
        let external = [
            (frame, Wrench { force: random.vector(50.0), moment: random.vector(5.0) }),
            (model.base_frame(), Wrench { force: random.vector(50.0), moment: random.vector(5.0) }),
        ];
        let (mut tau, mut again) = (DVector::zeros(nv), DVector::zeros(nv));
        rnea_with_external(&model, &mut ws, &q, &v, &a, &external, &mut tau);
        aba_with_external(&model, &mut ws, &q, &v, &tau, &external, &mut again);
        close("acceleration", &again, &a, 1e-9);
    }
}

#[test]
fn columns_of_the_mass_matrix_are_forces_of_unit_accelerations() {
    for Case { model, mut ws, q, a, .. } in cases() {
        let nv = model.nv();
        let (mut mass, mut columns) = (DMatrix::zeros(nv, nv), DMatrix::zeros(nv, nv));
        crba(&model, &mut ws, &q, &mut mass);
        let (mut with, mut without, still) = (DVector::zeros(nv), DVector::zeros(nv), DVector::zeros(nv));
        gravity_forces(&model, &mut ws, &q, &mut without);
        for j in 0..nv {
            let mut unit = DVector::zeros(nv);
            unit[j] = 1.0;
            rnea(&model, &mut ws, &q, &still, &unit, &mut with);
            columns.set_column(j, &(&with - &without));
        }
        close_matrix("M", &mass, &columns, ROUNDING);
        close_matrix("symmetry", &mass, &mass.transpose(), f64::MIN_POSITIVE);
        let energy = a.dot(&(&mass * &a));
        assert!(energy > 0.0, "M is positive definite");
    }
}

#[test]
fn whole_body_terms_agree_with_the_single_algorithms() {
    for Case { model, mut ws, q, v, .. } in cases() {
        let nv = model.nv();
        let frames: Vec<FrameIndex> = (0..model.frames().len()).step_by(3).map(FrameIndex).collect();
        let mut terms = WholeBodyTerms::new(&model, &frames);
        // Twice: what the first call leaves behind must not show in the second.
        let mut random = Random(5);
        whole_body_terms(&model, &mut ws, &configuration(&model, &mut random), &v, &mut terms);
        whole_body_terms(&model, &mut ws, &q, &v, &mut terms);
        let (mut mass, mut bias) = (DMatrix::zeros(nv, nv), DVector::zeros(nv));
        crba(&model, &mut ws, &q, &mut mass);
        bias_forces(&model, &mut ws, &q, &v, &mut bias);
        close_matrix("M", &terms.mass_matrix, &mass, ROUNDING);
        close("h", &terms.bias, &bias, ROUNDING);
        let mut moving = forward_kinematics_velocity(&model, &mut ws, &q, &v);
        let mut jacobian = DMatrix::zeros(6, nv);
        for frame in &terms.frames {
            moving.jacobian(frame.frame, &mut jacobian);
            close_matrix("J", &frame.jacobian, &jacobian, ROUNDING);
            let velocity = (&jacobian * &v).fixed_rows::<6>(0).into_owned();
            assert!((velocity - frame.velocity.to_vector()).norm() < ROUNDING * (1.0 + velocity.norm()));
            let drift = moving.drift(frame.frame);
            assert!((drift - frame.drift).norm() < ROUNDING * (1.0 + drift.norm()));
        }
        let mut com_j = DMatrix::zeros(3, nv);
        moving.com_jacobian(&mut com_j);
        close_matrix("Jcom", &terms.com_jacobian, &com_j, ROUNDING);
        assert!((terms.com - moving.center_of_mass()).norm() < ROUNDING);
        let momentum = (&terms.centroidal_matrix * &v).fixed_rows::<6>(0).into_owned();
        assert!((momentum - terms.momentum).norm() < ROUNDING * (1.0 + momentum.norm()));
        assert!((&com_j * &v - terms.com_velocity).norm() < ROUNDING * (1.0 + terms.com_velocity.norm()));
    }
}

/// Derivative along the motion `q (+) t v, v` at t = 0 by central differences.
fn derivative<T>(case: &mut Case, f: impl Fn(&Model, &mut Workspace, &Configuration) -> T) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Div<f64, Output = T>,
{
    let mut moved = case.q.clone();
    case.model.integrate(&case.q, &(&case.v * STEP), &mut moved);
    let after = f(&case.model, &mut case.ws, &moved);
    case.model.integrate(&case.q, &(&case.v * -STEP), &mut moved);
    let before = f(&case.model, &mut case.ws, &moved);
    (after - before) / (2.0 * STEP)
}

#[test]
fn velocities_and_drifts_are_derivatives() {
    for mut case in cases() {
        let frames: Vec<FrameIndex> = (0..case.model.frames().len()).map(FrameIndex).collect();
        let mut terms = WholeBodyTerms::new(&case.model, &frames);
        whole_body_terms(&case.model, &mut case.ws, &case.q, &case.v, &mut terms);
        let v = case.v.clone();
        for frame in &terms.frames {
            let spin = derivative(&mut case, |m, ws, q| {
                let placed = forward_kinematics(m, ws, q);
                placed.pose(frame.frame).rotation
            }) * frame.placement.rotation.transpose();
            let speed = derivative(&mut case, |m, ws, q| {
                let placed = forward_kinematics(m, ws, q);
                placed.pose(frame.frame).translation
            });
            let found = Twist { linear: speed, angular: so3::vee(&spin) }.to_vector();
            let expected = frame.velocity.to_vector();
            assert!((found - expected).norm() < DIFFERENCES * (1.0 + expected.norm()), "{found} {expected}");
            let drift = derivative(&mut case, |m, ws, q| {
                let moving = forward_kinematics_velocity(m, ws, q, &v);
                moving.velocity(frame.frame).to_vector()
            });
            assert!((drift - frame.drift).norm() < DIFFERENCES * (1.0 + drift.norm()), "{drift} {}", frame.drift);
        }
        let com_velocity = derivative(&mut case, |m, ws, q| {
            let placed = forward_kinematics(m, ws, q);
            placed.center_of_mass()
        });
        assert!((com_velocity - terms.com_velocity).norm() < DIFFERENCES * (1.0 + com_velocity.norm()));
        let rates = derivative(&mut case, |m, ws, q| {
            let mut terms = WholeBodyTerms::new(m, &[]);
            whole_body_terms(m, ws, q, &v, &mut terms);
            let mut both = DVector::zeros(9);
            both.fixed_rows_mut::<3>(0).copy_from(&terms.com_velocity);
            both.fixed_rows_mut::<6>(3).copy_from(&terms.momentum);
            both
        });
        let mut expected = DVector::zeros(9);
        expected.fixed_rows_mut::<3>(0).copy_from(&terms.com_drift);
        expected.fixed_rows_mut::<6>(3).copy_from(&terms.centroidal_drift);
        close("rate of momentum", &rates, &expected, DIFFERENCES);
    }
}

#[test]
fn bias_forces_follow_from_the_energy() {
    // d/dt (1/2 v' M v) = v' (tau - gravity forces), with tau = h when vd = 0.
    for mut case in cases() {
        let nv = case.model.nv();
        let v = case.v.clone();
        let rate = derivative(&mut case, |m, ws, q| {
            let mut mass = DMatrix::zeros(nv, nv);
            crba(m, ws, q, &mut mass);
            0.5 * v.dot(&(&mass * &v))
        });
        let (mut bias, mut gravity) = (DVector::zeros(nv), DVector::zeros(nv));
        bias_forces(&case.model, &mut case.ws, &case.q, &v, &mut bias);
        gravity_forces(&case.model, &mut case.ws, &case.q, &mut gravity);
        let power = v.dot(&(&bias - &gravity));
        assert!((power - rate).abs() < DIFFERENCES * (1.0 + rate.abs()), "{power} {rate}");
    }
}

#[test]
fn an_added_frame_is_where_it_was_put() {
    for Case { mut model, mut ws, q, mut random, .. } in cases() {
        let parent = FrameIndex(model.frames().len() - 1);
        let X_PF = Transform::new(so3::exp(&random.vector(1.0)), random.vector(0.3));
        let on_a_link = model.add_frame("tool", parent, X_PF);
        let on_the_tool = model.add_frame("tip", on_a_link, X_PF);
        let placed = forward_kinematics(&model, &mut ws, &q);
        let X_WP = placed.pose(parent);
        for (frame, expected) in [(on_a_link, X_WP * X_PF), (on_the_tool, X_WP * X_PF * X_PF)] {
            let found = placed.pose(frame);
            assert!((found.translation - expected.translation).norm() < 1e-13);
            assert!((found.rotation - expected.rotation).norm() < 1e-13);
        }
        assert_eq!((model.frame("tool").unwrap(), model.frame("tip").unwrap()), (on_a_link, on_the_tool));
    }
}

#[test]
fn an_external_wrench_enters_through_its_jacobian() {
    for Case { model, mut ws, q, v, a, mut random } in cases() {
        let nv = model.nv();
        let (mut with, mut without, mut jacobian) = (DVector::zeros(nv), DVector::zeros(nv), DMatrix::zeros(6, nv));
        for frame in (0..model.frames().len()).map(FrameIndex) {
            let wrench = Wrench { force: random.vector(30.0), moment: random.vector(3.0) };
            rnea(&model, &mut ws, &q, &v, &a, &mut without);
            rnea_with_external(&model, &mut ws, &q, &v, &a, &[(frame, wrench)], &mut with);
            forward_kinematics(&model, &mut ws, &q).jacobian(frame, &mut jacobian);
            let f: Vec6 = wrench.to_vector();
            close("J' F", &(&without - &with), &(jacobian.transpose() * f), ROUNDING);
        }
    }
}

#[test]
fn integration_and_difference_are_inverse() {
    for Case { model, q, mut random, .. } in cases() {
        for scale in [1e-9, 1e-3, 0.3, 1.7] {
            let dv = random.list(model.nv(), scale);
            let (mut moved, mut found) = (q.clone(), DVector::zeros(model.nv()));
            model.integrate(&q, &dv, &mut moved);
            model.difference(&q, &moved, &mut found);
            assert!((&found - &dv).amax() < 1e-14 * (1.0 + q.joints.amax()), "{:e}", (&found - &dv).amax());
        }
    }
}

#[test]
fn shifting_and_yawing_the_world_changes_nothing_but_the_axes() {
    // 100 m away: only the placement itself may feel it.
    let X_WV = Transform::new(so3::about_z(2.1), Vec3::new(100.0, -70.0, 0.0));
    for seed in 0..SEEDS {
        let model = model(seed, &ModelOptions::default());
        let mut random = Random(77 + seed);
        let q = configuration(&model, &mut random);
        let (nv, mut ws) = (model.nv(), Workspace::new(&model));
        let (v, a) = (random.list(nv, 2.0), random.list(nv, 5.0));
        let moved = Configuration { base: X_WV * q.base, joints: q.joints.clone() };
        let frames: Vec<FrameIndex> = (0..model.frames().len()).map(FrameIndex).collect();
        let (mut here, mut there) = (WholeBodyTerms::new(&model, &frames), WholeBodyTerms::new(&model, &frames));
        whole_body_terms(&model, &mut ws, &q, &v, &mut here);
        whole_body_terms(&model, &mut ws, &moved, &v, &mut there);
        close_matrix("M", &there.mass_matrix, &here.mass_matrix, 1e-13);
        close("h", &there.bias, &here.bias, 1e-13);
        let turn = |block: &DMatrix<f64>| {
            let mut out = block.clone();
            for k in (0..block.nrows()).step_by(3) {
                out.rows_mut(k, 3).copy_from(&(X_WV.rotation * block.rows(k, 3)));
            }
            out
        };
        close_matrix("Ag", &there.centroidal_matrix, &turn(&here.centroidal_matrix), 1e-13);
        close_matrix("Jcom", &there.com_jacobian, &turn(&here.com_jacobian), 1e-13);
        for (there, here) in there.frames.iter().zip(&here.frames) {
            close_matrix("J", &there.jacobian, &turn(&here.jacobian), 1e-13);
        }
        assert!((there.com - X_WV.point(&here.com)).norm() < 1e-13 * 100.0);
        let (mut tau, mut tau_there) = (DVector::zeros(nv), DVector::zeros(nv));
        rnea(&model, &mut ws, &q, &v, &a, &mut tau);
        rnea(&model, &mut ws, &moved, &v, &a, &mut tau_there);
        close("rnea", &tau_there, &tau, 1e-13);
        let (mut vd, mut vd_there) = (DVector::zeros(nv), DVector::zeros(nv));
        aba(&model, &mut ws, &q, &v, &tau, &mut vd);
        aba(&model, &mut ws, &moved, &v, &tau, &mut vd_there);
        close("aba", &vd_there, &vd, 1e-9);
    }
}
