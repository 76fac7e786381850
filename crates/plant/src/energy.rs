//! Where energy is and where it went.
//!
//! Kinetic and potential energy are states. The flows are sums over steps of force times displacement `dt v1`, all counted as
//! work *on* the robot. What is left,
//!
//! ```text
//! numerical = (kinetic + potential) - (their values at the start) - servo - friction - contact - pushes
//! ```
//!
//! is energy that only the integrator made (positive) or took (negative). For implicit Euler it is `-1/2 dv^T M dv` per step to
//! leading order: first order in dt over a given time.
//!
//! The contact's work on the robot, negative in sum, is what the soles store elastically and what viscosity and slip turn to heat.

/// Work on the robot since the clock was started (J).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnergyFlows {
    /// Motors.
    pub servo_j: f64,
    /// Friction in the joints, never positive.
    pub joint_friction_j: f64,
    /// Ground on soles: what is stored in them and lost in them, negated.
    pub contact_j: f64,
    /// Part of it that slip turned to heat, never positive.
    pub slip_j: f64,
    /// Pushes.
    pub push_j: f64,
}

/// Energies at a tick (J).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energies {
    /// Kinetic, rotors included.
    pub kinetic_j: f64,
    /// Potential, zero at the world's origin.
    pub potential_j: f64,
    /// Kinetic and potential energy when the robot was placed.
    pub initial_j: f64,
    /// Work since then.
    pub flows: EnergyFlows,
}

impl Energies {
    /// Energy made (positive) or taken (negative) by the integrator since the robot was placed (J).
    #[must_use]
    pub fn numerical_j(&self) -> f64 {
        let EnergyFlows { servo_j, joint_friction_j, contact_j, push_j, .. } = self.flows;
        self.kinetic_j + self.potential_j - self.initial_j - servo_j - joint_friction_j - contact_j - push_j
    }
}
