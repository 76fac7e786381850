//! What a walk was like, from health, truth, commands and deformations.

use messages::code::{Limit, Outcome, Process};
use messages::{CONTROL_PERIOD_S, Health, RobotCommand, SoleDeformation, Truth};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::time::Instant;

/// Figures of a walk, gathered while it goes on.
#[derive(Default)]
pub struct Summary {
    /// The first truth and when it came.
    first: Option<(Truth, Instant)>,
    last: Option<(Truth, Instant)>,
    /// How far the body has turned to the left (rad), also beyond half a round.
    turned_rad: f64,
    duration_s: f64,
    commands: BTreeMap<i64, RobotCommand>,
    com_error_m: Errors,
    zmp_error_m: Errors,
    cart_table_error_m: Errors,
    planned_zmp_m: BTreeMap<i64, [f64; 2]>,
    compute_ns: BTreeMap<u32, Vec<u64>>,
    misses: u64,
    steps: Option<ControllerSteps>,
    feedback: Feedback,
    estimates: Estimates,
    lost: u64,
    /// Truths, commands and deformations that came faster than they were listened to: they are missing here, not in the recording.
    pub unheard: u64,
}

/// How the controller's steps were found.
struct ControllerSteps {
    solved: u64,
    relaxed: u64,
    held: u64,
    /// Those of all that the reserve solver answered.
    by_reserve: u64,
    /// The worst limit that gave way: kind, which of its kind, by how much.
    worst: (Limit, u32, f64),
}

/// How far the controller's own state was from what it was drawn towards; all zero in open loop.
#[derive(Default)]
struct Feedback {
    base_max_m: f64,
    base_max_rad: f64,
    /// Measurements that were not used.
    refused: u64,
}

/// Root of the mean square, and the largest.
#[derive(Default)]
struct Errors {
    square_sum: f64,
    count: u64,
    max: f64,
}

impl Errors {
    fn add(&mut self, error: f64) {
        self.square_sum += error * error;
        self.count += 1;
        self.max = self.max.max(error);
    }

    fn root_mean_square(&self) -> f64 {
        (self.square_sum / self.count.max(1) as f64).sqrt()
    }
}

/// What the estimator's solver did, foot by foot under load.
#[derive(Default)]
struct Estimates {
    solved: u64,
    not_solved: u64,
    iterations: u64,
    iterations_max: u32,
    residual_max: f64,
}

impl Summary {
    /// Takes health of a process.
    pub fn health(&mut self, health: &Health) {
        if health.walk_duration_s > 0.0 {
            self.duration_s = health.walk_duration_s;
        }
        let times = self.compute_ns.entry(health.process).or_default();
        // While a process waits it repeats its health; each cycle counts once.
        if health.cycles > times.len() as u64 {
            times.push(health.compute_time_ns);
        }
        self.misses = self.misses.max(health.misses);
        if health.process == Process::Controller.code() && health.cycles > 0 {
            let figures = &health.controller;
            let worst = (
                Limit::from_code(figures.worst_limit).unwrap_or(Limit::None),
                figures.worst_limit_index,
                figures.worst_limit_amount,
            );
            self.steps = Some(ControllerSteps {
                solved: figures.steps_solved,
                relaxed: figures.steps_relaxed,
                held: figures.steps_held,
                by_reserve: figures.steps_by_backup,
                worst,
            });
            let feedback = &mut self.feedback;
            feedback.base_max_m = feedback.base_max_m.max(figures.base_distance_m);
            feedback.base_max_rad = feedback.base_max_rad.max(figures.base_distance_rad);
            feedback.refused = figures.measurements_refused;
        }
        if health.process == Process::Recorder.code() {
            self.lost = health.lost;
        }
    }

    /// Takes a command: its plan is for the tick after its own.
    pub fn command(&mut self, command: &RobotCommand) {
        let tick = command.header.tick + 1;
        self.commands.insert(tick, *command);
        if command.walk_time_s >= 0.0 {
            self.planned_zmp_m.insert(tick, command.plan.zmp_m);
        }
        while self.commands.len() > 512 {
            self.commands.pop_first();
        }
        while self.planned_zmp_m.len() > 512 {
            self.planned_zmp_m.pop_first();
        }
    }

    /// Takes what the estimator says. Plan and truth of the same tick must have come before.
    pub fn deformation(&mut self, deformation: &SoleDeformation) {
        let feet = &deformation.feet;
        let cart_table =
            [0, 1].map(|axis| feet.iter().map(|foot| foot.load_share * foot.planned_zmp_m[axis]).sum::<f64>());
        let tick = deformation.header.tick;
        let upright = self.last.is_some_and(|(truth, _)| truth.fallen == 0 || tick < truth.fall_tick);
        if let (Some(planned), true) = (self.planned_zmp_m.remove(&tick), upright) {
            self.cart_table_error_m.add(distance(&planned, &cart_table));
        }
        for foot in deformation.feet.iter().filter(|foot| foot.loaded == 1) {
            let estimates = &mut self.estimates;
            match Outcome::from_code(foot.status) {
                Some(Outcome::Solved) => {
                    estimates.solved += 1;
                    estimates.iterations += u64::from(foot.iterations);
                    estimates.iterations_max = estimates.iterations_max.max(foot.iterations);
                    estimates.residual_max = estimates.residual_max.max(foot.residual);
                }
                Some(Outcome::None) => {}
                _ => estimates.not_solved += 1,
            }
        }
    }

    /// Takes what the robot really did. The plan of the same tick must have come before.
    pub fn truth(&mut self, truth: &Truth) {
        let now = Instant::now();
        self.first.get_or_insert((*truth, now));
        let before = self.last.replace((*truth, now)).map_or(*truth, |(before, _)| before);
        let turned_rad = heading_rad(truth) - heading_rad(&before);
        // Nobody turns by half a round between two truths.
        self.turned_rad += turned_rad - TAU * (turned_rad / TAU).round();
        let tick = truth.header.tick;
        let command = self.commands.remove(&tick);
        let walking = command.is_some_and(|command| command.walk_time_s >= 0.0) && truth.fallen == 0;
        if let (Some(command), true) = (command, walking) {
            let plan = &command.plan;
            self.com_error_m.add(distance(&plan.com_position_m[..2], &truth.com_position_m[..2]));
            self.zmp_error_m.add(distance(&plan.zmp_m, &truth.zmp_m));
        }
    }

    /// How much of the walk is done, 0 to 1.
    pub fn done(&self) -> f64 {
        let walked_s = self.last.map_or(0.0, |(truth, _)| truth.walk_time_s);
        if self.duration_s > 0.0 { (walked_s / self.duration_s).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Whether the robot has fallen, and when on the simulated clock (s).
    pub fn fallen(&self) -> Option<f64> {
        let (truth, _) = self.last?;
        (truth.fallen == 1).then_some(truth.fall_tick as f64 * CONTROL_PERIOD_S)
    }

    /// Distance along the ground by which the middle of the soles has moved.
    pub fn distance_m(&self) -> f64 {
        let (Some((first, _)), Some((last, _))) = (self.first, self.last) else { return 0.0 };
        let middle = |truth: &Truth| -> [f64; 2] {
            let [left, right] = truth.sole_position_m;
            [0.5 * (left[0] + right[0]), 0.5 * (left[1] + right[1])]
        };
        distance(&middle(&first), &middle(&last))
    }

    /// Simulated time per real time.
    pub fn speed(&self) -> f64 {
        let (Some((first, start)), Some((last, end))) = (self.first, self.last) else { return 0.0 };
        let simulated_s = (last.header.tick - first.header.tick) as f64 * CONTROL_PERIOD_S;
        simulated_s / (end - start).as_secs_f64().max(f64::MIN_POSITIVE)
    }

    /// One line about the moment.
    pub fn line(&self) -> String {
        let Some((truth, _)) = self.last else { return "getting ready".to_string() };
        let worst_ns = self.compute_ns.values().flatten().max().copied().unwrap_or(0);
        let walked = if truth.walk_time_s < 0.0 {
            "settling".to_string()
        } else {
            format!("walked {:.1} of {:.1} s", truth.walk_time_s.min(self.duration_s), self.duration_s)
        };
        let (distance_m, speed) = (self.distance_m(), self.speed());
        format!("{walked} · {distance_m:.2} m · {speed:.2} x real time · worst tick {:.1} ms", worst_ns as f64 * 1e-6)
    }

    /// Whether anything was simulated.
    pub fn any(&self) -> bool {
        self.last.is_some()
    }

    /// The table at the end.
    pub fn table(&self) -> String {
        let mut table = String::new();
        let mut row = |name: &str, value: String| {
            // Writing to a string cannot fail.
            let _ = writeln!(table, "{name:<22} {value}");
        };
        let Some((truth, _)) = self.last else { return "no tick was simulated\n".to_string() };
        // In the tenths that are shown, and without the sign of a zero.
        let turned_deg = (10.0 * self.turned_rad.to_degrees()).round() / 10.0 + 0.0;
        let distance_m = self.distance_m();
        row("distance", format!("{distance_m:.3} m as the crow flies, turned by {turned_deg:.1} degrees"));
        row("walked", format!("{:.2} of {:.2} s", truth.walk_time_s.clamp(0.0, self.duration_s), self.duration_s));
        match self.fallen() {
            Some(time_s) => {
                let cause =
                    messages::code::Fall::from_code(truth.fall_cause).map_or("unknown cause", |fall| fall.word());
                row("fallen", format!("yes, {time_s:.2} s after the start: {cause}"));
            }
            None => row("fallen", "no".to_string()),
        }
        let millimetres = |errors: &Errors| {
            let (rms, max) = (1e3 * errors.root_mean_square(), 1e3 * errors.max);
            format!("{rms:.1} mm rms, {max:.1} mm max over {} ticks", errors.count)
        };
        row("COM, real to planned", millimetres(&self.com_error_m));
        // In its parts: else what the cart-table lacks (a swinging leg has angular momentum) would be blamed on the soles.
        row("ZMP, real to planned", millimetres(&self.zmp_error_m));
        row("ZMP, body to cart", millimetres(&self.cart_table_error_m));
        let estimates = &self.estimates;
        if estimates.solved + estimates.not_solved > 0 {
            let mean = estimates.iterations as f64 / estimates.solved.max(1) as f64;
            row(
                "sole estimates",
                format!(
                    "{} solved, {} not; {mean:.1} iterations mean, {} max; residual {:.1e} max",
                    estimates.solved, estimates.not_solved, estimates.iterations_max, estimates.residual_max
                ),
            );
        }
        if let Some(ControllerSteps { solved, relaxed, held, by_reserve, worst: (limit, index, amount) }) = self.steps {
            let worst = match limit {
                Limit::None => String::new(),
                Limit::Load | Limit::Contact => {
                    format!(" (worst: {limit} {} by {amount:.3e})", if index == 0 { "left" } else { "right" })
                }
                _ => format!(" (worst: {limit} {index} by {amount:.3e}; the controller's log has names)"),
            };
            let reserve =
                if by_reserve > 0 { format!("; {by_reserve} answered by the reserve solver") } else { String::new() };
            row("controller steps", format!("{solved} solved, {relaxed} relaxed{worst}, {held} held{reserve}"));
        }
        let Feedback { base_max_m, base_max_rad, refused } = self.feedback;
        if base_max_m > 0.0 || refused > 0 {
            let (base_mm, base_deg) = (1e3 * base_max_m, base_max_rad.to_degrees());
            let base = format!("observed base up to {base_mm:.1} mm, {base_deg:.2} deg from the own");
            row("feedback", format!("{base}; {refused} measurements not used"));
        }
        for (process, times) in &self.compute_ns {
            let (Some(process), false) = (Process::from_code(*process), times.is_empty()) else { continue };
            let mut sorted = times.clone();
            sorted.sort_unstable();
            let at = |part: f64| sorted[((sorted.len() - 1) as f64 * part) as usize] as f64 * 1e-6;
            let (median, p99, max) = (at(0.5), at(0.99), at(1.0));
            row(&format!("tick, {process}"), format!("{median:.3} ms median, {p99:.3} ms p99, {max:.3} ms max"));
        }
        row("speed", format!("{:.2} x real time", self.speed()));
        if self.misses > 0 {
            row("deadlines missed", format!("{} at most by one process", self.misses));
        }
        if self.lost > 0 {
            row("not recorded", format!("{} messages", self.lost));
        }
        if self.unheard > 0 {
            row("not in this summary", format!("{} messages: the launcher was held up", self.unheard));
        }
        table
    }
}

/// Where the body faces.
fn heading_rad(truth: &Truth) -> f64 {
    truth.base_rotation[3].atan2(truth.base_rotation[0])
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{ControllerFigures, Header};
    use messages::code::{Reason, State};
    use std::time::Duration;

    #[test]
    fn a_plan_is_held_against_the_truth_of_the_tick_it_is_for() {
        let mut summary = Summary::default();
        let mut command = RobotCommand { header: Header::new(4, 7), ..RobotCommand::default() };
        command.plan.com_position_m = [1.0, 2.0, 0.8];
        command.plan.zmp_m = [1.0, 2.0];
        summary.command(&command);
        let mut truth = Truth { header: Header::new(5, 7), ..Truth::default() };
        truth.com_position_m = [1.003, 2.004, 9.0];
        truth.zmp_m = [1.0, 2.0];
        summary.truth(&Truth { header: Header::new(4, 7), ..truth });
        assert_eq!(summary.com_error_m.count, 0, "no plan is for tick 4");
        summary.truth(&truth);
        assert!((summary.com_error_m.max - 0.005).abs() < 1e-12);
        assert_eq!(summary.zmp_error_m.max, 0.0);
    }

    #[test]
    fn the_controllers_steps_are_told_as_its_health_counts_them() {
        let mut summary = Summary::default();
        summary.truth(&Truth { header: Header::new(0, 7), ..Truth::default() });
        let mut health = Health::new(Process::Controller, State::Running, Reason::None);
        summary.health(&health);
        assert!(!summary.table().contains("controller steps"), "it has made none");
        health.cycles = 20;
        health.controller =
            ControllerFigures { steps_relaxed: 2, steps_held: 3, steps_solved: 15, ..ControllerFigures::default() };
        summary.health(&health);
        assert!(summary.table().contains("15 solved, 2 relaxed, 3 held\n"), "{}", summary.table());
        health.controller.worst_limit = Limit::Contact.code();
        (health.controller.worst_limit_index, health.controller.worst_limit_amount) = (1, 0.25);
        health.controller.steps_by_backup = 4;
        summary.health(&health);
        let told = "15 solved, 2 relaxed (worst: motion of standing ankle right by 2.500e-1), 3 held; 4 answered by the reserve solver";
        assert!(summary.table().contains(told), "{}", summary.table());
        (health.controller.worst_limit, health.controller.worst_limit_index) = (Limit::Torque.code(), 5);
        summary.health(&health);
        assert!(summary.table().contains("(worst: torque of joint 5 by"), "{}", summary.table());
        // Another process's figures mean something else.
        summary.health(&Health { process: Process::Simulator.code(), ..health });
        assert!(summary.table().contains("15 solved"), "{}", summary.table());
    }

    #[test]
    fn feedback_is_told_with_its_largest_distances_and_what_was_not_used_and_open_loop_has_none() {
        let mut summary = Summary::default();
        summary.truth(&Truth { header: Header::new(0, 7), ..Truth::default() });
        let mut health = Health::new(Process::Controller, State::Running, Reason::None);
        health.cycles = 20;
        summary.health(&health);
        assert!(!summary.table().contains("feedback"), "{}", summary.table());
        health.controller.measurements_refused = 3;
        (health.controller.base_distance_m, health.controller.base_distance_rad) = (0.012, 0.01);
        summary.health(&health);
        health.controller.measurements_refused = 7;
        (health.controller.base_distance_m, health.controller.base_distance_rad) = (0.002, 0.05);
        summary.health(&health);
        let told = "observed base up to 12.0 mm, 2.86 deg from the own; 7 measurements not used\n";
        assert!(summary.table().contains(told), "{}", summary.table());
    }

    #[test]
    fn times_are_of_cycles_and_what_was_lost_is_told() {
        let mut summary = Summary::default();
        summary.truth(&Truth { header: Header::new(0, 7), ..Truth::default() });
        let mut health = Health::new(Process::Estimator, State::Running, Reason::None);
        for cycle in 1..=100 {
            (health.cycles, health.compute_time_ns) = (cycle, cycle * 10_000);
            // Said again while it waits.
            summary.health(&health);
            summary.health(&health);
        }
        let told = "0.500 ms median, 0.990 ms p99, 1.000 ms max";
        assert!(summary.table().contains(told), "{}", summary.table());
        for absent in ["deadlines missed", "not recorded", "not in this summary"] {
            assert!(!summary.table().contains(absent), "{}", summary.table());
        }
        summary.health(&Health { misses: 4, lost: 9, ..health });
        assert!(!summary.table().contains("not recorded"), "only the recorder's losses are missing in the recording");
        summary.health(&Health { lost: 5, ..Health::new(Process::Recorder, State::Running, Reason::None) });
        summary.unheard = 6;
        let table = summary.table();
        for told in ["4 at most by one process", "5 messages\n", "6 messages: the launcher was held up"] {
            assert!(table.contains(told), "no `{told}` in {table}");
        }
    }

    #[test]
    fn estimates_count_feet_under_load_by_how_they_ended() {
        let mut summary = Summary::default();
        summary.truth(&Truth { header: Header::new(0, 7), ..Truth::default() });
        assert!(!summary.table().contains("sole estimates"));
        let mut deformation = SoleDeformation { header: Header::new(0, 7), ..SoleDeformation::default() };
        let [left, right] = &mut deformation.feet;
        (left.loaded, left.status, left.iterations, left.residual) = (1, Outcome::Solved.code(), 4, 1e-9);
        (right.loaded, right.status, right.iterations, right.residual) = (1, Outcome::Held.code(), 50, 1.0);
        summary.deformation(&deformation);
        let [left, right] = &mut deformation.feet;
        (left.iterations, left.residual, right.loaded) = (7, 3e-9, 0);
        summary.deformation(&deformation);
        let told = "2 solved, 1 not; 5.5 iterations mean, 7 max; residual 3.0e-9 max";
        assert!(summary.table().contains(told), "{}", summary.table());
    }

    #[test]
    fn speed_is_simulated_by_real_time_and_done_is_a_part_of_the_pattern() {
        let start = Instant::now();
        let truth = |tick| Truth { header: Header::new(tick, 7), walk_time_s: 1.5, ..Truth::default() };
        let mut summary = Summary::default();
        assert_eq!((summary.speed(), summary.done()), (0.0, 0.0));
        summary.first = Some((truth(100), start));
        summary.last = Some((truth(500), start + Duration::from_millis(500)));
        assert!((summary.speed() - 4.0).abs() < 1e-12, "400 ticks are 2 s: {}", summary.speed());
        summary.health(&Health { walk_duration_s: 6.0, ..Health::new(Process::Planner, State::Running, Reason::None) });
        assert_eq!(summary.done(), 0.25);
    }

    #[test]
    fn a_fall_and_the_distance_are_told() {
        let mut summary = Summary::default();
        let mut truth = Truth { header: Header::new(0, 7), ..Truth::default() };
        summary.truth(&truth);
        truth.sole_position_m = [[0.4, 0.0, 0.0], [0.2, 0.0, 0.0]];
        truth.fallen = 1;
        truth.fall_tick = 300;
        truth.fall_cause = 2;
        summary.truth(&truth);
        assert!((summary.distance_m() - 0.3).abs() < 1e-12);
        assert_eq!(summary.fallen(), Some(1.5));
        assert!(summary.table().contains("yes, 1.50 s after the start: tilted too far"), "{}", summary.table());
    }

    #[test]
    fn turning_is_counted_beyond_half_a_round() {
        let mut summary = Summary::default();
        for step in 0..=40 {
            let (sin, cos) = (0.1 * f64::from(step) + 3.0).sin_cos();
            let base_rotation = [cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0];
            summary.truth(&Truth { header: Header::new(step.into(), 7), base_rotation, ..Truth::default() });
        }
        assert!((summary.turned_rad - 4.0).abs() < 1e-12, "{}", summary.turned_rad);
    }

    #[test]
    fn the_cart_table_is_held_against_each_plan_until_the_robot_falls() {
        let mut summary = Summary::default();
        let fallen_from = 7;
        for tick in 5..10 {
            let mut command = RobotCommand { header: Header::new(tick - 1, 7), ..RobotCommand::default() };
            command.plan.zmp_m = [1.0, 2.0];
            summary.command(&command);
            let fallen = u32::from(tick >= fallen_from);
            summary.truth(&Truth { header: Header::new(tick, 7), fallen, fall_tick: fallen_from, ..Truth::default() });
        }
        // They come last, late even.
        for tick in 5..10 {
            let mut deformation = SoleDeformation { header: Header::new(tick, 7), ..SoleDeformation::default() };
            deformation.feet[0].load_share = 1.0;
            deformation.feet[0].planned_zmp_m = [1.0, 2.03];
            summary.deformation(&deformation);
        }
        assert_eq!(summary.cart_table_error_m.count, 2, "ticks 5 and 6");
        assert!((summary.cart_table_error_m.max - 0.03).abs() < 1e-12);
    }
}
