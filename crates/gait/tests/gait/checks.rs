//! The planner's checks see what they are there for: each is shown a pattern with one defect.

use crate::support::straight;
use gait::{CheckReport, GaitSettings, Landing, LegClearance, LegReach, Plan, Quantity, Walk, check, plan};
use pattern::{PhaseKind, Side};
use spatial::{Transform, Vec3, so3};

fn checked(change: impl Fn(&mut Plan)) -> CheckReport {
    let settings = straight(3);
    let mut plan = plan(&settings).expect("feasible");
    change(&mut plan);
    check(&plan, &settings, 1e-3, None)
}

/// Index of the first middle double support of a walk of three swings.
const DOUBLE: usize = 3;

#[test]
fn a_sound_plan_has_nothing_to_complain_about() {
    let report = checked(|plan| assert_eq!(plan.pattern.phases[DOUBLE].kind, PhaseKind::DoubleSupport));
    assert!(report.largest_violation().expect("checked").value < 1e-3);
    assert!(report.value(Quantity::ComEquation) < 1e-9);
}

#[test]
fn every_defect_is_seen_with_phase_and_amount() {
    type Case = (&'static str, fn(&mut Plan), Quantity, f64);
    let cases: [Case; 11] = [
        ("ZMP off its COM", |p| p.pattern.phases[DOUBLE].zmp[0].0[3] += 0.5, Quantity::ComEquation, 0.1),
        ("loads do not balance", |p| p.pattern.phases[DOUBLE].load.excess[1].0[0] += 0.1, Quantity::LoadBalance, 1e-3),
        ("ZMP jumps", |p| p.pattern.phases[DOUBLE].zmp[0].0[0] += 0.01, Quantity::ZmpJump, 0.0099),
        ("ZMP velocity jumps", |p| p.pattern.phases[DOUBLE].zmp[0].0[1] += 0.01, Quantity::ZmpVelocityJump, 0.0099),
        ("a foot's ZMP jumps", |p| p.pattern.phases[DOUBLE].zmp_1[0].0[0] += 0.01, Quantity::FootZmpJump, 0.0099),
        (
            "a foot's ZMP velocity jumps",
            |p| p.pattern.phases[DOUBLE].zmp_1[0].0[1] += 0.01,
            Quantity::FootZmpVelocityJump,
            0.0099,
        ),
        (
            "a foot's ZMP acceleration jumps",
            |p| p.pattern.phases[DOUBLE].load.excess[1].0[2] += 0.01,
            Quantity::FootZmpAccelerationJump,
            0.0099,
        ),
        ("COM jumps", |p| p.pattern.phases[DOUBLE].com[1].polynomial.0[0] += 0.01, Quantity::ComJump, 0.0099),
        (
            "COM velocity jumps",
            |p| p.pattern.phases[DOUBLE].com[1].polynomial.0[1] += 0.01,
            Quantity::ComVelocityJump,
            0.0099,
        ),
        ("ZMP outside", |p| p.pattern.phases[DOUBLE].zmp_1[1].0[0] += 0.2, Quantity::ZmpOutsidePolygon, 0.05),
        ("a landing too near", |p| p.landings[0].1.y_m += 0.05, Quantity::FeetTooClose, 0.02),
    ];
    for (name, change, quantity, at_least) in cases {
        let report = checked(change);
        assert!(report.value(quantity) >= at_least, "{name}: {quantity:?} = {}", report.value(quantity));
        let worst = report.worst.iter().find(|w| w.quantity == quantity).expect("measured");
        if quantity != Quantity::FeetTooClose {
            assert!((DOUBLE..=DOUBLE + 1).contains(&worst.phase), "{name}: {worst:?}");
        }
    }
    let far = checked(|plan| plan.landings[0].1.x_m += 0.4);
    let worst = far.largest_violation().expect("checked");
    assert_eq!((worst.quantity, worst.step), (Quantity::StepTooLong, 1), "{worst:?}");
    assert!((worst.value - 0.15).abs() < 1e-12, "{worst:?}");
    // The right foot lands 0.4 m farther out: 0.163 + 0.4 m from the left ankle, where 0.35 m are allowed.
    let wide = checked(|plan| plan.landings[0].1.y_m -= 0.4);
    let worst = wide.largest_violation().expect("checked");
    assert_eq!((worst.quantity, worst.step, worst.foot), (Quantity::StepTooWide, 1, Some(Side::Right)), "{worst:?}");
    assert!((worst.value - 0.213).abs() < 1e-12, "{worst:?}");
    for end in [0, 9] {
        let moving = checked(|plan| plan.pattern.phases[end].com[0].polynomial.0[1] += 0.01);
        assert!(moving.value(Quantity::SpeedAtEnds) > 0.0099, "phase {end}");
    }
}

/// The gap between turned feet by their corners: no corner of one sole comes nearer to the (endless) inner edge of the other.
#[test]
fn the_gap_between_turned_feet_is_that_of_their_corners() {
    let circle = |radius_m| (format!("radius {radius_m}"), Walk::Circle { swings: 6, step_length_m: 0.1, radius_m });
    let turn = |by| (format!("turn {by}"), Walk::InPlace { swings: 6, turn_per_swing_rad: by });
    let mut walks = vec![circle(0.5), circle(-0.5), turn(0.15), turn(-0.15)];
    // A long step with the toes turned outwards, forward and back: there the inner edge of the landing foot points at the standing one,
    // whose corner is the nearest.
    for (foot, x_m) in [(Side::Right, 0.25_f64), (Side::Left, 0.25), (Side::Right, -0.2), (Side::Left, -0.2)] {
        let yaw_rad = foot.sign() * 0.3 * x_m.signum();
        let (sin, cos) = yaw_rad.sin_cos();
        let y_m = foot.sign() * 0.14;
        let (beside_x, beside_y) = (x_m + foot.sign() * 0.25 * sin, y_m - foot.sign() * 0.25 * cos);
        let landings = [(foot, x_m, y_m), (foot.other(), beside_x, beside_y)].map(|(foot, x_m, y_m)| Landing {
            foot,
            x_m,
            y_m,
            yaw_rad,
            free: false,
        });
        walks.push((format!("{foot:?} foot to {x_m} m"), Walk::Path { landings: landings.into() }));
    }
    for (name, walk) in walks {
        let mut settings = straight(6);
        settings.start.ankle_distance_m = 0.25;
        settings.walk = walk;
        let plan = plan(&settings).unwrap_or_else(|error| panic!("{name}: {error}"));
        let half = settings.start.ankle_distance_m / 2.0;
        let mut standing = [half, -half].map(|y_m| pattern::Foothold { x_m: 0.0, y_m, yaw_rad: 0.0 });
        let mut smallest_m = f64::INFINITY;
        for (side, landing) in &plan.landings {
            standing[side.index()] = *landing;
            for (foot, other) in [(Side::Left, Side::Right), (Side::Right, Side::Left)] {
                let [f, o] = [foot, other].map(|side| standing[side.index()]);
                // Seen from a foot in its own axes, the other one's corners lie beyond its inner edge, 0.054 m from the ankle.
                for (x_m, y_m) in corners(other) {
                    let at = o.offset(nalgebra::Vector2::new(x_m, y_m));
                    let (dx, dy) = (at.x_m - f.x_m, at.y_m - f.y_m);
                    let across = f.yaw_rad.cos() * dy - f.yaw_rad.sin() * dx;
                    smallest_m = smallest_m.min(-foot.sign() * across - 0.054);
                }
            }
        }
        let found = check(&plan, &settings, 1e-2, None).value(Quantity::FeetTooClose);
        let expected = settings.limits.feet_gap_min_m - smallest_m;
        assert!((found - expected).abs() < 1e-12, "{name}: {found} and {expected}");
    }

    /// From the ankle: HRP-4's soles reach 0.13 m forward, 0.1 m back, 0.054 m inwards, 0.076 m outwards.
    fn corners(side: Side) -> [(f64, f64); 4] {
        let (inner, outer) = (-side.sign() * 0.054, side.sign() * 0.076);
        [(0.13, inner), (0.13, outer), (-0.1, inner), (-0.1, outer)]
    }
}

/// The legs are asked with the COM, both ankles, and the body turned half-way between the feet.
#[test]
fn the_body_looks_half_way_between_the_feet() {
    use std::cell::RefCell;
    #[derive(Default)]
    struct Seen(RefCell<Vec<(Side, f64, f64)>>);
    impl LegReach for Seen {
        fn clearance(&self, leg: Side, _: &Vec3, heading_rad: f64, ankle: &Transform) -> LegClearance {
            let yaw = ankle.rotation[(1, 0)].atan2(ankle.rotation[(0, 0)]);
            self.0.borrow_mut().push((leg, heading_rad, yaw));
            LegClearance { extension_m: 1.0, joint_rad: 1.0, joint: 0 }
        }
    }
    let mut settings = straight(4);
    // Past the half turn, where angles jump.
    settings.start.yaw_rad = 3.1;
    settings.walk = Walk::InPlace { swings: 4, turn_per_swing_rad: 0.1 };
    let seen = Seen::default();
    let reach = check(&plan(&settings).expect("feasible"), &settings, 5e-3, Some(&seen)).reach.expect("asked for");
    assert!(reach.is_walkable());
    let mut apart = 0.0_f64;
    for pair in seen.0.into_inner().chunks(2) {
        let [(Side::Left, heading, left), (Side::Right, same, right)] = pair else { panic!("{pair:?}") };
        assert_eq!(heading, same);
        let from = |yaw: f64| (yaw - heading).sin();
        assert!((from(*left) + from(*right)).abs() < 1e-12 && (left - heading).cos() > 0.9, "{pair:?}");
        apart = apart.max(from(*left).abs());
    }
    assert!((apart - 0.05_f64.sin()).abs() < 1e-6, "the feet turn 0.1 rad after each other");
    let beyond = gait::TightestReach { joint: (-1e-9, 0.0, Side::Left, 0), ..reach };
    let stretched = gait::TightestReach { extension: (-1e-9, 0.0, Side::Left), ..reach };
    assert!(!beyond.is_walkable() && !stretched.is_walkable());
}

#[test]
fn a_nan_does_not_hide_whatever_its_sign_and_place() {
    type Case = (&'static str, fn(&mut Plan) -> &mut f64, Quantity);
    let cases: [Case; 6] = [
        ("COM", |p| &mut p.pattern.phases[DOUBLE].com[0].polynomial.0[2], Quantity::ComEquation),
        ("COM, for friction", |p| &mut p.pattern.phases[DOUBLE].com[1].growing, Quantity::FrictionDemand),
        ("ZMP in single support", |p| &mut p.pattern.phases[DOUBLE - 1].zmp[1].0[0], Quantity::ZmpOutsidePolygon),
        ("a foot's ZMP along", |p| &mut p.pattern.phases[DOUBLE].zmp_1[0].0[0], Quantity::ZmpOutsidePolygon),
        ("a foot's ZMP across", |p| &mut p.pattern.phases[DOUBLE].zmp_1[1].0[3], Quantity::NegativeZmpMargin),
        ("ZMP at the start", |p| &mut p.pattern.phases[0].zmp[0].0[1], Quantity::SpeedAtEnds),
    ];
    for (name, place, quantity) in cases {
        // A division of zero by zero gives a negative NaN on x86, which sorts below every number.
        for nan in [f64::NAN, -f64::NAN] {
            let report = checked(|plan| *place(plan) = nan);
            assert!(report.value(quantity).is_nan(), "{name}: {quantity:?} = {}", report.value(quantity));
            if quantity == Quantity::ZmpOutsidePolygon {
                let largest = report.largest_violation().expect("checked");
                assert!(largest.value.is_nan(), "{name}: {largest:?}");
            }
        }
    }
    let report = checked(|plan| plan.landings[0].1.x_m = -f64::NAN);
    assert!(report.largest_violation().expect("checked").value.is_nan());
}

#[test]
fn legs_that_answer_with_a_nan_are_not_called_able() {
    struct Broken;
    impl LegReach for Broken {
        fn clearance(&self, _: Side, com: &Vec3, _: f64, _: &Transform) -> LegClearance {
            // No number at the beginning only: later numbers must not cover it.
            let nan = if com.x < 1e-6 { -f64::NAN } else { 1.0 };
            LegClearance { extension_m: nan, joint_rad: nan, joint: 0 }
        }
    }
    let settings = straight(3);
    let reach = check(&plan(&settings).expect("feasible"), &settings, 5e-3, Some(&Broken)).reach.expect("asked for");
    assert!(reach.extension.0.is_nan() && reach.joint.0.is_nan() && !reach.is_walkable(), "{reach:?}");
}

#[test]
fn friction_demand_is_the_steepest_force() {
    // On Earth and on the Moon.
    for gravity_m_per_s2 in [9.81, 1.62] {
        let mut settings = straight(3);
        settings.body.gravity_m_per_s2 = gravity_m_per_s2;
        let plan = plan(&settings).expect("feasible");
        let report = check(&plan, &settings, 1e-3, None);
        let mut steepest = 0.0_f64;
        let mut t = 0.0;
        while t < plan.pattern.duration_s() {
            for foot in plan.pattern.evaluate(t).feet.iter().filter(|foot| foot.force.z > 1.0) {
                steepest = steepest.max(foot.force.xy().norm() / foot.force.z);
            }
            t += 1e-3;
        }
        assert!((report.value(Quantity::FrictionDemand) - steepest).abs() < 1e-4 * steepest);
    }
}

/// Legs as rods between hip and ankle that do not stretch: the least a `LegReach` can be.
#[derive(Debug, Clone, Copy, PartialEq)]
struct RodLegs {
    /// Left hip as seen from the COM, in the axes of the upright body (m); the right one is its mirror image.
    left_hip_from_com_m: [f64; 3],
    /// Largest distance from hip to ankle (m).
    length_max_m: f64,
}

impl LegReach for RodLegs {
    fn clearance(&self, leg: Side, com: &Vec3, heading_rad: f64, ankle: &Transform) -> LegClearance {
        let [x, y, z] = self.left_hip_from_com_m;
        let hip = com + so3::about_z(heading_rad) * Vec3::new(x, leg.sign() * y, z);
        let extension_m = self.length_max_m - (ankle.translation - hip).norm();
        LegClearance { extension_m, joint_rad: f64::INFINITY, joint: 0 }
    }
}

/// HRP-4: hips 0.0331 m below the COM in half-sitting, straight legs of 0.358 + 0.34115 m offset by 0.01905 m.
fn legs() -> RodLegs {
    RodLegs { left_hip_from_com_m: [0.0, 0.0875, -0.0331], length_max_m: (0.69915_f64).hypot(0.01905) }
}

#[test]
fn legs_reach_at_the_usual_height_and_not_at_every_height() {
    let reach = |com_height_m: f64| {
        let mut settings = GaitSettings::default();
        settings.body.com_height_m = com_height_m;
        let plan = plan(&settings).expect("feasible");
        check(&plan, &settings, 5e-3, Some(&legs() as &dyn LegReach)).reach.expect("asked for")
    };
    let usual = reach(0.79);
    assert!(usual.is_walkable() && usual.extension.0 > 0.02, "{usual:?}");
    let high = reach(0.84);
    assert!(!high.is_walkable(), "{high:?}");
    assert!((0.0..15.0).contains(&high.extension.1));
}
