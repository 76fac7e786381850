//! Self-collision: capsules on links, pairs that keep their distance.
//!
//! Each pair is one row: its distance d shall not fall faster than a velocity damper allows,
//!
//! ```text
//! d' + dt d'' >= - xi (d - d_s) / (d_i - d_s),     d' = n (v1 - v2),   d'' = n (a1 - a2)
//! ```
//!
//! so that d approaches the safety distance d_s exponentially and never passes it (Faverjon and Tournassoud 1987). The row
//! is there from three times the interaction distance d_i on, where it never binds at walking speeds: nothing switches on
//! when it starts to matter. The centripetal part of d'' is left out, which errs to the safe side.

mod capsule;
mod proposal;

pub use capsule::{Capsule, Proximity, SMOOTHING_M, proximity};
pub use proposal::{PairProposal, ProposalSettings, Verdict, propose_pairs};

use multibody::{FrameIndex, WholeBodyTerms};
use nalgebra::RowDVector;
use serde::Deserialize;
use spatial::{Transform, Vec3};

/// A capsule on a link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkCapsule {
    /// Name, for pairs and reports.
    pub name: String,
    /// Link in whose frame it is given.
    pub link: String,
    /// First end of the axis in the link's frame (m).
    pub from_m: Vec3,
    /// Second end of the axis in the link's frame (m).
    pub to_m: Vec3,
    /// Radius (m).
    pub radius_m: f64,
}

/// Bodies, pairs and the damper.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CollisionSettings {
    /// Whether pairs are watched at all.
    pub on: bool,
    /// Bodies. *Robot's.*
    #[serde(skip)]
    pub capsules: Vec<LinkCapsule>,
    /// Pairs of names of capsules. *Robot's.*
    #[serde(skip)]
    pub pairs: Vec<[String; 2]>,
    /// d_i (m): from here on the damper counts.
    pub interaction_m: f64,
    /// d_s (m): never nearer than this.
    pub safety_m: f64,
    /// xi (m/s): speed of approach allowed at d_i.
    pub damping_m_per_s: f64,
}

impl Default for CollisionSettings {
    fn default() -> Self {
        Self {
            on: true,
            capsules: Vec::new(),
            pairs: Vec::new(),
            interaction_m: 0.1,
            safety_m: 0.01,
            damping_m_per_s: 0.5,
        }
    }
}

/// Rows are evaluated within this many interaction distances.
const REACH: f64 = 3.0;

/// A capsule with its link resolved.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    /// Position of the link's frame in the list of frames that the step computes.
    pub slot: usize,
    pub from: Vec3,
    pub to: Vec3,
    pub radius: f64,
}

/// All pairs of a model.
#[derive(Debug, Clone)]
pub(crate) struct Pairs {
    bodies: Vec<Body>,
    pairs: Vec<[usize; 2]>,
    interaction: f64,
    safety: f64,
    damping: f64,
    placed: Vec<Capsule>,
    /// Last evaluation, for the report.
    pub proximities: Vec<Proximity>,
}

impl Pairs {
    pub fn new(settings: &CollisionSettings, bodies: Vec<Body>, pairs: Vec<[usize; 2]>) -> Self {
        let nowhere = Capsule { from: Vec3::zeros(), to: Vec3::zeros(), radius: 0.0 };
        let unknown =
            Proximity { distance: f64::INFINITY, normal: Vec3::z(), on_first: Vec3::zeros(), on_second: Vec3::zeros() };
        Self {
            placed: vec![nowhere; bodies.len()],
            proximities: vec![unknown; pairs.len()],
            bodies,
            pairs,
            interaction: settings.interaction_m,
            safety: settings.safety_m,
            damping: settings.damping_m_per_s,
        }
    }

    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Writes gradient (first nv entries of the row) and lower limit of each pair's row.
    pub fn fill(
        &mut self,
        terms: &WholeBodyTerms,
        dt_s: f64,
        gradient: &mut RowDVector<f64>,
        mut write: impl FnMut(usize, Option<(&RowDVector<f64>, f64)>),
    ) {
        for (placed, body) in self.placed.iter_mut().zip(&self.bodies) {
            let X_WL: &Transform = &terms.frames[body.slot].placement;
            *placed = Capsule { from: X_WL.point(&body.from), to: X_WL.point(&body.to), radius: body.radius };
        }
        for (k, pair) in self.pairs.iter().enumerate() {
            let near = proximity(&self.placed[pair[0]], &self.placed[pair[1]], SMOOTHING_M);
            self.proximities[k] = near;
            if near.distance > REACH * self.interaction {
                write(k, None);
                continue;
            }
            gradient.fill(0.0);
            let (mut approach, mut drift) = (0.0, 0.0);
            for (index, point, sign) in [(pair[0], near.on_first, 1.0), (pair[1], near.on_second, -1.0)] {
                let frame = &terms.frames[self.bodies[index].slot];
                let lever = point - frame.placement.translation;
                let n = sign * near.normal;
                let m = lever.cross(&n);
                for (j, entry) in gradient.iter_mut().enumerate() {
                    let column = &frame.jacobian.as_slice()[6 * j..6 * j + 6];
                    *entry += n.x * column[0]
                        + n.y * column[1]
                        + n.z * column[2]
                        + m.x * column[3]
                        + m.y * column[4]
                        + m.z * column[5];
                }
                let w = frame.velocity.angular;
                approach += n.dot(&(frame.velocity.linear + w.cross(&lever)));
                let linear: Vec3 = frame.drift.fixed_rows::<3>(0).into();
                let angular: Vec3 = frame.drift.fixed_rows::<3>(3).into();
                drift += n.dot(&(linear + angular.cross(&lever) + w.cross(&w.cross(&lever))));
            }
            let slowest = -self.damping * (near.distance - self.safety) / (self.interaction - self.safety);
            write(k, Some((gradient, (slowest - approach) / dt_s - drift)));
        }
    }
}

/// Frames that a step computes, without repetition.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrameList(pub Vec<FrameIndex>);

impl FrameList {
    /// Position of a frame in the list, added if it is new.
    pub fn slot(&mut self, frame: FrameIndex) -> usize {
        self.0.iter().position(|f| *f == frame).unwrap_or_else(|| {
            self.0.push(frame);
            self.0.len() - 1
        })
    }
}
