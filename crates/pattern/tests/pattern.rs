//! Closed forms of the pattern and what it refuses.

use pattern::{ComSolution, PatternError, Phase, PhaseKind, Quintic, Side, WalkPattern};

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

fn broken(change: impl Fn(&mut WalkPattern)) -> PatternError {
    let mut pattern = walk();
    change(&mut pattern);
    pattern.check().expect_err("broken")
}

/// Index of the only single support, in which the right foot flies.
const FLIGHT: usize = 2;
const RIGHT: usize = 1;

#[test]
fn another_version_and_an_empty_walk_are_refused() {
    assert_eq!(broken(|p| p.version = 7), PatternError::Version { found: 7 });
    assert_eq!(broken(|p| p.phases.clear()), PatternError::Empty);
}

#[test]
fn constants_beyond_any_robot_are_refused_by_name() {
    type Field = fn(&mut WalkPattern) -> &mut f64;
    let fields: [(&str, Field); 6] = [
        ("mass_kg", |p| &mut p.mass_kg),
        ("gravity_m_per_s2", |p| &mut p.gravity_m_per_s2),
        ("com_height_m", |p| &mut p.com_height_m),
        ("ankle_height_m", |p| &mut p.ankle_height_m),
        ("ankle_in_sole_m[0][1]", |p| &mut p.ankle_in_sole_m[0][1]),
        ("ankle_in_sole_m[1][0]", |p| &mut p.ankle_in_sole_m[RIGHT][0]),
    ];
    for (name, field) in fields {
        for bad in [-1e300, 1e308, f64::INFINITY, f64::NAN] {
            let error = broken(|p| *field(p) = bad);
            assert!(matches!(error, PatternError::Constant { field, .. } if field == name), "{name} = {bad}: {error}");
        }
    }
    assert!(matches!(broken(|p| p.mass_kg = 0.0), PatternError::Constant { field: "mass_kg", .. }));
    let mut barefoot = walk();
    barefoot.ankle_height_m = 0.0;
    assert_eq!(barefoot.check(), Ok(()));
}

/// Two processes that hold the same hash do the same at all times: whatever a foot or a force follows from is in it.
#[test]
fn every_number_of_a_pattern_is_in_its_hash() {
    type Change = fn(&mut WalkPattern);
    let hash = walk().content_hash();
    let changes: [(&str, Change); 21] = [
        ("mass", |p| p.mass_kg += 1e-9),
        ("gravity", |p| p.gravity_m_per_s2 += 1e-9),
        ("COM height", |p| p.com_height_m += 1e-9),
        ("ankle height", |p| p.ankle_height_m += 1e-9),
        ("left ankle in its sole", |p| p.ankle_in_sole_m[0][1] += 1e-9),
        ("start", |p| p.phases[1].start_s += 1e-9),
        ("duration", |p| p.phases[4].duration_s += 1e-9),
        ("kind", |p| p.phases[1].kind = PhaseKind::Stop),
        ("step", |p| p.phases[3].step += 1),
        ("foot 1", |p| p.phases[3].foot_1 = p.phases[3].foot_1.other()),
        ("ZMP", |p| p.phases[3].zmp[1].0[5] += 1e-9),
        ("ZMP of foot 1", |p| p.phases[3].zmp_1[0].0[0] += 1e-9),
        ("shift of the ZMP", |p| p.phases[3].zmp_shift.0[1][8][2] += 1e-9),
        ("COM", |p| p.phases[2].com[1].growing += 1e-9),
        ("load share", |p| p.phases[0].load.share.0[3] += 1e-9),
        ("power", |p| p.phases[0].load.cancelled_power = 3),
        ("excess", |p| p.phases[0].load.excess[1].0[3] += 1e-9),
        ("foothold", |p| p.phases[0].feet[0].ankle_foothold.yaw_rad += 1e-9),
        ("contact", |p| p.phases[4].feet[RIGHT].contact_since_s += 1e-9),
        ("apex", |p| p.phases[FLIGHT].feet[RIGHT].swing.as_mut().expect("it flies").apex_m += 1e-9),
        ("landing", |p| p.phases[FLIGHT].feet[RIGHT].swing.as_mut().expect("it flies").t_end_s += 1e-9),
    ];
    for (name, change) in changes {
        let mut other = walk();
        change(&mut other);
        assert_ne!(other.content_hash(), hash, "{name}");
    }
    let mut shorter = walk();
    shorter.phases.pop();
    assert_ne!(shorter.content_hash(), hash);
}

#[test]
fn phases_out_of_order_or_without_duration_are_refused() {
    for gap_s in [0.1, -0.1, 1e-9] {
        assert!(matches!(broken(|p| p.phases[1].start_s += gap_s), PatternError::Time { phase: 1, .. }), "{gap_s}");
    }
    for bad in [-1.0, 0.0, 1e-200, 1e200, f64::NAN] {
        assert!(matches!(broken(|p| p.phases[4].duration_s = bad), PatternError::Time { phase: 4, .. }), "{bad}");
    }
}

#[test]
fn coefficients_that_are_no_numbers_or_far_too_large_are_refused() {
    type Field = fn(&mut Phase) -> &mut f64;
    let fields: [(&str, Field); 9] = [
        ("ZMP", |p| &mut p.zmp[0].0[5]),
        ("ZMP of foot 1", |p| &mut p.zmp_1[1].0[4]),
        ("COM", |p| &mut p.com[0].polynomial.0[2]),
        ("COM", |p| &mut p.com[1].growing),
        ("distance between ZMPs", |p| &mut p.load.excess[0].0[1]),
        ("load share", |p| &mut p.load.share.0[0]),
        ("foothold or swing of a foot", |p| &mut p.feet[0].ankle_foothold.y_m),
        ("foothold or swing of a foot", |p| &mut p.feet[1].swing.as_mut().expect("it flies").from_foothold.x_m),
        ("foothold or swing of a foot", |p| &mut p.feet[1].swing.as_mut().expect("it flies").apex_m),
    ];
    for (name, field) in fields {
        for bad in [f64::NAN, f64::INFINITY, 1e300] {
            let error = broken(|p| *field(&mut p.phases[FLIGHT]) = bad);
            assert_eq!(error, PatternError::Coefficient { phase: FLIGHT, of: name }, "{bad}");
        }
    }
    // Finite, but not after two seconds: the size that counts is that of the term.
    let error = broken(|p| (p.phases[4].zmp[0].0[5], p.phases[4].duration_s) = (1e9, 2.0));
    assert_eq!(error, PatternError::Coefficient { phase: 4, of: "ZMP" });
}

#[test]
fn load_shares_that_cannot_be_divided_by_are_refused_wherever_they_vanish() {
    let of = |phase: usize, change: fn(&mut Phase)| broken(|p| change(&mut p.phases[phase])).to_string();
    assert!(of(0, |p| p.load.cancelled_power = 2).contains("another power"));
    assert!(of(FLIGHT, |p| p.load.share = Quintic::constant(0.9)).contains("on the foot that stands"));
    assert!(of(3, |p| p.load.share.0[4] = 1.0).contains("divided by the cube"));
    assert!(of(0, |p| p.load.share = Quintic::constant(-0.1)).contains("vanishes"));
    assert!(of(0, |p| p.load.share = Quintic::constant(1.1)).contains("negative"));
    // A parabola that is negative for a few ten-thousandths of the phase only, between any even samples.
    let dip = |p: &mut Phase| {
        let (c, curvature) = (0.1234 * p.duration_s, 1.0 / p.duration_s.powi(2));
        p.load.share = Quintic([1e-3 - 1e-7 + curvature * c * c, -2.0 * curvature * c, curvature, 0.0, 0.0, 0.0]);
    };
    assert!(of(0, dip).contains("vanishes"));
}

#[test]
fn feet_that_do_not_fit_the_phase_are_refused() {
    let of = |phase: usize, change: fn(&mut Phase)| broken(|p| change(&mut p.phases[phase])).to_string();
    assert!(of(FLIGHT, |p| p.feet[RIGHT].swing = None).contains("has no flight"));
    assert!(of(FLIGHT, |p| p.feet[0].swing = p.feet[RIGHT].swing).contains("flies where it must stand"));
    assert!(of(FLIGHT, |p| p.foot_1 = Side::Left).contains("flight"));
    assert!(of(FLIGHT, |p| p.kind = PhaseKind::DoubleSupport).contains("flies where it must stand"));
    assert!(of(FLIGHT, |p| p.feet[RIGHT].contact_since_s = f64::NAN).contains("no time of contact"));
    assert!(of(3, |p| p.feet[RIGHT].contact_since_s = 1.7).contains("before its contact"));
    assert!(of(3, |p| p.feet[RIGHT].contact_since_s = f64::NAN).contains("before its contact"));
    assert!(of(1, |p| p.feet[0].ankle_foothold.x_m += 1e-9).contains("changes its foothold"));
    assert!(of(3, |p| p.feet[RIGHT].ankle_foothold.yaw_rad += 1e-9).contains("changes its foothold"));
    let away = |p: &mut Phase| p.feet[RIGHT].swing.as_mut().expect("it flies").from_foothold.x_m += 1e-9;
    assert!(of(FLIGHT, away).contains("does not take off where it stood"));
}

#[test]
fn flights_without_duration_or_off_their_single_support_are_refused_with_their_times() {
    let flight = |from_s: f64, to_s: f64| {
        broken(|p| {
            let swing = p.phases[FLIGHT].feet[RIGHT].swing.as_mut().expect("it flies");
            (swing.t_start_s, swing.t_end_s) = (from_s, to_s);
        })
    };
    // The single support lasts from 0.81 s to 1.61 s.
    let backwards = flight(1.61, 0.81);
    assert!(matches!(backwards, PatternError::Flight { phase: FLIGHT, foot: Side::Right, .. }), "{backwards}");
    for (from_s, to_s) in [(0.81, 0.81), (1.0, 1.61), (0.81, 1.5), (f64::NAN, 1.61), (0.81, f64::NAN), (0.81, 1e300)] {
        assert!(matches!(flight(from_s, to_s), PatternError::Flight { phase: FLIGHT, .. }), "{from_s} to {to_s}");
    }
    assert!(flight(0.5, 1.61).to_string().contains("took off before its single support"));
    assert!(flight(0.81, 2.0).to_string().contains("lands when it already stands"));
}

#[test]
fn a_flight_over_two_phases_may_not_change_in_the_air() {
    let mut pattern = walk();
    // Cut in two at half time: the ZMP stays in place, so that its polynomials are the same on both sides.
    let standing = pattern::Foothold { x_m: 0.0, y_m: 0.0815, yaw_rad: 0.0 };
    let zmp = [0.0, standing.y_m].map(Quintic::constant);
    let com = zmp.map(|q| ComSolution { polynomial: q, ..ComSolution::default() });
    let mut first = Phase { start_s: 0.0, duration_s: 0.4, zmp, com, ..pattern.phases[FLIGHT] };
    let swing = first.feet[RIGHT].swing.as_mut().expect("it flies");
    (swing.t_start_s, swing.t_end_s) = (0.0, 0.8);
    let mut second = Phase { start_s: 0.4, ..first };
    pattern.phases = vec![first, second];
    assert_eq!(pattern.check(), Ok(()));
    second.feet[RIGHT].swing.as_mut().expect("it flies").apex_m += 0.01;
    pattern.phases[1] = second;
    let error = pattern.check().expect_err("another flight");
    assert!(error.to_string().contains("changes its flight in the air"), "{error}");
}

#[test]
fn jumps_of_com_and_zmp_are_refused_with_their_size() {
    for (of, change) in [
        ("COM (m)", (|p: &mut Phase| p.com[1].polynomial.0[0] += 1e-3) as fn(&mut Phase)),
        ("velocity of the COM (m/s)", |p| p.com[0].polynomial.0[1] += 1e-3),
        ("ZMP (m)", |p| p.zmp[1].0[0] += 1e-3),
    ] {
        let error = broken(|p| change(&mut p.phases[3]));
        let PatternError::Jump { phase: 3, of: found_of, found, .. } = error else { panic!("{error}") };
        assert!(found_of == of && (found - 1e-3).abs() < 1e-9, "{found_of} {found}");
    }
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
