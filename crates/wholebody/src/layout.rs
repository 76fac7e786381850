//! Which unknown and which row stands where in the program of a step.
//!
//! Unknowns: `x = (vd, f of the left foot, f of the right foot)`, feet in the air left out. One layout per set of contacts.

use crate::settings::Limit;
use qp::Row;
use qp::dense::Size;

/// What a row or bound of the program means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConstraintId {
    /// Dynamics of the floating base, axis 0..6 in the base frame (force first): physics, never relaxed.
    BaseDynamics(usize),
    /// Acceleration of a stance ankle, axis 0..6 in the world (linear first).
    Contact {
        /// Left 0, right 1.
        foot: usize,
        /// 0..6.
        axis: usize,
    },
    /// Torque of a joint, by its index.
    Torque(usize),
    /// Position and speed of a joint, as bounds on its acceleration, by its index.
    JointMotion(usize),
    /// Load that a foot may carry.
    Load {
        /// Left 0, right 1.
        foot: usize,
    },
    /// Distance of a collision pair, by its index in the settings.
    Collision(usize),
    /// Intensity along a generator of a friction cone: nonnegative, physics, never relaxed.
    Intensity {
        /// Left 0, right 1.
        foot: usize,
        /// Point times generators per point plus generator.
        index: usize,
    },
}

impl ConstraintId {
    /// The kind of limit it is; `None` for physics, which never gives way.
    #[must_use]
    pub fn limit(self) -> Option<Limit> {
        match self {
            Self::Load { .. } => Some(Limit::Load),
            Self::Collision(_) => Some(Limit::Collision),
            Self::JointMotion(_) => Some(Limit::JointMotion),
            Self::Torque(_) => Some(Limit::Torque),
            Self::Contact { .. } => Some(Limit::Contact),
            Self::BaseDynamics(_) | Self::Intensity { .. } => None,
        }
    }
}

/// Positions for one set of contacts.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    pub nv: usize,
    pub joints: usize,
    pub pairs: usize,
    /// Feet that stand.
    pub contacts: [bool; 2],
    /// Intensities per foot.
    pub intensities: usize,
}

impl Layout {
    /// Feet that stand, in order.
    pub fn standing(&self) -> impl Iterator<Item = usize> + use<> {
        let contacts = self.contacts;
        (0..2).filter(move |i| contacts[*i])
    }

    fn rank(&self, foot: usize) -> usize {
        usize::from(foot == 1 && self.contacts[0])
    }

    fn feet(&self) -> usize {
        self.standing().count()
    }

    pub fn size(&self) -> Size {
        Size {
            variables: self.nv + self.feet() * self.intensities,
            equalities: 6 + 6 * self.feet(),
            inequalities: self.joints + self.feet() + self.pairs,
        }
    }

    /// First unknown of a foot's intensities.
    pub fn force(&self, foot: usize) -> usize {
        self.nv + self.rank(foot) * self.intensities
    }

    /// First equality of a foot's contact.
    pub fn contact(&self, foot: usize) -> usize {
        6 + 6 * self.rank(foot)
    }

    /// Inequality of a foot's load.
    pub fn load(&self, foot: usize) -> usize {
        self.joints + self.rank(foot)
    }

    /// Inequality of a collision pair.
    pub fn collision(&self, pair: usize) -> usize {
        self.joints + self.feet() + pair
    }

    /// Meaning of a row. Bounds on the base's acceleration do not exist.
    pub fn meaning(&self, row: Row) -> Option<ConstraintId> {
        let standing = |rank: usize| self.standing().nth(rank);
        match row {
            Row::Equality(i) if i < 6 => Some(ConstraintId::BaseDynamics(i)),
            Row::Equality(i) => standing(i / 6 - 1).map(|foot| ConstraintId::Contact { foot, axis: i % 6 }),
            Row::Inequality(i) if i < self.joints => Some(ConstraintId::Torque(i)),
            Row::Inequality(i) if i < self.joints + self.feet() => {
                standing(i - self.joints).map(|foot| ConstraintId::Load { foot })
            }
            Row::Inequality(i) => Some(ConstraintId::Collision(i - self.joints - self.feet())),
            Row::Bound(i) if i >= self.nv => {
                let k = i - self.nv;
                let index = k % self.intensities;
                standing(k / self.intensities).map(|foot| ConstraintId::Intensity { foot, index })
            }
            Row::Bound(i) => i.checked_sub(self.nv - self.joints).map(ConstraintId::JointMotion),
        }
    }

    /// The row with a meaning, if it exists for these contacts.
    pub fn row(&self, id: ConstraintId) -> Option<Row> {
        match id {
            ConstraintId::BaseDynamics(axis) => Some(Row::Equality(axis)),
            ConstraintId::Contact { foot, axis } => {
                self.contacts[foot].then(|| Row::Equality(self.contact(foot) + axis))
            }
            ConstraintId::Torque(joint) => Some(Row::Inequality(joint)),
            ConstraintId::JointMotion(joint) => Some(Row::Bound(self.nv - self.joints + joint)),
            ConstraintId::Load { foot } => self.contacts[foot].then(|| Row::Inequality(self.load(foot))),
            ConstraintId::Collision(pair) => Some(Row::Inequality(self.collision(pair))),
            ConstraintId::Intensity { foot, index } => {
                self.contacts[foot].then(|| Row::Bound(self.force(foot) + index))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_has_one_meaning_and_every_meaning_one_row() {
        for contacts in [[false, false], [true, false], [false, true], [true, true]] {
            let layout = Layout { nv: 20, joints: 14, pairs: 3, contacts, intensities: 16 };
            let Size { variables, equalities, inequalities } = layout.size();
            let rows = (0..equalities)
                .map(Row::Equality)
                .chain((0..inequalities).map(Row::Inequality))
                .chain((6..variables).map(Row::Bound));
            for row in rows {
                let id = layout.meaning(row).unwrap_or_else(|| panic!("{row:?} has no meaning"));
                assert_eq!(layout.row(id), Some(row), "{id:?}");
            }
            assert_eq!(layout.meaning(Row::Bound(2)), None);
        }
    }
}
