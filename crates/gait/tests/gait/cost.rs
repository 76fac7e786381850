//! The cost by quadrature on the unknowns against an independent integration of the finished motion.

use crate::support::straight;
use gait::{CostSettings, CostTerms, GaitSettings, Walk, plan};
use pattern::{PhaseKind, WalkPattern};

/// Composite Simpson with `n` intervals per phase on the evaluated references: another rule, other formulas, other data.
fn by_simpson(pattern: &WalkPattern, n: u32) -> CostTerms {
    let mut terms = CostTerms::default();
    for (i, phase) in pattern.phases.iter().enumerate() {
        let h = phase.duration_s / f64::from(n);
        for j in 0..=n {
            let weight = h / 3.0 * if j == 0 || j == n { 1.0 } else { 2.0 + 2.0 * f64::from(j % 2) };
            let r = pattern.evaluate_phase(i, if j == n { phase.duration_s } else { h * f64::from(j) });
            terms.com_force += weight * (pattern.mass_kg * r.com.acceleration).norm_squared();
            let torques = r.feet.iter().map(|foot| {
                let lever = foot.ankle_foothold.position() - foot.zmp.position;
                (foot.force.xy() * pattern.ankle_height_m - lever * foot.force.z).norm_squared()
            });
            if phase.kind == PhaseKind::SingleSupport {
                terms.ankle_torque_single += weight * torques.sum::<f64>();
            } else {
                terms.ankle_torque_double += 0.5 * weight * torques.sum::<f64>();
                let accelerations = r.feet.iter().map(|foot| foot.zmp.acceleration.norm_squared());
                terms.zmp_acceleration += weight * accelerations.sum::<f64>();
            }
        }
    }
    terms
}

/// The errors of both rules are far below: Simpson's falls with the fourth power of 4000 parts. A term left out would be far above.
const RELATIVE: f64 = 1e-8;

fn agrees(name: &str, settings: &GaitSettings) {
    let plan = plan(settings).expect("feasible");
    let dense = by_simpson(&plan.pattern, 4000);
    for (a, b) in plan.report.terms.to_array().into_iter().zip(dense.to_array()) {
        assert!((a - b).abs() <= RELATIVE * b.abs(), "{name}: {a:.15e} and {b:.15e}, relative {:e}", (a - b) / b);
    }
    let total = dense.weighted(&settings.cost).sum();
    assert!((plan.report.objective - total).abs() <= RELATIVE * total, "{name}");
}

#[test]
fn every_term_equals_an_independent_dense_quadrature() {
    agrees("default", &straight(11));
    agrees("lambda 0.3, mu 0", &GaitSettings { cost: CostSettings { lambda: 0.3, mu: 0.0 }, ..straight(3) });
    let circle = Walk::Circle { swings: 5, step_length_m: 0.1, radius_m: 0.8 };
    agrees("turning", &GaitSettings { walk: circle, ..GaitSettings::default() });
    let mut slow = straight(3);
    slow.timing.single_support_s = 3.0;
    slow.timing.double_support_s = 2.0;
    agrees("slow", &slow);
    let mut low = straight(3);
    low.body.com_height_m = 0.3;
    agrees("low", &low);
}
