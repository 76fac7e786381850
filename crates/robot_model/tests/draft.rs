//! The draft of a robot that is known, and of files that are no walking robots.

use robot::Robot;
use robot_model::{DraftError, draft};
use std::collections::BTreeMap;
use std::path::Path;

fn hrp4() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4")).expect("it ships")
}

#[test]
fn hrp4_is_found_again_in_its_urdf() {
    let robot = hrp4();
    let known = &robot.description;
    // The box of the left foot as ORIGIN.md has it: flat ground 93 mm below the ankle.
    let boxes = BTreeMap::from([("l_ankle".to_owned(), [[0.23, 0.13, 0.02], [0.015, 0.011, -0.083]])]);
    let draft = draft(&robot.urdf, "hrp4.urdf", &boxes).expect("it has two legs");
    let found = &draft.description;
    for group in ["left_leg", "right_leg"] {
        assert_eq!(found.groups[group], known.groups[group]);
    }
    assert_eq!(found.groups["trunk"], known.groups["chest"]);
    assert_eq!((&found.base_link, &found.imu_frame), (&known.base_link, &known.imu_frame));
    let mut joints = (found.joints.clone(), known.joints.clone());
    joints.0.sort();
    joints.1.sort();
    assert_eq!(joints.0, joints.1);
    let sensors = [0, 1].map(|foot| found.feet[foot].force_sensor_frame.as_str());
    assert_eq!(sensors, ["l_foot_force_sensor", "r_foot_force_sensor"]);
    for side in ["L", "R"] {
        let at = |joint: &str| found.half_sitting_deg.get(&format!("{side}_{joint}")).copied().unwrap_or(0.0);
        assert!((at("KNEE_P") - 40.0).abs() < 0.02, "{}", at("KNEE_P"));
        assert!((at("HIP_P") + at("KNEE_P") + at("ANKLE_P")).abs() < 0.02, "the foot is level");
    }
    assert!((draft.com_height_m - 0.79).abs() < 0.02, "{} m", draft.com_height_m);
    assert!((draft.ankle_distance_m - 0.1369).abs() < 1e-3, "{} m", draft.ankle_distance_m);
    let sole = &draft.sole;
    assert_eq!((sole.mesh.box_m, sole.foot.ankle_in_sole_m), (robot.sole.mesh.box_m, robot.sole.foot.ankle_in_sole_m));
}

#[test]
fn what_has_no_two_legs_is_refused() {
    let urdf =
        hrp4().urdf.replace(r#"<joint name="L_KNEE_P" type="revolute">"#, r#"<joint name="L_KNEE_P" type="fixed">"#);
    let refused = draft(&urdf, "hrp4.urdf", &BTreeMap::new()).expect_err("five joints are no leg");
    assert!(matches!(&refused, DraftError::Legs { found: 1, root } if root == "body"), "{refused}");
    let refused = draft("<robot/>", "empty.urdf", &BTreeMap::new()).expect_err("no link");
    assert!(matches!(refused, DraftError::Model(_)), "{refused}");
}
