//! Requests at the edge of what a walk can be.

use crate::support::{BETWEEN_SAMPLES_M, planned, straight};
use gait::{CostSettings, GaitSettings, Quantity, Walk, check, plan};
use pattern::Side;

#[test]
fn from_one_swing_to_a_thousand() {
    for swings in [1, 2, 3, 4, 11, 100, 1000] {
        planned(&format!("{swings} swings"), &straight(swings), BETWEEN_SAMPLES_M);
    }
}

#[test]
fn either_foot_may_go_first_and_the_walks_mirror_each_other() {
    let left = planned("left first", &first(Side::Left), BETWEEN_SAMPLES_M).pattern;
    let right = planned("right first", &first(Side::Right), BETWEEN_SAMPLES_M).pattern;
    for i in 0..=500 {
        let t = left.duration_s() * f64::from(i) / 500.0;
        let (l, r) = (left.evaluate(t), right.evaluate(t));
        assert!((l.com.position.x - r.com.position.x).abs() < 1e-8);
        assert!((l.com.position.y + r.com.position.y).abs() < 1e-8);
        assert!((l.zmp.position.y + r.zmp.position.y).abs() < 1e-7);
        assert!((l.feet[0].share.value - r.feet[1].share.value).abs() < 1e-12);
    }

    fn first(first_swing: Side) -> GaitSettings {
        let mut settings = straight(6);
        settings.start.first_swing = first_swing;
        settings
    }
}

#[test]
fn phases_from_a_twentieth_of_a_second_to_twenty_seconds_mixed() {
    let mut settings = straight(6);
    settings.timing.single_support_each_s = vec![0.05, 20.0, 0.3, 0.05, 5.0, 0.7];
    settings.timing.double_support_each_s = vec![20.0, 0.4, 0.3, 8.0, 0.4];
    planned("mixed phases", &settings, BETWEEN_SAMPLES_M);
    for phase in [0.05, 0.1, 2.0, 20.0] {
        let mut settings = straight(4);
        settings.timing.single_support_s = phase;
        settings.timing.double_support_s = phase;
        planned(&format!("all phases {phase} s"), &settings, BETWEEN_SAMPLES_M);
    }
}

#[test]
fn only_one_term_of_the_cost() {
    for (lambda, mu) in [(0.0, 15.0), (1.0, 15.0), (0.6, 1e4)] {
        planned(&format!("lambda {lambda}, mu {mu}"), &weighing(lambda, mu), BETWEEN_SAMPLES_M);
    }
    for (lambda, mu) in [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0)] {
        planned(&format!("lambda {lambda}, mu {mu}"), &weighing(lambda, mu), UNWEIGHED_BETWEEN_SAMPLES_M);
    }
}

/// Where nothing is paid for the feet's ZMPs (mu = 0) they swing between 11 samples by up to this (m).
const UNWEIGHED_BETWEEN_SAMPLES_M: f64 = 2.5e-3;

fn weighing(lambda: f64, mu: f64) -> GaitSettings {
    GaitSettings { cost: CostSettings { lambda, mu }, ..straight(5) }
}

#[test]
fn more_samples_keep_a_restless_zmp_in_its_margin() {
    for lambda in [0.5, 1.0] {
        let outside = |samples: u32| {
            let mut settings = weighing(lambda, 0.0);
            settings.discretisation.samples_per_polynomial = samples;
            let plan = planned(&format!("{samples} samples"), &settings, UNWEIGHED_BETWEEN_SAMPLES_M);
            check(&plan, &settings, 1e-3, None).value(Quantity::ZmpOutsidePolygon)
        };
        let measured = [11, 21, 41, 81].map(outside);
        // Between samples a distance h apart a smooth function leaves its bound by h^2 times a curvature: eight times as many leave a
        // 64th, if the worst place stays the same.
        let [coarse, finer, _, finest] = measured;
        assert!(finer < BETWEEN_SAMPLES_M && finest < coarse / 20.0, "lambda {lambda}: {measured:?}");
    }
}

/// A polygon one millimetre wide leaves no freedom across: the feet's ZMPs stand still, the loads are given, so the ZMP is.
/// Whether the COM that starts at rest gets into the walk's rhythm then depends on the duration of the start alone.
#[test]
fn a_millimetre_of_room_for_the_zmp_works_where_the_timing_fits() {
    let room = |start_s: f64| {
        let mut settings = straight(6);
        settings.sole.left_ankle_in_sole_m = Some([-0.015, 0.0]);
        settings.limits.zmp_margin_m = settings.sole.width_m() / 2.0 - 0.0005;
        (settings.timing.start_s, settings.timing.stop_s) = (start_s, start_s);
        settings
    };
    let settings = room(0.61);
    let plan = planned("1 mm", &settings, 1e-4);
    let margin = -check(&plan, &settings, 1e-3, None).value(Quantity::NegativeZmpMargin);
    assert!(margin > settings.limits.zmp_margin_m - 1e-4);
    for start_s in [0.60, 0.62, 0.81] {
        let error = gait::plan(&room(start_s)).expect_err("the rhythm does not fit");
        assert!(matches!(error, gait::GaitError::Infeasible { .. }), "{error}");
    }
}

#[test]
fn zero_step_length_marks_time() {
    let mut settings = straight(8);
    settings.walk = Walk::Straight { swings: 8, step_length_m: 0.0 };
    let plan = planned("in place", &settings, BETWEEN_SAMPLES_M);
    for i in 0..=200 {
        let r = plan.pattern.evaluate(plan.pattern.duration_s() * f64::from(i) / 200.0);
        assert!(r.com.position.x.abs() < 1e-9, "nothing moves forward");
    }
}

/// Eight swings on a circle whose longest distance along a stance foot is `length_m`, from ankle to ankle: the outer foot lands
/// `(|r| + d/2) sin(turn)` ahead of the inner one.
fn turning(radius_m: f64, length_m: f64) -> GaitSettings {
    let mut settings = straight(8);
    let ankle_distance_m = 0.25;
    settings.start.ankle_distance_m = ankle_distance_m;
    let turn = (length_m / (radius_m.abs() + ankle_distance_m / 2.0)).asin();
    settings.walk = Walk::Circle { swings: 8, step_length_m: radius_m.abs() * turn, radius_m };
    settings
}

#[test]
fn the_longest_step_while_turning() {
    let limit_m = GaitSettings::default().limits.step_length_max_m;
    // Rounding of eight footholds, each placed from the last one by the platform's sine and cosine; the steps asked for too much are a
    // thousand times longer.
    const ROUNDING_M: f64 = 1e-12;
    for radius_m in [3.0, -3.0, 1.2, -0.8] {
        let settings = turning(radius_m, limit_m);
        let plan = planned(&format!("radius {radius_m}"), &settings, BETWEEN_SAMPLES_M);
        let reached = check(&plan, &settings, 1e-3, None).value(Quantity::StepTooLong);
        assert!(reached.abs() < ROUNDING_M, "radius {radius_m}: {reached:e} from the limit");
        let error = gait::plan(&turning(radius_m, limit_m + 1e-9)).expect_err("a nanometre too long");
        let gait::GaitError::Step { rule: "distance along the stance foot", found_m, limit_m: told_m, .. } = error
        else {
            panic!("radius {radius_m}: {error}")
        };
        assert!((found_m - limit_m - 1e-9).abs() < ROUNDING_M && told_m == limit_m, "{error}");
    }
}

#[test]
fn com_heights_from_a_child_to_a_giant() {
    for com_height_m in [0.3, 0.79, 2.0] {
        let mut settings = straight(5);
        settings.body.com_height_m = com_height_m;
        planned(&format!("COM at {com_height_m} m"), &settings, BETWEEN_SAMPLES_M);
        settings.timing.single_support_s = 0.05;
        settings.timing.double_support_s = 0.05;
        planned(&format!("COM at {com_height_m} m, fast"), &settings, BETWEEN_SAMPLES_M);
    }
}

#[test]
fn wide_steps_in_a_twentieth_of_a_second() {
    // The ZMP crosses 0.2 m in 0.05 s: in the form of (9) its COM is a difference of numbers of 100 km.
    let mut settings = straight(6);
    settings.walk = Walk::Sideways { swings: 6, step_width_m: 0.05 };
    settings.start.first_swing = Side::Left;
    settings.timing.start_s = 0.3;
    settings.timing.single_support_s = 0.05;
    settings.timing.double_support_s = 0.05;
    planned("hopping sideways", &settings, BETWEEN_SAMPLES_M);
}

#[test]
fn a_kilometre_away_the_walk_is_the_same() {
    let here = plan(&straight(11)).expect("feasible").pattern;
    for (x_m, y_m, yaw_rad) in [(1000.0, -700.0, 0.0), (-300.0, 1000.0, 2.3)] {
        let mut settings = straight(11);
        settings.start = gait::StartSettings { x_m, y_m, yaw_rad, ..settings.start };
        let there = planned("far away", &settings, BETWEEN_SAMPLES_M).pattern;
        let (sin, cos) = yaw_rad.sin_cos();
        for i in 0..=1442 {
            let t = f64::from(i) * 0.01;
            let (a, b) = (here.evaluate(t), there.evaluate(t));
            for (p, q) in [
                (a.zmp.position, b.zmp.position),
                (a.com.position, b.com.position),
                (a.feet[0].zmp.position, b.feet[0].zmp.position),
                (a.feet[1].zmp.position, b.feet[1].zmp.position),
            ] {
                let (dx, dy) = (q.x - x_m, q.y - y_m);
                let back = nalgebra::Vector2::new(cos * dx + sin * dy, cos * dy - sin * dx);
                assert!((back - p).amax() < 1e-9, "at {t} s: {p} and {back}");
            }
            let turned = nalgebra::Vector2::new(
                cos * b.com.acceleration.x + sin * b.com.acceleration.y,
                cos * b.com.acceleration.y - sin * b.com.acceleration.x,
            );
            assert!((turned - a.com.acceleration).amax() < 1e-9);
        }
    }
}

#[test]
fn work_grows_linearly_with_the_number_of_swings() {
    // Counted, not timed: iterations stay bounded while entries and unknowns grow in proportion.
    for lambda in [0.0, 0.6, 0.99, 1.0] {
        let of = |swings: u32| {
            let mut settings = straight(swings);
            settings.cost.lambda = lambda;
            plan(&settings).expect("feasible").report.programs
        };
        for (a, b) in of(10).iter().zip(&of(1000)) {
            // At lambda = 1 ahead they do grow, as the crate's documentation says: 10 to 15. Last bits, other on another processor, add or
            // spare a few; in proportion it would be 100 times as many.
            assert!(
                b.iterations <= 2 * a.iterations,
                "lambda {lambda}: {} then {} iterations",
                a.iterations,
                b.iterations
            );
            // Digits are not lost on the way: the solver meets its own tolerance in the problem as it was given.
            assert!(b.residuals.max() <= SOLVER_TOLERANCE, "lambda {lambda}: {:?}", b.residuals);
            let entries = |p: &gait::ProgramReport| (p.hessian_entries + p.constraint_entries) as f64;
            assert!(entries(b) / entries(a) < 115.0);
            assert!(b.variables as f64 / (a.variables as f64) < 115.0);
        }
    }
}

/// What the settings ask for by default.
const SOLVER_TOLERANCE: f64 = 1e-10;

#[test]
fn asked_for_more_digits_than_there_are_the_solver_gives_those_it_reaches() {
    // Where the first attempt loses its way depends on the last bits, so there are several walks: what counts is that a plan with small
    // residuals comes. Where nothing is paid for the feet's ZMPs, and nothing moves ahead, there is least to hold on to.
    for (lambda, single_s, double_s) in
        [(0.6, 0.05, 0.05), (0.6, 5.0, 0.05), (0.9, 0.3, 0.1), (0.9, 2.0, 2.0), (0.9, 20.0, 20.0)]
    {
        let settings = beating(6, 0.0, [single_s, double_s], CostSettings { lambda, mu: 0.0 });
        let settings =
            GaitSettings { solver: gait::SolverSettings { tolerance: 1e-12, ..settings.solver }, ..settings };
        plan(&settings).unwrap_or_else(|error| panic!("lambda {lambda}, {single_s} s, {double_s} s: {error}"));
    }
}

/// A walk of equal single and of equal double supports.
fn beating(swings: u32, step_length_m: f64, [single_s, double_s]: [f64; 2], cost: CostSettings) -> GaitSettings {
    let mut settings = GaitSettings { walk: Walk::Straight { swings, step_length_m }, cost, ..GaitSettings::default() };
    (settings.timing.single_support_s, settings.timing.double_support_s) = (single_s, double_s);
    settings
}

/// A cost that is a million times heavier in one direction than in another, as the planner's ranges allow.
#[test]
fn a_heavy_weight_on_the_zmps_accelerations_does_not_stop_the_solver() {
    for mu in [1e4, 1e6] {
        for rhythm in [[0.05, 0.05], [5.0, 0.05], [0.05, 20.0], [0.1, 0.3]] {
            for step_length_m in [0.0, 0.05] {
                let settings = beating(6, step_length_m, rhythm, CostSettings { lambda: 0.0, mu });
                let plan =
                    plan(&settings).unwrap_or_else(|error| panic!("mu {mu}, {rhythm:?} s, {step_length_m} m: {error}"));
                assert_eq!(plan.pattern.check(), Ok(()));
            }
        }
    }
}
