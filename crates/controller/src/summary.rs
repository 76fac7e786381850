//! What health is told of the steps: counts and figures.

use messages::code::{Limit, Reason};
use state::Refused;
use wholebody::{AnsweredBy, ConstraintId, Relaxation, RelaxationSettings, StepReport, StepStatus, WholeBody};

/// A limit that gave way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidenedLimit {
    /// Which kind.
    pub limit: Limit,
    /// Which of its kind: foot, joint of the model, collision pair.
    pub index: usize,
    /// By how much, in its unit.
    pub amount: f64,
    /// Position of its kind in the configured order of giving way.
    pub rank: usize,
}

impl WidenedLimit {
    fn new(relaxed: &Relaxation, order: &RelaxationSettings) -> Self {
        let (limit, index) = match relaxed.id {
            ConstraintId::Load { foot } => (Limit::Load, foot),
            ConstraintId::Collision(pair) => (Limit::Collision, pair),
            ConstraintId::JointMotion(joint) => (Limit::JointMotion, joint),
            ConstraintId::Torque(joint) => (Limit::Torque, joint),
            ConstraintId::Contact { foot, .. } => (Limit::Contact, foot),
            // Physics never gives way.
            ConstraintId::BaseDynamics(_) | ConstraintId::Intensity { .. } => (Limit::None, 0),
        };
        let rank = relaxed.id.limit().and_then(|limit| order.rank(limit)).unwrap_or(0);
        Self { limit, index, amount: relaxed.amount, rank }
    }

    /// A limit that gives way later is worse, and of one kind the larger amount.
    fn is_worse_than(&self, other: &Self) -> bool {
        (self.rank, self.amount) > (other.rank, other.amount)
    }

    /// In words.
    #[must_use]
    pub fn describe(&self, body: &WholeBody) -> String {
        let Self { limit, index, amount, .. } = *self;
        let which = match limit {
            Limit::JointMotion | Limit::Torque => body.model().joints()[index].name.clone(),
            Limit::Collision => body.settings().collision.pairs[index].join(" and "),
            _ => ["left", "right"][index.min(1)].to_string(),
        };
        format!("{limit} {which} by {amount:.3e} (SI units)")
    }
}

/// Counts and figures for health.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Summary {
    /// Steps in which all limits held, so far.
    pub solved: u64,
    /// The worst limit that gave way, so far.
    pub worst: Option<WidenedLimit>,
    /// Why the posture is held now, if it is.
    pub holding: Option<Reason>,
    /// Whether the robot stands because it was told to.
    pub stopped: bool,
    /// Steps whose limits had to be widened, so far.
    pub relaxed: u64,
    /// Steps without a usable solution, so far.
    pub held: u64,
    /// Steps that the backup solver answered, for the first had no answer; so far.
    pub by_backup: u64,
    /// Ticks whose deformation was missing or older than allowed, so far.
    pub deformation_missing: u64,
    /// Ticks whose robot state had a number that is not finite, so far.
    pub state_refused: u64,
    /// Largest distance between a measured joint and its reference now (rad).
    pub joint_distance_rad: f64,
    /// Distance of the model's centre of mass from its reference now (m).
    pub com_error_m: f64,
    /// Distance of the observed base from the internal one at the last measurement used (m); feedback only.
    pub base_distance_m: f64,
    /// The same of its orientation (rad).
    pub base_distance_rad: f64,
    /// Distance between where the two standing feet place the base now (m); feedback only.
    pub feet_disagreement_m: f64,
    /// Measurements that were not used for feedback, so far.
    pub measurements_refused: u64,
    /// Why the last one of them was not.
    pub last_refused: Option<Refused>,
    /// Smallest distance of a collision pair now (m).
    pub collision_distance_m: f64,
    /// Joints of the model that a limit of speed or position has held back at any step so far: bit *i* is joint *i*.
    pub joints_limited_bits: u64,
    /// The same for their torque.
    pub torques_limited_bits: u64,
}

/// The bit of a joint of the model; none for one beyond the 64 that a word has.
fn bit(joint: usize) -> u64 {
    1_u64.checked_shl(joint as u32).unwrap_or(0)
}

/// Names of the joints whose bits are new.
#[must_use]
pub fn new_joints(before: u64, now: u64, body: &WholeBody) -> Vec<&str> {
    let joints = body.model().joints().iter().enumerate();
    joints.filter(|(joint, _)| now & !before & bit(*joint) != 0).map(|(_, joint)| joint.name.as_str()).collect()
}

impl Summary {
    /// Counts a step of the whole body.
    pub(crate) fn count_step(&mut self, report: &StepReport, order: &RelaxationSettings) {
        self.held += u64::from(report.status == StepStatus::Held);
        self.solved += u64::from(report.status == StepStatus::Solved);
        self.relaxed += u64::from(report.status == StepStatus::Relaxed);
        self.by_backup += u64::from(report.answered_by == AnsweredBy::Backup);
        let relaxed = if report.status == StepStatus::Relaxed { report.relaxed.as_slice() } else { &[] };
        for widened in relaxed.iter().map(|relaxed| WidenedLimit::new(relaxed, order)) {
            if self.worst.is_none_or(|worst| widened.is_worse_than(&worst)) {
                self.worst = Some(widened);
            }
        }
        for active in &report.active {
            match active.id {
                ConstraintId::JointMotion(joint) => self.joints_limited_bits |= bit(joint),
                ConstraintId::Torque(joint) => self.torques_limited_bits |= bit(joint),
                _ => {}
            }
        }
        self.com_error_m = report.body_error.fixed_rows::<3>(0).norm();
        self.collision_distance_m = report.distance_min_m;
    }

    /// Counts a measurement that was offered for feedback.
    pub(crate) fn count_measurement(&mut self, refused: Option<Refused>) {
        self.measurements_refused += u64::from(refused.is_some());
        self.last_refused = refused.or(self.last_refused);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wholebody::Limit as Kind;

    #[test]
    fn the_limit_that_should_have_given_way_last_is_the_worst() {
        let relaxed = |id, amount| Relaxation { id, amount, times: 1 };
        let (torque, contact) = (ConstraintId::Torque(3), ConstraintId::Contact { foot: 1, axis: 2 });
        for order in [[Kind::Torque, Kind::Contact], [Kind::Contact, Kind::Torque]] {
            let settings = RelaxationSettings { order: order.to_vec(), ..RelaxationSettings::default() };
            let widened = |id, amount| WidenedLimit::new(&relaxed(id, amount), &settings);
            let is_torque_worse = order[1] == Kind::Torque;
            for (torque_nm, contact_m_per_s2) in [(1.0, 100.0), (100.0, 1.0)] {
                let [torque, contact] = [widened(torque, torque_nm), widened(contact, contact_m_per_s2)];
                assert_eq!(torque.is_worse_than(&contact), is_torque_worse, "{order:?}");
                assert_eq!(contact.is_worse_than(&torque), !is_torque_worse, "{order:?}");
            }
            // Of one kind the larger amount.
            assert!(widened(torque, 2.0).is_worse_than(&widened(torque, 1.0)));
            assert!(!widened(torque, 1.0).is_worse_than(&widened(torque, 1.0)));
        }
    }
}
