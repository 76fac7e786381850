//! What the check on the fine grid found, in words: said with every plan that is published, not only with those that are refused.

use crate::PlannerOutput;
use crate::words::{amount, place, word};
use gait::Quantity;

impl PlannerOutput {
    /// Largest violation of a constraint, friction demand and ZMP margin, the tightest leg: one line each, every number with its
    /// phase, step and time.
    #[must_use]
    pub fn findings(&self) -> Vec<String> {
        let worst = |quantity: Quantity| self.check.worst.iter().find(|worst| worst.quantity == quantity);
        let mut lines = Vec::new();
        if let Some(w) = self.check.largest_violation() {
            let how =
                if w.value > 0.0 { "largest violation of a constraint" } else { "every constraint is kept, nearest" };
            lines.push(format!("{how}: {} {}", amount(w), place(w)));
        }
        if let (Some(friction), Some(margin)) = (worst(Quantity::FrictionDemand), worst(Quantity::NegativeZmpMargin)) {
            lines.push(format!(
                "friction demand: {:.3} of {:.3} {}; smallest ZMP margin to the sole's edge: {:.2} mm, {} foot, {}",
                friction.value,
                self.friction_available,
                place(friction),
                -1e3 * margin.value,
                margin.foot.map_or("loaded", word),
                place(margin)
            ));
        }
        if let Some(reach) = &self.check.reach {
            let ((extension_m, extension_s, leg), (room_rad, room_s, joint_leg, joint)) =
                (reach.extension, reach.joint);
            lines.push(format!(
                "tightest leg: the {} one could be {:.1} mm longer at {extension_s:.3} s; joint {} of the {} leg has {:.1} degrees \
                 to its limit at {room_s:.3} s",
                word(leg),
                1e3 * extension_m,
                self.leg_joints[joint_leg.index()][joint],
                word(joint_leg),
                room_rad.to_degrees()
            ));
        }
        let rms_mm = [0, 1].map(|axis| {
            let shift_m = self.rehearsal.zmp_shift_m(axis);
            1e3 * (shift_m.iter().map(|shift| shift * shift).sum::<f64>() / shift_m.len() as f64).sqrt()
        });
        let [travel, speed, torque] = &self.rooms;
        lines.push(format!(
            "rehearsed: the body's own ZMP is {:.1} mm forward and {:.1} mm sideways (rms) from the planned one; least room: {travel}, {speed}, \
             {torque}",
            rms_mm[0], rms_mm[1]
        ));
        lines.extend(self.speeds.clone());
        lines
    }
}
