//! Standing on both feet.

use plant::{Plant, PlantSettings};
use spatial::Vec3;

use super::robot;

const COM: Vec3 = Vec3::new(0.0, 0.0, 0.78);

fn settings(stabiliser: bool) -> PlantSettings {
    let mut settings = robot::settings();
    settings.stabiliser.enabled = stabiliser;
    settings
}

#[test]
fn on_hard_feet_the_robot_settles_with_half_its_weight_on_each() {
    let model = robot::model();
    let ankles = robot::flat_ankles(0.0);
    let q = robot::stand(&model, &ankles, COM);
    let plan = robot::resting_plan(&model, &q, &ankles, COM, [0.5, 0.5]);
    let weight = model.total_mass_kg() * model.gravity().norm();
    let mut plant = Plant::new(settings(false), robot::model(), robot::hard_soles(), &robot::frames()).unwrap();
    plant.place(&q);
    let time = plant.settle(&robot::command(&model, &q, &plan), 5.0);
    assert!(time.is_some(), "{:?} {:?}", plant.fallen(), plant.truth());
    for foot in &plant.truth().feet {
        assert!((foot.wrench.force.z - 0.5 * weight).abs() < 0.01 * weight, "{:?}", foot.wrench);
    }
}

#[test]
#[allow(clippy::disallowed_methods)] // its output says how long it took
fn on_soft_soles_the_robot_settles_with_half_its_weight_on_each() {
    let model = robot::model();
    let ankles = robot::flat_ankles(0.0);
    let q = robot::stand(&model, &ankles, COM);
    let plan = robot::resting_plan(&model, &q, &ankles, COM, [0.5, 0.5]);
    let weight = model.total_mass_kg() * model.gravity().norm();
    for stabiliser in [false, true] {
        let mut plant = Plant::new(settings(stabiliser), robot::model(), robot::soles(), &robot::frames()).unwrap();
        plant.place(&q);
        let start = std::time::Instant::now();
        let command = robot::command(&model, &q, &plan);
        let time = plant.settle(&command, 5.0);
        let truth = plant.truth();
        eprintln!("stabiliser {stabiliser}: settled in {time:?}, wall {:?}\n{truth:#?}", start.elapsed());
        assert!(time.is_some(), "{:?}", plant.fallen());
        for foot in &truth.feet {
            assert!((foot.wrench.force.z - 0.5 * weight).abs() < 0.01 * weight, "{:?}", foot.wrench);
            let sink_m = -foot.sole.translation.z;
            assert!((3e-4..6e-4).contains(&sink_m), "sunk by {sink_m} m");
        }
    }
}
