//! What the stabiliser is for: one foot on the soft sole, kicked; and the weight going slowly from foot to foot.

use multibody::Configuration;
use plant::disturbance::Push;
use plant::{Plan, Plant, PlantSettings};
use spatial::{Transform, Vec3};

use super::robot;

/// Sink of one sole under the whole weight (m): only decides how little the robot moves at first.
const SINK_M: f64 = 8.5e-4;

/// On the left foot, centre of mass above the ankle, the right foot 4 cm in the air.
fn on_the_left_foot(settings: PlantSettings) -> (Plant, Configuration, Plan) {
    let model = robot::model();
    let mut ankles = robot::flat_ankles(SINK_M);
    ankles[1].translation.z += 0.04;
    let com = Vec3::new(0.0, ankles[0].translation.y, 0.78);
    let q = robot::stand(&model, &ankles, com);
    let plan = robot::resting_plan(&model, &q, &ankles, com, [1.0, 0.0]);
    let mut plant = Plant::new(settings, model, robot::soles(), &robot::frames()).unwrap();
    plant.place(&q);
    (plant, q, plan)
}

/// An impulse on the torso that moves the divergent component `xi = x + v/w` by `kick`: `M w kick` within 20 ms.
fn kicked(kick: Vec3) -> PlantSettings {
    let mass = robot::model().total_mass_kg();
    let omega = (9.81f64 / 0.78).sqrt();
    let mut settings = robot::settings();
    let force_n: Vec3 = kick * (mass * omega / 0.02);
    settings.pushes.push(Push {
        link: "torso".to_owned(),
        force_n: force_n.into(),
        duration_s: 0.02,
        ..Default::default()
    });
    settings
}

/// Divergent component's distance from the plan (m).
fn dcm_error(plant: &Plant, plan: &Plan) -> f64 {
    let truth = plant.truth();
    (truth.com.xy() + truth.com_velocity.xy() / (9.81f64 / 0.78).sqrt() - plan.com.xy()).norm()
}

/// Settles for 1 s, kicks, waits 4 s; returns the largest and last distance of the divergent component, unless it falls.
fn kick(settings: PlantSettings) -> Option<(f64, f64)> {
    let (mut plant, q, plan) = on_the_left_foot(settings);
    let command = robot::command(plant.model(), &q, &plan);
    let mut largest = 0.0f64;
    for k in 0..1000 {
        if k == 200 {
            plant.start_clock();
        }
        plant.tick(&command);
        if k >= 200 {
            largest = largest.max(dcm_error(&plant, &plan));
        }
    }
    plant.fallen().is_none().then(|| (largest, dcm_error(&plant, &plan)))
}

#[test]
fn a_kick_of_two_centimetres_is_recovered_on_one_soft_sole() {
    for direction in [Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y()] {
        let (largest, last) = kick(kicked(0.02 * direction)).expect("it stands");
        assert!(largest > 0.018, "the kick was only {largest} m");
        assert!(last < 0.003, "{direction:?}: {last} m from the plan after 4 s");
    }
}

#[test]
fn with_the_sign_of_foot_damping_flipped_it_falls() {
    let mut settings = kicked(Vec3::zeros());
    settings.stabiliser.roll_damping_nm_s_per_rad *= -1.0;
    settings.stabiliser.pitch_damping_nm_s_per_rad *= -1.0;
    assert_eq!(kick(settings), None);
}

/// On one soft sole the robot stands without stabiliser while the weight is in the sole's kern, but not when it is kicked
/// sideways: the roll stiffness falls below m g h when the ZMP nears the edge.
#[test]
fn without_stabiliser_it_stands_on_one_sole_until_it_is_kicked_sideways() {
    let off = |mut settings: PlantSettings| {
        settings.stabiliser.enabled = false;
        kick(settings)
    };
    assert!(off(kicked(Vec3::zeros())).is_some());
    assert_eq!(off(kicked(0.02 * Vec3::y())), None);
    assert_eq!(off(kicked(-0.02 * Vec3::y())), None);
}

/// The centre of mass goes 6 cm to the left and back within 6 s, loads and ankle moments as planned, feet flat on the ground:
/// the plan knows nothing of the foam.
#[test]
fn the_weight_shifts_slowly_from_foot_to_foot() {
    let model = robot::model();
    let ankles: [Transform; 2] = robot::flat_ankles(4e-4);
    let height_m = 0.78;
    for stabiliser in [false, true] {
        let mut settings = robot::settings();
        settings.stabiliser.enabled = stabiliser;
        let mut plant = Plant::new(settings, robot::model(), robot::soles(), &robot::frames()).unwrap();
        let mut worst = 0.0f64;
        for k in 0..=1200 {
            let phase = std::f64::consts::TAU * f64::from(k) / 1200.0;
            let y = 0.03 * (1.0 - phase.cos());
            let left = 0.5 + y / (ankles[0].translation.y - ankles[1].translation.y);
            let com = Vec3::new(0.0, y, height_m);
            let q = robot::stand(&model, &ankles, com);
            let mut plan = robot::resting_plan(&model, &q, &ankles, com, [left, 1.0 - left]);
            plan.com_velocity.y = 0.03 * phase.sin() * std::f64::consts::TAU / 6.0;
            if k == 0 {
                plant.place(&q);
            }
            plant.tick(&robot::command(&model, &q, &plan));
            worst = worst.max((plant.truth().com.xy() - com.xy()).norm());
        }
        assert_eq!(plant.fallen(), None, "stabiliser {stabiliser}");
        // Without stabiliser the foam lets the robot lean; with it the centre of mass stays near the plan.
        let allowed_m = if stabiliser { 0.006 } else { 0.03 };
        assert!(worst < allowed_m, "stabiliser {stabiliser}: {worst} m");
    }
}
