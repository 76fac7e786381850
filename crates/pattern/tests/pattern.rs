//! Closed forms of the pattern and what it refuses.

use pattern::{ComSolution, PatternError, Phase, Quintic, Side, WalkPattern};

/// The solution of (8) for a ZMP that rises by `rise` m as fast as a quintic can, over a duration.
fn solution(duration_s: f64, omega: f64, rise: f64) -> (Quintic, ComSolution) {
    let zmp = Quintic::hermite(duration_s, [0.02, 0.1, -0.3], [0.02 + rise, -0.2, 0.5]);
    (zmp, ComSolution::through(&zmp, duration_s, omega, -0.01, 0.07))
}

#[test]
fn the_com_solves_its_equation_between_its_two_ends_for_any_duration() {
    for omega in [2.2, 3.52, 5.7] {
        for duration in [0.02, 0.05, 0.1, 0.99 / omega, 1.01 / omega, 0.8, 4.0, 20.0, 60.0] {
            let (zmp, com) = solution(duration, omega, 0.2);
            for i in 0..=400 {
                let t = duration * f64::from(i) / 400.0;
                let [x, _, acceleration, jerk, snap] = com.derivatives(t, duration, omega);
                let [z, z1, z2] = zmp.derivatives::<3>(t);
                let [_, velocity, ..] = com.derivatives(t, duration, omega);
                let w2 = omega * omega;
                assert!((acceleration - w2 * (x - z)).abs() < 1e-9, "{omega} {duration} {t}");
                // The equation's derivatives; what rounds there is larger by powers of 1/T.
                assert!((jerk - w2 * (velocity - z1)).abs() < 1e-9 / duration.min(1.0), "{omega} {duration} {t}");
                assert!(
                    (snap - w2 * (acceleration - z2)).abs() < 1e-9 / duration.min(1.0).powi(2),
                    "{omega} {duration} {t}"
                );
            }
            assert!((com.derivatives(0.0, duration, omega)[0] + 0.01).abs() < 1e-12);
            assert!((com.derivatives(duration, duration, omega)[0] - 0.07).abs() < 1e-12, "{omega} {duration}");
        }
    }
}

#[test]
fn velocity_is_the_integral_of_acceleration_in_the_short_form_too() {
    let (omega, duration) = (3.52, 0.2);
    let (_, com) = solution(duration, omega, 0.15);
    let h = 1e-4;
    for order in 0..4 {
        for i in 1..20 {
            let t = 0.01 * f64::from(i) - 0.005;
            let at = |t: f64| com.derivatives(t, duration, omega)[order];
            // Fourth-order central difference.
            let difference = (8.0 * (at(t + h) - at(t - h)) - (at(t + 2.0 * h) - at(t - 2.0 * h))) / (12.0 * h);
            let exact = com.derivatives(t, duration, omega)[order + 1];
            assert!(
                (difference - exact).abs() < 1e-7 * (1.0 + exact.abs()),
                "order {order} at {t}: {difference} {exact}"
            );
        }
    }
}

#[test]
fn a_cart_without_forces_follows_the_catenary() {
    // ZMP at rest in 0: x = cosh(w t) from 1 with velocity 0; both forms.
    let omega = 3.0;
    for duration in [0.2_f64, 1.0] {
        let end = (omega * duration).cosh();
        let com = ComSolution::through(&Quintic::default(), duration, omega, 1.0, end);
        for i in 0..=10 {
            let t = duration * f64::from(i) / 10.0;
            let d = com.derivatives(t, duration, omega);
            for (order, value) in d.into_iter().enumerate() {
                let wanted =
                    omega.powi(order as i32) * if order % 2 == 0 { (omega * t).cosh() } else { (omega * t).sinh() };
                assert!(
                    (value - wanted).abs() < 1e-12 * (1.0 + wanted.abs()) * omega.powi(order as i32),
                    "{duration} {t} {order}"
                );
            }
        }
    }
}

fn walk() -> WalkPattern {
    toml::from_str(include_str!("one_step.toml")).expect("a pattern")
}

#[test]
fn a_stored_pattern_is_still_read() {
    let pattern = walk();
    pattern.check().expect("well formed");
    assert_eq!(pattern.phases.len(), 5);
    assert_eq!(pattern.phases[2].foot_1, Side::Right);
    let middle = pattern.evaluate(pattern.duration_s() / 2.0);
    assert!(middle.feet[1].swing.is_some() && middle.feet[0].share.value == 1.0);
}

#[test]
fn every_defect_is_named() {
    let broken = |change: &dyn Fn(&mut WalkPattern)| {
        let mut pattern = walk();
        change(&mut pattern);
        pattern.check().expect_err("broken")
    };
    assert_eq!(broken(&|p| p.version = 7), PatternError::Version { found: 7 });
    assert_eq!(broken(&|p| p.phases.clear()), PatternError::Empty);
    assert_eq!(broken(&|p| p.mass_kg = 0.0), PatternError::Constant { field: "mass_kg", value: 0.0 });
    assert!(matches!(broken(&|p| p.com_height_m = f64::NAN), PatternError::Constant { field: "com_height_m", .. }));
    assert!(matches!(broken(&|p| p.phases[1].start_s += 0.1), PatternError::Time { phase: 1, .. }));
    assert!(matches!(broken(&|p| p.phases[4].duration_s = -1.0), PatternError::Time { phase: 4, .. }));
    assert_eq!(broken(&|p| p.phases[3].zmp_1[1].0[4] = f64::INFINITY), PatternError::Coefficient { phase: 3 });
    assert_eq!(broken(&|p| p.phases[0].load.share.0[0] = -0.1), PatternError::Coefficient { phase: 0 });
}

#[test]
fn time_is_clamped_to_the_walk_and_boundaries_belong_to_the_later_phase() {
    let pattern = walk();
    assert_eq!(pattern.evaluate(-3.0), pattern.evaluate(0.0));
    assert_eq!(pattern.evaluate(1e9), pattern.evaluate_phase(4, pattern.phases[4].duration_s));
    for (i, phase) in pattern.phases.iter().enumerate() {
        assert_eq!(pattern.phase_at(phase.start_s), i);
        assert_eq!(pattern.phase_at(phase.start_s + 0.5 * phase.duration_s), i);
    }
}

#[test]
fn a_thousand_steps_fit_one_message() {
    // 3001 phases at this size are 4 MB, below the 4096 phases for which consumers keep memory.
    assert!(size_of::<Phase>() <= 1400, "{}", size_of::<Phase>());
}
