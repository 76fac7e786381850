//! What the processes say of themselves while a walk goes on.

use messages::code::Process;
use messages::{CONTROL_PERIOD_S, Health};
use std::collections::BTreeMap;
use std::time::Instant;

/// The last health of each process: what it counts, it counts itself, so nothing is missed between two of them.
#[derive(Default)]
pub struct Heard {
    health: BTreeMap<u32, Health>,
    /// The simulator's first and last tick, and when they came.
    first: Option<(i64, Instant)>,
    last: Option<(i64, Instant)>,
}

impl Heard {
    /// Takes health of a process.
    pub fn take(&mut self, health: &Health) {
        if health.process == Process::Simulator.code() && health.cycles > 0 {
            let now = (health.header.tick, Instant::now());
            self.first.get_or_insert(now);
            self.last = Some(now);
        }
        self.health.insert(health.process, *health);
    }

    /// The last health of each process.
    pub fn healths(&self) -> Vec<Health> {
        self.health.values().copied().collect()
    }

    /// Whether anything was simulated.
    pub fn any(&self) -> bool {
        self.last.is_some()
    }

    fn simulator(&self) -> Option<&Health> {
        self.health.get(&Process::Simulator.code()).filter(|health| health.cycles > 0)
    }

    fn duration_s(&self) -> f64 {
        self.health.values().map(|health| health.walk_duration_s).fold(0.0, f64::max)
    }

    /// How much of the walk is done, 0 to 1.
    pub fn done(&self) -> f64 {
        let (walked_s, duration_s) = (self.simulator().map_or(0.0, |health| health.walk_time_s), self.duration_s());
        if duration_s > 0.0 { (walked_s / duration_s).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Simulated time per real time; `None` before two ticks.
    pub fn speed(&self) -> Option<f64> {
        let ((first, start), (last, end)) = (self.first?, self.last?);
        let simulated_s = (last - first) as f64 * CONTROL_PERIOD_S;
        (last > first).then(|| simulated_s / (end - start).as_secs_f64().max(f64::MIN_POSITIVE))
    }

    /// How the run kept to the clock, in one line.
    pub fn kept_time(&self) -> String {
        let of = |process: Process| self.health.get(&process.code()).copied().unwrap_or_default();
        let (simulator, controller) = (of(Process::Simulator), of(Process::Controller));
        let ticks = simulator.cycles;
        format!(
            "{ticks} ticks of 5 ms ({:.1} s), {} commands missing, {} deformations missing, the clock moved {} times",
            ticks as f64 * CONTROL_PERIOD_S,
            simulator.late,
            controller.late,
            simulator.clock_slips
        )
    }

    /// One line about the moment.
    pub fn line(&self) -> String {
        let Some(simulator) = self.simulator() else { return "getting ready".to_string() };
        let worst_ns = self.health.values().map(|health| health.compute_time_max_ns).max().unwrap_or(0);
        let walked = if simulator.walk_time_s < 0.0 {
            "settling".to_string()
        } else {
            let duration_s = self.duration_s();
            format!("walked {:.1} of {duration_s:.1} s", simulator.walk_time_s.min(duration_s))
        };
        let (distance_m, speed) = (simulator.simulator.distance_m, self.speed().unwrap_or(0.0));
        format!("{walked} · {distance_m:.2} m · {speed:.2} x real time · worst tick {:.1} ms", worst_ns as f64 * 1e-6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::code::{Reason, State};
    use std::time::Duration;

    #[test]
    fn the_line_tells_how_far_the_walk_is() {
        let mut heard = Heard::default();
        assert_eq!((heard.line().as_str(), heard.any(), heard.done()), ("getting ready", false, 0.0));
        let mut simulator = Health { cycles: 1, ..Health::new(Process::Simulator, State::Running, Reason::None) };
        simulator.walk_time_s = -1.0;
        heard.take(&simulator);
        assert!(heard.line().starts_with("settling"), "{}", heard.line());
        (simulator.walk_time_s, simulator.simulator.distance_m, simulator.compute_time_max_ns) =
            (1.5, 0.123, 7_000_000);
        heard.take(&simulator);
        let planner = Health { walk_duration_s: 6.0, ..Health::new(Process::Planner, State::Running, Reason::None) };
        heard.take(&planner);
        assert!(heard.line().starts_with("walked 1.5 of 6.0 s · 0.12 m"), "{}", heard.line());
        assert!(heard.line().ends_with("worst tick 7.0 ms"), "{}", heard.line());
        assert_eq!(heard.done(), 0.25);
    }

    #[test]
    fn what_was_missing_by_the_clock_is_one_line() {
        let mut heard = Heard::default();
        let health = |process, late, clock_slips| Health {
            cycles: 400,
            late,
            clock_slips,
            ..Health::new(process, State::Running, Reason::None)
        };
        heard.take(&health(Process::Simulator, 3, 1));
        heard.take(&health(Process::Controller, 7, 0));
        let said = "400 ticks of 5 ms (2.0 s), 3 commands missing, 7 deformations missing, the clock moved 1 times";
        assert_eq!(heard.kept_time(), said);
    }

    #[test]
    fn speed_is_simulated_by_real_time() {
        let start = Instant::now();
        let mut heard = Heard::default();
        assert_eq!(heard.speed(), None);
        (heard.first, heard.last) = (Some((100, start)), Some((500, start + Duration::from_millis(500))));
        assert!((heard.speed().expect("two ticks") - 4.0).abs() < 1e-12, "400 ticks are 2 s");
    }
}
