//! What every test asks of a plan.

use gait::{GaitSettings, Plan, Quantity, Walk, check, plan};

/// COM equation (m/s^2): a ten-billionth of gravity. Rounding leaves less; a wrong coefficient would leave far more.
pub const COM_EQUATION: f64 = 1e-9;
/// KKT residuals in scaled unknowns: what the planner accepts of a solver asked for more digits than it reaches.
pub const KKT: f64 = 1e-8;

/// How far a ZMP may leave its polygon between 11 samples (m): the planner's limit. The largest found here is 0.4 mm, with mu > 0.
pub const BETWEEN_SAMPLES_M: f64 = 1e-3;

pub fn straight(swings: u32) -> GaitSettings {
    GaitSettings { walk: Walk::Straight { swings, step_length_m: 0.05 }, ..GaitSettings::default() }
}

/// Plans and checks everything that must hold of any walk, whatever the request. `between_samples_m`: how far a ZMP may leave
/// its polygon between two samples.
pub fn planned(name: &str, settings: &GaitSettings, between_samples_m: f64) -> Plan {
    let plan = plan(settings).unwrap_or_else(|error| panic!("{name}: {error}"));
    plan.pattern.check().unwrap_or_else(|error| panic!("{name}: {error}"));
    for program in &plan.report.programs {
        assert!(program.residuals.max() <= KKT, "{name}: {:?}", program.residuals);
    }
    let report = check(&plan, settings, 1e-3, None);
    let largest = report.largest_violation().expect("polygons are always checked");
    assert!(largest.value <= between_samples_m, "{name}: {largest:?}");
    for (quantity, limit) in [
        (Quantity::ComEquation, COM_EQUATION),
        (Quantity::LoadBalance, 1e-11),
        (Quantity::ZmpJump, 1e-12),
        (Quantity::ZmpVelocityJump, 1e-10),
        (Quantity::ZmpAccelerationJump, 1e-8),
        (Quantity::FootZmpJump, 1e-12),
        (Quantity::FootZmpVelocityJump, 1e-10),
        (Quantity::FootZmpAccelerationJump, 1e-8),
        (Quantity::ComJump, 1e-12),
        (Quantity::ComVelocityJump, 1e-10),
        (Quantity::SpeedAtEnds, 1e-10),
    ] {
        let value = report.value(quantity);
        assert!(
            value <= limit,
            "{name}: {quantity:?} = {value:e}, {:?}",
            report.worst.iter().find(|w| w.quantity == quantity)
        );
    }
    plan
}
