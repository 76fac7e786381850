//! Where the feet go.

use crate::support::{BETWEEN_SAMPLES_M, planned, straight};
use gait::{GaitSettings, Landing, Quantity, Walk, check, plan};
use pattern::Side;

fn walking(walk: Walk) -> GaitSettings {
    GaitSettings { walk, ..GaitSettings::default() }
}

#[test]
fn sideways_opens_and_closes() {
    for step_width_m in [0.06, -0.06] {
        let mut settings = walking(Walk::Sideways { swings: 6, step_width_m });
        settings.start.first_swing = if step_width_m > 0.0 { Side::Left } else { Side::Right };
        let plan = planned("sideways", &settings, BETWEEN_SAMPLES_M);
        let end = plan.pattern.evaluate(f64::INFINITY);
        assert!((end.com.position.y - 3.0 * step_width_m).abs() < 1e-12, "three openings");
        let distance = end.feet[0].ankle_foothold.y_m - end.feet[1].ankle_foothold.y_m;
        assert!((distance - 0.163).abs() < 1e-12);
    }
}

#[test]
fn the_last_swing_sideways_closes_whichever_foot_it_moves() {
    // Opening, closing, opening, closing; the fifth swing has nothing left to do: an opening would leave the feet apart.
    for (step_width_m, first_swing) in [(0.06, Side::Left), (-0.06, Side::Right)] {
        let mut settings = walking(Walk::Sideways { swings: 5, step_width_m });
        settings.start.first_swing = first_swing;
        let end = planned("sideways", &settings, BETWEEN_SAMPLES_M).pattern.evaluate(f64::INFINITY);
        assert!((end.com.position.y - 2.0 * step_width_m).abs() < 1e-12);
        assert!((end.feet[0].ankle_foothold.y_m - end.feet[1].ankle_foothold.y_m - 0.163).abs() < 1e-12);
    }
}

#[test]
fn a_circle_is_followed_and_feet_stand_across_the_path() {
    let radius = 0.9;
    let settings = walking(Walk::Circle { swings: 20, step_length_m: 0.1, radius_m: radius });
    let plan = planned("circle", &settings, BETWEEN_SAMPLES_M);
    for (side, foothold) in &plan.landings {
        // Centre of the circle: (0, radius).
        let distance = foothold.x_m.hypot(foothold.y_m - radius);
        let expected = radius - side.sign() * 0.163 / 2.0;
        assert!((distance - expected).abs() < 1e-12);
        let across = (foothold.x_m / distance, (foothold.y_m - radius) / distance);
        assert!((across.0 * foothold.yaw_rad.cos() + across.1 * foothold.yaw_rad.sin()).abs() < 1e-12);
    }
}

#[test]
fn coupled_and_separate_problems_agree_when_nothing_turns() {
    // A heading so small that nothing moves, but x and y become one problem.
    let straight = plan(&straight(4)).expect("feasible");
    let landings = straight
        .landings
        .iter()
        .map(|(foot, f)| Landing { foot: *foot, x_m: f.x_m, y_m: f.y_m, yaw_rad: 1e-300, free: false })
        .collect();
    let coupled = planned("coupled", &walking(Walk::Path { landings }), BETWEEN_SAMPLES_M);
    assert_eq!((straight.report.programs.len(), coupled.report.programs.len()), (2, 1));
    let relative = (straight.report.objective - coupled.report.objective) / straight.report.objective;
    assert!(relative.abs() < 1e-9, "{relative:e}");
    for i in 0..=400 {
        let t = straight.pattern.duration_s() * f64::from(i) / 400.0;
        let (a, b) = (straight.pattern.evaluate(t), coupled.pattern.evaluate(t));
        assert!((a.com.position - b.com.position).amax() < 1e-7);
        assert!((a.zmp.position - b.zmp.position).amax() < 1e-6);
    }
}

#[test]
fn turning_in_place_turns() {
    let plan = planned("turn", &walking(Walk::InPlace { swings: 7, turn_per_swing_rad: 0.12 }), BETWEEN_SAMPLES_M);
    let (_, last) = plan.landings[6];
    assert!((last.yaw_rad - 0.72).abs() < 1e-12);
}

#[test]
fn free_footholds_cost_less_and_keep_the_rules() {
    let mut prescribed = straight(8);
    prescribed.cost.lambda = 1.0;
    let free = GaitSettings { walk: Walk::Free { swings: 8, distance_m: 0.35 }, ..prescribed.clone() };
    let (a, b) = (planned("prescribed", &prescribed, BETWEEN_SAMPLES_M), planned("free", &free, BETWEEN_SAMPLES_M));
    assert!(b.report.objective < a.report.objective);
    let report = check(&b, &free, 1e-3, None);
    for quantity in [Quantity::StepTooLong, Quantity::StepTooWide, Quantity::FeetTooClose] {
        assert!(report.value(quantity) < 1e-7, "{quantity:?}");
    }
    // lambda = 1: a small lateral swing wants the feet as close as allowed.
    assert!(report.value(Quantity::FeetTooClose) > -1e-4, "the gap is used up: {:?}", report.worst);
    assert!((b.landings[7].1.x_m - 0.35).abs() < 1e-12);
}

#[test]
fn free_footholds_on_turned_feet_keep_the_rules() {
    let mut landings: Vec<_> = (1..=8_u32)
        .map(|q| {
            let foot = if q % 2 == 1 { Side::Right } else { Side::Left };
            let yaw_rad = 0.1 * f64::from(q.min(7));
            let s = 0.08 * f64::from(q.min(7));
            Landing { foot, x_m: s, y_m: foot.sign() * 0.09, yaw_rad, free: q <= 6 }
        })
        .collect();
    // The last two must stand beside each other in their own heading.
    let (sin, cos) = 0.7_f64.sin_cos();
    landings[6].x_m = 0.5 + 0.09 * sin;
    landings[6].y_m = 0.2 - 0.09 * cos;
    landings[7].x_m = 0.5 - 0.09 * sin;
    landings[7].y_m = 0.2 + 0.09 * cos;
    let settings = walking(Walk::Path { landings });
    let plan = planned("free and turned", &settings, BETWEEN_SAMPLES_M);
    let report = check(&plan, &settings, 1e-3, None);
    assert!(report.largest_violation().expect("checked").value < 5e-3);
    assert!(report.value(Quantity::FeetTooClose) < 1e-7);
}

#[test]
fn a_starting_pose_turns_the_whole_walk() {
    let mut settings = straight(3);
    settings.start.yaw_rad = std::f64::consts::FRAC_PI_2;
    let plan = planned("to the left", &settings, BETWEEN_SAMPLES_M);
    assert_eq!(plan.report.programs.len(), 2, "the heading of the walk does not couple x and y");
    let end = plan.pattern.evaluate(f64::INFINITY).com.position;
    assert!((end - nalgebra::Vector2::new(0.0, 0.1)).amax() < 1e-12);
}
