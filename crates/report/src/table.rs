//! The figures as a table for a terminal; its rows are also those of the page.

use crate::WalkFigures;
use crate::figures::{ClockTimes, Lateness};
use crate::limbs::JointTicks;
use std::fmt::Write;

/// The table, a line per row.
#[must_use]
pub fn table(figures: &WalkFigures) -> String {
    let mut table = String::new();
    for (name, value) in rows(figures, &[]) {
        // Writing to a string cannot fail.
        let _ = writeln!(table, "{name:<22} {value}");
    }
    table
}

/// Name and value of each figure that there is. `joints` are the names of the joints, if they are known.
pub(crate) fn rows(figures: &WalkFigures, joints: &[String]) -> Vec<(String, String)> {
    let mut rows = vec![("verdict".to_string(), format!("{}: {}", figures.verdict, figures.verdict_reason))];
    let mut row = |name: &str, value: String| rows.push((name.to_string(), value));
    let planned = figures.planned_distance_m.map(|metres| format!(" of {metres:.3} planned")).unwrap_or_default();
    if let (Some(distance_m), Some(turned_rad)) = (figures.distance_m, figures.turned_rad) {
        // In the tenths that are shown, and without the sign of a zero.
        let turned_deg = (10.0 * turned_rad.to_degrees()).round() / 10.0 + 0.0;
        row("distance", format!("{distance_m:.3}{planned} m as the crow flies, turned by {turned_deg:.1} degrees"));
    } else if let Some(metres) = figures.planned_distance_m {
        row("distance planned", format!("{metres:.3} m as the crow flies"));
    }
    row("walked", format!("{:.2} of {:.2} s", figures.walked_s, figures.walk_duration_s));
    match (figures.fallen, figures.fall_time_s, &figures.fall_cause) {
        (Some(true), Some(time_s), Some(cause)) => row("fallen", format!("yes, {time_s:.2} s into the walk: {cause}")),
        (Some(_), ..) => row("fallen", "no".to_string()),
        (None, ..) => {}
    }
    let millimetres = |rms: Option<f64>, max: Option<f64>| {
        let (rms, max) = (1e3 * rms?, 1e3 * max?);
        Some(format!("{rms:.1} mm rms, {max:.1} mm max"))
    };
    if let Some(errors) = millimetres(figures.com_error_rms_m, figures.com_error_max_m) {
        row("COM, real to planned", format!("{errors} over {} ticks", figures.ticks_compared));
    }
    // In its parts: else what the cart-table lacks (a swinging leg has angular momentum) would be blamed on the soles.
    if let Some(errors) = millimetres(figures.zmp_error_rms_m, figures.zmp_error_max_m) {
        row("ZMP, real to planned", errors);
    }
    if let Some(errors) = millimetres(figures.zmp_body_to_cart_rms_m, figures.zmp_body_to_cart_max_m) {
        row("ZMP, body to cart", errors);
    }
    if let Some(tilt) = figures.base_tilt_max_rad {
        row("tilt of the base", format!("{:.2} degrees max from its plan", tilt.to_degrees()));
    }
    if figures.ticks_without_plan > 0 {
        row("ticks without plan", figures.ticks_without_plan.to_string());
    }
    for (name, joints_there) in [
        ("joints at a limit", &figures.joints_at_limit),
        ("drives saturated", &figures.drives_saturated),
        ("steps at joint limits", &figures.joints_held_back),
        ("steps at torque limits", &figures.torques_held_back),
    ] {
        if !joints_there.is_empty() {
            row(name, joint_ticks(joints_there, joints));
        }
    }
    let soles = &figures.sole_estimates;
    if soles.solved + soles.not_solved > 0 {
        row(
            "sole estimates",
            format!(
                "{} solved, {} not; {:.1} iterations mean, {} max; residual {:.1e} max",
                soles.solved,
                soles.not_solved,
                soles.iterations_mean(),
                soles.iterations_max,
                soles.residual_max
            ),
        );
    }
    if let Some(steps) = &figures.controller {
        let worst = match (steps.worst_limit.as_str(), steps.worst_limit_index, steps.worst_limit_amount) {
            ("", ..) => String::new(),
            (limit, index, amount) if limit.contains("foot") || limit.contains("ankle") => {
                format!(" (worst: {limit} {} by {amount:.3e})", if index == 0 { "left" } else { "right" })
            }
            (limit, index, amount) => {
                format!(" (worst: {limit} {index} by {amount:.3e}; the controller's log has names)")
            }
        };
        let backup = match steps.by_backup {
            0 => String::new(),
            by_backup => format!("; {by_backup} answered by the backup solver"),
        };
        let (solved, relaxed, held) = (steps.solved, steps.relaxed, steps.held);
        row("controller steps", format!("{solved} solved, {relaxed} relaxed{worst}, {held} held{backup}"));
        if steps.states_refused > 0 {
            row("states refused", steps.states_refused.to_string());
        }
    }
    if let Some(feedback) = &figures.feedback {
        let (base_mm, base_deg) = (1e3 * feedback.base_distance_max_m, feedback.base_distance_max_rad.to_degrees());
        let base = format!("observed base up to {base_mm:.1} mm, {base_deg:.2} deg from the model's");
        row("feedback", format!("{base}; {} measurements not used", feedback.measurements_refused));
    }
    if figures.periods_unconverged > 0 {
        row("plant, not to tolerance", format!("{} control periods", figures.periods_unconverged));
    }
    if figures.commands_refused > 0 {
        row("commands refused", figures.commands_refused.to_string());
    }
    for (process, times) in &figures.processes {
        let over = match times.over_period {
            0 => String::new(),
            over => format!("; {over} of {} over 5 ms", times.cycles),
        };
        let max = times.max_ms;
        let usual = match (times.median_ms, times.p99_ms) {
            (Some(median), Some(p99)) => format!("{median:.3} ms median, {p99:.3} ms p99"),
            _ => format!("{:.3} ms mean", times.mean_ms),
        };
        row(&format!("tick, {process}"), format!("{usual}, {max:.3} ms max{over}"));
    }
    for (process, clock) in figures.processes.iter().filter_map(|(name, times)| Some((name, times.clock.as_ref()?))) {
        row(&format!("clock, {process}"), clock_words(clock));
    }
    if let Some(speed) = figures.times_real_time {
        row("speed", format!("{speed:.2} x real time"));
    }
    let misses: u64 = figures.processes.values().map(|times| times.misses).sum();
    if misses > 0 {
        row("deadlines missed", format!("{misses} by all processes"));
    }
    if figures.messages_not_recorded > 0 {
        row("not recorded", format!("{} messages", figures.messages_not_recorded));
    }
    rows
}

/// How a process kept the clock, in a line: lateness of its wake-ups and answers, what went wrong, its rights.
fn clock_words(clock: &ClockTimes) -> String {
    let us = |ns: u64| format!("{:.0}", ns as f64 * 1e-3);
    let lateness = |times: &Lateness| {
        let percentile = |name: &str, ns: Option<u64>| ns.map(|ns| format!("{name} {}, ", us(ns))).unwrap_or_default();
        format!(
            "{}{}{}max {} us",
            percentile("p50", times.p50_ns),
            percentile("p99", times.p99_ns),
            percentile("p99.9", times.p999_ns),
            us(times.max_ns)
        )
    };
    let mut words =
        format!("woke {}; answered {}; {} ticks", lateness(&clock.woke), lateness(&clock.published), clock.woke.count);
    let [minor, major] = clock.page_faults;
    for (count, what) in [
        (clock.late_wakes, "late wake-ups"),
        (clock.late_answers, "late answers"),
        (clock.slips, "slips of the clock"),
        (minor, "minor page faults"),
        (major, "major page faults"),
    ] {
        if count > 0 {
            words += &format!("; {count} {what}");
        }
    }
    let policy = if clock.priority > 0 { format!("SCHED_FIFO {}", clock.priority) } else { "ordinary".to_string() };
    let core = clock.core.map(|core| format!(" on core {core}")).unwrap_or_default();
    let memory = if clock.memory_locked || clock.priority == 0 { "" } else { ", memory not locked" };
    words + &format!("; {policy}{core}{memory}")
}

/// Most joints that are named.
const NAMED_MAX: usize = 4;

fn joint_ticks(there: &[JointTicks], names: &[String]) -> String {
    let named = there.iter().take(NAMED_MAX).map(|JointTicks { joint, ticks }| match names.get(*joint as usize) {
        Some(name) => format!("{name} {ticks} ticks"),
        None => format!("joint {joint} {ticks} ticks"),
    });
    let named = named.collect::<Vec<_>>().join(", ");
    match there.len().saturating_sub(NAMED_MAX) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use crate::{Gather, ReportSettings, Said, table};
    use messages::code::{Limit, Process, Reason, State};
    use messages::{Health, LatenessFigures, RobotCommand, Truth};

    fn told(gather: &Gather) -> String {
        table(&gather.finish(&ReportSettings::default()))
    }

    #[test]
    fn the_controllers_steps_are_told_as_its_health_counts_them() {
        let mut gather = Gather::default();
        let mut health = Health::new(Process::Controller, State::Running, Reason::None);
        gather.take(Said::Health(&health));
        assert!(!told(&gather).contains("controller steps"), "it has made none");
        health.cycles = 20;
        (health.controller.steps_solved, health.controller.steps_relaxed, health.controller.steps_held) = (15, 2, 3);
        gather.take(Said::Health(&health));
        assert!(told(&gather).contains("15 solved, 2 relaxed, 3 held\n"), "{}", told(&gather));
        health.controller.worst_limit = Limit::Contact.code();
        (health.controller.worst_limit_index, health.controller.worst_limit_amount) = (1, 0.25);
        health.controller.steps_by_backup = 4;
        gather.take(Said::Health(&health));
        let expected = "15 solved, 2 relaxed (worst: motion of standing ankle right by 2.500e-1), 3 held; 4 answered by the backup";
        assert!(told(&gather).contains(expected), "{}", told(&gather));
        (health.controller.worst_limit, health.controller.worst_limit_index) = (Limit::Torque.code(), 5);
        gather.take(Said::Health(&health));
        assert!(told(&gather).contains("(worst: torque of joint 5 by"), "{}", told(&gather));
    }

    #[test]
    fn troubles_have_rows_only_when_there_are_any() {
        let mut gather = Gather::default();
        gather.take(Said::Truth(&Truth::default()));
        for absent in ["saturated", "at a limit", "steps at", "not recorded", "deadlines", "refused", "without plan"] {
            assert!(!told(&gather).contains(absent) || absent == "without plan", "{}", told(&gather));
        }
        gather.take(Said::Truth(&Truth {
            drives_saturated_bits: 1 << 3,
            joints_at_limit_bits: 1 << 9,
            ..Truth::default()
        }));
        gather.take(Said::Command(&RobotCommand {
            joints_limited_bits: 1 << 4,
            torques_limited_bits: 1 << 5,
            ..RobotCommand::default()
        }));
        let lost = Health { lost: 5, ..Health::new(Process::Recorder, State::Running, Reason::None) };
        gather.take(Said::Health(&lost));
        let table = told(&gather);
        let steps = ["steps at joint limits  joint 4 1 ticks", "steps at torque limits joint 5 1 ticks"];
        for told in [steps[0], steps[1], "joint 3 1 ticks", "joint 9 1 ticks", "5 messages\n"] {
            assert!(table.contains(told), "no `{told}` in {table}");
        }
    }

    #[test]
    fn the_clock_is_told_where_there_is_one() {
        let mut gather = Gather::default();
        let mut health = Health { cycles: 12_000, ..Health::new(Process::Controller, State::Running, Reason::None) };
        gather.take(Said::Health(&health));
        assert!(!told(&gather).contains("clock, controller"), "lock-step");
        health.timing.woke =
            LatenessFigures { count: 12_000, p50_ns: 51_000, p99_ns: 271_000, p999_ns: 0, max_ns: 4_594_000 };
        health.timing.published.max_ns = 900_000;
        (health.late_answers, health.minor_faults, health.real_time_priority, health.core_plus_one) = (2, 4, 65, 2);
        gather.take(Said::Health(&health));
        let expected = "woke p50 51, p99 271, max 4594 us; answered max 900 us; 12000 ticks; 2 late answers; 4 minor page faults; \
                        SCHED_FIFO 65 on core 1, memory not locked\n";
        assert!(told(&gather).contains(expected), "{}", told(&gather));
    }

    #[test]
    fn a_fall_is_told_with_its_time_and_cause() {
        let mut gather = Gather::default();
        gather.take(Said::Truth(&Truth::default()));
        gather.take(Said::Truth(&Truth { fallen: 1, fall_tick: 300, fall_cause: 2, ..Truth::default() }));
        assert!(told(&gather).contains("yes, 1.50 s into the walk: tilted too far"), "{}", told(&gather));
    }
}
