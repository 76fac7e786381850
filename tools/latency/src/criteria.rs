//! The criteria A1 to A13: from what was measured to verdicts.

use crate::campaign::{LONG_STALL_NS, Measured};
use crate::ticks::LOOP;
use lateness::Lateness;
use lateness::judge::{Criterion, Verdict, median_ratio, pooled_ratio};
use messages::code::Process;
use report::WalkFigures;

/// How much later than a thread that does nothing ours may wake up: p50, p99, p99.9 (A1).
const WAKE_RATIOS_MAX: [f64; 3] = [1.3, 1.5, 2.0];
/// Missing commands beyond the machine's long stalls (A3).
const MISSING_SHARE_MAX: f64 = 0.001;
/// The chain over what computes in it and three wake-ups (A4).
const CHAIN_RATIO_MAX: f64 = 1.2;
/// Errors by the clock over lock-step's: COM, ZMP (A7).
const ERROR_RATIOS_MAX: [f64; 2] = [1.1, 1.3];
/// Time of the processor, p99.9 (ms): simulator, estimator, controller (A8).
const PROCESSOR_MS_MAX: [f64; 3] = [2.5, 1.0, 0.3];
/// A message's wake-up over a futex's: p50, p99 (A10).
const EVENT_RATIOS_MAX: [f64; 2] = [2.0, 2.5];
/// How many times as many commands are missing without SCHED_FIFO (A13).
const CONTROL_RATIO_MIN: u64 = 10;
/// On a prepared control PC (us): wake p99.9 and largest, chain's largest, the reference's largest.
const ABSOLUTE_US_MAX: [f64; 4] = [50.0, 200.0, 1000.0, 100.0];
/// An hour of ticks: fewer do not show what a control PC is for.
const ABSOLUTE_TICKS_MIN: u64 = 720_000;

fn times(x: f64) -> String {
    format!("{x:.2}")
}

fn milliseconds(x: f64) -> String {
    format!("{x:.3} ms")
}

fn microseconds(x: f64) -> String {
    format!("{x:.0} us")
}

fn count(x: f64) -> String {
    format!("{x:.0}")
}

/// All criteria.
pub fn judge(measured: &Measured, absolute: bool) -> Vec<Criterion> {
    let mut criteria = Vec::new();
    wakes(measured, &mut criteria);
    missing(measured, &mut criteria);
    chain(measured, &mut criteria);
    bits(measured, &mut criteria);
    errors(measured, &mut criteria);
    work(measured, &mut criteria);
    events(measured, &mut criteria);
    replays(measured, &mut criteria);
    control(measured, &mut criteria);
    if absolute {
        on_a_control_pc(measured, &mut criteria);
    }
    criteria
}

fn wakes(measured: &Measured, out: &mut Vec<Criterion>) {
    let [p50, p99, p999] = WAKE_RATIOS_MAX;
    // By the timer of the grid, as the reference.
    let pairs = measured.paired_wakes(Process::Simulator);
    let name = |what: &str| format!("simulator: wake-up {what} / reference");
    out.push(Criterion::at_most("A1", name("p50"), median_ratio(&pairs, |q| q.p50_ns), p50, times));
    out.push(Criterion::at_most("A1", name("p99"), median_ratio(&pairs, |q| q.p99_ns), p99, times));
    let woke = measured.pooled(Process::Simulator).woke;
    let rare = pooled_ratio(&woke, &measured.pooled_reference(Process::Simulator), 0.999);
    out.push(Criterion::at_most("A1", name("p99.9, all rounds"), rare, p999, times));
    // By a message, as the wake-ups between two threads.
    let hand_over = measured.hand_over();
    for (what, share, limit) in [("p50", 0.5, p50), ("p99", 0.99, p99), ("p99.9", 0.999, p999)] {
        let found = pooled_ratio(&hand_over, &measured.wakes.event, share);
        out.push(Criterion::at_most(
            "A1",
            format!("controller: state out to woken {what} / wake-up by a message"),
            found,
            limit,
            times,
        ));
    }
}

fn missing(measured: &Measured, out: &mut Vec<Criterion>) {
    let missing = measured.missing();
    let found = (missing.all > 0).then_some(missing.ours() as f64).ok_or_else(|| "no valid round".to_string());
    let said = format!("commands missing and not excused, of {} ({} excused)", missing.all, missing.excused);
    out.push(Criterion::at_most("A2", said, found, 0.0, count));
    let mut reference = Lateness::default();
    measured
        .valid
        .iter()
        .flat_map(|round| &round.surroundings.references)
        .for_each(|core| reference.add(&core.lateness));
    let found =
        (missing.all > 0).then(|| missing.bad as f64 / missing.all as f64).ok_or_else(|| "no valid round".to_string());
    let limit = reference.share_beyond(LONG_STALL_NS) + MISSING_SHARE_MAX;
    let share = |x: f64| format!("{:.3} %", 100.0 * x);
    out.push(Criterion::at_most(
        "A3",
        "share of commands missing, all; limit by the reference's stalls > 3 ms",
        found,
        limit,
        share,
    ));
}

fn chain(measured: &Measured, out: &mut Vec<Criterion>) {
    let published = measured.pooled(Process::Controller).published;
    let (estimator, controller) = (measured.pooled(Process::Estimator), measured.pooled(Process::Controller));
    for (name, share) in [("p50", 0.5), ("p99", 0.99)] {
        let parts =
            [&estimator.processor, &controller.processor, &measured.wakes.event].map(|part| part.quantile_ns(share));
        let found = match (published.quantile_ns(share), parts) {
            (Some(chain), [Some(estimator), Some(controller), Some(event)]) => {
                Ok(chain as f64 / (estimator + controller + 3 * event).max(1) as f64)
            }
            _ => Err("too few samples".to_string()),
        };
        let said = format!("chain (tick to command) {name} / (processor of both + 3 wake-ups)");
        out.push(Criterion::at_most("A4", said, found, CHAIN_RATIO_MAX, times));
    }
}

fn bits(measured: &Measured, out: &mut Vec<Criterion>) {
    let rounds = measured.valid.iter().chain(&measured.invalid);
    let compared: Vec<_> = rounds.map(|round| round.compared).collect();
    let equal: u64 = compared.iter().map(|round| round.ticks).sum();
    let different = compared.iter().filter(|round| round.first_difference.is_some()).count();
    let verdict = match (equal, different) {
        (0, 0) => Verdict::NotJudged("nothing to compare".to_string()),
        (_, 0) => Verdict::Met,
        _ => Verdict::NotMet,
    };
    out.push(Criterion {
        id: "A5",
        measure: "commands before the first stale input, against lock-step's".to_string(),
        accept: "the same bits".to_string(),
        found: format!("{equal} the same; {different} of {} rounds differ", compared.len()),
        verdict,
    });
}

fn errors(measured: &Measured, out: &mut Vec<Criterion>) {
    for (name, lock_step, by_the_clock) in &measured.walks {
        let fallen = by_the_clock.iter().filter(|figures| figures.fallen != Some(false)).count();
        let said = format!("{name}: falls in {} walks by the clock", by_the_clock.len());
        out.push(Criterion::at_most("A7", said, Ok(fallen as f64), 0.0, count));
        let worst = |figure: &dyn Fn(&WalkFigures) -> Option<f64>| {
            let largest = by_the_clock.iter().map(|figures| figure(figures).unwrap_or(f64::NAN));
            let largest = largest.fold(0.0_f64, |a, b| if b.is_nan() { b } else { a.max(b) });
            Ok(largest / figure(lock_step).unwrap_or(f64::NAN))
        };
        for (what, found, limit) in [
            ("COM", worst(&|figures| figures.com_error_max_m), ERROR_RATIOS_MAX[0]),
            ("ZMP", worst(&|figures| figures.zmp_error_max_m), ERROR_RATIOS_MAX[1]),
        ] {
            out.push(Criterion::at_most(
                "A7",
                format!("{name}: largest {what} error / lock-step's"),
                found,
                limit,
                times,
            ));
        }
    }
}

fn work(measured: &Measured, out: &mut Vec<Criterion>) {
    for (process, limit) in LOOP.into_iter().zip(PROCESSOR_MS_MAX) {
        let processor = measured.pooled(process).processor;
        let found = processor.quantile_ns(0.999).map(|ns| ns as f64 * 1e-6);
        let found = found.ok_or_else(|| format!("{} samples, too few for 99.9 %", processor.count()));
        out.push(Criterion::at_most(
            "A8",
            format!("{process}: time of the processor p99.9"),
            found,
            limit,
            milliseconds,
        ));
    }
    for process in LOOP {
        let faults = measured.valid.iter().filter_map(|round| round.faults_minor.get(&process.code())).max();
        let found = faults.map(|faults| *faults as f64).ok_or_else(|| "no valid round".to_string());
        out.push(Criterion::at_most(
            "A9",
            format!("{process}: minor page faults of the worst round"),
            found,
            0.0,
            count,
        ));
    }
}

fn events(measured: &Measured, out: &mut Vec<Criterion>) {
    for ((name, share), limit) in [("p50", 0.5), ("p99", 0.99)].into_iter().zip(EVENT_RATIOS_MAX) {
        let found = pooled_ratio(&measured.wakes.event, &measured.wakes.futex, share);
        out.push(Criterion::at_most("A10", format!("wake-up by a message / by a futex, {name}"), found, limit, times));
    }
}

fn replays(measured: &Measured, out: &mut Vec<Criterion>) {
    for (process, replay) in &measured.replays {
        let verdict = match replay {
            Ok(true) => Verdict::Met,
            Ok(false) => Verdict::NotMet,
            Err(why) => Verdict::NotJudged(why.clone()),
        };
        let found = if *replay == Ok(true) { "the same" } else { "-" }.to_string();
        let measure = format!("{process}: replay of the last round");
        out.push(Criterion { id: "A12", measure, accept: "the same bits".to_string(), found, verdict });
    }
}

fn control(measured: &Measured, out: &mut Vec<Criterion>) {
    let Some([with, without]) = measured.control else { return };
    let verdict = match (with.all.min(without.all), without.bad >= CONTROL_RATIO_MIN * with.bad.max(1)) {
        (0, _) => Verdict::NotJudged("nothing was measured".to_string()),
        (_, true) => Verdict::Met,
        (_, false) => Verdict::NotMet,
    };
    out.push(Criterion {
        id: "A13",
        measure: "control experiment: commands missing under load without SCHED_FIFO".to_string(),
        accept: format!(">= {CONTROL_RATIO_MIN} times as many as with it"),
        found: format!("{} of {} without, {} of {} with", without.bad, without.all, with.bad, with.all),
        verdict,
    });
}

/// What only a prepared machine can meet.
fn on_a_control_pc(measured: &Measured, out: &mut Vec<Criterion>) {
    let us = |ns: u64| ns as f64 * 1e-3;
    let some = |lateness: &Lateness| {
        (lateness.count() > 0).then(|| us(lateness.max_ns())).ok_or_else(|| "no samples".to_string())
    };
    let [p999, wake, chain, reference] = ABSOLUTE_US_MAX;
    for process in [Process::Simulator, Process::Controller] {
        let woke = measured.pooled(process).woke;
        let rare = woke.quantile_ns(0.999).map(us).ok_or_else(|| "too few samples".to_string());
        out.push(Criterion::at_most("abs", format!("{process}: wake p99.9"), rare, p999, microseconds));
        out.push(Criterion::at_most("abs", format!("{process}: wake, largest"), some(&woke), wake, microseconds));
        let seen = some(&measured.pooled_reference(process));
        out.push(Criterion::at_most(
            "abs",
            format!("{process}: its reference, largest (else the machine is not ready)"),
            seen,
            reference,
            microseconds,
        ));
    }
    let published = measured.pooled(Process::Controller).published;
    out.push(Criterion::at_most("abs", "chain, largest", some(&published), chain, microseconds));
    let missing = measured.missing();
    let found = if missing.all >= ABSOLUTE_TICKS_MIN {
        Ok(missing.bad as f64)
    } else {
        Err(format!("{} of {ABSOLUTE_TICKS_MIN} ticks: --seconds, --rounds", missing.all))
    };
    out.push(Criterion::at_most("abs", "commands missing in an hour", found, 0.0, count));
}

/// The table for a terminal.
pub fn table(criteria: &[Criterion], measured: &Measured) -> String {
    let mut text = String::new();
    for round in measured.valid.iter().chain(&measured.invalid) {
        text += &round.line();
        text.push('\n');
    }
    let ticks = measured.missing().all;
    text += &format!(
        "{} valid rounds, {} invalid; {ticks} ticks in {:.0} s\n\n",
        measured.valid.len(),
        measured.invalid.len(),
        measured.lasted.as_secs_f64()
    );
    for process in LOOP {
        for (figure, lateness) in measured.figures(process) {
            text += &format!("{:<34} {}\n", format!("{process}, {figure}"), quantiles(&lateness));
        }
    }
    for (name, lateness) in [
        ("state to controller", &measured.hand_over()),
        ("wake by message", &measured.wakes.event),
        ("  on one core", &measured.wakes.event_on_one_core),
        ("wake by futex", &measured.wakes.futex),
    ] {
        text += &format!("{name:<34} {}\n", quantiles(lateness));
    }
    text.push('\n');
    for Criterion { id, measure, accept, found, verdict } in criteria {
        text += &format!("{id:<4} {measure:<78} {found:<28} {accept:<14} {verdict}\n");
    }
    text
}

/// Percentiles in microseconds, the largest first, with the count.
pub fn quantiles(lateness: &Lateness) -> String {
    let quantiles = lateness.quantiles();
    let us = |ns: u64| format!("{:.0}", ns as f64 * 1e-3);
    let or = |ns: Option<u64>| ns.map_or("-".to_string(), us);
    format!(
        "max {:>8} us   p50 {:>6}   p99 {:>6}   p99.9 {:>6}   of {}",
        us(quantiles.max_ns),
        or(quantiles.p50_ns),
        or(quantiles.p99_ns),
        or(quantiles.p999_ns),
        quantiles.count
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use lateness::reference::Excused;

    fn verdict<'a>(criteria: &'a [Criterion], id: &str) -> &'a Verdict {
        &criteria.iter().find(|criterion| criterion.id == id).expect("it is there").verdict
    }

    #[test]
    fn without_measurements_nothing_is_judged_and_nothing_passes() {
        for absolute in [false, true] {
            let criteria = judge(&Measured::default(), absolute);
            for criterion in &criteria {
                assert!(matches!(criterion.verdict, Verdict::NotJudged(_)), "{criterion:?}");
            }
            assert_eq!(criteria.iter().any(|criterion| criterion.id == "abs"), absolute);
        }
    }

    #[test]
    fn a_control_experiment_that_sees_no_difference_is_a_failure_of_the_test() {
        let missing = |bad| Excused { all: 3_000, bad, excused: 0 };
        for (with, without, expected) in [(0, 900, Verdict::Met), (0, 9, Verdict::NotMet), (100, 500, Verdict::NotMet)]
        {
            let measured = Measured { control: Some([missing(with), missing(without)]), ..Measured::default() };
            assert_eq!(verdict(&judge(&measured, false), "A13"), &expected, "{with}, {without}");
        }
        let none = Measured { control: Some([Excused::default(); 2]), ..Measured::default() };
        assert!(matches!(verdict(&judge(&none, false), "A13"), Verdict::NotJudged(_)));
    }

    #[test]
    fn a_replay_that_differs_is_not_met_and_one_that_cannot_be_is_not_judged() {
        for (replay, expected) in [
            (Ok(true), Verdict::Met),
            (Ok(false), Verdict::NotMet),
            (Err("refused".to_string()), Verdict::NotJudged("refused".to_string())),
        ] {
            let replays = vec![("controller".to_string(), replay)];
            let measured = Measured { replays, ..Measured::default() };
            assert_eq!(verdict(&judge(&measured, false), "A12"), &expected);
        }
    }

    #[test]
    fn messages_that_wake_three_times_as_slowly_as_a_futex_are_not_met() {
        let mut measured = Measured::default();
        measured.wakes.event = Lateness::of([60_000; 2_000]);
        measured.wakes.futex = Lateness::of([20_000; 2_000]);
        assert_eq!(verdict(&judge(&measured, false), "A10"), &Verdict::NotMet);
        measured.wakes.futex = Lateness::of([40_000; 2_000]);
        assert_eq!(verdict(&judge(&measured, false), "A10"), &Verdict::Met);
    }
}
