//! Laws of motion: what a robot does when it is let go.

use crate::random_robot::{Random, configuration, coupled_model, model};
use multibody::*;
use nalgebra::{DMatrix, DVector};
use spatial::{Vec3, Vec6};

/// Kinetic plus potential energy (J).
fn energy(model: &Model, ws: &mut Workspace, q: &Configuration, v: &DVector<f64>) -> f64 {
    let mut mass = DMatrix::zeros(model.nv(), model.nv());
    crba(model, ws, q, &mut mass);
    let com = forward_kinematics(model, ws, q).center_of_mass();
    0.5 * v.dot(&(mass * v)) - model.total_mass_kg() * model.gravity().dot(&com)
}

/// The robot after `duration_s` without any force but gravity, by the explicit midpoint rule in `steps` steps.
fn let_go(
    model: &Model,
    ws: &mut Workspace,
    mut q: Configuration,
    mut v: DVector<f64>,
    duration_s: f64,
    steps: usize,
) -> (Configuration, DVector<f64>) {
    let h = duration_s / steps as f64;
    let (tau, mut vd) = (DVector::zeros(model.nv()), DVector::zeros(model.nv()));
    let (mut middle, mut next) = (q.clone(), q.clone());
    for _ in 0..steps {
        aba(model, ws, &q, &v, &tau, &mut vd);
        model.integrate(&q, &(&v * (0.5 * h)), &mut middle);
        let v_middle = &v + &vd * (0.5 * h);
        aba(model, ws, &middle, &v_middle, &tau, &mut vd);
        model.integrate(&q, &(v_middle * h), &mut next);
        std::mem::swap(&mut q, &mut next);
        v += &vd * h;
    }
    (q, v)
}

/// Largest order that differs from the expected one by rounding and higher terms only.
fn assert_order(name: &str, coarse: f64, fine: f64, expected: f64) {
    let order = (coarse / fine).log2();
    assert!(order > expected - 0.25, "{name}: errors {coarse:e} and {fine:e}, observed order {order}");
}

#[test]
fn energy_is_conserved_with_the_order_of_the_integrator() {
    let free = [(Base::Floating, 1), (Base::Floating, 4), (Base::Fixed, 2), (Base::Fixed, 5)];
    let coupled = [(Base::Floating, 0), (Base::Floating, 3), (Base::Fixed, 1), (Base::Fixed, 2)];
    let options = |base| ModelOptions { base, ..ModelOptions::default() };
    let robots = free.map(|(base, seed)| (model(seed, &options(base)), seed)).into_iter();
    for (model, seed) in robots.chain(coupled.map(|(base, seed)| (coupled_model(seed, &options(base)), seed))) {
        let mut random = Random(seed);
        let (q, v) = (configuration(&model, &mut random), random.list(model.nv(), 0.5));
        let mut ws = Workspace::new(&model);
        let start = energy(&model, &mut ws, &q, &v);
        let mut error = |steps| {
            let (q, v) = let_go(&model, &mut ws, q.clone(), v.clone(), 0.1, steps);
            (energy(&model, &mut ws, &q, &v) - start).abs()
        };
        let (coarse, fine) = (error(800), error(1600));
        assert_order("energy", coarse, fine, 2.0);
        assert!(fine < 1e-3 * start.abs().max(1.0), "{fine:e} of {start}");
    }
}

#[test]
fn in_free_fall_the_centre_of_mass_falls_and_the_momentum_stays() {
    let options = ModelOptions { gravity: Vec3::new(0.5, -1.0, -9.81), ..ModelOptions::default() };
    for (seed, model) in (0..6).flat_map(|seed| [(seed, model(seed, &options)), (seed, coupled_model(seed, &options))])
    {
        let mut random = Random(50 + seed);
        let (q, v) = (configuration(&model, &mut random), random.list(model.nv(), 3.0));
        // Joint torques are internal: they change nothing either.
        let mut tau = random.list(model.nv(), 20.0);
        tau.fixed_rows_mut::<6>(0).fill(0.0);
        let (mut ws, mut vd) = (Workspace::new(&model), DVector::zeros(model.nv()));
        aba(&model, &mut ws, &q, &v, &tau, &mut vd);
        let mut terms = WholeBodyTerms::new(&model, &[]);
        whole_body_terms(&model, &mut ws, &q, &v, &mut terms);
        let fall = &terms.com_jacobian * &vd + terms.com_drift;
        assert!((fall - model.gravity()).norm() < 1e-9 * (1.0 + vd.amax()), "{fall}");
        let rate: Vec6 = (&terms.centroidal_matrix * &vd).fixed_rows::<6>(0) + terms.centroidal_drift;
        let moment = rate.fixed_rows::<3>(3).norm();
        assert!(moment < 1e-9 * (1.0 + vd.amax()) * model.total_mass_kg(), "{moment:e}");
    }
}

#[test]
fn a_rod_swings_with_the_period_of_the_textbook() {
    // A rod on a hinge: period 2 pi sqrt(I / (m g d)) for small swings.
    let (mass, inertia, distance, angle) = (2.0_f64, 0.1, 0.5, 1e-3_f64);
    let text = format!(
        r#"<robot name="pendulum"><link name="world"/><link name="rod"><inertial><origin xyz="0 0 -{distance}"/>
        <mass value="{mass}"/><inertia ixx="{inertia}" iyy="{inertia}" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
        </link><joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
        </robot>"#
    );
    let model = Model::from_urdf(&text, &ModelOptions { base: Base::Fixed, ..ModelOptions::default() }).unwrap();
    let about_hinge = inertia + mass * distance * distance;
    let period = std::f64::consts::TAU * (about_hinge / (mass * 9.81 * distance)).sqrt();
    let mut q = model.neutral();
    q.joints[0] = angle;
    let mut ws = Workspace::new(&model);
    let (q, v) = let_go(&model, &mut ws, q, DVector::zeros(1), period, 2000);
    // Midpoint rule: phase error (omega h)^2 / 24 per radian, and the amplitude's correction angle^2 / 16.
    assert!((q.joints[0] - angle).abs() < 1e-5 * angle, "{}", q.joints[0]);
    assert!(v[0].abs() < 1e-4 * angle, "{}", v[0]);
}

#[test]
fn a_thousand_turns_leave_the_base_a_rotation() {
    let model = model(0, &ModelOptions::default());
    let mut random = Random(3);
    let (mut q, step) = (configuration(&model, &mut random), random.list(model.nv(), 0.7));
    let mut next = q.clone();
    for _ in 0..10_000 {
        model.integrate(&q, &step, &mut next);
        std::mem::swap(&mut q, &mut next);
    }
    let r = q.base.rotation;
    assert!((r.transpose() * r - spatial::Mat3::identity()).norm() < 1e-14);
}

#[test]
fn the_factored_mass_matrix_solves_the_equations_of_motion() {
    for (seed, base) in [(0, Base::Floating), (1, Base::Fixed), (2, Base::Floating), (3, Base::Fixed)] {
        for make in [model, coupled_model] {
            let model = make(seed, &ModelOptions { base, ..ModelOptions::default() });
            let mut random = Random(seed);
            let (q, nv) = (configuration(&model, &mut random), model.nv());
            let (v, tau) = (random.list(nv, 2.0), random.list(nv, 10.0));
            let (mut ws, mut mass) = (Workspace::new(&model), DMatrix::zeros(nv, nv));
            let (mut bias, mut expected) = (DVector::zeros(nv), DVector::zeros(nv));
            crba(&model, &mut ws, &q, &mut mass);
            bias_forces(&model, &mut ws, &q, &v, &mut bias);
            aba(&model, &mut ws, &q, &v, &tau, &mut expected);
            let mut factor = MassFactor::new(&model);
            factor.factor(&mass).unwrap();
            let mut found = &tau - &bias;
            factor.solve(&mut found);
            assert!((&found - &expected).amax() < 1e-9 * (1.0 + expected.amax()));
        }
    }
}

#[test]
fn a_joint_that_moves_nothing_is_named_and_its_matrix_refused() {
    let text = |mass: f64| {
        format!(
            r#"<robot name="r"><link name="base"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0"
            iyz="0"/></inertial></link><link name="tip"><inertial><mass value="{mass}"/><inertia ixx="0" iyy="0" izz="0"
            ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="idle" type="continuous"><parent link="base"/>
            <child link="tip"/></joint></robot>"#
        )
    };
    // Massless, and a point mass on the axis.
    for mass in [0.0, 0.5] {
        let mut model = Model::from_urdf(&text(mass), &ModelOptions::default()).unwrap();
        assert_eq!(model.massless_joint(), Some(JointIndex(0)));
        let (mut ws, mut m) = (Workspace::new(&model), DMatrix::zeros(7, 7));
        crba(&model, &mut ws, &model.neutral(), &mut m);
        let refused = MassFactor::new(&model).factor(&m);
        assert_eq!(refused, Err(NotPositiveDefinite { column: 6, pivot: 0.0 }));
        model.set_rotor_inertia(JointIndex(0), 0.1);
        assert_eq!(model.massless_joint(), None);
        crba(&model, &mut ws, &model.neutral(), &mut m);
        assert_eq!(MassFactor::new(&model).factor(&m), Ok(()));
        m[(3, 3)] = f64::NAN;
        assert!(
            matches!(MassFactor::new(&model).factor(&m), Err(NotPositiveDefinite { column: 3, pivot }) if pivot.is_nan())
        );
    }
    // A flywheel whose mass is counted elsewhere is moved all the same.
    let flywheel = text(0.0).replacen(r#"ixx="0" iyy="0""#, r#"ixx="0.1" iyy="0.1""#, 1);
    let tolerant = ModelOptions { inertia: InertiaCheck::Tolerant, ..ModelOptions::default() };
    assert_eq!(Model::from_urdf(&flywheel, &tolerant).unwrap().massless_joint(), None);
}

#[test]
fn what_stands_fast_in_the_world_has_no_share_in_mass_and_centre_of_mass() {
    let link = |name: &str, mass: f64| {
        format!(
            r#"<link name="{name}"><inertial><origin xyz="0.5 0 0"/><mass value="{mass}"/><inertia ixx="1" iyy="1" izz="1" ixy="0"
            ixz="0" iyz="0"/></inertial></link>"#
        )
    };
    let joint = |name: &str, kind: &str, parent: &str, child: &str| {
        format!(
            r#"<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/></joint>"#
        )
    };
    let (links, joints) = (
        link("pillar", 50.0) + &link("plinth", 7.0) + &link("arm", 2.0),
        joint("glued", "fixed", "pillar", "plinth") + &joint("turn", "continuous", "plinth", "arm"),
    );
    let text = format!(r#"<robot name="crane">{links}{joints}</robot>"#);
    for (base, mass_kg, com_x_m) in [(Base::Fixed, 2.0, 0.0), (Base::Floating, 59.0, 57.0 * 0.5 / 59.0)] {
        let model = Model::from_urdf(&text, &ModelOptions { base, ..ModelOptions::default() }).unwrap();
        assert!((model.total_mass_kg() - mass_kg).abs() < 1e-14);
        let (mut ws, mut q) = (Workspace::new(&model), model.neutral());
        q.joints[0] = std::f64::consts::FRAC_PI_2;
        let com = forward_kinematics(&model, &mut ws, &q).center_of_mass();
        assert!((com - Vec3::new(com_x_m, 0.5 * 2.0 / mass_kg, 0.0)).norm() < 1e-15, "{com}");
    }
}

#[test]
fn a_rotor_is_felt_by_every_algorithm() {
    let mut model = model(2, &ModelOptions::default());
    let mut random = Random(8);
    let (q, nv) = (configuration(&model, &mut random), model.nv());
    let (v, a) = (random.list(nv, 1.0), random.list(nv, 1.0));
    let mut ws = Workspace::new(&model);
    let mut outputs = |model: &Model| {
        let (mut mass, mut tau) = (DMatrix::zeros(nv, nv), DVector::zeros(nv));
        crba(model, &mut ws, &q, &mut mass);
        rnea(model, &mut ws, &q, &v, &a, &mut tau);
        let (mut again, mut terms) = (DVector::zeros(nv), WholeBodyTerms::new(model, &[]));
        aba(model, &mut ws, &q, &v, &tau, &mut again);
        assert!((&again - &a).amax() < 1e-9);
        whole_body_terms(model, &mut ws, &q, &v, &mut terms);
        assert!((&terms.mass_matrix - &mass).amax() < 1e-12 * mass.amax());
        (mass, tau)
    };
    let (mass, tau) = outputs(&model);
    let joint = JointIndex(1);
    let column = model.column(joint);
    model.set_rotor_inertia(joint, 7.0);
    let (mass_after, tau_after) = outputs(&model);
    let added = mass_after[(column, column)] - mass[(column, column)];
    assert!((added - (tau_after[column] - tau[column]) / a[column]).abs() < 1e-9);
    assert!((added - 7.0).abs() < 0.02 + 1e-9, "the random robot's own rotor is at most 0.02: {added}");
}
