//! Which pairs of capsules should be watched: found by moving every joint through its range.
//!
//! A pair is left out when it cannot matter: capsules on the same or on neighbouring links, which the joint between them keeps
//! apart; pairs that touch in nearly every posture, or when the robot stands, for their capsules overlap where the bodies are
//! joined; pairs that never come near each other. What remains is proposed. A person may still leave out pairs that the joints'
//! ranges allow and the robot's work does not, and says why (`robot.toml`).

use super::LinkCapsule;
use crate::{Capsule, proximity};
use multibody::{Configuration, JointIndex, Model, ModelError, Workspace, forward_kinematics};

/// How [`propose_pairs`] searches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProposalSettings {
    /// Postures tried, every joint uniformly in its range.
    pub samples: usize,
    /// Seed of the postures: the same gives the same result.
    pub seed: u64,
    /// Pairs that stay further apart than this are never near (m): the damper's interaction distance.
    pub near_m: f64,
    /// Pairs that touch in this part of all postures or more always do.
    pub always: f64,
}

impl Default for ProposalSettings {
    fn default() -> Self {
        Self { samples: 20_000, seed: 1, near_m: 0.1, always: 0.95 }
    }
}

/// What becomes of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// It should be watched.
    Proposed,
    /// On the same link, or with one joint between.
    Adjacent,
    /// Touching in nearly every posture.
    AlwaysTouching,
    /// Touching in the posture in which the robot stands: it could not be kept.
    TouchingStanding,
    /// Never nearer than [`ProposalSettings::near_m`].
    NeverNear,
}

/// A pair, and what was seen of it.
#[derive(Debug, Clone, PartialEq)]
pub struct PairProposal {
    /// Names of the capsules.
    pub pair: [String; 2],
    /// What becomes of it.
    pub verdict: Verdict,
    /// Smallest distance seen (m); negative inside each other.
    pub distance_min_m: f64,
    /// Part of the postures in which they touch.
    pub touching: f64,
}

/// All pairs of capsules of a model, in the order of the list. `standing`: a posture that must be allowed.
///
/// # Errors
/// A capsule's link is not in the model.
pub fn propose_pairs(
    model: &Model,
    capsules: &[LinkCapsule],
    standing: &Configuration,
    settings: &ProposalSettings,
) -> Result<Vec<PairProposal>, ModelError> {
    let frames: Vec<_> = capsules.iter().map(|capsule| model.frame(&capsule.link)).collect::<Result<_, _>>()?;
    let pairs: Vec<[usize; 2]> =
        (0..capsules.len()).flat_map(|i| (i + 1..capsules.len()).map(move |j| [i, j])).collect();
    let mut nearest = vec![f64::INFINITY; pairs.len()];
    let mut touched = vec![0_usize; pairs.len()];
    let mut q = standing.clone();
    let mut ws = Workspace::new(model);
    let mut placed = Vec::with_capacity(capsules.len());
    let mut distances = vec![0.0; pairs.len()];
    let mut measure = |q: &Configuration, distances: &mut [f64]| {
        let robot = forward_kinematics(model, &mut ws, q);
        placed.clear();
        placed.extend(capsules.iter().zip(&frames).map(|(capsule, frame)| {
            let X_WL = robot.pose(*frame);
            Capsule { from: X_WL.point(&capsule.from_m), to: X_WL.point(&capsule.to_m), radius: capsule.radius_m }
        }));
        for (distance, [i, j]) in distances.iter_mut().zip(&pairs) {
            *distance = proximity(&placed[*i], &placed[*j], 0.0).distance;
        }
    };
    let mut when_standing = distances.clone();
    measure(standing, &mut when_standing);
    let mut random = Random(settings.seed);
    for _ in 0..settings.samples {
        for (position, joint) in q.joints.iter_mut().zip(model.joints()) {
            let [lower, upper] = [joint.limits.lower, joint.limits.upper]
                .map(|limit| limit.clamp(-std::f64::consts::PI, std::f64::consts::PI));
            *position = lower + (upper - lower) * random.unit();
        }
        measure(&q, &mut distances);
        for (k, distance) in distances.iter().enumerate() {
            nearest[k] = nearest[k].min(*distance);
            touched[k] += usize::from(*distance <= 0.0);
        }
    }
    let joints_between = |i: usize, j: usize| {
        let moves = |k: usize, joint| model.moves(JointIndex(joint), frames[k]);
        (0..model.joint_count()).filter(|joint| moves(i, *joint) != moves(j, *joint)).count()
    };
    let proposal = |(k, [i, j]): (usize, &[usize; 2])| {
        let touching = touched[k] as f64 / settings.samples.max(1) as f64;
        let verdict = if joints_between(*i, *j) <= 1 {
            Verdict::Adjacent
        } else if touching >= settings.always {
            Verdict::AlwaysTouching
        } else if when_standing[k] <= 0.0 {
            Verdict::TouchingStanding
        } else if nearest[k] > settings.near_m {
            Verdict::NeverNear
        } else {
            Verdict::Proposed
        };
        let pair = [capsules[*i].name.clone(), capsules[*j].name.clone()];
        PairProposal { pair, verdict, distance_min_m: nearest[k], touching }
    };
    Ok(pairs.iter().enumerate().map(proposal).collect())
}

/// Numbers between 0 and 1 (Steele, Lea, Flood, *Fast splittable pseudorandom number generators*, OOPSLA 2014).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
