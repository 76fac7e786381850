//! How often joints were at their limits.

use messages::MAX_JOINTS;
use serde::{Deserialize, Serialize};

/// A joint and for how many ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct JointTicks {
    /// Which, in the order of the robot's description.
    pub joint: u32,
    /// Ticks.
    pub ticks: u64,
}

/// Ticks of each joint whose bit was set.
#[derive(Debug, Clone)]
pub(crate) struct BitTicks([u64; MAX_JOINTS]);

impl Default for BitTicks {
    fn default() -> Self {
        Self([0; MAX_JOINTS])
    }
}

impl BitTicks {
    pub(crate) fn add(&mut self, bits: u64) {
        for (joint, ticks) in self.0.iter_mut().enumerate() {
            *ticks += bits >> joint & 1;
        }
    }

    /// Those with any, the most often set first.
    pub(crate) fn worst_first(&self) -> Vec<JointTicks> {
        let mut joints: Vec<JointTicks> = (0..)
            .zip(self.0)
            .filter(|(_, ticks)| *ticks > 0)
            .map(|(joint, ticks)| JointTicks { joint, ticks })
            .collect();
        joints.sort_by_key(|joint| std::cmp::Reverse(joint.ticks));
        joints
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_joint_that_is_most_often_at_its_limit_comes_first() {
        let mut ticks = BitTicks::default();
        [0b101, 0b100, 1 << 39].into_iter().for_each(|bits| ticks.add(bits));
        let found: Vec<(u32, u64)> = ticks.worst_first().iter().map(|joint| (joint.joint, joint.ticks)).collect();
        assert_eq!(found, [(2, 2), (0, 1), (39, 1)]);
    }
}
