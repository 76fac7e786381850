//! Figure 7a in numbers: what lambda trades.

use crate::support::straight;
use gait::{CostSettings, Plan, plan};
use pattern::PhaseKind;

struct Trend {
    lambda: f64,
    /// Lateral amplitude of the COM over the regular part of the walk (m).
    swing_m: f64,
    /// Mean of the ankle torque's magnitude (N m).
    torque_nm: f64,
    /// Mean COM acceleration (m/s^2).
    acceleration: f64,
    /// How far inside the ankle the ZMP lies in single support, on average (m).
    inside_m: f64,
}

fn trend(lambda: f64) -> Trend {
    let settings = gait::GaitSettings { cost: CostSettings { lambda, mu: 15.0 }, ..straight(11) };
    let Plan { pattern, .. } = plan(&settings).expect("feasible");
    let (mut swing_m, mut torque_nm, mut acceleration, mut inside_m) = (0.0_f64, 0.0, 0.0, 0.0);
    let (mut count, mut single) = (0.0, 0.0);
    let mut t = 0.0;
    while t < pattern.duration_s() {
        let r = pattern.evaluate(t);
        swing_m = swing_m.max(r.com.position.y.abs());
        for (foot, sign) in r.feet.iter().zip([1.0, -1.0]) {
            let lever = foot.ankle_foothold.position() - foot.zmp.position;
            let torque = foot.force.xy() * pattern.ankle_height_m - lever * foot.force.z;
            torque_nm += torque.norm();
            if r.kind == PhaseKind::SingleSupport && foot.in_contact {
                inside_m += sign * lever.y;
                single += 1.0;
            }
        }
        acceleration += r.com.acceleration.norm();
        count += 1.0;
        t += 0.002;
    }
    let (torque_nm, acceleration, inside_m) = (torque_nm / count, acceleration / count, inside_m / single);
    Trend { lambda, swing_m, torque_nm, acceleration, inside_m }
}

#[test]
fn with_lambda_the_com_swings_less_and_the_ankles_work_more() {
    let trends = [0.0, 0.2, 0.4, 0.5, 0.6, 0.8, 1.0].map(trend);
    for pair in trends.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        assert!(b.swing_m < a.swing_m, "lateral swing from lambda {} to {}", a.lambda, b.lambda);
        assert!(b.torque_nm > a.torque_nm, "ankle torque from lambda {} to {}", a.lambda, b.lambda);
        assert!(b.acceleration < a.acceleration, "acceleration from lambda {} to {}", a.lambda, b.lambda);
        assert!(b.inside_m > a.inside_m, "ZMP moves inwards from lambda {} to {}", a.lambda, b.lambda);
    }
    let (first, last) = (&trends[0], &trends[6]);
    // Not exactly under them: the torque that vanishes is that of weight and horizontal force together.
    assert!(first.inside_m.abs() < 5e-3, "lambda = 0: the ZMP stays near the ankles ({} m)", first.inside_m);
    // The polygon's inner edge is 0.034 m inside the ankle.
    assert!(last.inside_m > 0.030, "lambda = 1: the ZMP goes to the inner edge ({} m)", last.inside_m);
    assert!(last.swing_m < 0.7 * first.swing_m);
}
