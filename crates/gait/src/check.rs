//! What the planner verifies after solving, from the finished pattern alone: nothing here knows how it was found.
//!
//! Inequalities hold at the samples of the problem; between them nothing forces the ZMP to stay inside. [`check()`] walks
//! through the pattern on a fine grid and reports the worst of every quantity with its phase, time and amount.

use crate::constraint::{Outline, step_rules};
use crate::layout::{Slot, Stand};
use crate::{GaitSettings, Plan};
use nalgebra::Vector2;
use pattern::{AnkleState, FootReference, Foothold, PhaseKind, Reference, Side, SwingTrajectory, WalkPattern};
use spatial::{Transform, Vec3};

/// Something that is measured along a walk. All but the last two vanish in a perfect pattern, or are negative where there
/// is room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// How far a foot's ZMP lies outside its sole shrunk by the margin (m); negative: inside.
    ZmpOutsidePolygon,
    /// By how much a distance along the stance foot exceeds its limit (m).
    StepTooLong,
    /// By how much a distance across the stance foot exceeds its limit (m).
    StepTooWide,
    /// By how much the gap between the feet falls short of its limit (m).
    FeetTooClose,
    /// Residual, in magnitude, of `x'' = w^2 (x - x_Z)` (m/s^2).
    ComEquation,
    /// Distance between the ZMP and the feet's ZMPs weighed by their loads (m).
    LoadBalance,
    /// Jump of the ZMP where phases meet (m).
    ZmpJump,
    /// Jump of its velocity (m/s).
    ZmpVelocityJump,
    /// Jump of its acceleration (m/s^2).
    ZmpAccelerationJump,
    /// The same for each foot that is loaded on both sides of the joint: its own ZMP goes on while phases, and the foot's part in
    /// them, change (m).
    FootZmpJump,
    /// Jump of its velocity (m/s).
    FootZmpVelocityJump,
    /// Jump of its acceleration (m/s^2).
    FootZmpAccelerationJump,
    /// Jump of the COM where phases meet (m).
    ComJump,
    /// Jump of its velocity (m/s).
    ComVelocityJump,
    /// Speed of COM or ZMP at either end of the walk (m/s).
    SpeedAtEnds,
    /// Friction needed so that no foot slips: horizontal over vertical force.
    FrictionDemand,
    /// Distance between a loaded foot's ZMP and the nearest edge of its whole sole, negated (m): the largest value belongs to
    /// the smallest margin.
    NegativeZmpMargin,
}

/// The worst value of a quantity and where it occurs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worst {
    /// What was measured.
    pub quantity: Quantity,
    /// The largest value found.
    pub value: f64,
    /// Index of the phase.
    pub phase: usize,
    /// Part of the walk.
    pub kind: PhaseKind,
    /// The swing that phase carries out, prepares or follows.
    pub step: u32,
    /// Walk time (s).
    pub time_s: f64,
    /// The foot concerned, if one is.
    pub foot: Option<Side>,
}

/// Result of [`check()`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CheckReport {
    /// One entry per quantity that occurs.
    pub worst: Vec<Worst>,
    /// The tightest instant for the legs, if a [`LegReach`] was given.
    pub reach: Option<TightestReach>,
}

impl CheckReport {
    /// The worst value of a quantity; minus infinity if it does not occur (a walk without free steps has no other).
    #[must_use]
    pub fn value(&self, quantity: Quantity) -> f64 {
        self.worst.iter().find(|w| w.quantity == quantity).map_or(f64::NEG_INFINITY, |w| w.value)
    }

    /// The constraint with the largest violation (m), friction demand and margins aside.
    #[must_use]
    pub fn largest_violation(&self) -> Option<&Worst> {
        const CONSTRAINTS: [Quantity; 4] =
            [Quantity::ZmpOutsidePolygon, Quantity::StepTooLong, Quantity::StepTooWide, Quantity::FeetTooClose];
        let constraints = self.worst.iter().filter(|w| CONSTRAINTS.contains(&w.quantity));
        constraints.reduce(|worst, w| if exceeds(w.value, worst.value) { w } else { worst })
    }

    fn note(&mut self, quantity: Quantity, value: f64, r: &Reference, foot: Option<Side>) {
        let new = Worst { quantity, value, phase: r.phase_index, kind: r.kind, step: r.step, time_s: r.t_s, foot };
        match self.worst.iter_mut().find(|w| w.quantity == quantity) {
            Some(old) if exceeds(value, old.value) => *old = new,
            Some(_) => {}
            None => self.worst.push(new),
        }
    }
}

/// Whether a value is worse than the worst so far. A NaN is worse than any number, and stays.
fn exceeds(value: f64, worst: f64) -> bool {
    value > worst || (value.is_nan() && !worst.is_nan())
}

/// What a leg has left at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegClearance {
    /// How much farther the ankle could get from the hip before the knee is stretched as far as is allowed (m); negative: the
    /// ankle is out of reach.
    pub extension_m: f64,
    /// Distance to the nearest joint limit (rad); negative: beyond it; infinite if the model has no joints.
    pub joint_rad: f64,
    /// Which joint that is, counted from the hip.
    pub joint: usize,
}

/// The legs, as the planner needs to know them. Implemented by who holds a robot model.
pub trait LegReach {
    /// Clearance of a leg with the COM at `com` (m), the body upright with a heading, the ankle frame at `ankle`.
    fn clearance(&self, leg: Side, com: &Vec3, heading_rad: f64, ankle: &Transform) -> LegClearance;
}

/// The instant with the least clearance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TightestReach {
    /// Least extension left (m), and when, and which leg.
    pub extension: (f64, f64, Side),
    /// Least distance to a joint limit (rad), when, which leg, which joint.
    pub joint: (f64, f64, Side, usize),
}

impl TightestReach {
    /// Whether the legs can follow.
    #[must_use]
    pub fn is_walkable(&self) -> bool {
        self.extension.0 >= 0.0 && self.joint.0 >= 0.0
    }
}

/// Measures a plan on a grid of `step_s` (s; the project uses 1 ms) and at both ends of every phase.
#[must_use]
pub fn check(plan: &Plan, settings: &GaitSettings, step_s: f64, legs: Option<&dyn LegReach>) -> CheckReport {
    let pattern = &plan.pattern;
    let mut report = CheckReport::default();
    for (i, phase) in pattern.phases.iter().enumerate() {
        let count = (phase.duration_s / step_s).ceil().max(1.0) as u64;
        for sample in 0..=count {
            let t = (sample as f64 * step_s).min(phase.duration_s);
            check_instant(&mut report, pattern, settings, &pattern.evaluate_phase(i, t));
        }
        if i > 0 {
            let before = pattern.evaluate_phase(i - 1, pattern.phases[i - 1].duration_s);
            check_joint(&mut report, &before, &pattern.evaluate_phase(i, 0.0));
        }
    }
    for end in [pattern.evaluate(0.0), pattern.evaluate(pattern.duration_s())] {
        report.note(Quantity::SpeedAtEnds, end.com.velocity.norm(), &end, None);
        report.note(Quantity::SpeedAtEnds, end.zmp.velocity.norm(), &end, None);
    }
    check_steps(&mut report, plan, settings);
    report.reach = legs.map(|legs| check_reach(pattern, legs, step_s));
    report
}

fn check_instant(report: &mut CheckReport, pattern: &WalkPattern, settings: &GaitSettings, r: &Reference) {
    let w2 = pattern.omega().powi(2);
    let residual = (r.com.acceleration - w2 * (r.com.position - r.zmp.position)).norm();
    report.note(Quantity::ComEquation, residual, r, None);
    let weighed: Vector2<f64> = r.feet.iter().map(|foot| foot.share.value * foot.zmp.position).sum();
    report.note(Quantity::LoadBalance, (weighed - r.zmp.position).norm(), r, None);
    report.note(Quantity::FrictionDemand, r.com.acceleration.norm() / pattern.gravity_m_per_s2, r, None);
    for side in Side::BOTH {
        let foot = &r.feet[side.index()];
        if foot.in_contact {
            let outside = |margin| outside(foot, &Outline::new(settings, side, margin));
            report.note(Quantity::ZmpOutsidePolygon, outside(settings.limits.zmp_margin_m), r, Some(side));
            report.note(Quantity::NegativeZmpMargin, outside(0.0), r, Some(side));
        }
    }
}

/// How far the foot's ZMP lies outside a rectangle given from the ankle in the axes of the foot.
fn outside(foot: &FootReference, outline: &Outline) -> f64 {
    let from_ankle = foot.zmp.position - foot.ankle_foothold.position();
    let (sin, cos) = foot.ankle_foothold.yaw_rad.sin_cos();
    let (x, y) = (cos * from_ankle.x + sin * from_ankle.y, cos * from_ankle.y - sin * from_ankle.x);
    [outline.x[0] - x, x - outline.x[1], outline.y[0] - y, y - outline.y[1]]
        .into_iter()
        .fold(f64::NEG_INFINITY, |worst, side| if exceeds(side, worst) { side } else { worst })
}

fn check_joint(report: &mut CheckReport, before: &Reference, after: &Reference) {
    let jumps = [
        (Quantity::ZmpJump, after.zmp.position - before.zmp.position),
        (Quantity::ZmpVelocityJump, after.zmp.velocity - before.zmp.velocity),
        (Quantity::ZmpAccelerationJump, after.zmp.acceleration - before.zmp.acceleration),
        (Quantity::ComJump, after.com.position - before.com.position),
        (Quantity::ComVelocityJump, after.com.velocity - before.com.velocity),
    ];
    for (quantity, jump) in jumps {
        report.note(quantity, jump.norm(), after, None);
    }
    for side in Side::BOTH {
        let [b, a] = [before, after].map(|r| &r.feet[side.index()]);
        if b.in_contact && a.in_contact {
            let jumps = [
                (Quantity::FootZmpJump, a.zmp.position - b.zmp.position),
                (Quantity::FootZmpVelocityJump, a.zmp.velocity - b.zmp.velocity),
                (Quantity::FootZmpAccelerationJump, a.zmp.acceleration - b.zmp.acceleration),
            ];
            for (quantity, jump) in jumps {
                report.note(quantity, jump.norm(), after, Some(side));
            }
        }
    }
}

fn check_steps(report: &mut CheckReport, plan: &Plan, settings: &GaitSettings) {
    let stand = |side: Side, step: usize, guess: Foothold| {
        let step = u32::try_from(step).unwrap_or(u32::MAX);
        Stand { side, step, guess, slots: [Slot::default(); 2], since_s: 0.0 }
    };
    let initial = plan.pattern.phases[0].feet.map(|foot| foot.ankle_foothold);
    let mut standing = [stand(Side::Left, 0, initial[0]), stand(Side::Right, 0, initial[1])];
    for (i, (side, foothold)) in plan.landings.iter().enumerate() {
        let landing = stand(*side, i + 1, *foothold);
        let stance = standing[side.other().index()];
        let p = landing.guess.position() - stance.guess.position();
        let instant = plan
            .pattern
            .phases
            .iter()
            .position(|phase| phase.kind == PhaseKind::SingleSupport && phase.step as usize == i + 1);
        let instant = plan.pattern.evaluate_phase(instant.unwrap_or(0), f64::INFINITY);
        let rules = step_rules(&landing, &stance, settings);
        let quantities = [Quantity::StepTooLong, Quantity::StepTooWide, Quantity::FeetTooClose, Quantity::FeetTooClose];
        for (rule, quantity) in rules.iter().zip(quantities) {
            let value = rule.direction[0] * p.x + rule.direction[1] * p.y;
            let violation = (value - rule.upper).max(rule.lower - value);
            report.note(quantity, violation, &instant, Some(*side));
        }
        standing[side.index()] = landing;
    }
}

fn check_reach(pattern: &WalkPattern, legs: &dyn LegReach, step_s: f64) -> TightestReach {
    let mut tightest =
        TightestReach { extension: (f64::INFINITY, 0.0, Side::Left), joint: (f64::INFINITY, 0.0, Side::Left, 0) };
    let count = (pattern.duration_s() / step_s).ceil() as u64;
    for sample in 0..=count {
        let r = pattern.evaluate(sample as f64 * step_s);
        let ankles = Side::BOTH.map(|side| ankle_pose(pattern, &r.feet[side.index()], r.t_s));
        let yaw = |pose: &Transform| pose.rotation[(1, 0)].atan2(pose.rotation[(0, 0)]);
        let (left, right) = (yaw(&ankles[0]), yaw(&ankles[1]));
        // Halfway between the feet, the short way round.
        let heading = left + 0.5 * (right - left).sin().atan2((right - left).cos());
        for side in Side::BOTH {
            let c = legs.clearance(side, &r.com_position(), heading, &ankles[side.index()]);
            if exceeds(-c.extension_m, -tightest.extension.0) {
                tightest.extension = (c.extension_m, r.t_s, side);
            }
            if exceeds(-c.joint_rad, -tightest.joint.0) {
                tightest.joint = (c.joint_rad, r.t_s, side, c.joint);
            }
        }
    }
    tightest
}

/// The ankle as planned, on undeformed soles.
#[must_use]
pub fn ankle_pose(pattern: &WalkPattern, foot: &FootReference, t_s: f64) -> Transform {
    match foot.swing {
        None => pattern.ankle_pose(&foot.ankle_foothold),
        Some(swing) => {
            let from = AnkleState::at_rest(pattern.ankle_pose(&swing.from_foothold));
            let to = pattern.ankle_pose(&swing.to_foothold);
            SwingTrajectory::new(&from, &to, swing.t_start_s, swing.t_end_s, swing.apex_m).evaluate(t_s).pose
        }
    }
}
