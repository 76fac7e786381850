//! The walk on an ideal plant and rigid footholds.

use nalgebra::Vector2;
use pattern::{Reference, WalkPattern};
use spatial::{Vec3, Wrench};
use stance::{FootEstimate, StanceSettings, WalkOnSoles};
use tracking::{Start, reference, start};
use wholebody::{ConfigurationError, ConstraintId, FootTarget, RobotState, StepReport, StepStatus, TaskId, WholeBody};

/// One tick of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RehearsedTick {
    /// Where the forces of the whole-body step act as a whole (m).
    pub zmp_m: Vector2<f64>,
    /// Where the pattern has them (m).
    pub planned_zmp_m: Vector2<f64>,
    /// Distance of the centre of mass from its reference (m).
    pub com_error_m: f64,
}

/// Which limit of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitKind {
    /// Its end of travel (rad).
    Position,
    /// Its speed (rad/s).
    Speed,
    /// Its drive's torque (N m).
    Torque,
}

/// How near a joint comes to a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demand {
    /// Joint of the model.
    pub joint: usize,
    /// Which of its limits.
    pub kind: LimitKind,
    /// Walk time (s).
    pub time_s: f64,
    /// Angle, speed or torque there.
    pub value: f64,
    /// The limit that is near: of travel the end, of speed and torque the largest.
    pub limit: f64,
    /// What is left to the limit; negative beyond it.
    pub room: f64,
}

/// A joint that its speed limit holds back: what it moves is late.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtSpeed {
    /// Joint of the model.
    pub joint: usize,
    /// For how long, all times together (s).
    pub lasting_s: f64,
    /// How many times.
    pub times: usize,
    /// When for the first time, in walk time (s).
    pub first_s: f64,
    last_s: f64,
}

/// What the rehearsal found.
#[derive(Debug, Clone, PartialEq)]
pub struct Rehearsal {
    /// Time from tick to tick (s).
    pub period_s: f64,
    /// From time zero to the end of the walk.
    pub ticks: Vec<RehearsedTick>,
    /// For position, speed and torque the joint that comes nearest to its limit, measured by the limit itself.
    pub tightest: [Demand; 3],
    /// Joints that are as fast as they may be for a time, in the model's order.
    pub at_speed: Vec<AtSpeed>,
    /// Largest distance, along an axis, of a swinging ankle from its reference (m).
    pub swing_error_m: f64,
}

/// A walk that the body cannot make even on an ideal plant.
#[derive(Debug, Clone, PartialEq)]
pub enum NotRehearsed {
    /// There is no configuration in which it begins.
    Start(ConfigurationError),
    /// A limit gave way, or nothing helped.
    Limit {
        /// Walk time (s).
        time_s: f64,
        /// What gave way first, and by how much (N m, m/s^2, rad/s^2, N); none when no step was found at all.
        gave_way: Option<(ConstraintId, f64)>,
    },
    /// A limit holds a joint where the walk wants it elsewhere.
    AtLimit(Demand),
}

impl Rehearsal {
    /// How far the body's own ZMP is from the planned one, x or y, tick by tick (m).
    #[must_use]
    pub fn zmp_shift_m(&self, axis: usize) -> Vec<f64> {
        self.ticks.iter().map(|tick| tick.zmp_m[axis] - tick.planned_zmp_m[axis]).collect()
    }
}

/// How long the robot stands before the walk (s). The start configuration is near the posture, not at rest in it: what the postures'
/// objectives (10 rad/s) still move has come to rest to 5e-4 of itself, as in a robot that settles before it walks.
const STANDING_S: f64 = 1.0;

/// Stands, then walks the pattern once, a step every `period_s`.
///
/// # Errors
/// [`NotRehearsed`] names time, joint and amount.
pub fn rehearse(body: &mut WholeBody, walk: &WalkPattern, period_s: f64) -> Result<Rehearsal, NotRehearsed> {
    let mut feet = WalkOnSoles::new(walk.clone(), [None, None], &StanceSettings::default(), period_s);
    let mut wanted = |tick: i64, time_s: f64| {
        let planned = walk.evaluate(time_s);
        let targets = feet.at_tick(tick, &[]);
        let target = |foot: usize| target(&planned, foot, &targets[foot]);
        (planned, reference(&planned, [target(0), target(1)]))
    };
    let from = Start::of(body);
    let mut state = start(body, &from, &wanted(0, 0.0).1).map_err(NotRehearsed::Start)?;
    let mut tightest = Tightest::default();
    let (mut at_speed, mut swing_error_m) = (Vec::new(), 0.0_f64);
    let standing = (STANDING_S / period_s).ceil() as i64;
    let ticks = (walk.duration_s() / period_s).ceil() as i64;
    let mut rehearsed = Vec::with_capacity(ticks as usize + 1);
    body.forget();
    for tick in -standing..=ticks {
        let is_walking = tick >= 0;
        let tick = tick.max(0);
        let time_s = tick as f64 * period_s;
        let (planned, wanted) = wanted(tick, time_s);
        body.step(&state, &wanted, period_s);
        let report = body.report();
        if report.status != StepStatus::Solved {
            let gave_way = report.relaxed.first().map(|relaxed| (relaxed.id, relaxed.amount));
            return Err(NotRehearsed::Limit { time_s, gave_way });
        }
        state = RobotState { q: report.q_next.clone(), v: report.v_next.clone() };
        if !is_walking {
            continue;
        }
        rehearsed.push(RehearsedTick {
            zmp_m: zmp(report, &wanted.feet),
            planned_zmp_m: planned.zmp.position,
            com_error_m: report.body_error.fixed_rows::<3>(0).norm(),
        });
        let swings = report.tasks.iter().filter(|task| matches!(task.id, TaskId::SwingPosition(_)));
        swing_error_m = swings.fold(swing_error_m, |largest, task| largest.max(task.tracking_error));
        tightest.look(body, time_s)?;
        note_speeds(&mut at_speed, body, time_s, period_s);
    }
    at_speed.sort_by_key(|speed: &AtSpeed| speed.joint);
    Ok(Rehearsal { period_s, ticks: rehearsed, tightest: tightest.found(), at_speed, swing_error_m })
}

/// A foot on a rigid sole.
fn target(planned: &Reference, foot: usize, on_sole: &FootEstimate) -> FootTarget {
    let planned = &planned.feet[foot];
    FootTarget {
        in_contact: on_sole.loaded,
        load_share: planned.share.value,
        ankle_pose: on_sole.ankle.pose,
        ankle_twist: on_sole.ankle.twist,
        ankle_acceleration: on_sole.ankle.acceleration,
        wrench: Wrench { force: planned.force, moment: Vec3::zeros() },
        zmp: on_sole.zmp,
    }
}

/// Where the feet's wrenches act as a whole, on the ground; NaN where nothing presses.
fn zmp(report: &StepReport, feet: &[FootTarget; 2]) -> Vector2<f64> {
    let about_origin = |foot: usize| report.feet[foot].wrench.about(&-feet[foot].ankle_pose.translation);
    let total = about_origin(0) + about_origin(1);
    total.zmp(&Vec3::zeros(), 0.0).unwrap_or_else(|| Vector2::repeat(f64::NAN))
}

/// Which joints their speed limit holds back in the step that was taken.
fn note_speeds(at_speed: &mut Vec<AtSpeed>, body: &WholeBody, time_s: f64, period_s: f64) {
    for active in &body.report().active {
        let ConstraintId::JointMotion(joint) = active.id else { continue };
        let [position, speed, _] = demands(body, joint, time_s);
        if part(&position, body) <= part(&speed, body) {
            continue;
        }
        let known = at_speed.iter_mut().find(|known| known.joint == joint);
        if let Some(known) = known {
            // One and a half periods: the tick before, whatever rounding makes of it.
            known.times += usize::from(time_s - known.last_s > 1.5 * period_s);
            known.lasting_s += period_s;
            known.last_s = time_s;
        } else {
            at_speed.push(AtSpeed { joint, lasting_s: period_s, times: 1, first_s: time_s, last_s: time_s });
        }
    }
}

/// The joint nearest to its limit, for each kind.
#[derive(Default)]
struct Tightest([Option<Demand>; 3]);

/// Limit of position, speed and torque, and what a joint needs of each.
fn demands(body: &WholeBody, joint: usize, time_s: f64) -> [Demand; 3] {
    let (report, limits) = (body.report(), &body.joint_limits()[joint]);
    let angle = report.q_next.joints[joint];
    let rate = report.v_next[body.model().base_dofs() + joint];
    let torque = report.torques[joint];
    let end = if angle - limits.lower < limits.upper - angle { limits.lower } else { limits.upper };
    [
        (LimitKind::Position, angle, end, (angle - end).abs()),
        (LimitKind::Speed, rate, limits.velocity, limits.velocity - rate.abs()),
        (LimitKind::Torque, torque, limits.torque, limits.torque - torque.abs()),
    ]
    .map(|(kind, value, limit, room)| Demand { joint, kind, time_s, value, limit, room })
}

/// A demand's room as a part of what there is.
fn part(demand: &Demand, body: &WholeBody) -> f64 {
    let limits = &body.joint_limits()[demand.joint];
    let whole = match demand.kind {
        LimitKind::Position => limits.upper - limits.lower,
        LimitKind::Speed | LimitKind::Torque => demand.limit,
    };
    demand.room / whole
}

impl Tightest {
    fn look(&mut self, body: &WholeBody, time_s: f64) -> Result<(), NotRehearsed> {
        for joint in 0..body.model().joint_count() {
            for (nearest, demand) in self.0.iter_mut().zip(demands(body, joint, time_s)) {
                if nearest.is_none_or(|nearest| part(&demand, body) < part(&nearest, body)) {
                    *nearest = Some(demand);
                }
            }
        }
        // What holds with equality holds the body back.
        for active in &body.report().active {
            let demand = match active.id {
                ConstraintId::JointMotion(joint) => {
                    let [position, speed, _] = demands(body, joint, time_s);
                    // A swinging leg that is as fast as it may be is a little late, and in time for its landing.
                    if part(&position, body) > part(&speed, body) {
                        continue;
                    }
                    position
                }
                ConstraintId::Torque(joint) => demands(body, joint, time_s)[2],
                _ => continue,
            };
            return Err(NotRehearsed::AtLimit(demand));
        }
        Ok(())
    }

    fn found(self) -> [Demand; 3] {
        self.0.map(|nearest| nearest.expect("a walking robot has joints"))
    }
}
