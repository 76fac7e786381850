//! The planner over the bus: plans once, then serves the pattern to whoever comes.

use messages::code::{Process, Reason, State};
use node::{End, Failure, Program, Shell};
use planner::{PlannerOutput, PlannerSettings};
use soles::Store;
use std::time::Duration;

struct Plan(PlannerOutput);

impl Program for Plan {
    const PROCESS: Process = Process::Planner;
    const ABOUT: &'static str = "Plans the walk and publishes the pattern.";
    type Settings = PlannerSettings;

    fn build(settings: PlannerSettings) -> Result<Self, Failure> {
        let mut store = Store::from_environment();
        let planned = planner::plan_with_store(&settings, &mut store).map_err(Failure::unusable)?;
        for finding in planned.findings() {
            tracing::info!("{finding}");
        }
        if let Some(soles) = &planned.soles {
            let (tilt_deg, compressed) = (soles.tilt_rad.value.to_degrees(), 100.0 * soles.compression.value);
            tracing::info!(
                "the soles carry the walk; at most {tilt_deg:.1} degrees of tilt (at {:.2} s), {compressed:.1} % of compression",
                soles.tilt_rad.time_s
            );
        }
        Ok(Self(planned))
    }

    fn robot_fingerprint(&self) -> Option<u64> {
        Some(self.0.header.header.robot_fingerprint)
    }

    fn run(&mut self, shell: &mut Shell) -> Result<End, Failure> {
        let mut patterns = shell.pattern_publisher(self.0.phases.len())?;
        patterns.publish(&self.0.header, &self.0.phases)?;
        shell.figures().walk_duration_s = self.0.header.duration_s;
        shell.ready()?;
        shell.announce(State::Running, Reason::None)?;
        // Late joiners get the pattern from this process: it stays, and lets new subscribers in now and then.
        while shell.idle(Duration::from_millis(20))? {
            patterns.serve_late_joiners()?;
        }
        Ok(End::Asked)
    }
}

fn main() -> std::process::ExitCode {
    node::main::<Plan>()
}
