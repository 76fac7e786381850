//! The 200 Hz processes evaluate pattern and swing at every tick: neither may allocate.

use pattern::{
    AnkleState, ComSolution, FootPhase, Foothold, Load, PATTERN_VERSION, Phase, PhaseKind, Quintic, Side,
    SwingTrajectory, WalkPattern,
};
use spatial::{Transform, Vec3};
use std::hint::black_box;

fn allocations(work: impl FnOnce()) -> u64 {
    allocation_counter::measure(work).count_total
}

fn standing() -> WalkPattern {
    let foothold =
        |y_m| FootPhase { ankle_foothold: Foothold { x_m: 0.0, y_m, yaw_rad: 0.0 }, contact_since_s: 0.0, swing: None };
    let com = ComSolution { polynomial: Quintic::constant(0.1), ..ComSolution::default() };
    let phase = |start_s| Phase {
        start_s,
        duration_s: 0.5,
        kind: PhaseKind::DoubleSupport,
        step: 1,
        foot_1: Side::Left,
        zmp: [Quintic::constant(0.1); 2],
        com: [com; 2],
        load: Load { cancelled_power: 0, share: Quintic::constant(0.5), excess: [Quintic::default(); 2] },
        zmp_1: [Quintic::constant(0.1); 2],
        zmp_shift: pattern::ZmpShift::default(),
        feet: [foothold(0.1), foothold(-0.1)],
    };
    WalkPattern {
        version: PATTERN_VERSION,
        mass_kg: 39.0,
        gravity_m_per_s2: 9.81,
        com_height_m: 0.78,
        ankle_height_m: 0.1,
        ankle_in_sole_m: [[0.0; 2]; 2],
        phases: (0..64).map(|i| phase(0.5 * f64::from(i))).collect(),
    }
}

#[test]
fn evaluating_allocates_nothing_and_the_counter_counts() {
    let mut pattern = None;
    assert!(allocations(|| pattern = Some(black_box(standing()))) > 0, "the counter sees the phases being collected");
    let pattern = pattern.expect("made above");
    pattern.check().expect("well formed");
    let from = AnkleState::at_rest(Transform::identity());
    let to = Transform::from_translation(Vec3::new(0.1, 0.0, 0.0));

    let count = allocations(|| {
        for i in 0..10_000 {
            black_box(pattern.evaluate(black_box(f64::from(i) * 0.005 - 1.0)));
        }
        let swing = SwingTrajectory::new(black_box(&from), &to, 0.0, 0.8, 0.04);
        for i in 0..1000 {
            black_box(swing.evaluate(f64::from(i) * 1e-3));
        }
    });
    assert_eq!(count, 0);
}
