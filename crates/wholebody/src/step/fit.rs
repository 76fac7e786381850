//! Do settings and model fit together?

use crate::constraint::limits::JointLimits;
use crate::error::WholeBodyError;
use crate::settings::WholeBodySettings;
use multibody::Model;

pub(super) fn joint_limits(model: &Model, settings: &WholeBodySettings) -> Vec<JointLimits> {
    let constraints = &settings.constraints;
    model
        .joints()
        .iter()
        .map(|joint| {
            let limits = joint.limits;
            let margin = constraints.position_margin_rad.min(0.25 * (limits.upper - limits.lower));
            JointLimits {
                lower: limits.lower + margin,
                upper: limits.upper - margin,
                velocity: constraints.velocity_fraction * limits.velocity,
                torque: constraints.torque_fraction * limits.effort,
                braking: constraints.braking_rad_per_s2,
                acceleration: constraints.acceleration_max_rad_per_s2,
            }
        })
        .collect()
}

pub(super) fn resolve_pairs(settings: &WholeBodySettings) -> Result<Vec<[usize; 2]>, WholeBodyError> {
    let position = |name: &String| {
        settings
            .collision
            .capsules
            .iter()
            .position(|capsule| capsule.name == *name)
            .ok_or_else(|| WholeBodyError::UnknownCapsule { name: name.clone() })
    };
    settings.collision.pairs.iter().map(|[a, b]| Ok([position(a)?, position(b)?])).collect()
}

/// Settings that the equations cannot take.
pub(super) fn check(settings: &WholeBodySettings) -> Result<(), WholeBodyError> {
    let positive = |setting: &'static str, found: f64| {
        if found > 0.0 && found.is_finite() {
            Ok(())
        } else {
            Err(WholeBodyError::Setting { setting, found, expected: "positive and finite" })
        }
    };
    let (tasks, constraints, collision) = (&settings.tasks, &settings.constraints, &settings.collision);
    for (setting, gains) in [
        ("tasks.com", tasks.com),
        ("tasks.torso", tasks.torso),
        ("tasks.posture", tasks.posture),
        ("tasks.leg_posture", tasks.leg_posture),
        ("tasks.swing_position", tasks.swing_position),
        ("tasks.swing_orientation", tasks.swing_orientation),
    ] {
        positive(setting, gains.weight)?;
        positive(setting, gains.stiffness)?;
    }
    positive("tasks.com_height_factor", tasks.com_height_factor)?;
    positive("tasks.wrench_lever_m", tasks.wrench_lever_m)?;
    positive("tasks.intensity_damping", tasks.intensity_damping)?;
    positive("sole.length_m", settings.sole.length_m)?;
    positive("sole.width_m", settings.sole.width_m)?;
    positive("constraints.friction", constraints.friction)?;
    positive("constraints.torque_fraction", constraints.torque_fraction)?;
    positive("constraints.velocity_fraction", constraints.velocity_fraction)?;
    positive("constraints.braking_rad_per_s2", constraints.braking_rad_per_s2)?;
    positive("constraints.acceleration_max_rad_per_s2", constraints.acceleration_max_rad_per_s2)?;
    positive("collision.damping_m_per_s", collision.damping_m_per_s)?;
    positive("collision.interaction_m - collision.safety_m", collision.interaction_m - collision.safety_m)?;
    if constraints.generators_per_point < 3 {
        return Err(WholeBodyError::Setting {
            setting: "constraints.generators_per_point",
            found: constraints.generators_per_point as f64,
            expected: "at least 3",
        });
    }
    Ok(())
}
