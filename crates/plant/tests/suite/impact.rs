//! Landing fast: what the integrator takes, and how hard it is.

use crate::suite::robot;
use nalgebra::DVector;
use plant::{Plant, PlantSettings};
use spatial::Vec3;

/// What a drop was like.
struct Drop {
    peak_n: f64,
    contact_j: f64,
    integrator_j: f64,
    most_made_j: f64,
    rejected: usize,
}

/// The robot comes down on both feet, which are a tenth of a millimetre above the ground, at this speed.
fn drop(speed_m_per_s: f64, edit: impl FnOnce(&mut PlantSettings)) -> Drop {
    let mut settings = robot::settings();
    settings.stabiliser.enabled = false;
    edit(&mut settings);
    let model = robot::model();
    let ankles = robot::flat_ankles(-1e-4);
    let com = Vec3::new(0.0, 0.0, 0.78);
    let q = robot::stand(&model, &ankles, com);
    let plan = robot::resting_plan(&model, &q, &ankles, com, [0.5, 0.5]);
    let command = robot::command(&model, &q, &plan);
    let mut plant = Plant::new(settings, model, robot::soles(), &robot::frames()).expect("the robot");
    let mut v = DVector::zeros(plant.model().nv());
    v.fixed_rows_mut::<3>(0).copy_from(&(q.base.rotation.transpose() * Vec3::new(0.0, 0.0, -speed_m_per_s)));
    plant.place_moving(&q, &v);
    let mut found = Drop { peak_n: 0.0, contact_j: 0.0, integrator_j: 0.0, most_made_j: f64::MIN, rejected: 0 };
    for _ in 0..60 {
        plant.tick(&command);
        let truth = plant.truth();
        found.peak_n = found.peak_n.max(truth.integration.vertical_force_max_n);
        found.most_made_j = found.most_made_j.max(truth.energies.numerical_j());
        found.rejected += truth.integration.rejected_steps;
    }
    let energies = plant.truth().energies;
    (found.contact_j, found.integrator_j) = (energies.flows.contact_j, energies.numerical_j());
    found
}

#[test]
fn an_impact_is_as_hard_as_with_far_shorter_steps() {
    for speed in [0.2, 1.0] {
        let found = drop(speed, |_| {});
        let fine = drop(speed, |settings| (settings.step.step_s, settings.step.work_error_max_j) = (6.25e-5, 1e6));
        let error = (found.peak_n / fine.peak_n - 1.0).abs();
        assert!(error < 0.05, "{speed} m/s: {} N, with short steps {} N", found.peak_n, fine.peak_n);
        let part = found.integrator_j / found.contact_j;
        assert!(found.contact_j < 0.0 && (0.0..0.05).contains(&part), "{speed} m/s: {part} of the contact's work");
        assert!(found.most_made_j < 1e-4, "{speed} m/s: {} J", found.most_made_j);
        assert!(found.rejected > 0);
        // What it was about: without substeps the impact is softer, and the integrator takes its share.
        let coarse = drop(speed, |settings| settings.step.work_error_max_j = 1e6);
        let (error, part) = (1.0 - coarse.peak_n / fine.peak_n, coarse.integrator_j / coarse.contact_j);
        assert!(coarse.rejected == 0 && (error.abs() > 0.05 || part > 0.05), "{speed} m/s: {error}, {part}");
    }
}
