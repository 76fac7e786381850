//! What cannot be walked is refused with the step and the number.

use crate::support::straight;
use gait::{GaitError, GaitSettings, Landing, RowLabel, Walk, plan};
use pattern::Side;

fn refused(settings: &GaitSettings) -> GaitError {
    match plan(settings) {
        Err(error) => error,
        Ok(_) => panic!("planned: {settings:?}"),
    }
}

fn path(landings: &[(Side, f64, f64)]) -> GaitSettings {
    let landings = landings
        .iter()
        .map(|(foot, x_m, y_m)| Landing { foot: *foot, x_m: *x_m, y_m: *y_m, yaw_rad: 0.0, free: false })
        .collect();
    GaitSettings { walk: Walk::Path { landings }, ..GaitSettings::default() }
}

const Y: f64 = 0.0815;

#[test]
fn a_step_too_long_is_named_with_its_length() {
    let settings = path(&[(Side::Right, 0.1, -Y), (Side::Left, 0.42, Y), (Side::Right, 0.42, -Y)]);
    let error = refused(&settings);
    let GaitError::Step { step: 2, foot: Side::Left, found_m, limit_m, at_least: false, .. } = error else {
        panic!("{error}")
    };
    assert!((found_m - 0.32).abs() < 1e-12 && (limit_m - 0.30).abs() < 1e-12);
    assert_eq!(
        error.to_string(),
        "step 2: the Left foot's distance along the stance foot would be 0.320000 m, but must be at most 0.300000 m"
    );
}

#[test]
fn a_step_too_long_backwards_is_named_too() {
    let settings = path(&[(Side::Right, -0.31, -Y), (Side::Left, -0.31, Y)]);
    let error = refused(&settings);
    assert!(matches!(error, GaitError::Step { step: 1, found_m, .. } if (found_m - 0.31).abs() < 1e-12), "{error}");
}

#[test]
fn overlapping_feet_are_named_with_their_gap() {
    // Inner edges lie 0.054 m inside the ankles: 0.10 m between the ankles is an overlap of 8 mm.
    let settings = path(&[(Side::Right, 0.05, Y - 0.10), (Side::Left, 0.1, Y), (Side::Right, 0.1, -Y)]);
    let error = refused(&settings);
    let GaitError::Step { step: 1, foot: Side::Right, found_m, limit_m, at_least: true, .. } = error else {
        panic!("{error}")
    };
    assert!((found_m + 0.008).abs() < 1e-12 && (limit_m - 0.03).abs() < 1e-12, "{error}");
}

#[test]
fn an_initial_stance_too_narrow_is_step_zero() {
    let mut settings = straight(3);
    settings.start.ankle_distance_m = 0.12;
    assert!(matches!(refused(&settings), GaitError::Step { step: 0, at_least: true, .. }));
}

#[test]
fn turning_feet_into_each_other_is_seen_at_the_corners() {
    let mut settings = straight(4);
    settings.walk = Walk::InPlace { swings: 4, turn_per_swing_rad: 0.5 };
    let error = refused(&settings);
    assert!(matches!(error, GaitError::Step { rule: "gap to the other foot", .. }), "{error}");
}

#[test]
fn a_step_too_wide_is_named() {
    let settings = path(&[(Side::Left, 0.0, 0.3), (Side::Right, 0.0, 0.3 - 2.0 * Y)]);
    let error = refused(&settings);
    assert!(matches!(error, GaitError::Step { step: 1, rule: "distance across the stance foot", .. }), "{error}");
}

#[test]
fn a_margin_that_empties_the_polygon_is_refused_with_the_half_width() {
    let mut settings = straight(3);
    settings.limits.zmp_margin_m = 0.065;
    let error = refused(&settings);
    let said = "`limits.zmp_margin_m` is 0.065, must be less than half of the sole's smaller side, 0.065000";
    assert!(error.to_string().starts_with(said), "{error}");
}

#[test]
fn free_steps_that_cannot_cover_the_distance_name_the_lengths_in_conflict() {
    // Four free landings of at most 0.30 m each and the first of the final stance: 1.5 m at most.
    let mut settings = straight(6);
    settings.walk = Walk::Free { swings: 6, distance_m: 1.6 };
    let error = refused(&settings);
    let GaitError::Infeasible { conflict, least_violation_m } = &error else { panic!("{error}") };
    let lengths = conflict.iter().filter(|label| matches!(label, RowLabel::StepLength { .. })).count();
    assert_eq!(lengths, 5, "{error}");
    let told = error.to_string();
    let named = (1..=5).filter(|step| told.contains(&format!("length of step {step}"))).count();
    assert!(named == 4 && told.ends_with("; and 1 more"), "{told}");
    // Five landings share 0.1 m too much: at best each breaks its limit by 0.02 m.
    assert!((least_violation_m - 0.02).abs() < 1e-8, "{least_violation_m}");
}

#[test]
fn a_margin_that_excludes_the_ankle_is_refused_with_the_room_there_is() {
    let mut settings = straight(3);
    settings.limits.zmp_margin_m = 0.06;
    let error = refused(&settings);
    let said = "`limits.zmp_margin_m` is 0.06, must be at most 0.054000, the ankle's distance";
    assert!(error.to_string().starts_with(said), "{error}");
}

#[test]
fn a_com_that_cannot_get_over_the_foot_in_time_names_zmp_rows_with_step_and_time() {
    // 0.05 s to get from rest between the feet over one of them, where 5 s have to be spent.
    let mut settings = straight(3);
    settings.timing.start_s = 0.05;
    settings.timing.single_support_s = 5.0;
    let error = refused(&settings);
    let GaitError::Infeasible { conflict, least_violation_m } = &error else { panic!("{error}") };
    let first = conflict.iter().any(|label| {
        matches!(label, RowLabel::Zmp { step: 1, kind: pattern::PhaseKind::SingleSupport, direction: 1, .. })
    });
    assert!(first, "{error}");
    // The ankles are 0.163 m apart, the polygon reaches 0.034 m inwards: some centimetres are missing.
    assert!((0.005..0.1).contains(least_violation_m), "{error}");
    assert!(error.to_string().contains("step 1, SingleSupport"), "{error}");
}

#[test]
fn feet_must_alternate_and_the_final_stance_must_be_prescribed() {
    let settings = path(&[(Side::Right, 0.05, -Y), (Side::Right, 0.1, -Y)]);
    assert_eq!(refused(&settings), GaitError::SameFootTwice { step: 2, foot: Side::Right });
    let mut settings = path(&[(Side::Right, 0.05, -Y), (Side::Left, 0.1, Y), (Side::Right, 0.1, -Y)]);
    if let Walk::Path { landings } = &mut settings.walk {
        landings[1].free = true;
    }
    assert_eq!(refused(&settings), GaitError::FreeFinalStance { step: 2, steps: 3 });
}

#[test]
fn an_iteration_limit_is_told_with_the_residual_reached() {
    let mut settings = straight(3);
    settings.solver.iterations_max = 2;
    assert!(matches!(refused(&settings), GaitError::NotSolved { iterations: 2, .. }));
}
