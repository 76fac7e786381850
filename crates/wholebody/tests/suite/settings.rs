//! Settings that do not fit are refused with what was expected.

use crate::support::{Joints, model, robot, settings};
use multibody::{Base, Model, ModelOptions};
use wholebody::{Limit, WholeBody, WholeBodyError, WholeBodySettings};

/// A number of the settings: its key in the file, how to change it, whether it may be zero and whether negative.
struct Number {
    key: &'static str,
    set: fn(&mut WholeBodySettings, f64),
    zero: bool,
    negative: bool,
}

const fn positive(key: &'static str, set: fn(&mut WholeBodySettings, f64)) -> Number {
    Number { key, set, zero: false, negative: false }
}

const fn not_negative(key: &'static str, set: fn(&mut WholeBodySettings, f64)) -> Number {
    Number { key, set, zero: true, negative: false }
}

const fn any(key: &'static str, set: fn(&mut WholeBodySettings, f64)) -> Number {
    Number { key, set, zero: true, negative: true }
}

const NUMBERS: &[Number] = &[
    positive("tasks.swing_position.weight", |s, x| s.tasks.swing_position.weight = x),
    positive("tasks.swing_position.stiffness_per_s2", |s, x| s.tasks.swing_position.stiffness_per_s2 = x),
    positive("tasks.swing_orientation.weight", |s, x| s.tasks.swing_orientation.weight = x),
    positive("tasks.swing_orientation.stiffness_per_s2", |s, x| s.tasks.swing_orientation.stiffness_per_s2 = x),
    positive("tasks.com.weight", |s, x| s.tasks.com.weight = x),
    positive("tasks.com.stiffness_per_s2", |s, x| s.tasks.com.stiffness_per_s2 = x),
    positive("tasks.com_height_factor", |s, x| s.tasks.com_height_factor = x),
    positive("tasks.torso.weight", |s, x| s.tasks.torso.weight = x),
    positive("tasks.torso.stiffness_per_s2", |s, x| s.tasks.torso.stiffness_per_s2 = x),
    positive("tasks.posture.weight", |s, x| s.tasks.posture.weight = x),
    positive("tasks.posture.stiffness_per_s2", |s, x| s.tasks.posture.stiffness_per_s2 = x),
    positive("tasks.leg_posture.weight", |s, x| s.tasks.leg_posture.weight = x),
    positive("tasks.leg_posture.stiffness_per_s2", |s, x| s.tasks.leg_posture.stiffness_per_s2 = x),
    not_negative("tasks.wrench_weight", |s, x| s.tasks.wrench_weight = x),
    positive("tasks.wrench_lever_m", |s, x| s.tasks.wrench_lever_m = x),
    positive("tasks.intensity_damping", |s, x| s.tasks.intensity_damping = x),
    not_negative("tasks.angular_momentum.weight", |s, x| s.tasks.angular_momentum.weight = x),
    positive("tasks.angular_momentum.rate_per_s", |s, x| s.tasks.angular_momentum.rate_per_s = x),
    not_negative("tasks.torque_weight", |s, x| s.tasks.torque_weight = x),
    positive("constraints.contact_position_stiffness_per_s2", |s, x| {
        s.constraints.contact_position_stiffness_per_s2 = x;
    }),
    positive("constraints.contact_orientation_stiffness_per_s2", |s, x| {
        s.constraints.contact_orientation_stiffness_per_s2 = x;
    }),
    positive("constraints.friction", |s, x| s.constraints.friction = Some(x)),
    not_negative("constraints.load_margin", |s, x| s.constraints.load_margin = x),
    positive("constraints.braking_rad_per_s2", |s, x| s.constraints.braking_rad_per_s2 = x),
    positive("constraints.acceleration_max_rad_per_s2", |s, x| s.constraints.acceleration_max_rad_per_s2 = x),
    positive("limits.torque_factor", |s, x| s.constraints.torque_factor = x),
    positive("limits.velocity_factor", |s, x| s.constraints.velocity_factor = x),
    not_negative("limits.position_margin_deg", |s, x| s.constraints.position_margin_rad = x),
    positive("collision.interaction_m", |s, x| s.collision.interaction_m = x),
    not_negative("collision.safety_m", |s, x| s.collision.safety_m = x),
    positive("collision.damping_m_per_s", |s, x| s.collision.damping_m_per_s = x),
    not_negative("relaxation.load_n", |s, x| s.relaxation.load_n = x),
    not_negative("relaxation.collision_m_per_s2", |s, x| s.relaxation.collision_m_per_s2 = x),
    not_negative("relaxation.joint_motion_rad_per_s2", |s, x| s.relaxation.joint_motion_rad_per_s2 = x),
    not_negative("relaxation.torque_factor", |s, x| s.relaxation.torque_factor = x),
    not_negative("relaxation.contact_m_per_s2", |s, x| s.relaxation.contact_m_per_s2 = x),
    positive("solver.interior_tolerance", |s, x| s.solver.interior_tolerance = x),
    positive("sole.length_m", |s, x| s.sole.length_m = x),
    positive("sole.width_m", |s, x| s.sole.width_m = x),
    any("foot.ankle_in_sole_m[1]", |s, x| s.feet[1].ankle_in_sole_m.y = x),
    any("half_sitting_deg.L_KNEE_P", |s, x| {
        let knee = s.posture.iter_mut().find(|joint| joint.joint == "L_KNEE_P").expect("a knee");
        knee.position_rad = x;
    }),
    positive("capsules.pelvis.radius_m", |s, x| s.collision.capsules[0].radius_m = x),
    any("capsules.pelvis.from_m[2]", |s, x| s.collision.capsules[0].from_m.z = x),
    any("capsules.pelvis.to_m[0]", |s, x| s.collision.capsules[0].to_m.x = x),
];

#[test]
fn every_number_is_checked_and_the_refusal_spells_its_key_as_the_file_does() {
    let robot = robot();
    let model = model(&robot, Joints::Legs);
    let good = settings(&robot, &model);
    for Number { key, set, zero, negative } in NUMBERS {
        let attempt = |x: f64| {
            let mut settings = good.clone();
            set(&mut settings, x);
            WholeBody::new(model.clone(), settings).err().map(|error| error.to_string())
        };
        let refused = |x: f64| {
            let error = attempt(x).unwrap_or_else(|| panic!("{key} = {x} is accepted"));
            assert!(error.contains(&format!("`{key}` is ")) && error.contains("must be"), "{key} = {x}: {error}");
            let remedy = error.rsplit(": ").next().unwrap_or_default();
            assert!(remedy.len() > 10, "{key}: a remedy in {error}");
        };
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
            refused(x);
        }
        for (x, allowed) in [(0.0, *zero), (-1e-3, *negative)] {
            if allowed {
                assert_eq!(attempt(x), None, "{key} = {x}");
            } else {
                refused(x);
            }
        }
    }
}

/// Numbers of the file that are whole or stand for something else, tested elsewhere.
const OTHERS: [&str; 2] = ["constraints.generators_per_point", "solver.iterations_max"];

#[test]
fn every_number_of_the_shipped_file_is_in_the_table() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/controller.toml");
    let text = std::fs::read_to_string(file).expect("it ships");
    let root: toml::Table = text.parse().expect("it is TOML");
    let mut found = Vec::new();
    for section in ["tasks", "constraints", "collision", "relaxation", "solver"] {
        numbers(section, &root[section], &mut found);
    }
    assert!(found.len() > 20, "{found:?}");
    for key in found {
        assert!(NUMBERS.iter().any(|n| n.key == key) || OTHERS.contains(&key.as_str()), "{key} is not in the table");
    }
}

fn numbers(key: &str, value: &toml::Value, found: &mut Vec<String>) {
    match value {
        toml::Value::Table(table) => table.iter().for_each(|(k, v)| numbers(&format!("{key}.{k}"), v, found)),
        toml::Value::Float(_) | toml::Value::Integer(_) => found.push(key.to_owned()),
        _ => {}
    }
}

#[test]
fn unknown_names_and_impossible_numbers_are_refused() {
    let robot = robot();
    let model = model(&robot, Joints::Legs);
    let good = settings(&robot, &model);
    let refuse = |change: &dyn Fn(&mut wholebody::WholeBodySettings)| {
        let mut settings = good.clone();
        change(&mut settings);
        WholeBody::new(model.clone(), settings).err().expect("refused").to_string()
    };
    assert!(refuse(&|s| s.torso_link = "torsoo".to_owned()).contains("torsoo"));
    assert!(refuse(&|s| s.feet[0].ankle_link = "foot".to_owned()).contains("foot"));
    assert!(refuse(&|s| s.posture[0].joint = "NO_JOINT".to_owned()).contains("NO_JOINT"));
    assert!(refuse(&|s| s.collision.pairs.push(["left_foot".to_owned(), "tail".to_owned()])).contains("tail"));
    assert!(refuse(&|s| s.collision.pairs.push(["torso".to_owned(), "torso".to_owned()])).contains("with itself"));
    assert!(refuse(&|s| s.collision.safety_m = s.collision.interaction_m).contains("interaction"));
    assert!(refuse(&|s| s.constraints.torque_factor = 1.01).contains("limits.torque_factor"));
    for generators in [0, 2, 3, 5, 6, 32, 100_000, usize::MAX] {
        let refused = refuse(&|s| s.constraints.generators_per_point = generators);
        assert!(refused.contains("`constraints.generators_per_point`") && refused.contains("4, 8 or 16"), "{refused}");
    }
    for (limit, key) in Limit::ALL.into_iter().zip(["load", "collision", "joint-motion", "torque", "contact"]) {
        let refused = refuse(&|s| s.relaxation.order.push(limit));
        assert!(refused.contains(&format!("`relaxation.order` is a list with {key} twice")), "{refused}");
    }
    assert!(refuse(&|s| s.solver.iterations_max = 0).contains("`solver.iterations_max` is 0"));
    assert!(refuse(&|s| s.solver.iterations_max = usize::MAX).contains("`solver.iterations_max`"));
    let fixed = ModelOptions { base: Base::Fixed, ..ModelOptions::default() };
    let fixed = Model::from_urdf(&robot.urdf, &fixed).expect("readable");
    assert!(matches!(WholeBody::new(fixed, good.clone()), Err(WholeBodyError::FixedBase)));
}
