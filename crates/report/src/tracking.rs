//! How far the robot was from its plan.

use crate::Spread;
use messages::code::Mode;
use messages::timing::REACHED_TICKS;
use messages::{Plan, RobotCommand, SoleDeformation, Truth};
use std::collections::BTreeMap;

/// Errors over a walk, whatever the order in which commands, truths and deformations come.
#[derive(Debug, Clone, Default)]
pub struct Tracking {
    /// Horizontal distance of the centre of mass from its plan (m).
    pub com_error_m: Spread,
    /// Distance of the zero-moment point from its plan (m).
    pub zmp_error_m: Spread,
    /// Angle between the base's vertical axis and its plan (rad).
    pub base_tilt_rad: Spread,
    /// Distance of the computed zero-moment point from the pattern's (m).
    pub zmp_body_to_cart_m: Spread,
    /// By the tick that reaches the plan.
    commands: BTreeMap<i64, Planned>,
    truths: BTreeMap<i64, Real>,
    /// By the tick that it is for: the pattern's ZMP.
    carts: BTreeMap<i64, [f64; 2]>,
    /// By the tick that the plan is for: the computed ZMP.
    bodies: BTreeMap<i64, [f64; 2]>,
    fall_tick: Option<i64>,
}

#[derive(Debug, Clone, Copy)]
struct Planned {
    com_m: [f64; 2],
    zmp_m: [f64; 2],
    up: [f64; 3],
    finished: bool,
}

#[derive(Debug, Clone, Copy)]
struct Real {
    com_m: [f64; 2],
    zmp_m: [f64; 2],
    up: [f64; 3],
}

impl Tracking {
    /// Takes a command.
    pub fn command(&mut self, command: &RobotCommand) {
        let Plan { com_position_m, zmp_m, base_rotation, .. } = command.plan;
        let tick = command.header.tick;
        let finished = command.mode == Mode::Finished.code();
        let com_m = [com_position_m[0], com_position_m[1]];
        let planned = Planned { com_m, zmp_m, up: axis_z(&base_rotation), finished };
        self.commands.insert(tick + REACHED_TICKS, planned);
        self.compare(tick + REACHED_TICKS);
        if command.walk_time_s >= 0.0 {
            self.bodies.insert(tick + 1, zmp_m);
            self.compare_cart(tick + 1);
        }
    }

    /// Takes what the robot really did.
    pub fn truth(&mut self, truth: &Truth) {
        if truth.fallen == 1 {
            self.fall_tick = Some(truth.fall_tick);
        }
        let tick = truth.header.tick;
        let walking = truth.walk_time_s >= 0.0 && truth.fallen == 0;
        if !walking {
            self.commands.remove(&tick);
            return;
        }
        let [x, y, _] = truth.com_position_m;
        self.truths.insert(tick, Real { com_m: [x, y], zmp_m: truth.zmp_m, up: axis_z(&truth.base_rotation) });
        self.compare(tick);
    }

    /// Takes what the estimator was given by the pattern.
    pub fn deformation(&mut self, deformation: &SoleDeformation) {
        let cart = [0, 1]
            .map(|axis| deformation.feet.iter().map(|foot| foot.load_share * foot.planned_zmp_m[axis]).sum::<f64>());
        self.carts.insert(deformation.header.tick, cart);
        self.compare_cart(deformation.header.tick);
    }

    /// Ticks of the walk whose plan is not known.
    #[must_use]
    pub fn ticks_without_plan(&self) -> u64 {
        self.truths.len() as u64
    }

    fn compare(&mut self, tick: i64) {
        if let (Some(planned), Some(real)) = (self.commands.get(&tick), self.truths.get(&tick)) {
            if !planned.finished {
                self.com_error_m.add(tick, apart(planned.com_m, real.com_m));
                self.zmp_error_m.add(tick, apart(planned.zmp_m, real.zmp_m));
                let cosine: f64 = planned.up.iter().zip(real.up).map(|(a, b)| a * b).sum();
                self.base_tilt_rad.add(tick, cosine.clamp(-1.0, 1.0).acos());
            }
            self.commands.remove(&tick);
            self.truths.remove(&tick);
        }
    }

    fn compare_cart(&mut self, tick: i64) {
        if let (Some(body), Some(cart)) = (self.bodies.get(&tick), self.carts.get(&tick)) {
            if self.fall_tick.is_none_or(|fall| tick < fall) {
                self.zmp_body_to_cart_m.add(tick, apart(*body, *cart));
            }
            self.bodies.remove(&tick);
            self.carts.remove(&tick);
        }
    }
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Column z of a rotation, row-major.
fn axis_z(rotation: &[f64; 9]) -> [f64; 3] {
    [rotation[2], rotation[5], rotation[8]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::Header;

    fn command(tick: i64, com_m: f64) -> RobotCommand {
        let mut command = RobotCommand { header: Header::new(tick, 7), ..RobotCommand::default() };
        command.plan.com_position_m = [com_m, 2.0, 0.8];
        command.plan.zmp_m = [1.0, 2.0];
        command
    }

    fn truth(tick: i64) -> Truth {
        let mut truth = Truth { header: Header::new(tick, 7), ..Truth::default() };
        (truth.com_position_m, truth.zmp_m) = ([1.003, 2.004, 9.0], [1.0, 2.0]);
        truth
    }

    #[test]
    fn a_plan_is_held_against_the_truth_that_reaches_it() {
        let mut forwards = Tracking::default();
        for tick in 2..6 {
            forwards.command(&command(tick, if tick == 4 { 1.0 } else { 1.003 }));
        }
        (2..9).for_each(|tick| forwards.truth(&truth(tick)));
        assert_eq!((forwards.com_error_m.count, forwards.com_error_m.max_tick), (4, 6));
        assert!((forwards.com_error_m.max - 0.005).abs() < 1e-12 && forwards.zmp_error_m.max == 0.0);
        assert_eq!(forwards.ticks_without_plan(), 3, "2, 3 and 8");
        let mut backwards = Tracking::default();
        (2..9).rev().for_each(|tick| backwards.truth(&truth(tick)));
        (2..6).rev().for_each(|tick| backwards.command(&command(tick, if tick == 4 { 1.0 } else { 1.003 })));
        assert_eq!(backwards.com_error_m, forwards.com_error_m, "messages may come in any order");
    }

    #[test]
    fn errors_begin_at_time_zero_and_end_with_the_walk_or_the_fall() {
        let mut tracking = Tracking::default();
        for tick in 0..10 {
            let mode = if tick >= 6 { Mode::Finished } else { Mode::Walking };
            tracking.command(&RobotCommand { mode: mode.code(), ..command(tick, 1.0) });
        }
        for tick in 0..12 {
            let walk_time_s = 0.005 * (tick as f64 - 4.0);
            tracking.truth(&Truth { walk_time_s, ..truth(tick) });
        }
        assert_eq!(tracking.com_error_m.count, 4, "ticks 4 to 7: from 8 on the finished plan is reached");
        let mut fallen = Tracking::default();
        (0..10).for_each(|tick| fallen.command(&command(tick, 1.0)));
        for tick in 0..12 {
            fallen.truth(&Truth { fallen: u32::from(tick >= 5), fall_tick: 5, ..truth(tick) });
        }
        assert_eq!(fallen.com_error_m.count, 3, "ticks 2 to 4");
    }

    #[test]
    fn the_cart_table_is_held_against_each_plan_until_the_fall() {
        let mut tracking = Tracking::default();
        for tick in 5..10 {
            tracking.truth(&Truth { fallen: u32::from(tick >= 7), fall_tick: 7, ..truth(tick) });
            tracking.command(&command(tick - 1, 1.0));
            let mut deformation = SoleDeformation { header: Header::new(tick, 7), ..SoleDeformation::default() };
            deformation.feet[0].load_share = 1.0;
            deformation.feet[0].planned_zmp_m = [1.0, 2.03];
            tracking.deformation(&deformation);
        }
        assert_eq!(tracking.zmp_body_to_cart_m.count, 2, "ticks 5 and 6");
        assert!((tracking.zmp_body_to_cart_m.max - 0.03).abs() < 1e-12);
    }
}
