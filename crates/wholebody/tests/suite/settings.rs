//! Settings that do not fit are refused with what was expected.

use crate::support::{Joints, model, robot, settings};
use multibody::{Base, Model, ModelOptions};
use wholebody::{WholeBody, WholeBodyError};

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
    assert!(refuse(&|s| s.constraints.friction = -0.1).contains("constraints.friction"));
    assert!(refuse(&|s| s.constraints.generators_per_point = 2).contains("at least 3"));
    assert!(refuse(&|s| s.collision.safety_m = s.collision.interaction_m).contains("interaction"));
    assert!(refuse(&|s| s.tasks.leg_posture.weight = 0.0).contains("leg_posture"));
    let fixed = ModelOptions { base: Base::Fixed, ..ModelOptions::default() };
    let fixed = Model::from_urdf(&robot.urdf, &fixed).expect("readable");
    assert!(matches!(WholeBody::new(fixed, good.clone()), Err(WholeBodyError::FixedBase)));
}
