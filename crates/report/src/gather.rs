//! From messages to figures.

use crate::figures::{ClockTimes, ControllerSteps, Feedback, Lateness, ProcessTimes, WalkFigures};
use crate::limbs::BitTicks;
use crate::{Estimates, ReportSettings, Tracking, Verdict};
use messages::code::{Fall, Limit, Mode, Process, Reason};
use messages::{
    CONTROL_PERIOD_NS, CONTROL_PERIOD_S, Health, LatenessFigures, PatternHeader, PatternPhase, RobotCommand,
    RobotState, SoleDeformation, Truth, WalkStart,
};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// A message, whatever its topic.
#[derive(Debug, Clone, Copy)]
pub enum Said<'a> {
    /// The walk.
    Pattern(&'a PatternHeader, &'a [PatternPhase]),
    /// Time zero.
    Start(&'a WalkStart),
    /// Sensors.
    State(&'a RobotState),
    /// Soles.
    Deformation(&'a SoleDeformation),
    /// References.
    Command(&'a RobotCommand),
    /// What really was.
    Truth(&'a Truth),
    /// How a process is.
    Health(&'a Health),
}

/// Gathers the figures of a walk. Messages of one topic come in their order; topics may come one after the other or mixed.
#[derive(Debug, Clone, Default)]
pub struct Gather {
    tracking: Tracking,
    estimates: Estimates,
    planned_distance_m: Option<f64>,
    duration_s: f64,
    tick_zero: Option<i64>,
    first: Option<Truth>,
    last: Option<Truth>,
    turned_rad: f64,
    at_limit: BitTicks,
    saturated: BitTicks,
    held_back: BitTicks,
    torques_held_back: BitTicks,
    /// Whether a command held the posture after the walk, and the walk time of the last one.
    finished: bool,
    commanded_s: f64,
    compute_ns: BTreeMap<u32, Vec<u64>>,
    health: BTreeMap<u32, Health>,
    /// Of the simulator: cycles after the first and the time that they took.
    paced: (u64, u64),
    joint_distance_max_rad: f64,
    feedback: Option<Feedback>,
}

impl Gather {
    /// Takes a message.
    pub fn take(&mut self, said: Said) {
        match said {
            Said::Pattern(header, phases) => {
                self.duration_s = header.duration_s;
                self.planned_distance_m = planned_distance_m(header, phases);
            }
            Said::Start(start) => self.tick_zero = Some(start.tick_zero),
            Said::State(_) => {}
            Said::Deformation(deformation) => {
                self.tracking.deformation(deformation);
                self.estimates.take(deformation);
            }
            Said::Command(command) => {
                self.tracking.command(command);
                self.held_back.add(command.joints_limited_bits);
                self.torques_held_back.add(command.torques_limited_bits);
                self.finished |= command.mode == Mode::Finished.code();
                self.commanded_s = self.commanded_s.max(command.walk_time_s);
            }
            Said::Truth(truth) => self.truth(truth),
            Said::Health(health) => self.health(health),
        }
    }

    fn truth(&mut self, truth: &Truth) {
        self.tracking.truth(truth);
        self.first.get_or_insert(*truth);
        let before = self.last.replace(*truth).unwrap_or(*truth);
        let turned_rad = heading_rad(truth) - heading_rad(&before);
        // Nobody turns by half a round within a tick.
        self.turned_rad += turned_rad - TAU * (turned_rad / TAU).round();
        self.at_limit.add(truth.joints_at_limit_bits);
        self.saturated.add(truth.drives_saturated_bits);
    }

    fn health(&mut self, health: &Health) {
        let times = self.compute_ns.entry(health.process).or_default();
        let before = self.health.insert(health.process, *health);
        // While a process waits it repeats its health; each cycle counts once.
        if before.is_none_or(|before| health.cycles > before.cycles) && health.cycles > 0 {
            times.push(health.compute_time_ns);
            if health.process == Process::Simulator.code() && health.cycles > 1 {
                self.paced = (self.paced.0 + 1, self.paced.1 + health.cycle_time_ns);
            }
        }
        if health.walk_duration_s > 0.0 && self.duration_s == 0.0 {
            self.duration_s = health.walk_duration_s;
        }
        if health.process == Process::Controller.code() && health.cycles > 0 {
            let now = &health.controller;
            self.joint_distance_max_rad = self.joint_distance_max_rad.max(now.joint_distance_max_rad);
            if now.base_distance_m > 0.0 || now.measurements_refused > 0 {
                let feedback = self.feedback.get_or_insert(Feedback {
                    base_distance_max_m: 0.0,
                    base_distance_max_rad: 0.0,
                    measurements_refused: 0,
                });
                feedback.base_distance_max_m = feedback.base_distance_max_m.max(now.base_distance_m);
                feedback.base_distance_max_rad = feedback.base_distance_max_rad.max(now.base_distance_rad);
                feedback.measurements_refused = now.measurements_refused;
            }
        }
    }

    /// The figures that the processes themselves kept, from the last health of each: all that is known without a recording.
    #[must_use]
    pub fn of_health(healths: &[Health], settings: &ReportSettings) -> WalkFigures {
        let mut gather = Self::default();
        for health in healths {
            gather.duration_s = gather.duration_s.max(health.walk_duration_s);
            gather.commanded_s = gather.commanded_s.max(health.walk_time_s);
            gather.finished |= health.reason == Reason::Finished.code();
            gather.health.insert(health.process, *health);
        }
        gather.tick_zero = (gather.commanded_s > 0.0).then_some(0);
        let mut figures = gather.finish(settings);
        if let Some(health) = gather.health.get(&Process::Simulator.code()).filter(|health| health.cycles > 0) {
            let simulator = &health.simulator;
            (figures.distance_m, figures.fallen) = (Some(simulator.distance_m), Some(simulator.fallen == 1));
            if simulator.fallen == 1 {
                let cause = Fall::from_code(simulator.fall_cause).map_or("unknown cause", |fall| fall.word());
                (figures.fall_time_s, figures.fall_cause) = (Some(health.walk_time_s), Some(cause.to_string()));
                (figures.verdict, figures.verdict_reason) = gather.judge(&figures);
            }
        }
        figures
    }

    /// Walk time of a tick (s); of the time since tick 0 while there is no time zero.
    fn walk_time_s(&self, tick: i64) -> f64 {
        (tick - self.tick_zero.unwrap_or(0)) as f64 * CONTROL_PERIOD_S
    }

    /// The figures, judged.
    #[must_use]
    pub fn finish(&self, settings: &ReportSettings) -> WalkFigures {
        let tracking = &self.tracking;
        let reached_s = self.last.map_or(self.commanded_s, |truth| truth.walk_time_s);
        let fallen = self.last.map(|truth| truth.fallen == 1);
        let last = self.last.filter(|truth| truth.fallen == 1);
        let simulator = self.health.get(&Process::Simulator.code()).map(|health| health.simulator).unwrap_or_default();
        let recorder = self.health.get(&Process::Recorder.code());
        let mut figures = WalkFigures {
            verdict: Verdict::EndedEarly,
            verdict_reason: String::new(),
            distance_m: self.first.zip(self.last).map(|(first, last)| moved_m(&first, &last)),
            planned_distance_m: self.planned_distance_m,
            turned_rad: self.last.map(|_| self.turned_rad),
            walked_s: reached_s.clamp(0.0, self.duration_s),
            walk_duration_s: self.duration_s,
            fallen,
            fall_time_s: last.map(|truth| self.walk_time_s(truth.fall_tick)),
            fall_cause: last
                .map(|truth| Fall::from_code(truth.fall_cause).map_or("unknown cause", |fall| fall.word()).to_string()),
            com_error_rms_m: tracking.com_error_m.rms(),
            com_error_max_m: tracking.com_error_m.largest(),
            zmp_error_rms_m: tracking.zmp_error_m.rms(),
            zmp_error_max_m: tracking.zmp_error_m.largest(),
            zmp_error_max_time_s: tracking
                .zmp_error_m
                .largest()
                .map(|_| self.walk_time_s(tracking.zmp_error_m.max_tick)),
            zmp_error_allowed_m: settings.zmp_error_max_m,
            zmp_body_to_cart_rms_m: tracking.zmp_body_to_cart_m.rms(),
            zmp_body_to_cart_max_m: tracking.zmp_body_to_cart_m.largest(),
            base_tilt_max_rad: tracking.base_tilt_rad.largest(),
            ticks_compared: tracking.com_error_m.count,
            ticks_without_plan: tracking.ticks_without_plan(),
            servo_work_j: self.last.map(|truth| truth.servo_work_j),
            joints_at_limit: self.at_limit.worst_first(),
            drives_saturated: self.saturated.worst_first(),
            joints_held_back: self.held_back.worst_first(),
            torques_held_back: self.torques_held_back.worst_first(),
            periods_unconverged: simulator.periods_unconverged,
            commands_refused: simulator.commands_refused,
            sole_estimates: self.estimates,
            controller: self.controller_steps(),
            feedback: self.feedback,
            processes: self.process_times(),
            times_real_time: self.times_real_time(),
            messages_not_recorded: recorder.map_or(0, |health| health.lost),
        };
        (figures.verdict, figures.verdict_reason) = self.judge(&figures);
        figures
    }

    fn judge(&self, figures: &WalkFigures) -> (Verdict, String) {
        if let (Some(time_s), Some(cause)) = (figures.fall_time_s, &figures.fall_cause) {
            return (Verdict::Fell, format!("{cause}, {time_s:.2} s into the walk"));
        }
        let reason = self.health.values().map(|health| health.reason).find_map(|reason| {
            let reason = Reason::from_code(reason)?;
            let is_trouble = !matches!(reason, Reason::None | Reason::Finished | Reason::Asked);
            is_trouble.then(|| format!(": {reason}"))
        });
        let reason = reason.unwrap_or_default();
        if self.tick_zero.is_none() && !self.finished {
            return (Verdict::EndedEarly, format!("the walk was not begun{reason}"));
        }
        if !self.finished {
            let (walked_s, of_s) = (figures.walked_s, figures.walk_duration_s);
            return (Verdict::EndedEarly, format!("{walked_s:.2} of {of_s:.2} s were walked{reason}"));
        }
        let (Some(zmp_m), Some(time_s)) = (figures.zmp_error_max_m, figures.zmp_error_max_time_s) else {
            return (Verdict::Unjudged, "the recording holds no truth, or no plan for it".to_string());
        };
        let (zmp_mm, allowed_mm) = (1e3 * zmp_m, 1e3 * figures.zmp_error_allowed_m);
        let told =
            format!("the ZMP was up to {zmp_mm:.1} mm from its plan, at {time_s:.2} s; {allowed_mm:.0} mm are allowed");
        let verdict = if zmp_m > figures.zmp_error_allowed_m { Verdict::OffPlan } else { Verdict::Walked };
        (verdict, told)
    }

    fn controller_steps(&self) -> Option<ControllerSteps> {
        let health = self.health.get(&Process::Controller.code()).filter(|health| health.cycles > 0)?;
        let now = &health.controller;
        let limit = Limit::from_code(now.worst_limit).filter(|limit| *limit != Limit::None);
        Some(ControllerSteps {
            solved: now.steps_solved,
            relaxed: now.steps_relaxed,
            held: now.steps_held,
            by_backup: now.steps_by_backup,
            worst_limit: limit.map_or(String::new(), |limit| limit.to_string()),
            worst_limit_index: now.worst_limit_index,
            worst_limit_amount: now.worst_limit_amount,
            joint_distance_max_rad: self.joint_distance_max_rad,
            states_refused: now.states_refused,
        })
    }

    fn process_times(&self) -> BTreeMap<String, ProcessTimes> {
        let mut processes = BTreeMap::new();
        for (code, health) in self.health.iter().filter(|(_, health)| health.cycles > 0) {
            let Some(process) = Process::from_code(*code) else { continue };
            let mut sorted = self.compute_ns.get(code).cloned().unwrap_or_default();
            sorted.sort_unstable();
            let at = |part: f64| {
                let last = sorted.len().checked_sub(1)?;
                Some(sorted[(last as f64 * part) as usize] as f64 * 1e-6)
            };
            let times = ProcessTimes {
                cycles: health.cycles,
                mean_ms: health.compute_time_sum_ns as f64 * 1e-6 / health.cycles as f64,
                median_ms: at(0.5),
                p99_ms: at(0.99),
                max_ms: health.compute_time_max_ns as f64 * 1e-6,
                over_period: sorted.iter().filter(|time| **time > CONTROL_PERIOD_NS).count() as u64,
                misses: health.misses,
                late: health.late,
                clock: clock(health),
            };
            processes.insert(process.word().to_string(), times);
        }
        processes
    }

    fn times_real_time(&self) -> Option<f64> {
        let (cycles, time_ns) = self.paced;
        (time_ns > 0).then(|| (cycles * CONTROL_PERIOD_NS) as f64 / time_ns as f64)
    }
}

/// How a process kept the clock, as it said itself; `None` if no tick had a time.
fn clock(health: &Health) -> Option<ClockTimes> {
    let some = |ns: u64| (ns > 0).then_some(ns);
    let told = |figures: &LatenessFigures| Lateness {
        count: figures.count,
        p50_ns: some(figures.p50_ns),
        p99_ns: some(figures.p99_ns),
        p999_ns: some(figures.p999_ns),
        max_ns: figures.max_ns,
    };
    let timing = &health.timing;
    (timing.woke.count > 0).then(|| ClockTimes {
        woke: told(&timing.woke),
        inputs: told(&timing.inputs),
        published: told(&timing.published),
        processor: told(&timing.processor),
        late_wakes: health.late_wakes,
        late_answers: health.late_answers,
        slips: health.clock_slips,
        page_faults: [health.minor_faults, health.major_faults],
        priority: health.real_time_priority,
        core: health.core_plus_one.checked_sub(1),
        memory_locked: health.memory_locked == 1,
    })
}

/// Where the body faces.
fn heading_rad(truth: &Truth) -> f64 {
    truth.base_rotation[3].atan2(truth.base_rotation[0])
}

/// How far the middle of the soles has moved.
fn moved_m(first: &Truth, last: &Truth) -> f64 {
    let middle = |truth: &Truth| {
        let [left, right] = truth.sole_position_m;
        [0.5 * (left[0] + right[0]), 0.5 * (left[1] + right[1])]
    };
    let (from, to) = (middle(first), middle(last));
    (to[0] - from[0]).hypot(to[1] - from[1])
}

/// The same as the pattern has it.
fn planned_distance_m(header: &PatternHeader, phases: &[PatternPhase]) -> Option<f64> {
    let middle = |phase: &PatternPhase| {
        let soles = [0, 1].map(|foot| {
            let [x, y, yaw] = phase.feet[foot].ankle_foothold;
            let ([ankle_x, ankle_y], (sin, cos)) = (header.ankle_in_sole_m[foot], yaw.sin_cos());
            [x - (cos * ankle_x - sin * ankle_y), y - (sin * ankle_x + cos * ankle_y)]
        });
        [0, 1].map(|axis| 0.5 * (soles[0][axis] + soles[1][axis]))
    };
    let (from, to) = (middle(phases.first()?), middle(phases.last()?));
    Some((to[0] - from[0]).hypot(to[1] - from[1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::Header;
    use messages::code::State;

    fn health(process: Process) -> Health {
        Health::new(process, State::Running, Reason::None)
    }

    /// A walk of 100 ticks that ends as it should, its ZMP off by so much.
    fn walk(zmp_error_m: f64) -> Gather {
        let mut gather = Gather::default();
        let mut phases = [PatternPhase::default(); 2];
        phases[1].feet.iter_mut().for_each(|foot| foot.ankle_foothold = [0.5, 0.0, 0.0]);
        gather.take(Said::Pattern(&PatternHeader { duration_s: 0.5, ..PatternHeader::default() }, &phases));
        gather.take(Said::Start(&WalkStart::default()));
        for tick in 0..110 {
            let mode = if tick > 100 { Mode::Finished } else { Mode::Walking };
            let header = Header::new(tick, 7);
            gather.take(Said::Command(&RobotCommand { header, mode: mode.code(), ..RobotCommand::default() }));
            let mut truth = Truth { header, walk_time_s: tick as f64 * CONTROL_PERIOD_S, ..Truth::default() };
            truth.zmp_m = if tick == 50 { [zmp_error_m, 0.0] } else { [0.0; 2] };
            truth.sole_position_m = [[0.005 * tick as f64, 0.0, 0.0]; 2];
            gather.take(Said::Truth(&truth));
        }
        gather
    }

    #[test]
    fn a_walk_is_judged_by_its_zmp_and_its_end() {
        let figures = walk(0.149).finish(&ReportSettings::default());
        assert_eq!(figures.verdict, Verdict::Walked);
        assert!((figures.zmp_error_max_m.unwrap() - 0.149).abs() < 1e-12);
        assert!((figures.planned_distance_m.unwrap() - 0.5).abs() < 1e-12);
        assert!((figures.distance_m.unwrap() - 0.545).abs() < 1e-12);
        let off = walk(0.151).finish(&ReportSettings::default());
        assert_eq!(off.verdict, Verdict::OffPlan);
        assert!(
            off.verdict_reason.contains("151.0 mm") && off.verdict_reason.contains("0.25 s"),
            "{}",
            off.verdict_reason
        );
        let strict = ReportSettings { zmp_error_max_m: 0.1 };
        assert_eq!(walk(0.149).finish(&strict).verdict, Verdict::OffPlan);
    }

    #[test]
    fn falls_early_ends_and_robots_without_truth_are_told_apart() {
        let mut fallen = walk(0.0);
        let truth = Truth { fallen: 1, fall_tick: 60, fall_cause: 2, ..Truth::default() };
        fallen.take(Said::Truth(&truth));
        let figures = fallen.finish(&ReportSettings::default());
        assert_eq!((figures.verdict, figures.fallen), (Verdict::Fell, Some(true)));
        assert_eq!(figures.verdict_reason, "tilted too far, 0.30 s into the walk");

        let mut early = Gather::default();
        early.take(Said::Truth(&Truth::default()));
        let figures = early.finish(&ReportSettings::default());
        assert_eq!((figures.verdict, figures.verdict_reason.as_str()), (Verdict::EndedEarly, "the walk was not begun"));
        early.take(Said::Start(&WalkStart::default()));
        let stopped = Health { reason: Reason::NotSettled.code(), ..health(Process::Controller) };
        early.take(Said::Health(&stopped));
        let figures = early.finish(&ReportSettings::default());
        assert_eq!(figures.verdict_reason, "0.00 of 0.00 s were walked: did not settle");

        let mut real = Gather::default();
        real.take(Said::Start(&WalkStart::default()));
        real.take(Said::Command(&RobotCommand { mode: Mode::Finished.code(), ..RobotCommand::default() }));
        let figures = real.finish(&ReportSettings::default());
        assert_eq!((figures.verdict, figures.fallen, figures.distance_m), (Verdict::Unjudged, None, None));
        assert_eq!(figures.com_error_rms_m, None);
    }

    #[test]
    fn without_a_recording_the_processes_own_figures_are_told() {
        let mut simulator =
            Health { cycles: 3439, walk_time_s: 14.0, walk_duration_s: 14.0, ..health(Process::Simulator) };
        simulator.reason = Reason::Finished.code();
        simulator.simulator.distance_m = 0.5;
        (simulator.compute_time_sum_ns, simulator.compute_time_max_ns) = (3_439_000_000, 7_000_000);
        let figures = Gather::of_health(&[simulator], &ReportSettings::default());
        assert_eq!((figures.verdict, figures.distance_m, figures.fallen), (Verdict::Unjudged, Some(0.5), Some(false)));
        let times = figures.processes["simulator"];
        assert_eq!((times.mean_ms, times.median_ms, times.max_ms), (1.0, None, 7.0));
        (simulator.simulator.fallen, simulator.simulator.fall_cause, simulator.walk_time_s) = (1, 2, 3.5);
        let figures = Gather::of_health(&[simulator], &ReportSettings::default());
        assert_eq!(
            (figures.verdict, figures.verdict_reason.as_str()),
            (Verdict::Fell, "tilted too far, 3.50 s into the walk")
        );
    }

    #[test]
    fn times_are_of_cycles_not_of_messages() {
        let mut gather = Gather::default();
        for cycle in 1..=100 {
            let compute_time_ns = cycle * 10_000;
            let health = Health {
                cycles: cycle,
                compute_time_ns,
                compute_time_max_ns: compute_time_ns,
                cycle_time_ns: 2_500_000,
                ..health(Process::Simulator)
            };
            // Said again while it waits.
            gather.take(Said::Health(&health));
            gather.take(Said::Health(&health));
        }
        let figures = gather.finish(&ReportSettings::default());
        let times = figures.processes["simulator"];
        assert_eq!((times.cycles, times.median_ms, times.p99_ms, times.max_ms), (100, Some(0.5), Some(0.99), 1.0));
        assert_eq!(figures.times_real_time, Some(2.0));
    }

    #[test]
    fn turning_is_counted_beyond_half_a_round() {
        let mut gather = Gather::default();
        for step in 0..=40 {
            let (sin, cos) = (0.1 * f64::from(step) + 3.0).sin_cos();
            let base_rotation = [cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0];
            gather.take(Said::Truth(&Truth { base_rotation, ..Truth::default() }));
        }
        assert!((gather.finish(&ReportSettings::default()).turned_rad.unwrap() - 4.0).abs() < 1e-12);
    }

    #[test]
    fn feedback_is_told_by_its_largest_distances_and_open_loop_has_none() {
        let mut gather = Gather::default();
        let mut controller = Health { cycles: 20, ..health(Process::Controller) };
        gather.take(Said::Health(&controller));
        assert_eq!(gather.finish(&ReportSettings::default()).feedback, None);
        for (base_distance_m, base_distance_rad, measurements_refused) in [(0.012, 0.01, 3), (0.002, 0.05, 7)] {
            let figures = &mut controller.controller;
            (figures.base_distance_m, figures.base_distance_rad) = (base_distance_m, base_distance_rad);
            figures.measurements_refused = measurements_refused;
            gather.take(Said::Health(&controller));
        }
        let feedback = gather.finish(&ReportSettings::default()).feedback.expect("closed loop");
        assert_eq!((feedback.base_distance_max_m, feedback.base_distance_max_rad), (0.012, 0.05));
        assert_eq!(feedback.measurements_refused, 7);
    }

    #[test]
    fn figures_survive_the_way_through_json() {
        let figures = walk(0.1).finish(&ReportSettings::default());
        let text = serde_json::to_string(&figures).expect("numbers and words");
        assert_eq!(serde_json::from_str::<WalkFigures>(&text).expect("the same"), figures);
        assert!(text.contains(r#""verdict":"walked""#), "{text}");
    }
}
