//! What the rehearsal found becomes part of the pattern.
//!
//! **A dynamics filter was tried instead**: move the COM so that the body's own ZMP is the planned one, by the bounded solution of
//! `d'' = w^2 (d + s)` for the shift `s`. The walks are no better, also when the soles are told what is left (`docs/walks.md`).

use crate::rehearsed::{in_words, joint_name, room, speeds};
use crate::{PlannerError, PlannerSettings};
use pattern::{SHIFT_INTERVALS, SHIFT_KNOTS, WalkPattern, ZmpShift};
use rehearsal::{Rehearsal, Samples, local_cubic};
use robot::Robot;
use robot_model::walking_model;
use wholebody::WholeBody;

/// The rehearsal, and in words what it says of joints and drives.
#[derive(Debug)]
pub(crate) struct Rehearsed {
    pub rehearsal: Rehearsal,
    /// What is left to the limits of travel, speed and torque.
    pub rooms: [String; 3],
    /// Which joints are as fast as they may be, if any.
    pub speeds: Option<String>,
}

/// Walks the pattern on an ideal plant and gives it the body's own ZMP.
pub(crate) fn rehearse(
    walk: &mut WalkPattern,
    robot: &Robot,
    settings: &PlannerSettings,
) -> Result<Rehearsed, PlannerError> {
    let (model, _) = walking_model(robot)?;
    let body = settings.controller.whole_body(robot, &model).map_err(|error| error.under("controller"))?;
    let mut body = WholeBody::new(model, body)?;
    let rehearsal = rehearsal::rehearse(&mut body, walk, settings.rehearsal.period_s);
    let rehearsal = rehearsal.map_err(|refused| in_words(refused, &body))?;
    if settings.rehearsal.body_zmp {
        shift(walk, &rehearsal, settings.rehearsal.smoothing_s);
    }
    let rooms = rehearsal.tightest.map(|demand| room(&demand, &joint_name(&body, demand.joint)));
    let speeds = speeds(&rehearsal, &body);
    Ok(Rehearsed { rehearsal, rooms, speeds })
}

/// Writes the body's own ZMP into every phase, at its knots. Where phases meet both have the same numbers.
fn shift(walk: &mut WalkPattern, rehearsal: &Rehearsal, half_width_s: f64) {
    let end_s = walk.duration_s();
    let shift_m = [0, 1].map(|axis| rehearsal.zmp_shift_m(axis));
    let curve = |t_s: f64, axis: usize| {
        let samples = Samples { values: &shift_m[axis], period_s: rehearsal.period_s };
        let [value, rate, acceleration] = local_cubic(&samples, t_s, half_width_s);
        // Before and after the walk it is held.
        if t_s <= 0.0 || t_s >= end_s { [value, 0.0, 0.0] } else { [value, rate, acceleration] }
    };
    let mut before: Option<ZmpShift> = None;
    for phase in &mut walk.phases {
        let time_s = |knot: usize| phase.start_s + phase.duration_s * knot as f64 / SHIFT_INTERVALS as f64;
        let mut knots = [0, 1].map(|axis| std::array::from_fn::<_, SHIFT_KNOTS, _>(|knot| curve(time_s(knot), axis)));
        if let Some(ZmpShift(before)) = before {
            (knots[0][0], knots[1][0]) = (before[0][SHIFT_INTERVALS], before[1][SHIFT_INTERVALS]);
        }
        phase.zmp_shift = ZmpShift(knots);
        before = Some(phase.zmp_shift);
    }
}
