//! What is done about a message that has not come: go on, fade, hold, stop.
//!
//! By the clock nobody waits for ever. Whoever lacks this tick's input has one of the past, and makes of it what stands in: the drives of a
//! simulator or a robot what the next command would have said ([`command_instead`]), the controller where the soles have moved to
//! ([`deformation_instead`]). Both are functions of the last message and of how many ticks have passed, so a recording that tells which
//! message was used can be replayed to the bit.
//!
//! ```text
//! ticks without one      1     2     3     4     5     6    ..   10    ..   40
//! joints go on with      1     1    0.75  0.5   0.25   0          0          of their last rates
//! torques are            1     1    0.75  0.5   0.25   0          0          of the last ones
//! answer                 goes on ..............................  hold  ..   stop
//! ```
//!
//! Held is for good: the plan has gone on meanwhile, and the way back to it would be a jump.

use crate::{CONTROL_PERIOD_S, Plan, RobotCommand, SoleDeformation, from_row_major, row_major};
use spatial::{Vec3, so3};

/// With which share of the last joint rates the joints go on in the first, second, .. tick without a command; then not at all. Two whole
/// ticks bridge what an ordinary machine loses; the next three bring the joints to rest within 15 ms.
pub const RATE_SHARES: [f64; 5] = [1.0, 1.0, 0.75, 0.5, 0.25];
/// Ticks without an input after which what is there is held for good: 50 ms, a fifth of the time in which the robot topples.
pub const HOLD_AFTER_TICKS: i64 = 10;
/// Ticks without an input after which the run is ended: 200 ms.
pub const STOP_AFTER_TICKS: i64 = 40;

/// What is done after so many ticks without an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// It is there.
    Present,
    /// What stands in for it is used.
    GoOn,
    /// The posture is held for good.
    Hold,
    /// The run is over.
    Stop,
}

impl Answer {
    /// After so many ticks without an input.
    #[must_use]
    pub const fn after(missing_ticks: i64) -> Self {
        match missing_ticks {
            ..=0 => Self::Present,
            1..HOLD_AFTER_TICKS => Self::GoOn,
            HOLD_AFTER_TICKS..STOP_AFTER_TICKS => Self::Hold,
            _ => Self::Stop,
        }
    }
}

/// What the drives are told in the `missing_ticks`-th tick without a command, by the last one: brought to rest, its torques faded.
#[must_use]
pub fn command_instead(last: &RobotCommand, missing_ticks: i64) -> RobotCommand {
    let mut command = brought_to_rest(last, missing_ticks);
    let share = last_share(missing_ticks);
    command.feed_forward_torque_nm.iter_mut().for_each(|torque_nm| *torque_nm *= share);
    command
}

/// A command `passed_ticks` after the last one of a motion, on the way to rest: joints and plan go on with their last rates, by
/// [`RATE_SHARES`], and stay where that leads to. Its torques stay: who stands needs them.
#[must_use]
pub fn brought_to_rest(last: &RobotCommand, passed_ticks: i64) -> RobotCommand {
    let mut command = *last;
    let passed = usize::try_from(passed_ticks).unwrap_or(0);
    let ticks: f64 = RATE_SHARES.iter().take(passed).sum();
    let (time_s, share) = (ticks * CONTROL_PERIOD_S, last_share(passed_ticks));
    for (reference_rad, rate_rad_per_s) in
        command.joint_position_reference_rad.iter_mut().zip(&mut command.joint_velocity_reference_rad_per_s)
    {
        *reference_rad += time_s * *rate_rad_per_s;
        *rate_rad_per_s *= share;
    }
    bring_plan_to_rest(&mut command.plan, time_s, share);
    command
}

/// Share of the last rates and torques after so many ticks.
fn last_share(passed_ticks: i64) -> f64 {
    match usize::try_from(passed_ticks) {
        Ok(passed @ 1..) => RATE_SHARES.get(passed - 1).copied().unwrap_or(0.0),
        _ => 1.0,
    }
}

/// The body goes on for `time_s` with its last velocity, of which a `share` is left; with the rest of it goes what made it accelerate: the
/// ZMP comes under the centre of mass. Who stands on both feet then shares the load by where that is between them.
fn bring_plan_to_rest(plan: &mut Plan, time_s: f64, share: f64) {
    for axis in 0..3 {
        let moved_m = time_s * plan.com_velocity_m_per_s[axis];
        plan.com_position_m[axis] += moved_m;
        plan.base_position_m[axis] += moved_m;
        plan.com_velocity_m_per_s[axis] *= share;
        plan.com_acceleration_m_per_s2[axis] *= share;
    }
    if share == 1.0 || plan.feet.iter().any(|foot| foot.loaded != 1) {
        return;
    }
    let com_m = [plan.com_position_m[0], plan.com_position_m[1]];
    let ankles_m = plan.feet.map(|foot| [foot.ankle_position_m[0], foot.ankle_position_m[1]]);
    let between_m = [ankles_m[1][0] - ankles_m[0][0], ankles_m[1][1] - ankles_m[0][1]];
    let from_left_m = [com_m[0] - ankles_m[0][0], com_m[1] - ankles_m[0][1]];
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let distance_squared_m2 = dot(between_m, between_m);
    if distance_squared_m2 == 0.0 {
        return;
    }
    let right = (dot(from_left_m, between_m) / distance_squared_m2).clamp(0.0, 1.0);
    let off_line_m = [0, 1].map(|axis| from_left_m[axis] - right * between_m[axis]);
    let weight_n: f64 = plan.feet.iter().map(|foot| foot.wrench_n_nm[2]).sum();
    let blend = |was: f64, at_rest: f64| share * was + (1.0 - share) * at_rest;
    for (foot, at_rest) in plan.feet.iter_mut().zip([1.0 - right, right]) {
        foot.load_share = blend(foot.load_share, at_rest);
        let force_n = at_rest * weight_n;
        // A vertical force beside the ankle.
        let wrench = [0.0, 0.0, force_n, off_line_m[1] * force_n, -off_line_m[0] * force_n, 0.0];
        for (number, at_rest) in foot.wrench_n_nm.iter_mut().zip(wrench) {
            *number = blend(*number, at_rest);
        }
    }
    for (axis, zmp_m) in plan.zmp_m.iter_mut().enumerate() {
        *zmp_m = blend(*zmp_m, com_m[axis]);
    }
}

/// Where the soles have moved to `age_ticks` after the last deformation, by its own twists and accelerations. Loads, forces and compliances
/// stay. The header stays, too: it says which message was used.
#[must_use]
pub fn deformation_instead(last: &SoleDeformation, age_ticks: i64) -> SoleDeformation {
    let mut deformation = *last;
    if age_ticks <= 0 {
        return deformation;
    }
    let dt_s = age_ticks.min(HOLD_AFTER_TICKS) as f64 * CONTROL_PERIOD_S;
    for foot in &mut deformation.feet {
        let (twist, acceleration) = (foot.ankle_twist_m_rad_per_s, foot.ankle_acceleration_m_rad_per_s2);
        let moved = |i: usize| dt_s * twist[i] + 0.5 * dt_s * dt_s * acceleration[i];
        for (axis, position_m) in foot.ankle_position_m.iter_mut().enumerate() {
            *position_m += moved(axis);
        }
        let turn_rad = Vec3::new(moved(3), moved(4), moved(5));
        foot.ankle_rotation = row_major(&(so3::exp(&turn_rad) * from_row_major(&foot.ankle_rotation)));
        for (i, rate) in foot.ankle_twist_m_rad_per_s.iter_mut().enumerate() {
            *rate += dt_s * acceleration[i];
        }
    }
    deformation
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Header;

    #[test]
    fn joints_go_on_come_to_rest_and_torques_fade() {
        let mut last = RobotCommand { header: Header::new(7, 1), joint_count: 2, ..RobotCommand::default() };
        last.joint_position_reference_rad[..2].copy_from_slice(&[0.1, -0.2]);
        last.joint_velocity_reference_rad_per_s[..2].copy_from_slice(&[1.0, -2.0]);
        last.feed_forward_torque_nm[..2].copy_from_slice(&[10.0, -20.0]);
        assert_eq!(command_instead(&last, 0), last);
        assert_eq!(command_instead(&last, -3), last);
        let mut before_rad = last.joint_position_reference_rad[0];
        for (missing, share) in (1..).zip([1.0, 1.0, 0.75, 0.5, 0.25, 0.0, 0.0]) {
            let now = command_instead(&last, missing);
            let moved_rad = now.joint_position_reference_rad[0] - before_rad;
            assert!((moved_rad - share * CONTROL_PERIOD_S).abs() < 1e-15, "{missing}: {moved_rad}");
            assert_eq!(now.joint_velocity_reference_rad_per_s[1], -2.0 * share, "{missing}");
            assert_eq!(now.feed_forward_torque_nm[1], -20.0 * share, "{missing}");
            assert_eq!(now.header, last.header);
            assert_eq!(brought_to_rest(&last, missing).feed_forward_torque_nm, last.feed_forward_torque_nm);
            before_rad = now.joint_position_reference_rad[0];
        }
        assert_eq!(command_instead(&last, i64::MAX), command_instead(&last, HOLD_AFTER_TICKS));
    }

    #[test]
    fn the_plan_comes_to_rest_with_the_zmp_under_the_centre_of_mass() {
        let mut last = RobotCommand::default();
        let plan = &mut last.plan;
        plan.com_position_m = [0.52, 0.02, 0.78];
        plan.com_velocity_m_per_s = [0.1, -0.2, 0.0];
        plan.com_acceleration_m_per_s2 = [0.5, 1.0, 0.0];
        plan.zmp_m = [0.5, 0.08];
        for (foot, y_m) in plan.feet.iter_mut().zip([0.08, -0.08]) {
            (foot.loaded, foot.ankle_position_m) = (1, [0.5, y_m, 0.1]);
        }
        plan.feet[0].load_share = 1.0;
        plan.feet[0].wrench_n_nm = [3.0, -5.0, 380.0, 1.0, 2.0, 3.0];
        let plan = last.plan;
        let (moved, rest) = (brought_to_rest(&last, 2).plan, brought_to_rest(&last, 8).plan);
        assert_eq!(
            (moved.com_velocity_m_per_s, moved.zmp_m, moved.feet),
            (plan.com_velocity_m_per_s, plan.zmp_m, plan.feet)
        );
        assert!((moved.com_position_m[1] - (0.02 - 0.002)).abs() < 1e-15);
        // Two whole ticks, and three of 1.5 together.
        let com_m = [0.52 + 3.5 * 0.0005, 0.02 - 3.5 * 0.001];
        for axis in 0..2 {
            assert!((rest.com_position_m[axis] - com_m[axis]).abs() < 1e-15);
            assert!((rest.zmp_m[axis] - com_m[axis]).abs() < 1e-15);
        }
        assert_eq!((rest.com_velocity_m_per_s, rest.com_acceleration_m_per_s2), ([0.0; 3], [0.0; 3]));
        let shares = rest.feet.map(|foot| foot.load_share);
        assert!((shares[1] - (0.08 - com_m[1]) / 0.16).abs() < 1e-12 && (shares[0] + shares[1] - 1.0).abs() < 1e-15);
        // The wrenches' own ZMP is that of the plan.
        let mut moment_nm = [0.0; 2];
        for foot in &rest.feet {
            let (at, w) = (foot.ankle_position_m, foot.wrench_n_nm);
            moment_nm[0] += w[3] + at[1] * w[2];
            moment_nm[1] += w[4] - at[0] * w[2];
        }
        let zmp_m = [-moment_nm[1] / 380.0, moment_nm[0] / 380.0];
        assert!((zmp_m[0] - com_m[0]).abs() < 1e-12 && (zmp_m[1] - com_m[1]).abs() < 1e-12, "{zmp_m:?}");
        // On one foot there is nothing to share.
        last.plan.feet[1].loaded = 0;
        let on_one = brought_to_rest(&last, 8).plan;
        assert_eq!((on_one.feet, on_one.zmp_m), (last.plan.feet, last.plan.zmp_m));
    }

    #[test]
    fn soles_move_on_as_constant_acceleration_has_it() {
        let mut last = SoleDeformation { header: Header::new(7, 1), ..SoleDeformation::default() };
        for foot in &mut last.feet {
            foot.ankle_rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
            foot.ankle_twist_m_rad_per_s = [0.2, 0.0, -0.1, 0.0, 0.0, 0.5];
            foot.ankle_acceleration_m_rad_per_s2 = [4.0, 0.0, 0.0, 0.0, 0.0, 10.0];
        }
        assert_eq!(deformation_instead(&last, 0), last);
        let moved = deformation_instead(&last, 2);
        let foot = &moved.feet[1];
        // Over 10 ms.
        assert!((foot.ankle_position_m[0] - (0.002 + 0.0002)).abs() < 1e-15);
        assert!((foot.ankle_position_m[2] + 0.001).abs() < 1e-15);
        let yaw_rad = foot.ankle_rotation[3].atan2(foot.ankle_rotation[0]);
        assert!((yaw_rad - (0.005 + 0.0005)).abs() < 1e-12, "{yaw_rad}");
        assert!((foot.ankle_twist_m_rad_per_s[0] - 0.24).abs() < 1e-15);
        assert!((foot.ankle_twist_m_rad_per_s[5] - 0.6).abs() < 1e-15);
        assert_eq!((moved.header, foot.planned_zmp_m), (last.header, last.feet[1].planned_zmp_m));
    }

    #[test]
    fn after_ten_ticks_it_is_held_and_after_forty_over() {
        let answers = [(0, Answer::Present), (1, Answer::GoOn), (9, Answer::GoOn), (10, Answer::Hold)];
        for (missing, answer) in answers.into_iter().chain([(39, Answer::Hold), (40, Answer::Stop)]) {
            assert_eq!(Answer::after(missing), answer, "{missing}");
        }
    }
}
