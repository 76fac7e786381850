//! The whole walk: phases one after the other, evaluated at any time.

use crate::{FootReference, Foothold, Phase, PhaseKind, Planar, PlanarMotion, Reference, Scalar, SwingReference};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use spatial::{Transform, Vec3};

/// Version of [`WalkPattern`] as data; a reader refuses later ones.
pub const PATTERN_VERSION: u32 = 2;

/// A planned walk.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WalkPattern {
    /// [`PATTERN_VERSION`] of the writer.
    pub version: u32,
    /// `M` (kg).
    pub mass_kg: f64,
    /// `g` (m/s^2).
    pub gravity_m_per_s2: f64,
    /// `z_COM` above the ground (m).
    pub com_height_m: f64,
    /// Height of the ankle above the ground when the foot stands flat on an undeformed sole (m).
    pub ankle_height_m: f64,
    /// Ankle in the sole frame, x and y (m), left and right.
    pub ankle_in_sole_m: [[f64; 2]; 2],
    /// Pieces in the order of time, the first at 0.
    pub phases: Vec<Phase>,
}

impl WalkPattern {
    /// `w = sqrt(g / z_COM)` (1/s).
    #[must_use]
    pub fn omega(&self) -> f64 {
        (self.gravity_m_per_s2 / self.com_height_m).sqrt()
    }

    /// When the walk is over (s).
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.phases.last().map_or(0.0, Phase::end_s)
    }

    /// Number of its phases, start time and duration, every coefficient: a digest by which two processes know that they
    /// hold the same pattern (FNV-1a over the bits).
    #[must_use]
    pub fn content_hash(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut feed = |value: f64| {
            for byte in value.to_bits().to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        };
        feed(f64::from(self.version));
        for value in [self.mass_kg, self.gravity_m_per_s2, self.com_height_m, self.ankle_height_m] {
            feed(value);
        }
        self.ankle_in_sole_m.iter().flatten().for_each(|value| feed(*value));
        for phase in &self.phases {
            self.visit_phase(phase, &mut feed);
        }
        hash
    }

    fn visit_phase(&self, phase: &Phase, visit: &mut impl FnMut(f64)) {
        visit(phase.start_s);
        visit(phase.duration_s);
        visit(phase.kind as u8 as f64);
        visit(f64::from(phase.step));
        visit(phase.foot_1.index() as f64);
        visit(f64::from(phase.load.cancelled_power));
        let quintics = (phase.zmp.iter()).chain(&phase.zmp_1).chain(&phase.load.excess).chain([&phase.load.share]);
        quintics.chain(phase.com.iter().map(|c| &c.polynomial)).for_each(|q| q.0.iter().for_each(|a| visit(*a)));
        for com in &phase.com {
            visit(com.decaying);
            visit(com.growing);
        }
        // Patterns of version 1 knew no shift; their hash in recordings is without it.
        if self.version > 1 || phase.zmp_shift.numbers().any(|number| number != 0.0) {
            phase.zmp_shift.numbers().for_each(&mut *visit);
        }
        for foot in &phase.feet {
            for foothold in [Some(foot.ankle_foothold), foot.swing.map(|s| s.from_foothold)].into_iter().flatten() {
                visit(foothold.x_m);
                visit(foothold.y_m);
                visit(foothold.yaw_rad);
            }
            visit(foot.contact_since_s);
            if let Some(swing) = foot.swing {
                visit(swing.t_start_s);
                visit(swing.t_end_s);
                visit(swing.apex_m);
            }
        }
    }

    /// Index of the phase that `t_s` lies in: the last one that has started, the first before the walk.
    #[must_use]
    pub fn phase_at(&self, t_s: f64) -> usize {
        self.phases.partition_point(|phase| phase.start_s <= t_s).saturating_sub(1)
    }

    /// The references at walk time `t_s` (s); before the walk those of its start, after it those of its end. Exact,
    /// allocation-free.
    ///
    /// # Panics
    /// If the pattern has no phases.
    #[must_use]
    pub fn evaluate(&self, t_s: f64) -> Reference {
        let phase_index = self.phase_at(t_s);
        self.evaluate_phase(phase_index, t_s - self.phases[phase_index].start_s)
    }

    /// The references at local time `t` of a phase, clamped to it: at a boundary, the phases on both sides can be asked.
    ///
    /// # Panics
    /// If there is no such phase.
    #[must_use]
    pub fn evaluate_phase(&self, phase_index: usize, t: f64) -> Reference {
        let phase = &self.phases[phase_index];
        let t = t.clamp(0.0, phase.duration_s);
        let omega = self.omega();
        let [x, y] = phase.zmp.map(|axis| axis.derivatives::<3>(t));
        let [shift_x, shift_y] = phase.zmp_shift.evaluate(t, phase.duration_s);
        let zmp = planar(x, y);
        let [x, y] = phase.com.map(|axis| axis.derivatives(t, phase.duration_s, omega));
        let com = PlanarMotion {
            position: Vector2::new(x[0], y[0]),
            velocity: Vector2::new(x[1], y[1]),
            acceleration: Vector2::new(x[2], y[2]),
            jerk: Vector2::new(x[3], y[3]),
            snap: Vector2::new(x[4], y[4]),
        };
        let [k, k1, k2] = phase.load.share_of_foot_2(t);
        let [zmp_1, zmp_2] = self.zmp_of_feet(phase, t, &zmp);
        let one = (Scalar { value: 1.0 - k, rate: -k1, acceleration: -k2 }, zmp_1);
        let two = (Scalar { value: k, rate: k1, acceleration: k2 }, zmp_2);
        let ordered = if phase.foot_1.index() == 0 { [one, two] } else { [two, one] };
        let feet = std::array::from_fn(|i| self.foot(phase, i, ordered[i].0, ordered[i].1, &com));
        Reference {
            t_s: phase.start_s + t,
            phase_index,
            kind: phase.kind,
            step: phase.step,
            zmp,
            zmp_shift: planar(shift_x, shift_y),
            com,
            com_height_m: self.com_height_m,
            feet,
        }
    }

    /// ZMP of foot 1 and of foot 2.
    fn zmp_of_feet(&self, phase: &Phase, t: f64, zmp: &Planar) -> [Planar; 2] {
        if phase.kind == PhaseKind::SingleSupport {
            let resting = phase.feet[phase.foot_1.index()].ankle_foothold.position();
            return [Planar { position: resting, ..Planar::default() }, *zmp];
        }
        let [x1, y1] = phase.zmp_1.map(|axis| axis.derivatives::<3>(t));
        let [dx, dy] = [0, 1].map(|axis| phase.load.lead_of_foot_1(axis, t));
        let minus = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] - b[i]);
        [planar(x1, y1), planar(minus(x1, dx), minus(y1, dy))]
    }

    fn foot(&self, phase: &Phase, index: usize, share: Scalar, zmp: Planar, com: &PlanarMotion) -> FootReference {
        let foot = &phase.feet[index];
        let M = self.mass_kg;
        let total = Vec3::new(M * com.acceleration.x, M * com.acceleration.y, M * self.gravity_m_per_s2);
        let rate = Vec3::new(M * com.jerk.x, M * com.jerk.y, 0.0);
        let acceleration = Vec3::new(M * com.snap.x, M * com.snap.y, 0.0);
        FootReference {
            in_contact: foot.swing.is_none(),
            share,
            force: share.value * total,
            force_rate: share.rate * total + share.value * rate,
            force_acceleration: share.acceleration * total + 2.0 * share.rate * rate + share.value * acceleration,
            zmp,
            ankle_foothold: foot.ankle_foothold,
            sole_foothold: self.sole_foothold(index, &foot.ankle_foothold),
            contact_since_s: foot.contact_since_s,
            swing: foot.swing.map(|swing| SwingReference {
                from_foothold: swing.from_foothold,
                to_foothold: foot.ankle_foothold,
                t_start_s: swing.t_start_s,
                t_end_s: swing.t_end_s,
                apex_m: swing.apex_m,
            }),
        }
    }

    /// The point under the sole frame's origin for a foot (0 left, 1 right) whose ankle stands above `ankle_foothold`.
    #[must_use]
    pub fn sole_foothold(&self, foot: usize, ankle_foothold: &Foothold) -> Foothold {
        let [x, y] = self.ankle_in_sole_m[foot];
        ankle_foothold.offset(Vector2::new(-x, -y))
    }

    /// Ankle pose of a foot that stands flat on an undeformed sole with its ankle above `ankle_foothold`.
    #[must_use]
    pub fn ankle_pose(&self, ankle_foothold: &Foothold) -> Transform {
        ankle_foothold.pose_at_height(self.ankle_height_m)
    }
}

fn planar(x: [f64; 3], y: [f64; 3]) -> Planar {
    Planar {
        position: Vector2::new(x[0], y[0]),
        velocity: Vector2::new(x[1], y[1]),
        acceleration: Vector2::new(x[2], y[2]),
    }
}
