//! Cost (4), term by term, as quadratic forms over the slots of a phase.

use crate::basis::{ANKLE_1, ANKLE_2, Basis, Row, SLOTS, Transfer};
use crate::{BodySettings, CostSettings};
use nalgebra::SMatrix;

/// `u' H u` over the slots.
pub type Form = SMatrix<f64, SLOTS, SLOTS>;

/// The integrals of (4) without their weights.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CostTerms {
    /// `INT |M P''_COM|^2` over the walk (N^2 s).
    pub com_force: f64,
    /// `INT |Ga|^2` over single supports (N^2 m^2 s).
    pub ankle_torque_single: f64,
    /// `1/2 INT (|Ga_1|^2 + |Ga_2|^2)` over double supports (N^2 m^2 s).
    pub ankle_torque_double: f64,
    /// `INT (|P''_ZMP1|^2 + |P''_ZMP2|^2)` over double supports (m^2 s^-3).
    pub zmp_acceleration: f64,
}

impl CostTerms {
    /// The four numbers.
    #[must_use]
    pub fn to_array(self) -> [f64; 4] {
        [self.com_force, self.ankle_torque_single, self.ankle_torque_double, self.zmp_acceleration]
    }

    /// Each term times its weight.
    #[must_use]
    pub fn weighted(self, weights: &CostSettings) -> Self {
        let CostSettings { lambda, mu } = *weights;
        Self {
            com_force: lambda * self.com_force,
            ankle_torque_single: (1.0 - lambda) * self.ankle_torque_single,
            ankle_torque_double: (1.0 - lambda) * self.ankle_torque_double,
            zmp_acceleration: mu * self.zmp_acceleration,
        }
    }

    /// The sum: of weighted terms, J.
    #[must_use]
    pub fn sum(self) -> f64 {
        self.to_array().iter().sum()
    }
}

/// The terms of one phase and axis.
#[derive(Clone)]
pub struct Forms {
    /// `INT F^2`.
    pub com_force: Form,
    /// `INT Ga^2`, or half the sum of both feet's.
    pub ankle_torque: Form,
    /// `INT (x_1''^2 + x_2''^2)`.
    pub zmp_acceleration: Form,
}

impl Forms {
    /// Composite Gauss-Legendre with `rule` on each of [`panels`].
    pub fn new(basis: &Basis, body: &BodySettings, rule: &[(f64, f64)]) -> Self {
        let mut forms = Self { com_force: Form::zeros(), ankle_torque: Form::zeros(), zmp_acceleration: Form::zeros() };
        let weight_n = body.mass_kg() * body.gravity_m_per_s2;
        let panels = panels(basis);
        let width = basis.duration_s / panels as f64;
        for panel in 0..panels {
            for (node, gauss) in rule {
                let (t, w) = (width * (panel as f64 + node), width * gauss);
                let force = basis.com(t)[2] * body.mass_kg();
                add_square(&mut forms.com_force, &force, w);
                // Ga = F z_a - M g (p_a - p_Z), times the foot's share; the share multiplies the ZMP before the division.
                if basis.transfer == Transfer::Single {
                    let lever = unit(ANKLE_2) - basis.zmp(t)[0];
                    add_square(&mut forms.ankle_torque, &(force * body.ankle_height_m() - lever * weight_n), w);
                    continue;
                }
                let k = basis.share(t)[0];
                let (zmp, zmp_1) = (basis.zmp(t)[0], basis.zmp_1(t));
                let lever_1 = (unit(ANKLE_1) - zmp_1[0]) * (1.0 - k);
                let lever_2 = unit(ANKLE_2) * k - (zmp_1[0] * k - (zmp_1[0] - zmp));
                for (share, lever) in [(1.0 - k, lever_1), (k, lever_2)] {
                    let torque = force * (share * body.ankle_height_m()) - lever * weight_n;
                    add_square(&mut forms.ankle_torque, &torque, 0.5 * w);
                }
                add_square(&mut forms.zmp_acceleration, &zmp_1[2], w);
                add_square(&mut forms.zmp_acceleration, &basis.zmp_2(t)[2], w);
            }
        }
        forms
    }
}

/// Panels per phase. Exponentials of `w T` up to 3 per panel, and the poles of `1/κ` (0.4 phases away from a double support,
/// and cubed in the acceleration of ZMP2), leave a relative error below 1e-9 with 12 nodes (`tests/gait/cost.rs`).
fn panels(basis: &Basis) -> usize {
    let by_decay = (basis.omega * basis.duration_s / 3.0).ceil() as usize;
    by_decay.max(if basis.transfer == Transfer::Single { 1 } else { 4 })
}

fn unit(slot: usize) -> Row {
    let mut row = Row::zeros();
    row[slot] = 1.0;
    row
}

fn add_square(form: &mut Form, row: &Row, weight: f64) {
    form.ger(weight, row, row, 1.0);
}
