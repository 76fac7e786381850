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
                velocity: constraints.velocity_factor * limits.velocity,
                torque: constraints.torque_factor * limits.effort,
                motor_torque: limits.effort,
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
    let pair = |[a, b]: &[String; 2]| {
        if a == b {
            return Err(WholeBodyError::PairOfOne { name: a.clone() });
        }
        Ok([position(a)?, position(b)?])
    };
    let pairs = if settings.collision.on { settings.collision.pairs.as_slice() } else { &[] };
    pairs.iter().map(pair).collect()
}
