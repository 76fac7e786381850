//! In the air only gravity acts from outside: the balance of momentum is exact, motion converges with the step.

use multibody::{Configuration, Model};
use nalgebra::DVector;
use plant::disturbance::Push;
use plant::settings::{DriveSettings, ServoSettings, StepSettings};
use plant::{CornerSettings, Plant, PlantCommand, PlantSettings};
use spatial::{Transform, Vec3, so3};

use super::robot;

/// A robot with limp joints that tumbles with swinging limbs, 100 m above the ground.
fn tumbling(step: StepSettings) -> (Plant, Configuration, DVector<f64>) {
    let model = robot::model();
    let limp = DriveSettings { stiffness_nm_per_rad: 0.0, damping_nm_s_per_rad: 0.0, ..Default::default() };
    let settings =
        PlantSettings { step, servo: ServoSettings { default: limp, ..Default::default() }, ..Default::default() };
    let (q, v) = start(&model);
    let mut plant = Plant::new(settings, model, [CornerSettings::default(); 2], &robot::frames()).unwrap();
    plant.place_moving(&q, &v);
    (plant, q, v)
}

fn start(model: &Model) -> (Configuration, DVector<f64>) {
    let mut q = robot::posture(model);
    q.base = Transform::new(so3::exp(&Vec3::new(0.3, -0.2, 0.5)), Vec3::new(0.0, 0.0, 100.0));
    let rates = |i: usize| ((i * 7919) % 13) as f64 / 13.0 - 0.5;
    let v = DVector::from_fn(model.nv(), |i, _| if i < 3 { 1.0 } else { 2.0 * rates(i) });
    (q, v)
}

fn hold(q: &Configuration) -> PlantCommand {
    PlantCommand { joint_positions: q.joints.clone(), joint_torques: DVector::zeros(q.joints.len()), plan: None }
}

fn step(step_s: f64) -> StepSettings {
    StepSettings { step_s, control_period_s: 0.005, force_tolerance_n: 1e-10, ..StepSettings::default() }
}

#[test]
fn momentum_follows_gravity_to_rounding() {
    let (mut plant, q, _) = tumbling(step(1e-3));
    let model = robot::model();
    let mass = model.total_mass_kg();
    let before = *plant.truth();
    let command = hold(&q);
    for k in 1..=100 {
        plant.tick(&command);
        let now = plant.truth();
        let t_s = 0.005 * f64::from(k);
        assert!((now.com_velocity - before.com_velocity - t_s * model.gravity()).norm() < 1e-11, "tick {k}");
        assert!((now.angular_momentum - before.angular_momentum).norm() < 1e-10 * mass, "tick {k}");
        assert!((now.com_acceleration - model.gravity()).norm() < 1e-12);
    }
}

#[test]
fn tumbling_converges_with_first_order() {
    let end = |step_s: f64| {
        let (mut plant, q, _) = tumbling(step(step_s));
        let command = hold(&q);
        for _ in 0..40 {
            plant.tick(&command);
        }
        (plant.state().q.clone(), plant.truth().energies.numerical_j())
    };
    let (exact, _) = end(0.005 / 160.0);
    let model = robot::model();
    let mut difference = DVector::zeros(model.nv());
    let mut errors = Vec::new();
    for parts in [5, 10, 20] {
        let (q, numerical_j) = end(0.005 / f64::from(parts));
        model.difference(&q, &exact, &mut difference);
        errors.push((difference.norm(), numerical_j));
    }
    // The finest run stands for the exact one: its own error is an eighth of the last, so orders below 1.2 show as up to 1.2.
    for pair in errors.windows(2) {
        let order = (pair[0].0 / pair[1].0).log2();
        assert!((0.9..1.25).contains(&order), "errors and energies {errors:?}");
        // Energy that is neither kinetic nor potential nor any drive's is the integrator's own.
        let order = (pair[0].1 / pair[1].1).log2();
        assert!((0.8..1.2).contains(&order), "errors and energies {errors:?}");
    }
}

/// A push of 100 N on a robot in free fall from half a tick before to half a tick after a tick's beginning.
#[test]
fn a_push_that_begins_between_two_steps_acts_for_its_own_time() {
    let model = robot::model();
    let mut q = robot::posture(&model);
    q.base.translation.z = 100.0;
    let push = Push {
        link: "body".to_owned(),
        force_n: [100.0, 0.0, 0.0],
        start_s: 0.0127,
        duration_s: 0.0036,
        ..Default::default()
    };
    let settings = PlantSettings { step: step(1e-3), pushes: vec![push], ..robot::settings() };
    let mass = model.total_mass_kg();
    let mut plant = Plant::new(settings, model, [CornerSettings::default(); 2], &robot::frames()).unwrap();
    let command = hold(&q);
    for _ in 0..2 {
        plant.place(&q);
        let impulse = |plant: &Plant| mass * plant.truth().com_velocity.x;
        for _ in 0..7 {
            plant.tick(&command);
            assert_eq!(plant.truth().energies.flows.push_j, 0.0);
        }
        assert!(impulse(&plant).abs() < 1e-9, "the clock has not been started: placing stops it");
        plant.start_clock();
        // Two ticks before it begins, 2.3 ms of it in the third, 1.3 ms in the fourth.
        for expected_s in [0.0, 0.0, 0.0023, 0.0036, 0.0036] {
            plant.tick(&command);
            assert!((impulse(&plant) - 100.0 * expected_s).abs() < 1e-9, "{} not {expected_s}", impulse(&plant));
        }
        assert!(plant.truth().energies.flows.push_j > 0.0);
    }
}

#[test]
fn a_robot_placed_in_motion_feels_no_jolt() {
    let model = robot::model();
    let (q, mut v) = start(&model);
    // Neither turning nor bending: everything flies as one.
    v.rows_mut(3, v.len() - 3).fill(0.0);
    let settings = PlantSettings { step: step(1e-3), ..robot::settings() };
    let mut plant = Plant::new(settings, model, [CornerSettings::default(); 2], &robot::frames()).unwrap();
    plant.place_moving(&q, &v);
    assert!((plant.sensors().orientation * plant.sensors().acceleration - Vec3::z() * 9.81).norm() < 1e-12);
    plant.tick(&hold(&q));
    assert!(plant.sensors().acceleration.norm() < 1e-3, "weightless: {}", plant.sensors().acceleration);
}
