//! Where and in which direction the robot walks changes nothing, and left is as right.

use crate::support::{Joints, PERIOD_S, Walk, model, moved, moved_state, robot, settings, start, walk};
use gait::GaitSettings;
use nalgebra::DVector;
use pattern::Side;
use spatial::{Transform, Vec3, so3};
use wholebody::WholeBody;

#[test]
fn a_walk_shifted_by_100_m_and_turned_needs_the_same_torques() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let plan = Walk::straight(2);
    let elsewhere = Transform::new(so3::about_z(2.1), Vec3::new(100.0, -73.0, 0.0));
    let mut here = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
    let mut there = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
    let mut state = start(&model, &settings, &plan.reference(0.0));
    let mut moved_on = moved_state(&state, &elsewhere);
    let mut worst: f64 = 0.0;
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let reference = plan.reference(tick as f64 * PERIOD_S);
        let a = here.step(&state, &reference, PERIOD_S);
        let b = there.step(&moved_on, &moved(&reference, &elsewhere), PERIOD_S);
        let scale = a.torques.amax().max(1.0);
        worst = worst.max((&a.torques - &b.torques).amax() / scale);
        (state.q, state.v) = (a.q_next.clone(), a.v_next.clone());
        (moved_on.q, moved_on.v) = (b.q_next.clone(), b.v_next.clone());
    }
    assert!(worst < 1e-8, "{worst:e}");
}

/// Joints of the mirrored robot: left and right exchanged, roll and yaw axes with the opposite sign.
fn mirrored(model: &multibody::Model, torques: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(torques.len(), |i, _| {
        let name = &model.joints()[i].name;
        let other = match name.split_at(2) {
            ("L_", rest) => format!("R_{rest}"),
            ("R_", rest) => format!("L_{rest}"),
            _ => name.clone(),
        };
        let sign = if name.ends_with("_P") { 1.0 } else { -1.0 };
        sign * torques[model.joint(&other).expect("robots are symmetric").0]
    })
}

#[test]
fn a_walk_that_begins_with_the_other_foot_is_its_mirror_image() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let mut settings = settings(&robot, &model);
    // Half-sitting was measured on a robot and is not quite symmetric: make it so.
    for posture in &mut settings.posture {
        if posture.joint.contains("HIP_R") || posture.joint.contains("ANKLE_R") {
            posture.position_rad = 0.0;
        }
    }
    let pitch: Vec<(String, f64)> =
        settings.posture.iter().map(|target| (target.joint.clone(), target.position_rad)).collect();
    for posture in &mut settings.posture {
        if let Some(rest) = posture.joint.strip_prefix("L_") {
            let right = format!("R_{rest}");
            let sign = if posture.joint.ends_with("_P") { 1.0 } else { -1.0 };
            let target = pitch.iter().find(|(name, _)| *name == right).map_or(0.0, |(_, position)| *position);
            posture.position_rad = sign * target;
        }
    }
    let run = |first: Side| {
        let mut gait =
            GaitSettings { walk: gait::Walk::Straight { swings: 2, step_length_m: 0.05 }, ..GaitSettings::default() };
        gait.start.first_swing = first;
        let plan = Walk::plan(&gait);
        let mut body = WholeBody::new(model.clone(), settings.clone()).expect("settings fit the model");
        let mut torques = Vec::new();
        walk(&plan, &mut body, PERIOD_S, |_, _, _, report| torques.push(report.torques.clone()));
        torques
    };
    let (right, left) = (run(Side::Right), run(Side::Left));
    assert_eq!(right.len(), left.len());
    let worst = right.iter().zip(&left).map(|(r, l)| (mirrored(&model, r) - l).amax()).fold(0.0, f64::max);
    // The two patterns agree to the planner's tolerance only; on 40 N m that is this much.
    assert!(worst < 1e-3, "{worst:e} N m");
}
