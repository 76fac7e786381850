//! What a command must be so that a robot could follow it: everything else is refused before it reaches plant and stabiliser.

use messages::{Plain, Plan, RobotCommand};
use spatial::{Mat3, Vec3};

/// A command that no robot could follow.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ImpossibleCommand {
    /// A number is not finite.
    #[error("a command with a number that is not finite")]
    NotFinite,
    /// It is for a robot with other joints.
    #[error("a command for {found} joints, the robot has {expected}")]
    Joints {
        /// In the command.
        found: u32,
        /// Of the robot.
        expected: usize,
    },
    /// It answers a state that has not been.
    #[error("a command for tick {found}, it is tick {now}")]
    Future {
        /// In the command.
        found: i64,
        /// The latest state's.
        now: i64,
    },
    /// A number is larger than anything that walks.
    #[error("a command whose plan has the number {0:e}, beyond {NUMBER_MAX:e}")]
    TooLarge(f64),
    /// Feet push; they do not pull.
    #[error("a command whose plan has {found_n} N pull on foot {foot}")]
    Pull {
        /// 0 left, 1 right.
        foot: usize,
        /// Vertical force (N).
        found_n: f64,
    },
    /// A share of the weight is a part of it.
    #[error("a command whose plan has a share of {found} of the load on foot {foot}")]
    Share {
        /// 0 left, 1 right.
        foot: usize,
        /// Share.
        found: f64,
    },
    /// A matrix that turns nothing.
    #[error("a command whose plan has no rotation where one belongs ({0})")]
    Rotation(&'static str),
    /// A foot that has no heading.
    #[error("a command whose plan has foot {foot} upright on its tip")]
    Upright {
        /// 0 left, 1 right.
        foot: usize,
    },
    /// The stabiliser's pendulum would hang.
    #[error("a command whose plan has the centre of mass at {com_m} m and an ankle at {ankle_m} m")]
    ComBelowAnkle {
        /// Height of the centre of mass (m).
        com_m: f64,
        /// Height of the higher ankle (m).
        ankle_m: f64,
    },
}

/// Positions, forces and moments beyond this (m, N, N m) are of no robot: a thousand kilometres, a hundred tons.
const NUMBER_MAX: f64 = 1e6;
/// Plans come from a solver: a force this little below zero is its rounding (N), a quarter of a percent of a light robot's weight.
const PULL_MAX_N: f64 = 1.0;
/// As little may a share of the load be off its range.
const SHARE_EXCESS_MAX: f64 = 1e-3;
/// By how much `R R'` may differ from one: matrices are products of many.
const ROTATION_ERROR_MAX: f64 = 1e-6;
/// Smallest horizontal part of a foot's x axis from which it still has a heading.
const HEADING_MIN: f64 = 0.1;

/// Could a robot with that many joints follow it at this tick?
pub(crate) fn check_command(command: &RobotCommand, joint_count: usize, now: i64) -> Result<(), ImpossibleCommand> {
    // It would be newer than all that come.
    if command.header.tick > now {
        return Err(ImpossibleCommand::Future { found: command.header.tick, now });
    }
    if !command.all_finite() {
        return Err(ImpossibleCommand::NotFinite);
    }
    if command.joint_count as usize != joint_count {
        return Err(ImpossibleCommand::Joints { found: command.joint_count, expected: joint_count });
    }
    check_plan(&command.plan)
}

fn check_plan(plan: &Plan) -> Result<(), ImpossibleCommand> {
    let vectors =
        [plan.base_position_m, plan.com_position_m, plan.com_velocity_m_per_s, plan.com_acceleration_m_per_s2];
    let of_feet = plan.feet.iter().flat_map(|foot| foot.wrench_n_nm.iter().chain(&foot.ankle_position_m));
    if let Some(large) = vectors.as_flattened().iter().chain(&plan.zmp_m).chain(of_feet).find(|x| x.abs() > NUMBER_MAX)
    {
        return Err(ImpossibleCommand::TooLarge(*large));
    }
    rotation(&plan.base_rotation, "base")?;
    for (foot, planned) in plan.feet.iter().enumerate() {
        let R_WA = rotation(&planned.ankle_rotation, ["left ankle", "right ankle"][foot])?;
        if R_WA.column(0).xy().norm() < HEADING_MIN {
            return Err(ImpossibleCommand::Upright { foot });
        }
        let found_n = planned.wrench_n_nm[2];
        if found_n < -PULL_MAX_N {
            return Err(ImpossibleCommand::Pull { foot, found_n });
        }
        let found = planned.load_share;
        if !(-SHARE_EXCESS_MAX..=1.0 + SHARE_EXCESS_MAX).contains(&found) {
            return Err(ImpossibleCommand::Share { foot, found });
        }
    }
    let com_m = plan.com_position_m[2];
    let ankle_m = plan.feet[0].ankle_position_m[2].max(plan.feet[1].ankle_position_m[2]);
    if com_m <= ankle_m {
        return Err(ImpossibleCommand::ComBelowAnkle { com_m, ankle_m });
    }
    Ok(())
}

fn rotation(row_major: &[f64; 9], whose: &'static str) -> Result<Mat3, ImpossibleCommand> {
    let R = messages::from_row_major(row_major);
    let columns: [Vec3; 3] = [0, 1, 2].map(|i| R.column(i).into());
    let right_handed = columns[0].cross(&columns[1]).dot(&columns[2]) > 0.0;
    let orthonormal = (R * R.transpose() - Mat3::identity()).amax() <= ROTATION_ERROR_MAX;
    if right_handed && orthonormal { Ok(R) } else { Err(ImpossibleCommand::Rotation(whose)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

    fn command() -> RobotCommand {
        let mut command = RobotCommand { joint_count: 30, ..RobotCommand::default() };
        command.plan.base_rotation = ONE;
        command.plan.com_position_m[2] = 0.79;
        for foot in &mut command.plan.feet {
            foot.ankle_rotation = ONE;
            foot.ankle_position_m[2] = 0.1;
            foot.load_share = 0.5;
            foot.wrench_n_nm[2] = 190.0;
        }
        command
    }

    #[test]
    fn what_no_robot_could_follow_is_refused_by_name() {
        assert_eq!(check_command(&command(), 30, 0), Ok(()));
        let refused = |change: fn(&mut RobotCommand)| {
            let mut changed = command();
            change(&mut changed);
            check_command(&changed, 30, 0).expect_err("impossible").to_string()
        };
        for (change, said) in [
            ((|c| c.plan.zmp_m[0] = f64::NAN) as fn(&mut RobotCommand), "not finite"),
            (|c| c.joint_count = 29, "29 joints"),
            (|c| c.header.tick = 1, "for tick 1, it is tick 0"),
            (|c| c.plan.feet[1].wrench_n_nm[4] = 1e300, "1e300"),
            (|c| c.plan.feet[0].wrench_n_nm[2] = -5.0, "-5 N pull on foot 0"),
            (|c| c.plan.feet[1].load_share = 1.5, "share of 1.5"),
            (|c| c.plan.base_rotation = [0.0; 9], "no rotation where one belongs (base)"),
            (|c| c.plan.feet[1].ankle_rotation[0] = -1.0, "(right ankle)"),
            (|c| c.plan.feet[0].ankle_rotation = [0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0], "upright"),
            (|c| c.plan.com_position_m[2] = 0.05, "0.05 m and an ankle at 0.1 m"),
        ] {
            let message = refused(change);
            assert!(message.contains(said), "no `{said}` in {message}");
        }
        let mut rounded = command();
        rounded.plan.feet[0].wrench_n_nm[2] = -1e-9;
        assert_eq!(check_command(&rounded, 30, 0), Ok(()));
    }
}
