//! Every quantity of a phase as a row over the phase's own unknowns.
//!
//! One phase and one axis has the [`SLOTS`] numbers below; ZMPs, COM, torques are linear in them, with rows that depend on
//! the duration, the pendulum's frequency and the load share alone. Phases of equal shape share one basis.

use nalgebra::SVector;
use pattern::{ComSolution, Quintic};

/// Numbers that describe a phase along one axis.
pub const SLOTS: usize = 16;
/// ZMP at the start: position, velocity, acceleration.
pub const ZMP_START: usize = 0;
/// ZMP at the end.
pub const ZMP_END: usize = 3;
/// COM position at the start.
pub const COM_START: usize = 6;
/// COM position at the end.
pub const COM_END: usize = 7;
/// ZMP of foot 1 at the start: position, velocity, acceleration. Where foot 2 lands these are the ZMP's.
pub const ZMP_1_START: usize = 8;
/// ZMP of foot 1 at the end.
pub const ZMP_1_END: usize = 11;
/// Ankle of foot 1.
pub const ANKLE_1: usize = 14;
/// Ankle of foot 2.
pub const ANKLE_2: usize = 15;

/// Coefficients over the slots.
pub type Row = SVector<f64, SLOTS>;

/// How load moves from foot 1 to foot 2 during a phase: `k` at its two ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Transfer {
    /// Foot 2 alone.
    Single,
    /// 0 to 1.
    Middle,
    /// 1/2 to 1/4: the foot about to leave is loaded first, as people do.
    StartFirst,
    /// 1/4 to 1.
    StartSecond,
    /// 0 to 3/4.
    StopFirst,
    /// 3/4 to 1/2.
    StopSecond,
}

impl Transfer {
    fn ends(self) -> (f64, f64) {
        match self {
            Self::Single => (1.0, 1.0),
            Self::Middle => (0.0, 1.0),
            Self::StartFirst => (0.5, 0.25),
            Self::StartSecond => (0.25, 1.0),
            Self::StopFirst => (0.0, 0.75),
            Self::StopSecond => (0.75, 0.5),
        }
    }

    /// Whether foot 2 lands at the start of the phase, so that `t^3` is cancelled.
    pub fn lands(self) -> bool {
        self.ends().0 == 0.0
    }

    /// `(p, κ)` with `k = t^p κ`.
    pub fn share(self, duration_s: f64) -> (u32, Quintic) {
        let (from, to) = self.ends();
        let k = Quintic::hermite(duration_s, [from, 0.0, 0.0], [to, 0.0, 0.0]);
        if self.lands() { (3, k.divided_by_cube()) } else { (0, k) }
    }
}

/// Rows of one shape of phase.
pub struct Basis {
    /// `T` (s).
    pub duration_s: f64,
    /// `w` (1/s).
    pub omega: f64,
    /// Load transfer.
    pub transfer: Transfer,
    load: pattern::Load,
    hermite: [Quintic; 6],
    com: [ComSolution; 8],
    excess: [Quintic; SLOTS],
}

impl Basis {
    /// Solves the phase for a unit in each slot.
    pub fn new(duration_s: f64, omega: f64, transfer: Transfer) -> Self {
        let hermite = std::array::from_fn(|i| {
            let mut ends = [[0.0; 3]; 2];
            ends[i / 3][i % 3] = 1.0;
            Quintic::hermite(duration_s, ends[0], ends[1])
        });
        let com = std::array::from_fn(|i| {
            let zmp = hermite.get(i).copied().unwrap_or_default();
            let at = |slot| if i == slot { 1.0 } else { 0.0 };
            ComSolution::through(&zmp, duration_s, omega, at(COM_START), at(COM_END))
        });
        let mut excess = [Quintic::default(); SLOTS];
        let negative = |q: &Quintic| Quintic::default().minus(q);
        for i in 0..6 {
            if !transfer.lands() {
                excess[ZMP_START + i] = negative(&hermite[i]);
                excess[ZMP_1_START + i] = hermite[i];
            } else if i >= 3 {
                // Equal starts cancel exactly; what the ends contribute carries the factor t^3.
                excess[ZMP_START + i] = negative(&hermite[i].divided_by_cube());
                excess[ZMP_1_START + i] = hermite[i].divided_by_cube();
            }
        }
        let (cancelled_power, share) = transfer.share(duration_s);
        let load = pattern::Load { cancelled_power, share, excess: [Quintic::default(); 2] };
        Self { duration_s, omega, transfer, load, hermite, com, excess }
    }

    fn quintic_rows(&self, first_slot: usize, t: f64) -> [Row; 3] {
        let mut rows = [Row::zeros(); 3];
        for (i, quintic) in self.hermite.iter().enumerate() {
            for (row, value) in rows.iter_mut().zip(quintic.derivatives::<3>(t)) {
                row[first_slot + i] = value;
            }
        }
        rows
    }

    /// ZMP with two derivatives.
    pub fn zmp(&self, t: f64) -> [Row; 3] {
        self.quintic_rows(ZMP_START, t)
    }

    /// COM position, velocity, acceleration.
    pub fn com(&self, t: f64) -> [Row; 3] {
        let mut rows = [Row::zeros(); 3];
        for (slot, solution) in self.com.iter().enumerate() {
            for (row, value) in rows.iter_mut().zip(solution.derivatives(t, self.duration_s, self.omega)) {
                row[slot] = value;
            }
        }
        rows
    }

    /// `k` and two derivatives.
    pub fn share(&self, t: f64) -> [f64; 3] {
        self.load.share_of_foot_2(t)
    }

    /// ZMP of foot 1 with two derivatives.
    pub fn zmp_1(&self, t: f64) -> [Row; 3] {
        self.quintic_rows(ZMP_1_START, t)
    }

    /// ZMP of foot 2 with two derivatives: in single support that of the robot.
    pub fn zmp_2(&self, t: f64) -> [Row; 3] {
        if self.transfer == Transfer::Single {
            return self.zmp(t);
        }
        let [k, k1, k2] = self.load.share.derivatives::<3>(t);
        let mut excess = [Row::zeros(); 3];
        for (slot, quintic) in self.excess.iter().enumerate() {
            for (row, value) in excess.iter_mut().zip(quintic.derivatives::<3>(t)) {
                row[slot] = value;
            }
        }
        let r = excess[0] / k;
        let r1 = (excess[1] - r * k1) / k;
        let r2 = (excess[2] - 2.0 * r1 * k1 - r * k2) / k;
        let [x, x1, x2] = self.zmp_1(t);
        [x - r, x1 - r1, x2 - r2]
    }
}
